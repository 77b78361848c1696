"""Yu & Beachley 1986: every printed number and Figs. 6, 8, 9, 11-14 from the model of a split-path transmission on its bench."""

from __future__ import annotations

from functools import cache
from itertools import combinations, permutations, product
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

import powertrain as pt
from powertrain.components.cvu import CVU
from powertrain.components.differentials import FundamentalDifferential, Planets, Ring, Sun
from powertrain.components.transmissions import TYPES, Layout, SplitPathTransmission
from powertrain.design import SplitPathBench, split_path_designs
from powertrain.reproductions.papers import Paper, Picture
from powertrain.reproductions.table import Row, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

GEAR, UNIT = "transmission.differential", "transmission.cvu"
DIFFERENTIAL = FundamentalDifferential.from_teeth(Sun(90), Ring(153), Planets(31), eta_ab=0.95, eta_ba=0.95)
TRANSMISSION = SplitPathTransmission(differential=DIFFERENTIAL, cvu=CVU(eta_ab=0.9, eta_ba=0.9))
LOSSLESS = {f"{part}.eta_{way}": 1.0 for part in (GEAR, UNIT) for way in ("ab", "ba")}
EXAMPLE = -0.13
"""N_3/N_1 of the worked example, in which b is at 1, H at 2 and a at 3 (type 1)."""


@cache
def bench(layout: Layout) -> pt.Plant[SplitPathBench]:
    """The paper's transmission of a layout on its bench."""
    return pt.compile(SplitPathBench(transmission=pt.replace(TRANSMISSION, layout=layout)))


def points(layout: Layout, r: NDArray[np.float64], **options: Any) -> xr.Dataset:
    """Operating points over r with a load against the motion."""
    load = xr.DataArray(np.where(r < 0, 10.0, -10.0), dims="r")
    names = ["V", "efficiency", "K", "P_1", "P_2", "P_3", f"{GEAR}.*", f"{UNIT}.lossPower", "drive.w"]
    outputs = [*names, "transmission.flange_a.tau"]
    return pt.steady(bench(layout), {"r": r, "load": load}, outputs=outputs, progress=False, **options)


def worked_example() -> Table:
    """P. 15, steps 1-8."""
    p = {
        name: float(value)
        for name, value in points("bHa", np.array([EXAMPLE])).isel(r=0).items()
        if name != "status_laws"
    }
    P_b, P_H, P_a = p["P_1"], p["P_2"], p["P_3"]
    T_a, T_b, T_H = (p[f"{GEAR}.{member}.tau"] for member in ("a", "b", "carrier"))
    P_f, P_fv = (-p[f"{part}.lossPower"] for part in (GEAR, UNIT))
    P_in = p["transmission.flange_a.tau"] * p["drive.w"]
    w_a, w_rel = EXAMPLE * p["drive.w"], p[f"{GEAR}.w_rel"]
    misprint = "printed as −(P_a + P_b)/P_b, which is not an efficiency; the number is that of −(P_a + P_H)/P_b"
    named = "by eq. (29), power into the unit; the nomenclature has its output"
    rows = [
        Row("R_o = r_ab^h from 90 and 153 teeth", "1", "p. 15, eq. (3)", "-1.7", float(DIFFERENTIAL.ratio)),
        Row("V = N_2/N_1", "1", "step 2, eq. (23)", "0.581", p["V"]),
        Row("N_H/N_a = V/r", "1", "step 2", "-4.47", p["V"] / EXAMPLE),
        Row("S_a = P_a^h/P_a", "1", "step 3, eq. (19)", "5.47", w_rel / w_a),
        Row("T_b/T_a", "1", "step 3, eq. (18)", "1.789", T_b / T_a),
        Row("T_H/T_a", "1", "step 3, eq. (21)", "-2.789", T_H / T_a),
        Row("P_b/P_a", "1", "step 4, eq. (22)", "-13.77", P_b / P_a),
        Row("P_H/P_a", "1", "step 4, eq. (22)", "12.48", P_H / P_a),
        Row("P_f/P_a", "1", "step 4", "0.288", P_f / P_a),
        Row("η_d, efficiency of the differential", "%", "step 5, eq. (4a)", "97.9", -100 * (P_a + P_H) / P_b, misprint),
        Row("|P_fv|/|P_out|", "1", "step 6, eq. (25a)", "1.248", P_fv / P_a),
        Row("P_loss/P_out", "1", "step 6, eq. (26b)", "1.536", (P_f + P_fv) / P_a),
        Row("P_in/P_out", "1", "step 7, eq. (27b)", "-2.536", P_in / P_a),
        Row("η_oa, overall efficiency", "%", "step 7, eq. (28)", "39.4", 100 * p["efficiency"]),
        Row("K, share of the input power through the unit", "1", "step 8, eq. (29a)", "-4.92", p["K"], named),
    ]
    return Table("The worked example", rows)


