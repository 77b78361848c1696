"""Plots of a power flow: levers, the share of a variator and the efficiency over a ratio, and efficiency maps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from powertrain.equilibrium.points import STUCK_POINT
from powertrain.errors import ParameterError
from powertrain.figures.plot import axes_of, unit_text
from powertrain.language.arguments import names as texts
from powertrain.language.arguments import number
from powertrain.language.reals import Array
from powertrain.power.powerflow import PowerFlow
from powertrain.power.variator import VARIATOR_CASES

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

REGIMES = {
    "idle": "#d9d9d9",
    "split": "#b7dfb2",
    "series": "#c6dbef",
    "positive recirculation": "#fdd9a5",
    "negative recirculation": "#d8c7e6",
}
"""The colour of every case."""
_HATCHES = {
    "idle": "xx",
    "split": "",
    "series": "--",
    "positive recirculation": "//",
    "negative recirculation": "\\\\",
}
_MEMBERS = (("a", "b", "carrier"), ("sun", "ring", "carrier"))
_LARGEST_SHARE = 5.0
_LEAST_AREA = 0.02


def plot_lever(
    flow: PowerFlow,
    name: str,
    members: tuple[str, str, str] | None = None,
    *,
    ratio: float | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Lever diagram of a differential at one point: the speeds of its members lie on a line, the torques act at its points.

    The third member (the carrier) is at 0, the second at 1, the first at R_o = (w_1 - w_3)/(w_2 - w_3), so speeds are collinear and
    torques balance like forces on a rigid lever; with losses a moment remains. ``members``: names of the ports, by default
    (a, b, carrier) or (sun, ring, carrier). ``ratio``: R_o, required if all members turn at the same speed.

    Raises ParameterError for other components, for more than one point, and for a point without a solution.
    """
    ports = _member_ports(flow, name, members)
    values = flow.data.sel(port=ports)
    if values["speed"].ndim != 1:
        raise ParameterError("a lever shows one point: choose one with isel(...) or sel(...)")
    speed, torque = values["speed"].values.astype(float), values["torque"].values.astype(float)
    if not np.isfinite([speed, torque]).all():
        raise ParameterError(
            f"plot_lever: the speeds and torques of {name} are not known at this point; choose another one"
        )
    speed, torque = (np.where(np.abs(v) > 1e-9 * np.abs(v).max(), v, 0.0) for v in (speed, torque))  # round-off is zero
    R_o = _lever_ratio(name, speed, ratio)
    x = np.array([R_o, 1.0, 0.0])
    ax = axes_of(ax, (7.0, 4.6))
    span = max(np.ptp(speed), np.abs(speed).max(), 1e-12)
    length = 0.32 * span / max(np.abs(torque).max(), 1e-300)
    ax.axhline(0.0, color="0.3", lw=1.0)
    ends = np.array([x.min() - 0.15 * np.ptp(x), x.max() + 0.15 * np.ptp(x)])
    ax.plot(ends, speed[2] + ends * (speed[1] - speed[2]), color="0.45", lw=4, solid_capstyle="round", zorder=2)
    for k, port in enumerate(ports):
        _draw_member(
            ax,
            port.rpartition(".")[2],
            float(x[k]),
            float(speed[k]),
            float(torque[k]),
            length,
            bool(speed[1] > speed[2]),
        )
    ax.set_xlim(ends[0] - 0.25 * np.ptp(x), ends[1] + 0.25 * np.ptp(x))
    heights = [*speed, *(speed + length * torque), 0.0]
    ax.set_ylim(min(heights) - 0.3 * span, max(heights) + 0.3 * span)
    ax.set_xlabel(
        "Position on the lever (carrier 0, b 1, a $R_o$)" if ports[0].endswith(".a") else "Position on the lever"
    )
    ax.set_ylabel("Speed [rad/s]")
    ax.set_title(f"{name}: $R_o$ = {R_o:.4g}", fontsize=10)
    ax.grid(visible=True, axis="y", alpha=0.3)
    _lever_legend(ax)
    return ax


