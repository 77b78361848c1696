"""Six split-path transmissions from one differential: Figs. 11-14 of Yu & Beachley 1986, and how to choose.

A differential (90 and 153 teeth, R_o = -1.7) and a variable unit are connected in parallel. The three members of the differential can be
assigned to input, unit and output in six ways. The ratio of the unit, the efficiency and the power through the unit are not programmed
here: they follow from the model of gears with losses.

At r = 1 all members turn as one block. The gears do not roll and hold each other by friction, and efficiency and K may have
any value between those on the two sides: the curves end there, and a bar shows the interval.
"""

from __future__ import annotations

import sys
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr

import powertrain as pt
from powertrain.components.cvu import CVU
from powertrain.components.differentials import FundamentalDifferential, Planets, Ring, Sun
from powertrain.components.transmissions import TYPES, SplitPathTransmission
from powertrain.design import SplitPathBench, sets_near, split_path_designs

DIFFERENTIAL = FundamentalDifferential.from_teeth(Sun(90), Ring(153), Planets(31), eta_ab=0.95, eta_ba=0.95)
UNIT = CVU(eta_ab=0.9, eta_ba=0.9)
TRANSMISSION = SplitPathTransmission(differential=DIFFERENTIAL, cvu=UNIT)
IDEAL = {f"transmission.{part}.eta_{way}": 1.0 for part in ("differential", "cvu") for way in ("ab", "ba")}
PLACES = {"a": "a", "b": "b", "H": "carrier"}


def curves() -> xr.Dataset:
    """V, efficiency, K and K_o of the six types over r; the load is against the motion."""
    r = np.unique(np.append(np.linspace(-2, 3, 1001).round(9), [1 - 1e-9, 1 + 1e-9]))
    r = r[r != 0]  # nothing is delivered at standstill
    grid = {"r": r, "load": xr.DataArray(np.where(r < 0, 10.0, -10.0), dims="r")}
    found: list[xr.Dataset] = []
    for layout in TYPES.values():
        plant = pt.compile(SplitPathBench(transmission=pt.replace(TRANSMISSION, layout=layout)))
        lossy = pt.steady(plant, grid, outputs=["V", "efficiency", "K"])
        ideal = pt.steady(
            plant, {**grid, "r": r[r != 1], "load": grid["load"][r != 1]}, outputs={"K_o": "K"}, parameters=IDEAL
        )
        found.append(
            xr.merge([lossy.drop_vars(["status_laws"], errors="ignore"), ideal.K_o], join="left", compat="override")
        )
    return xr.concat(found, xr.DataArray(list(TYPES), dims="type", name="type"), combine_attrs="drop_conflicts")


FIGURES = [
    ("V", "Fig. 11  Ratio of the variable unit", r"$V = N_2/N_1$", (-4, 4)),
    ("efficiency", "Fig. 12  Overall efficiency", r"$\eta_{oa}$", (0, 1)),
    ("K", "Fig. 13  Fraction of the input power through the unit", "$K$", (-6, 6)),
    ("K_o", "Fig. 14  The same without friction", r"$K_o$", (-6, 6)),
]
CLOSER = {"efficiency": ([0.56, 0.09, 0.4, 0.5], (0.74, 0.98)), "K": ([0.65, 0.09, 0.32, 0.25], (-2, 3))}
NUMBERS = {1: 2.75, 2: 2.75, 3: 1.75, 4: 2.2, 5: 2.2, 6: 2.3}
"""Where the numbers stand on the lines of Fig. 11; in the others they stand to the left."""