def power_directions() -> Table:
    """P. 13, Fig. 6."""
    r = np.array([-0.03, 0.03])
    p = points("bHa", r)
    P_b, P_H = (p[f"P_{k}"].values / p.P_3.values for k in (1, 2))
    torque = (p[f"{GEAR}.b.tau"] / p[f"{GEAR}.a.tau"]).values
    rows = [
        Row("P_b/P_a at N_a/N_b = −0.03", "1", "p. 13, Fig. 6a", "-59.6", float(P_b[0])),
        Row("P_H/P_a at N_a/N_b = −0.03", "1", "p. 13, Fig. 6a", "57.5", float(P_H[0])),
        Row("P_b/P_a in Fig. 6b", "1", "p. 13, Fig. 6b", "53.8", float(P_b[1]), "at +0.03, not at 0.05 as printed"),
        Row("P_H/P_a in Fig. 6b", "1", "p. 13, Fig. 6b", "-55.9", float(P_H[1]), "at +0.03, not at 0.05 as printed"),
        Row(
            "N_a/N_b of Fig. 6b, where P_b/P_a is the printed 53.8",
            "1",
            "p. 13, Fig. 6b",
            "0.05",
            float(torque[1] / 53.8),
            right="0.03",
        ),
    ]
    return Table("Directions of power", rows)


def connections() -> Table:
    """P. 16: the six types, Table 1, and the ranges read from the curves."""
    printed = ["-1.7", "2.7", "0.630", "0.37", "1.59", "-0.59"]
    r = 0.5
    rows = []
    for (number, layout), text in zip(TYPES.items(), printed, strict=True):
        V = float(points(layout, np.array([r])).V[0])
        what = f"R = (N_3 − N_2)/(N_1 − N_2) of type {number} ({layout})"
        rows.append(Row(what, "1", "p. 16", text, (r - V) / (1 - V)))
    orders: list[Layout] = ["".join(order) for order in permutations("abH")]  # type: ignore[misc]
    kinds = {round(float(points(order, np.array([r])).V[0]), 9) for order in orders}
    kept = [sum(one == other for one, other in zip(x, y, strict=True)) for x, y in combinations(orders, 2)]
    low, high = points(TYPES[6], np.array([0.5, 2.0])).V.values
    rows += [
        Row("connections of a, b and H that differ in V at r = 0.5", "1", "p. 16", "6", len(kinds)),
        Row("combinations in which two members change places", "1", "p. 16, Table 1", "9", kept.count(1)),
        Row("designs with any of these before and after a shift", "1", "p. 16", "36", len(list(product(kinds, kinds)))),
        Row("least V of type 6 for r from 0.5 to 2", "1", "p. 16", "0.69", float(low)),
        Row("largest V of type 6 for r from 0.5 to 2", "1", "p. 16", "1.66", float(high), right="1.630"),
    ]
    return Table("Types of connection", rows)


def choice() -> Table:
    """P. 16: which of types 4 and 6 for r from 0.5 to 2."""
    designs = split_path_designs(
        (0.5, 2.0), [DIFFERENTIAL], transmission=TRANSMISSION, couplings=["input"], combinations=False, progress=False
    )
    six = designs.table.set_index("type").loc[["4", "6"]]
    span = six.V_max - six.V_min
    rows = [
        Row(
            "the type of 4 and 6 with the higher mean efficiency",
            "",
            "p. 16, Fig. 12",
            "4",
            str(six.mean_efficiency.idxmax()),
        ),
        Row("the one with less power through the unit", "", "p. 16, Fig. 13", "4", str(six.max_K.idxmin())),
        Row("the one with the smaller range of V", "", "p. 16, Fig. 11", "6", str(span.idxmin())),
        *[Row(f"mean efficiency of type {n}", "1", "Fig. 12", "", float(six.mean_efficiency[n])) for n in ("4", "6")],
        *[Row(f"largest |K| of type {n}", "1", "Fig. 13", "", float(six.max_K[n])) for n in ("4", "6")],
    ]
    return Table(
        "The choice for r from 0.5 to 2",
        rows,
        "Rows without numbers compare what the paper says in words.",
    )


