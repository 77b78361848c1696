"""Plots of a run on a cycle: speed and its tolerance, prime movers and ratio, power, energy, operating points."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import powertrain as pt
from powertrain.components.common_units import KM_H, RPM
from powertrain.components.cvu.interfaces import VariableUnit
from powertrain.components.transmissions import Shiftable, VariableTransmission
from powertrain.components.wheels import WheelBrake
from powertrain.figures.plot import axes_of
from powertrain.language.reals import Array
from powertrain.power.powerplot import REGIMES
from powertrain.power.variator import VARIATOR_CASES, port_motion
from powertrain.trials.anatomy import anatomy, parts_of, value_at, variators
from powertrain.trials.cycle_run import CycleRun

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

POINTS = 2001
"""Samples of the power flow."""
FAINT = 1e-3
"""Share of the largest power below which a power flow counts as zero."""
AREA = 5000.0
"""Total area of all operating points [pt2]."""
SLOW = 5.0
"""Speed of an input [rad/s] below which a ratio is not shown."""
SETTLED = 0.99
"""Share of the top speed up to which an acceleration is shown."""
STORED = "stored at the end"
MOVERS = ("C1", "C4", "C5", "C6", "C8", "C9")
"""Colours of prime movers."""


def cycle_figure(run: CycleRun) -> Figure:
    """All plots of a run on one page."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13, 15), layout="constrained")
    grid = figure.add_gridspec(4, 2, height_ratios=[1.0, 1.0, 1.0, 1.5])
    top = figure.add_subplot(grid[0, :])
    second = figure.add_subplot(grid[1, :], sharex=top)
    plot_speed(run, ax=top)
    plot_prime_movers_and_ratio(run, ax=second)
    plot_powers(run, ax=figure.add_subplot(grid[2, :], sharex=top))
    for ax in (top, second):
        ax.label_outer()
    plot_energy(run, ax=figure.add_subplot(grid[3, 0]))
    plot_operating_points(run, ax=figure.add_subplot(grid[3, 1]))
    figure.suptitle(f"{run.title}: {run.distance / 1e3:.2f} km, {_consumption(run)}", fontsize=13)
    return figure


def _consumption(run: CycleRun) -> str:
    """Fuel and carbon dioxide for a vehicle with an engine, electricity without one."""
    if not run.distance > 1:
        return "not driven"
    if run.anatomy.engines:
        return f"{run.litres_per_100km:.2f} l/100 km, {run.co2_per_km:.0f} g/km CO₂"
    return f"{run.wh_per_km:.0f} W.h/km"


