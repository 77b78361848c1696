"""``powertrain compare``: two runs side by side."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from powertrain.cli.options import PAGE, PICTURE, Command, driving, settings
from powertrain.cli.sources import Drive, Source, driven, model_of, name_of
from powertrain.cli.text import columns, number, title

if TYPE_CHECKING:
    import pandas as pd

    import powertrain as pt
    from powertrain.cli.vehicle import VehicleArgument
    from powertrain.components.cycles import DriveCycle

MOST = 25
"""Signals and parameters that are listed."""


@click.command(
    "compare",
    cls=Command,
    short_help="Two runs side by side: results, differences, overlaid plots.",
    examples=(
        "compare ManualCar AutomaticCar --cycle udds",
        "compare ManualCar --set body.m=1500 --report heavier.html",
        "compare before.nc after.nc --signals body.v --plot speed.png",
    ),
)
@click.argument("runs", metavar="VEHICLE|FILE [VEHICLE|FILE]", type=Source(), nargs=-1)
@driving
@settings
@click.option(
    "--signals", multiple=True, metavar="PATTERN", help="Signals to compare, such as 'engine.*'; may be repeated."
)
@click.option("--plot", type=PICTURE, help="Plot the signals of both runs (.png, .pdf, .svg).")
@click.option("--report", type=PAGE, help="Write the interactive page of both runs to this .html file.")
def command(
    runs: tuple[Path | VehicleArgument, ...],
    cycle: DriveCycle | None,
    span: tuple[float, float] | None,
    texts: tuple[str, ...],
    params: Path | None,
    begin: tuple[str, ...],
    signals: tuple[str, ...],
    plot: Path | None,
    report: Path | None,
) -> None:
    """Compare two runs: main results, signals and parameters with their differences.

    A run is a saved one (.nc), or a vehicle or a parameter file (.toml) of one, which is driven over the cycle first. A single vehicle is
    compared with itself after the changes of --set and --params. --cycle, --span and --start hold for the vehicles; a vehicle beside a
    saved run needs --cycle.
    """
    import powertrain as pt

    named = _runs(runs, Drive(cycle, span, begin), texts, params)
    both = pt.compare(*named.values(), *signals, names=(*named,))  # type: ignore[arg-type]
    click.echo(described(both))
    if plot is not None:
        axes = both.plot(*signals)
        figure = axes.get_figure(root=True)
        assert figure is not None
        figure.savefig(plot, dpi=120)
    if report is not None:
        both.explore(report, *signals)
    for path in (plot, report):
        if path is not None:
            click.echo(f"wrote {path}")


def _runs(
    runs: tuple[Path | VehicleArgument, ...], drive: Drive, texts: tuple[str, ...], params: Path | None
) -> dict[str, Any]:
    """The two runs by their names."""
    changes = bool(texts or params)
    if len(runs) not in (1, 2) or (len(runs) == 1) is not changes:
        raise click.UsageError(
            "give two runs, or one vehicle with --set or --params, which is compared with itself as changed"
        )
    if changes:
        one, other = model_of(runs[0], None, ()), model_of(runs[0], params, texts)
        changed = " ".join(texts) or str(params)
        both = {"as it is": one, changed: other}
        return {name: driven(model, drive, name) for name, model in both.items()}
    saved = [run for run in runs if isinstance(run, Path)]
    if len(saved) == 1 and drive.cycle is None:
        raise click.UsageError(f"{saved[0]} does not contain its cycle; give the cycle of the vehicle with --cycle")
    if len(saved) == 2 and drive:
        raise click.UsageError("both runs are saved ones; --cycle, --span and --start need a vehicle")
    names = [name_of(run) for run in runs]
    if names[0] == names[1]:
        names = [str(run) if isinstance(run, Path) else run.name for run in runs]
    if names[0] == names[1]:
        names = [f"{name} {k}" for k, name in enumerate(names, 1)]
    return {name: _run(run, drive, name) for name, run in zip(names, runs, strict=True)}


def _run(run: Path | VehicleArgument, drive: Drive, name: str) -> Any:
    import powertrain as pt

    return pt.load(run) if isinstance(run, Path) else driven(model_of(run, None, ()), drive, name)


def described(both: pt.Comparison) -> str:
    """The tables of a comparison as text."""
    shown = [
        f"{both.names[0]} and {both.names[1]}, {both.time[0]:g} to {both.time[-1]:g} s",
        "",
        _table(both.table, "quantity"),
    ]
    if both.table is not both.signals and len(both.compared) <= MOST:
        shown += [title("Signals, mean values"), _table(both.signals, "signal")]
    if len(both.parameters):
        shown += [title("Parameters that differ"), _table(both.parameters, "parameter")]
    return "\n".join(shown)


def _table(table: pd.DataFrame, what: str) -> str:
    rows = [
        (str(name), *(number(v) if isinstance(v, float) else str(v) for v in row))
        for name, row in zip(table.index, table.to_numpy(), strict=True)
    ]
    more = f"\n  ... {len(rows) - MOST} more" if len(rows) > MOST else ""
    return columns(rows[:MOST], (what, *map(str, table.columns)), right=[*range(1, len(table.columns))]) + more
