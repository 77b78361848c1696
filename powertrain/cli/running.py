"""``powertrain run``: a vehicle over a drive cycle."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from powertrain.cli.options import (
    DATA,
    PAGE,
    PICTURE,
    Command,
    Interrupted,
    Interruption,
    OutputFile,
    driving,
    of_the_command_line,
    settings,
    starts_of,
)
from powertrain.cli.text import columns, number, title
from powertrain.cli.vehicle import VehicleArgument, VehicleName, configured

if TYPE_CHECKING:
    import powertrain as pt
    from powertrain.components.cycles import DriveCycle
    from powertrain.trials import CycleRun

WORTH_A_REPORT = 1.0
"""Distance [m] from which a run that ended early is reported."""
MAP = 47, 61
"""Speeds and positions of the accelerator of a map."""
COUNTED = ("sources", "lost", "stored")
"""Columns of the audit that are shown."""
PRINTED_FROM = 50.0
"""Energy [J] below which a component is not listed: half of the last digit."""


@click.command(
    "run",
    cls=Command,
    short_help="Drive a vehicle over a cycle: consumption, energy audit, figures.",
    examples=(
        "run SplitPathCar --cycle wltc --plot run.png",
        "run SplitPathCar --cycle udds --set body.m=1500 --set body.Cd=0.28 --out run.nc",
        "run PowerSplitHybrid --report hybrid.html",
        "run ElectricCar --cycle udds --start battery.soc=0.95",
        "run SplitPathCar --backward",
        "run SplitPathCar --span 0:200 --set transmission.cvu=HydrostaticUnit --set 'engine=MappedEngine.gasoline()'",
        "run ManualCar --set engine.curve=full_load.csv --write-params car.toml",
        "run car.toml --cycle my_cycle.csv",
    ),
)
@click.argument("vehicle", type=VehicleName())
@driving
@settings
@click.option(
    "--write-params", type=OutputFile(".toml"), help="Write all parameters with units and ranges to this TOML file."
)
@click.option("--out", type=DATA, help="Write the signals to a netCDF file (.nc), with units, or to a .csv file.")
@click.option(
    "--signals",
    multiple=True,
    metavar="PATTERN",
    help="Write only these signals to --out, such as 'engine.*'; may be repeated.",
)
@click.option(
    "--plot", type=PICTURE, help="Plot speed, engine and ratio, power, energy and operating points (.png, .pdf, .svg)."
)
@click.option(
    "--map",
    "chart",
    type=PICTURE,
    help="Plot the efficiency map from tank to road with the operating points of the cycle, and print it.",
)
@click.option(
    "--report",
    "page",
    type=PAGE,
    help="Write an interactive page to this .html file: power flow, signals, operating points, events, energy, parameters.",
)
@click.option(
    "--backward",
    is_flag=True,
    help="Also compute the fuel quasi-statically, from the operating points of the map, without transients.",
)
@click.option(
    "--rtol",
    type=click.FloatRange(1e-12, 1e-2),
    default=1e-4,
    show_default=True,
    help="Relative tolerance of the integrator; at the default the fuel is accurate to 1e-4 or better.",
)
def command(
    vehicle: VehicleArgument,
    cycle: DriveCycle | None,
    span: tuple[float, float] | None,
    texts: tuple[str, ...],
    params: Path | None,
    begin: tuple[str, ...],
    write_params: Path | None,
    out: Path | None,
    signals: tuple[str, ...],
    plot: Path | None,
    chart: Path | None,
    page: Path | None,
    backward: bool,
    rtol: float,
) -> None:
    """Simulate a vehicle over a drive cycle and print its consumption and energy balance.

    VEHICLE is a name that `powertrain list vehicles` lists, or a parameter file (.toml) that names its class. `powertrain info VEHICLE`
    lists the parameters and slots that can be set.

    The vehicle starts at rest, so a span of a cycle should also start at rest.
    """
    import powertrain as pt
    from powertrain.presets import files
    from powertrain.presets.settings import free_or_error
    from powertrain.trials import drive_cycle
    from powertrain.trials.backward import check_backward
    from powertrain.trials.cycle import so_far
    from powertrain.trials.driveline import check_map

    model, paths = configured(vehicle, params, texts)
    model, driven = spanned(model, cycle, span)
    with of_the_command_line():
        if backward:
            check_backward(model)
        if chart is not None:
            check_map(model)
    plant = pt.compile(model)
    with of_the_command_line():
        free_or_error(paths, model, plant.parameters)
    starts = starts_of(begin, plant)
    chosen = _chosen(plant, out, signals)
    if write_params is not None:
        write_params.write_text(files.written(model, plant.parameters), encoding="utf-8")
    with Interruption(driven, so_far(plant)) as watch:
        run = drive_cycle(plant, starts=starts, progress=watch, rtol=rtol, name=vehicle.name)
    if out is not None:
        run.result.save(out, *chosen)
    if not run.message or run.distance >= WORTH_A_REPORT:
        _say(report(run))
        if backward:
            click.echo(_beside(run, model))
        if plot is not None:
            _draw_run(run, plot)
        if chart is not None:
            click.echo(f"\n{_draw_map(run, vehicle.name, model, chart)}")
        if page is not None:
            run.explore(page)
    for path in (write_params, out, plot, chart, page):
        if path is not None and path.exists():
            click.echo(f"wrote {path}")
    end(run, watch)


def end(run: CycleRun, watch: Interruption) -> None:
    """An error for a run with a message, which Ctrl-C or the simulation ended."""
    if run.message:
        early = run.result.time[-1] < run.cycle.times[-1]
        kind = Interrupted if watch.asked else click.ClickException
        raise kind(f"the run ended at {run.result.time[-1]:.4g} s. {run.message}" if early else run.message)


def _say(parts: Iterable[str]) -> None:
    """Print each part as soon as it is there."""
    for part in parts:
        click.echo(part)


def _beside(run: CycleRun, model: pt.Component) -> str:
    """The fuel of the same drive from steady operating points, and how far it is from the simulation's."""
    from powertrain.trials import backward

    end = float(run.result.time[-1])
    back = backward(model, run.cycle.part(float(run.cycle.times[0]), end) if run.message else run.cycle)
    litres = run.litres_per_100km * back.fuel / run.fuel
    rows = [("fuel", number(back.fuel), "kg"), ("consumption", number(litres), "l/100 km")]
    rows += [("against the simulation", f"{back.fuel / run.fuel - 1:+.2%}", "")]
    if back.missing.any():
        rows += [("force that the vehicle lacks, at most", number(float(back.missing.max())), "N")]
    return f"{title('Backward, from steady operating points')}\n{columns(rows, right=[1])}"