def plot_variator(
    flow: PowerFlow,
    name: str,
    x: str,
    *,
    ax: Axes | None = None,
    source: str | None = None,
    largest: float = _LARGEST_SHARE,
) -> Axes:
    """Share of a variator and efficiency along one dimension, with the cases of the power flow shaded.

    ``x``: a coordinate or an output of the flow, such as the overall ratio. K (and K_o, if known) is on the left axis, clipped at
    +-``largest``; efficiency is on the right axis. Dotted lines: points without a unique solution. ``source``: see ``PowerFlow.variator``.

    Raises ParameterError for anything but one dimension, and if no point has an efficiency.
    """
    efficiency = _known("plot_variator", flow)
    if len(efficiency.dims) != 1:
        raise ParameterError(f"plot_variator shows one dimension, not {len(efficiency.dims)}: choose with isel(...)")
    if number("largest", largest) <= 0.0:
        raise ParameterError(f"largest = {largest:g} must be positive")
    share = flow.variator(name, source)
    along = _along(flow, x)
    order = np.argsort(along, kind="stable")
    order = order[np.isfinite(along[order])]
    along, cases = along[order], share["case"].values[order]
    ax = axes_of(ax, (7.5, 4.4))
    _shade(ax, along, cases)
    K = share["K"].values[order].astype(float)
    alone = "o" if along.size == 1 else None
    handles = ax.plot(along, _cut(K, largest), marker=alone, color="C0", label="K")
    if "K_o" in share:
        K_o = share["K_o"].values[order].astype(float)
        handles += ax.plot(along, _cut(K_o, largest), color="C0", ls="--", lw=1, label="$K_o$ (no losses)")
    right = ax.twinx()
    handles += right.plot(along, efficiency.values[order], marker=alone, color="C3", label="efficiency")
    right.set_ylim(0, 1)
    right.set_ylabel("Efficiency", color="C3")
    ax.set_ylim(-largest, largest)
    ax.axhline(0, color="0.4", lw=0.8)
    ax.set_ylabel(f"Power into {name} over input power", color="C0")
    ax.set_xlabel(_axis_text(flow, x))
    ax.margins(x=0)
    for place in along[~np.isfinite(K)]:
        ax.axvline(place, color="0.3", lw=0.8, ls=":")
    right.legend(
        handles=[*handles, *_patches(cases)], loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=3, fontsize=8
    )
    return ax


def plot_efficiency_map(
    flow: PowerFlow, x: str, y: str, *, variator: str | None = None, ax: Axes | None = None, step: float = 0.05
) -> Axes:
    """Contours of efficiency over two dimensions, with the cases of a variator's power flow hatched over them.

    ``x``, ``y``: the dimensions. ``step``: distance of the contours. White: no power enters, or there is no unique solution.
    Dots: friction is at rest, and the efficiency is an interval; contours pass single lines of such points between their neighbours.
    Raises ParameterError if these are not the two dimensions of the flow, if one of them has a single value, or if no point has an
    efficiency.
    """
    from matplotlib.patches import Patch

    efficiency = _known("plot_efficiency_map", flow)
    if set(efficiency.dims) != {x, y}:
        raise ParameterError(
            f"plot_efficiency_map shows two dimensions, but this flow has {', '.join(map(str, efficiency.dims))}"
        )
    if min(efficiency.shape) < 2:
        raise ParameterError(
            f"plot_efficiency_map needs two values of {x} and of {y} at least; this flow has {dict(efficiency.sizes)}"
        )
    if not 1e-3 <= number("step", step) <= 0.5:
        raise ParameterError(f"step = {step:g}: contours of efficiency are 0.001 to 0.5 apart")
    order = {d: np.argsort(flow.data[d].values) for d in (x, y)}  # contours need growing coordinates
    across, up = (flow.data[d].values[order[d]] for d in (x, y))
    found = efficiency.isel(order).transpose(y, x).values.astype(float)
    rests = flow.data["status"].isel(order).transpose(y, x).values == STUCK_POINT
    found = np.minimum(found, 1.0)  # beyond the last level there is no colour, also where only round-off is
    values = np.ma.masked_invalid(_bridged(_bridged(found, rests, across).T, rests.T, up).T)
    ax = axes_of(ax, (7.5, 5.4))
    levels = np.arange(step, 1.0 - 1e-9, step)
    filled = ax.contourf(across, up, values, levels=[0.0, *levels, 1.0], cmap="viridis", extend="neither")
    lines = ax.contour(across, up, values, levels=levels[1::2], colors="k", linewidths=0.5)
    ax.clabel(lines, [level for level in levels[1::2] if level > 0.45], fmt="%.2f", fontsize=7)
    ax.figure.colorbar(filled, ax=ax, label="Efficiency", ticks=[*levels[1::2], 1.0])
    if rests.any():
        row, column = np.nonzero(rests)
        ax.plot(across[column], up[row], ".", color="0.3", ms=2)
    if variator is not None:
        cases = flow.variator(variator)["case"].isel(order).transpose(y, x).values
        present = [case for case in VARIATOR_CASES if (cases == case).mean() > _LEAST_AREA]
        for case in present:
            here = np.where(cases == case, 1.0, 0.0)
            if _HATCHES[case]:
                ax.contourf(across, up, here, levels=[0.5, 1.5], colors="none", hatches=[_HATCHES[case]])
            ax.contour(across, up, here, levels=[0.5], colors="w", linewidths=1.4)
        handles = [Patch(fc="0.85", ec="0.2", hatch=_HATCHES[case], label=case) for case in present]
        ax.legend(
            handles=handles,
            loc="upper center",
            bbox_to_anchor=(0.5, -0.12),
            ncols=len(handles),
            fontsize=8,
            handleheight=1.6,
            handlelength=2.6,
        )
    ax.set_xlabel(_axis_text(flow, x))
    ax.set_ylabel(_axis_text(flow, y))
    return ax


def _known(what: str, flow: PowerFlow) -> xr.DataArray:
    """The efficiency of a flow. ParameterError if no point has one."""
    efficiency = flow.efficiency
    if not np.isfinite(efficiency.values).any():
        raise ParameterError(f"{what}: no point has an efficiency; no power enters, or there is no unique solution")
    return efficiency