def one_block() -> Table:
    """Where the curves of Figs. 12 and 13 jump, at r = 1."""
    rows = []
    for number, layout in TYPES.items():
        p = points(layout, np.array([1.0])).isel(r=0)
        for name in ("efficiency", "K"):
            ends = " to ".join(f"{float(p[f'{name}_{end}']):.4f}" for end in ("low", "high"))
            rows.append(
                Row(f"{name} of type {number}", "1", "Fig. 12" if name == "efficiency" else "Fig. 13", "", ends)
            )
    note = (
        "At r = 1 all members turn as one block: no tooth rolls, friction holds the meshes at rest, and efficiency and K may have any "
        "value between those on both sides. The paper's curves jump there."
    )
    return Table("Intervals at r = 1", rows, note)


@cache
def curves() -> xr.Dataset:
    """V, efficiency, K and, without losses, K_o of the six types over r."""
    r = np.unique(np.append(np.linspace(-2, 3, 601).round(9), [1 - 1e-9, 1 + 1e-9]))
    r = r[(r != 0) & (r != 1)]  # nothing is delivered at standstill
    found: list[xr.Dataset] = []
    for layout in TYPES.values():
        lossy, ideal = points(layout, r), points(layout, r, parameters=LOSSLESS)
        found.append(lossy[["V", "efficiency", "K"]].assign(K_o=ideal.K))
    return xr.concat(found, xr.DataArray(list(TYPES), dims="type", name="type"), combine_attrs="drop_conflicts")


def _inset(ax: Axes) -> Axes:
    """Where the intervals at r = 1, too small for the curves' scale, are drawn."""
    inset = ax.inset_axes((0.62, 0.1, 0.35, 0.26))
    inset.set_title("interval at $r = 1$ about its middle", fontsize=8)
    inset.set_xlabel("type", fontsize=8, labelpad=1)
    inset.tick_params(labelsize=7)
    inset.axhline(0, color="0.6", lw=0.6)
    return inset


def _over_r(name: str, label: str, limits: tuple[float, float]) -> Figure:
    import matplotlib.pyplot as plt

    figure, ax = plt.subplots(figsize=(7.5, 5), layout="constrained")
    found = curves()
    r = found.r.values
    at_one = {number: points(layout, np.array([1.0])).isel(r=0) for number, layout in TYPES.items()}
    spans = {
        number: [float(p[f"{name}_{end}"]) for end in ("low", "high") if f"{name}_{end}" in p]
        for number, p in at_one.items()
    }
    inset = _inset(ax) if any(span and abs(span[1] - span[0]) > 1e-9 for span in spans.values()) else None
    for number, layout in TYPES.items():
        y = found[name].sel(type=number).values
        for part in (r < 0, (r > 0) & (r < 1), r > 1):
            text = f"{number}: {', '.join(layout)}" if r[part][0] > 1 else None
            ax.plot(r[part], y[part], color=f"C{number - 1}", label=text)
        if inset is not None:
            low, high = sorted(spans[number])
            ax.plot([1, 1], [low, high], color=f"C{number - 1}", lw=3, solid_capstyle="butt", zorder=4)
            half = (high - low) / 2
            inset.errorbar(number, 0, yerr=half, color=f"C{number - 1}", capsize=4, lw=2.5, capthick=1.5)
    ax.set(xlabel=r"overall ratio $r = N_3/N_1$  [1]", ylabel=label, xlim=(-2, 3), ylim=limits)
    ax.axhline(0, color="0.6", lw=0.6)
    ax.axvline(0, color="0.6", lw=0.6)
    ax.grid(alpha=0.25)
    figure.legend(
        title="type: member at input, unit, output", ncols=6, fontsize=8, title_fontsize=8, loc="outside lower center"
    )
    return figure