def _draw_run(run: CycleRun, plot: Path) -> None:
    """The picture of the run."""
    from powertrain.trials.figures import cycle_figure

    cycle_figure(run).savefig(plot, dpi=120)


def _draw_map(run: CycleRun, name: str, model: pt.Component, chart: Path) -> str:
    """The picture of the vehicle's map up to the cycle's speeds; what it says in text."""
    import numpy as np

    from powertrain.cli.driveline import mapped
    from powertrain.trials.driveline import SLOWEST

    speeds = np.linspace(SLOWEST, 1.05 * max(run.cycle.top_speed, 10.0), MAP[0])
    text, _, figure = mapped(model, speeds, MAP[1], name=name, run=run)
    assert figure is not None
    figure.savefig(chart, dpi=120)
    return text


def report(run: CycleRun) -> Iterator[str]:
    """The results in text: the run's table at once, then the energy audit, which takes its time."""
    from powertrain.trials.charge import beyond_correction, charge_corrected, stores_of

    cycle = run.cycle
    about = f"{cycle.duration:.0f} s, {cycle.distance / 1e3:.2f} km, up to {cycle.top_speed * 3.6:.1f} km/h"
    results = [
        (what, number(value), unit) for what, (value, unit) in zip(run.table.index, run.table.values, strict=True)
    ]
    far = ""
    if run.anatomy.engines and (stores := stores_of(run)):
        far = beyond_correction(run)
        results.append(
            (
                f"consumption, corrected to equal charge ({' and '.join(stores)})",
                number(math.nan if far else charge_corrected(run)),
                "l/100 km",
            )
        )
    yield "\n".join(
        [
            f"{run.title} ({about})",
            "",
            columns(results, right=[1]),
            *_not_followed(run),
            *_not_corrected(far),
            *(f"\nNote: {note}." for note in run.result.notes),
        ]
    )
    yield f"{title('Energy by component')}\n{_energies(run)}"