def acceleration_figure(result: pt.Result[Any], name: str) -> Figure:
    """Speed and acceleration over time with the accelerator fully pressed."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 5.5), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    body = anatomy(result.model).the("body")
    v = result[f"{body}.v"] / KM_H
    above.plot(result.time, v, color="C0")
    above.set(ylabel="Speed [km/h]", title=f"{name} with a full accelerator: {v.max():.0f} km/h")
    once = np.diff(result.time, append=np.inf) > 0.0  # an event appears twice
    below.plot(result.time[once], np.gradient(v[once] * KM_H, result.time[once]), color="C1")
    settled = result.time[np.argmax(v >= SETTLED * v.max())]
    below.set(ylabel="Acceleration [m/s²]", xlabel="Time [s]", xlim=(0, 1.1 * settled))
    for ax in (above, below):
        ax.grid(visible=True, alpha=0.3)
    return figure


def plot_speed(run: CycleRun, *, ax: Axes | None = None) -> Axes:
    """Speed [km/h] over time [s] with the cycle and the speed tolerance of the regulation; the line is red outside the tolerance."""
    ax = axes_of(ax, (9, 4))
    t, low, high = run.band
    ax.fill_between(t, np.maximum(low, 0) / KM_H, high / KM_H, color="0.85", label="tolerance: ±2 km/h, ±1 s")
    times, wanted = run.cycle.times, run.cycle.speeds
    ax.plot(times, wanted / KM_H, color="0.45", lw=0.8, ls="--", label=f"cycle {run.cycle.name}")
    time, v = run.result.time, run.speed / KM_H
    ax.plot(time, v, color="C0", lw=1.1, label="vehicle")
    outside = run.excess != 0
    if outside.any():
        ax.plot(time, np.where(outside, v, np.nan), color="C3", lw=2, label=f"outside, {run.time_outside:.1f} s")
    ax.set(ylabel="Speed [km/h]", xlabel="Time [s]", xlim=(t[0], t[-1]))
    return _finish(ax)


def plot_prime_movers_and_ratio(run: CycleRun, *, ax: Axes | None = None) -> Axes:
    """Speeds of engines and machines [rpm] and, on the right, the ratio of the transmission: output speed over input speed [1]."""
    ax = axes_of(ax, (9, 4))
    time, lines, top = run.result.time, [], 1.0
    for (path, colour), speed in _movers(run, "w"):
        lines += ax.plot(time, speed / RPM, color=colour, lw=0.9, label=f"speed of {path}")
        top = max(top, float(speed.max()) / RPM)
    ax.set(ylabel="Speed [rpm]", xlabel="Time [s]")
    ax.set_ylim(top=1.3 * top)
    found = transmission_ratio(run)
    if found is not None:
        right = ax.twinx()
        lines += right.plot(time, found, color="C2", lw=0.9, label="transmission, output over input speed")
        right.set_ylabel("Ratio [1]", color="C2")
        right.set_ylim(0, 1.3 * np.nanmax(found, initial=1.0))
    ax.grid(visible=True, alpha=0.3)
    ax.legend(handles=lines, loc="upper left", ncols=2, fontsize=8)
    return ax


def plot_powers(run: CycleRun, *, ax: Axes | None = None) -> Axes:
    """Power [kW] of engines and machines, into the variable unit and into the brakes over time.

    If there is a variable unit, the cases of its power flow are shaded; the legend gives the share of the transmission's energy that flowed
    through it in each case.
    """
    ax = axes_of(ax, (9, 4))
    for (path, colour), power in _movers(run, "power"):
        ax.plot(run.result.time, power / 1e3, color=colour, lw=0.9, label=path)
    first, last = run.result.time[[0, -1]]
    flow = pt.power_flow(run.result, at=np.linspace(first, last, POINTS))
    time = flow.data["time"].values
    brakes = [flow.data["loss"].sel(component=path).values / 1e3 for path in parts_of(run.plant.model, WheelBrake)]
    ax.plot(time, np.sum(brakes, axis=0), color="C3", lw=0.9, label="into the brakes")
    for unit in variators(run.plant.model):
        share = flow.variator(unit)
        power = share["power"].values / 1e3
        ax.plot(time, power, color="C0", lw=0.9, label=f"into {unit}")
        _shade(ax, time, share["case"].values, power)
        break
    ax.axhline(0, color="0.5", lw=0.6)
    ax.set(ylabel="Power [kW]", xlabel="Time [s]", xlim=(first, last))
    ax.set_ylim(top=1.3 * ax.get_ylim()[1])  # room for the legend
    return _finish(ax)


def plot_energy(run: CycleRun, *, ax: Axes | None = None) -> Axes:
    """Losses of the components [MJ], the largest on top, and energy stored in parts, with their shares of the energy supplied."""
    ax = axes_of(ax, (9, 4))
    table, supplied = run.audit.components, run.supplied
    all_lost = float(table["lost"][""])
    stored = supplied - all_lost
    lost = {_short(table.lost, path): _own_loss(table.lost, path) for path in map(str, table.index) if path}
    shown = sorted(((n, e) for n, e in lost.items() if e > 5e-4 * all_lost), key=lambda pair: pair[1])
    if stored > 5e-4 * all_lost:
        shown.insert(0, (STORED, stored))
    y = np.arange(len(shown))
    values = np.array([energy for _, energy in shown]) / 1e6
    kinds = dict.fromkeys(parts_of(run.plant.model, WheelBrake), "C3") | dict(_colours(run))
    colours = ["C7" if name == STORED else kinds.get(name, "C0") for name, _ in shown]
    bars = ax.barh(y, values, color=colours)
    ax.bar_label(bars, [f"{v:.3g} MJ, {v * 1e6 / supplied:.1%}" for v in values], padding=3, fontsize=8)
    ax.set_yticks(y, [name for name, _ in shown])
    ax.set_xlim(0, 1.35 * values.max(initial=1e-9))
    ax.set_xlabel("Lost [MJ]")
    ax.set_title(f"Of {supplied / 1e6:.3g} MJ supplied (energy residual {run.audit.closure:.0e})", fontsize=10)
    ax.grid(visible=True, axis="x", alpha=0.3)
    return ax


def plot_operating_points(run: CycleRun, *, ax: Axes | None = None) -> Axes:
    """Operating points of the (first) engine in its consumption map, or of the machine of an electric car in its efficiency map.

    The area of a dot is proportional to the fuel burnt there, or to the energy through the shaft of the machine. Points are grouped in
    cells of 100 rpm by a thirtieth of the largest torque.
    """
    ax = axes_of(ax, (9, 4))
    path = _on_a_map(run, ax)
    w, tau = run.result[f"{path}.w"] / RPM, run.result[f"{path}.tau"]
    engine = path in run.anatomy.engines
    rate = run.result[f"{path}.fuel_rate"] if engine else np.abs(run.result[f"{path}.power"])
    fuel = rate * np.gradient(run.result.time)
    cells = (np.arange(0, w.max() + 200, 100.0), np.linspace(tau.min() - 1e-3, tau.max() + 1e-3, 61))
    burnt, across, up = np.histogram2d(w, tau, bins=cells, weights=fuel)
    i, j = np.nonzero(burnt > 1e-4 * burnt.sum())
    area = AREA * burnt[i, j] / max(burnt.sum(), 1e-300)
    x, y = (across[:-1] + across[1:])[i] / 2, (up[:-1] + up[1:])[j] / 2
    ax.scatter(x, y, s=area, color="C0", edgecolors="w", linewidths=0.4, alpha=0.85, zorder=3)
    said = "area: fuel burnt there" if engine else "area: energy through the shaft there"
    ax.scatter([], [], s=40, color="C0", label=said)
    ax.legend(loc="lower right", fontsize=8, framealpha=0.9)
    return ax


def _on_a_map(run: CycleRun, ax: Axes) -> str:
    """Draw the map of the first prime mover with the parameters of the run; return its path."""
    path = run.anatomy.prime_movers[0]
    part = value_at(run.vehicle, path)
    if path in run.anatomy.engines:
        from powertrain.components.engines.figures import plot_engine_map

        plot_engine_map(part, ax=ax)
    else:
        from powertrain.components.electric.figures import plot_machine_map

        plot_machine_map(part, ax=ax)
    return path


def _colours(run: CycleRun) -> list[tuple[str, str]]:
    """Paths of the prime movers with a colour each."""
    return list(zip(run.anatomy.prime_movers, MOVERS, strict=False))


def _movers(run: CycleRun, signal: str) -> Iterator[tuple[tuple[str, str], Array]]:
    """A signal of each prime mover, with its path and colour."""
    return ((mover, run.result[f"{mover[0]}.{signal}"]) for mover in _colours(run))


def transmission_ratio(run: CycleRun) -> Array | None:
    """Output speed over input speed of the transmission, gearbox or variable unit at ``run.result.time``.

    NaN while the input is (nearly) at rest; None if the vehicle has no such component.
    """
    kinds = (VariableTransmission, Shiftable, VariableUnit)
    name = next((path for kind in kinds for path in parts_of(run.plant.model, kind)), None)
    if name is None:
        return None
    ports = [port_motion(run.result.compiled, f"{name}.{flange}") for flange in ("flange_a", "flange_b")]
    w_in, w_out = run.result.evaluate(ports).T
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(np.abs(w_in) > SLOW, w_out / w_in, np.nan)


def _short(lost: Any, path: str) -> str:
    """The path of a composite that loses only what this part loses, else the part's own path."""
    whole = path.rpartition(".")[0]
    return _short(lost, whole) if whole and lost[whole] == lost[path] != 0 else path


def _own_loss(lost: Any, path: str) -> float:
    """The loss of a composite apart from its parts."""
    parts = [n for n in lost.index if str(n).startswith(f"{path}.") and "." not in str(n)[len(path) + 1 :]]
    return float(lost[path] - lost[parts].sum())


def _shade(ax: Axes, time: Array, cases: NDArray[Any], power: Array) -> None:
    """The cases of the power flow as bands behind the lines."""
    steps = np.gradient(time) * np.abs(np.nan_to_num(power))
    total = max(float(steps.sum()), 1e-300)
    for case in VARIATOR_CASES:
        here = (cases == case) & (power > FAINT * np.nanmax(power))
        if case != "idle" and here.any():
            said = f"{case}: {steps[here].sum() / total:.0%} of the energy into it"
            ax.fill_between(
                time, 0, 1, where=here, transform=ax.get_xaxis_transform(), color=REGIMES[case], lw=0, label=said
            )


def _finish(ax: Axes) -> Axes:
    ax.grid(visible=True, alpha=0.3)
    ax.legend(loc="upper left", ncols=3, fontsize=8)
    return ax