def figure_6() -> Figure:
    """Powers of b and H over that of a, which delivers, over N_a/N_b."""
    import matplotlib.pyplot as plt

    r = np.concatenate([np.linspace(-0.2, -0.012, 80), np.linspace(0.012, 0.2, 80)])
    figure, ax = plt.subplots(figsize=(7.5, 4.5), layout="constrained")
    for name, k in (("b", 1), ("H", 2)):
        for part in (r[r < 0], r[r > 0]):
            p = points("bHa", part)
            ax.plot(part, p[f"P_{k}"] / p.P_3, color=f"C{k}", label=f"$P_{name}/P_a$" if part[0] > 0 else None)
        marked = np.array([-0.03, 0.03])
        p = points("bHa", marked)
        for x, y in zip(marked, (p[f"P_{k}"] / p.P_3).values, strict=True):
            ax.plot(x, y, "o", color=f"C{k}")
            ax.annotate(
                f"{y:.1f}", (x, y), (8 if x > 0 else -8, 0), textcoords="offset points", ha="left" if x > 0 else "right"
            )
    ax.set(xlabel="$N_a/N_b$  [1]", ylabel="power into the member over that into $a$  [1]", ylim=(-110, 110))
    ax.axhline(0, color="0.6", lw=0.6)
    ax.axvline(0, color="0.6", lw=0.6)
    ax.grid(alpha=0.25)
    figure.legend(ncols=2, loc="outside lower center")
    return figure


def _flow(r: float, layout: Layout, ax: Axes, title: str) -> None:
    grid = {"r": np.array([r]), "load": 10.0 if r < 0 else -10.0}
    names = {
        "transmission.differential": "differential",
        "transmission.cvu": "unit",
        "drive": "input",
        "torque": "output",
    }
    pt.power_flow(bench(layout), grid, progress=False).isel(r=0).plot(ax, names=names)
    ax.set_title(title)


def figure_8() -> Figure:
    """The three cases of power flow."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(3, 1, figsize=(8, 11), layout="constrained")
    cases: list[tuple[float, Layout, str]] = [
        (0.9, "baH", "a) split"),
        (0.9, "bHa", "b) positive recirculation"),
        (-0.5, "bHa", "c) negative recirculation"),
    ]
    for ax, (r, layout, title) in zip(axes, cases, strict=True):
        _flow(r, layout, ax, f"{title}: type {layout}, r = {r:g}")
    return figure


def figure_9() -> Figure:
    """Power flow of the worked example."""
    import matplotlib.pyplot as plt

    figure, ax = plt.subplots(figsize=(8, 4.5), layout="constrained")
    _flow(EXAMPLE, "bHa", ax, f"r = {EXAMPLE:g}: power at 130 W output")
    return figure


DATA = "R_o = −1.7, η_ab = η_ba = 0.95, η_v = 0.9"
PAPER = Paper(
    name="yu-beachley",
    title="Mechanical efficiency of differential gearing",
    citation="D. Yu, N. Beachley, Mechanical efficiency of differential gearing, Gear Technology, July/August 1986, pp. 9-16, 48.",
    summary=(
        "A differential loses power where gears roll on each other, which depends only on the motion relative to its carrier. With a "
        "variable unit in parallel it forms six split-path transmissions. The computed values come from one acausal model: the "
        "transmission between a drive and a load, at its operating points."
    ),
    tables=(worked_example, power_directions, connections, choice, one_block),
    pictures=(
        Picture("figure-6", f"Fig. 6: power of b and H over that of a, the output; {DATA}.", figure_6),
        Picture("figure-8", f"Fig. 8: the three cases of power flow; {DATA}.", figure_8),
        Picture("figure-9", f"Fig. 9: power flow of the worked example; {DATA}.", figure_9),
        Picture(
            "figure-11",
            "Fig. 11: ratio V of the variable unit over the overall ratio, six types, R_o = −1.7.",
            lambda: _over_r("V", "$V = N_2/N_1$  [1]", (-4, 4)),
        ),
        Picture(
            "figure-12",
            f"Fig. 12: overall efficiency; bars at r = 1 are intervals; {DATA}.",
            lambda: _over_r("efficiency", r"overall efficiency $\eta_{oa}$  [1]", (0, 1)),
        ),
        Picture(
            "figure-13",
            f"Fig. 13: share of the input power through the unit; bars at r = 1 are intervals; {DATA}.",
            lambda: _over_r("K", "$K$  [1]", (-6, 6)),
        ),
        Picture(
            "figure-14",
            "Fig. 14: the same without friction, R_o = −1.7.",
            lambda: _over_r("K_o", "$K_o$  [1]", (-6, 6)),
        ),
    ),
)