def draw(found: xr.Dataset, name: str) -> None:
    """The four figures, as a picture."""
    figure, axes = plt.subplots(2, 2, figsize=(11, 9), sharex=True, layout="constrained")
    for (signal, title, label, limits), ax in zip(FIGURES, axes.flat, strict=True):
        fill(ax, found, signal)
        ax.set(title=title, ylabel=f"{label}  [1]", xlim=(-2, 3), ylim=limits)
        for number in TYPES:
            at = found.sel(type=number, r=NUMBERS[number] if signal == "V" else -1.85 + 0.14 * number, method="nearest")
            box = {"boxstyle": "circle,pad=0.12", "fc": "white", "ec": "none"}
            where = float(at.r), float(at[signal])
            ax.text(*where, str(number), color=f"C{number - 1}", weight="bold", ha="center", va="center", bbox=box)
        if signal in CLOSER:
            place, inside = CLOSER[signal]
            closer = ax.inset_axes(place, xlim=(0.9, 1.1), ylim=inside, xticks=[0.9, 1, 1.1])
            closer.set_title(r"interval at $r = 1$", fontsize=8, pad=3)
            closer.tick_params(labelsize=8)
            fill(closer, found, signal)
    for ax in axes[1]:
        ax.set_xlabel(r"overall ratio $r = N_3/N_1$  [1]")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    title = "type: member at input, unit, output"
    figure.legend(handles, labels, loc="outside lower center", ncols=6, frameon=False, title=title)
    figure.suptitle(r"Input-coupled split-path CVT: $R_o = -1.7$, $\eta_{ab} = \eta_{ba} = 0.95$, $\eta_v = 0.9$")
    figure.savefig(name, dpi=120)


def fill(ax: Any, found: xr.Dataset, signal: str) -> None:
    """The six curves. They end on both sides of r = 0, where nothing is delivered, and of r = 1, where bars are the intervals."""
    for number, layout in TYPES.items():
        one, colour = found.sel(type=number), f"C{number - 1}"
        label = f"{number}: {', '.join(PLACES[m] for m in layout)}"
        r, y = one.r.values, one[signal].values
        for part in (r < 0, (r > 0) & (r < 1), r > 1):
            ax.plot(r[part], y[part], color=colour, lw=1.6, label=label if r[part][0] > 1 else None)
        if signal in CLOSER:
            low, high = (float(one.sel(r=1)[f"{signal}_{end}"]) for end in ("low", "high"))
            ax.errorbar(1, (low + high) / 2, (high - low) / 2, color=colour, lw=2.5, capsize=3)
    ax.axvline(1, color="0.6", lw=0.6, ls=":")
    ax.axvline(0, color="0.6", lw=0.6)
    ax.axhline(0, color="0.6", lw=0.6)
    ax.grid(alpha=0.25)


def main() -> None:
    """Draw the figures, then let the design program draw the paper's conclusions; pass a file name to save the figure."""
    found = curves()
    if len(sys.argv) > 1:
        draw(found, sys.argv[1])
    shown = ["type", "mean_efficiency", "min_efficiency", "max_K", "V_min", "V_max", "regimes"]
    for text, unit in (("a unit that cannot reverse", (0.0, np.inf)), ("a unit with V from 0.6 to 1.7", (0.6, 1.7))):
        designs = split_path_designs(
            (0.5, 2.0), [DIFFERENTIAL], unit=unit, transmission=TRANSMISSION, couplings=["input"]
        )
        table = designs.feasible
        print(
            f"\nr from 0.5 to 2, {text}:\n{table[~table.type.str.contains(':')][shown].round(3).to_string(index=False)}"
        )
    search = split_path_designs((0.5, 2.0), np.linspace(-4, -0.25, 16), unit=(0.4, 2.5), transmission=TRANSMISSION)
    print(f"\nOther ratios, V from 0.4 to 2.5, the best of {len(search.table)}:")
    print(search.feasible[["coupling", "R_o", *shown]].head(8).round(3).to_string(index=False))
    best = search.refine(0)
    print(
        f"\nR_o = {best.R_o:.4f} has a mean efficiency of {best.mean_efficiency:.4f} (before: {best.before:.4f}). Teeth near it:"
    )
    print(sets_near(best.R_o, tolerance=0.005).head(4).to_string(index=False))


if __name__ == "__main__":
    main()