def _bridged(values: Array, rests: NDArray[np.bool_], along: Array) -> Array:
    """Rows of values; a single point at rest without a value takes it from the two points beside it in its row."""
    found, share = values.copy(), (along[1:-1] - along[:-2]) / (along[2:] - along[:-2])
    between = values[:, :-2] + share * (values[:, 2:] - values[:, :-2])
    here = rests[:, 1:-1] & np.isnan(values[:, 1:-1]) & np.isfinite(between)
    found[:, 1:-1][here] = between[here]
    return found


def _member_ports(flow: PowerFlow, name: str, members: tuple[str, str, str] | None) -> list[str]:
    known = {str(port) for port in flow.data["port"].values}
    choices = _MEMBERS if members is None else [tuple(texts("members", members))]
    if len(choices[0]) != 3:
        raise ParameterError(f"members = {members!r}: give the names of three ports")
    for names in choices:
        ports = [f"{name}.{member}" for member in names]
        if known.issuperset(ports):
            return ports
    wanted = " or ".join(map(str, choices))
    raise ParameterError(f"a lever needs a component with the ports {wanted}; {name} has none of these")


def _lever_ratio(name: str, speed: Array, ratio: float | None) -> float:
    if ratio is not None:
        return number("ratio", ratio)
    if abs(speed[1] - speed[2]) <= 1e-9 * np.abs(speed).max(initial=0.0):
        raise ParameterError(
            f"the members of {name} turn at the same speed, so its ratio cannot be determined: give ratio=..."
        )
    return float((speed[0] - speed[2]) / (speed[1] - speed[2]))


def _draw_member(ax: Axes, name: str, x: float, speed: float, torque: float, length: float, rising: bool) -> None:
    """The point of a member, its torque as an arrow, and its label."""
    power = torque * speed + 0.0  # no -0
    colour = "C2" if power > 0 else "C3" if power < 0 else "0.5"
    ax.plot([x, x], [0, speed], color="0.6", lw=1, zorder=1)
    ax.annotate(
        "",
        xy=(x, speed + length * torque),
        xytext=(x, speed),
        arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 2.2, "shrinkA": 0, "shrinkB": 0},
        zorder=3,
    )
    ax.plot([x], [speed], "o", color="k", ms=6, zorder=4)
    text = f"{name}\n{speed:.4g} rad/s\n{torque:.4g} N·m\n{power / 1e3:.4g} kW"
    below = torque > 0
    right = below == rising
    ax.annotate(
        text,
        xy=(x, speed),
        xytext=(9 if right else -9, -8 if below else 8),
        textcoords="offset points",
        va="top" if below else "bottom",
        ha="left" if right else "right",
        fontsize=8,
        bbox={"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.8},
        zorder=5,
    )


def _lever_legend(ax: Axes) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color="C2", lw=2.2, label="torque that drives (power in)"),
        Line2D([], [], color="C3", lw=2.2, label="torque that brakes (power out)"),
    ]
    ax.legend(handles=handles, loc="best", fontsize=8)


def _along(flow: PowerFlow, x: str) -> Array:
    if x not in flow.data and x not in flow.data.coords:
        raise ParameterError(f"the power flow has no coordinate or output {x}; name it in outputs=...")
    if flow.data[x].dims != flow.efficiency.dims:
        raise ParameterError(f"{x} is not one value for each point of the flow; name a coordinate or an output")
    values = np.asarray(flow.data[x].values, float)
    if f"{x}_low" not in flow.data:
        return values
    low, high = (np.asarray(flow.data[f"{x}_{end}"].values, float) for end in ("low", "high"))
    known = ~np.isfinite(values) & (np.abs(high - low) <= 1e-9 * (1 + np.abs(low)))
    return np.where(known, low, values)


def _axis_text(flow: PowerFlow, x: str) -> str:
    attributes: dict[str, Any] = flow.data[x].attrs
    unit = attributes.get("units", "1")
    text = str(attributes.get("long_name", x))
    return f"{text} [{unit_text(unit)}]" if unit not in ("", "1") else text


def _shade(ax: Axes, along: Array, cases: NDArray[Any]) -> None:
    """A coloured span for every run of points with the same case, extended half way to the neighbouring points."""
    middles = np.concatenate([along[:1], (along[1:] + along[:-1]) / 2, along[-1:]])
    first = 0
    for k in range(1, len(cases) + 1):
        if k == len(cases) or cases[k] != cases[first]:
            if cases[first]:
                ax.axvspan(middles[first], middles[k], color=REGIMES[cases[first]], lw=0, zorder=0)
            first = k


def _patches(cases: NDArray[Any]) -> list[Any]:
    from matplotlib.patches import Patch

    return [Patch(color=REGIMES[case], label=case) for case in VARIATOR_CASES if (cases == case).any()]


def _cut(values: Array, largest: float) -> Array:
    """Values clipped to the limits, without lines across poles."""
    shown = np.where(np.abs(values) <= 1.5 * largest, values, np.nan)
    jump = (np.abs(np.diff(values)) > largest) & (np.diff(np.sign(values)) != 0)
    shown[1:][jump] = np.nan
    return shown