def _not_followed(run: CycleRun) -> list[str]:
    """A sentence where the vehicle leaves the speed tolerance."""
    if run.time_outside == 0:
        return []
    k = int(abs(run.excess).argmax())
    how = "fast" if run.excess[k] > 0 else "slow"
    most = (
        f", most at {run.result.time[k]:.0f} s: {abs(run.excess[k]) * 3.6:.1f} km/h too {how}" if run.excess[k] else ""
    )
    return [
        "",
        f"The vehicle does not follow the cycle: {run.time_outside:.1f} s outside the speed tolerance (±2 km/h, ±1 s){most}.",
    ]


def _not_corrected(far: str) -> list[str]:
    """A sentence where the run is too far from equal charge."""
    return ["", f"No consumption at equal charge: {far}."] if far else []


def _energies(run: CycleRun) -> str:
    """A line for every component that supplied, lost or stored energy; parts stand below their whole, indented."""
    table = run.audit.components
    supplied = run.supplied
    rows = []
    amounts = {str(path): [float(row[name]) for name in COUNTED] for path, row in table.iterrows()}
    for path, own in amounts.items():
        alone = amounts.get(path.rpartition(".")[0]) == own  # the only part of its whole that does anything
        if path and not alone and max(map(abs, own)) >= PRINTED_FROM:
            rows.append((_indented(path), table.type[path], *map(_kilojoules, own), _share(own[1], supplied)))
    total = amounts[""]
    rows.append(("all", "", *map(_kilojoules, total), _share(total[1], supplied)))
    head = ("component", "kind", "supplied [kJ]", "lost [kJ]", "stored [kJ]", "lost/supplied")
    closes = f"  energy residual: {number(run.audit.residual, 3)} J ({run.audit.closure:.1e} of the energy exchanged)"
    return "\n".join([columns(rows, head, right=[2, 3, 4, 5]), closes])


def _indented(path: str) -> str:
    return "  " * path.count(".") + path.rpartition(".")[2]


def _kilojoules(energy: float) -> str:
    return f"{energy / 1e3:.1f}" if abs(energy) >= PRINTED_FROM else "-"


def _share(part: float, whole: float) -> str:
    return f"{part / whole:.1%}" if whole > 0 and abs(part) > 5e-4 * whole else "-"


def spanned(
    model: pt.Component, cycle: DriveCycle | None, span: tuple[float, float] | None
) -> tuple[pt.Component, DriveCycle]:
    """The vehicle on a cycle, or on a part of it, and that cycle; ``None``: its own."""
    from powertrain.trials.anatomy import anatomy, value_at
    from powertrain.trials.cycle import on_cycle

    driven: DriveCycle = cycle or value_at(model, anatomy(model).the("cycle")).cycle
    with of_the_command_line():
        driven = _part(driven, *span) if span is not None else driven
        return on_cycle(model, driven), driven


def _part(cycle: DriveCycle, start: float, stop: float) -> DriveCycle:
    from powertrain import ParameterError

    first, last = float(cycle.times[0]), float(cycle.times[-1])
    if start < first or stop > last:
        raise ParameterError(f"--span {start:g}:{stop:g} s is not within the cycle {cycle.name}, {first:g}:{last:g} s")
    return cycle.part(start, stop)


def _chosen(plant: pt.Plant[Any], out: Path | None, patterns: tuple[str, ...]) -> list[str]:
    """The signals that are written; what cannot be written is refused before the simulation."""
    from powertrain.export import engine
    from powertrain.signals import signals_of

    if patterns and out is None:
        raise click.UsageError("--signals selects what --out writes: also give --out")
    with of_the_command_line():
        if out is not None and out.suffix.lower() == ".nc":
            engine("--out")
        return signals_of(plant.compiled).matching(patterns)
