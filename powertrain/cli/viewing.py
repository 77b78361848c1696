"""``powertrain view``: the interactive page of a run."""

from __future__ import annotations

import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING

import click

from powertrain.cli.options import PAGE, Command, driving, settings
from powertrain.cli.sources import Drive, Source, driven, model_of, name_of

if TYPE_CHECKING:
    from powertrain.cli.vehicle import VehicleArgument
    from powertrain.components.cycles import DriveCycle


@click.command(
    "view",
    cls=Command,
    short_help="An interactive page of a run: power flow, signals, maps, events.",
    examples=(
        "view ManualCar",
        "view PowerSplitHybrid --cycle udds --out hybrid.html",
        "view car.toml --span 0:200",
        "view run.nc",
    ),
)
@click.argument("run", metavar="VEHICLE|FILE", type=Source())
@driving
@settings
@click.option("--out", type=PAGE, help="Write the page to this .html file and do not open the browser.")
def command(
    run: Path | VehicleArgument,
    cycle: DriveCycle | None,
    span: tuple[float, float] | None,
    texts: tuple[str, ...],
    params: Path | None,
    begin: tuple[str, ...],
    out: Path | None,
) -> None:
    """Show a run in the browser: the schematic with the power flowing through it, signals, operating points, events, energy, parameters.

    A vehicle, or a parameter file (.toml) of one, is driven over its cycle first. A saved run (.nc) has signals, events and parameters, but
    no power flow. The page is one file that needs no network.
    """
    path = written(run, Drive(cycle, span, begin), texts, params, out)
    click.echo(f"wrote {path}")
    if out is None and not webbrowser.open(path.resolve().as_uri()):
        click.echo("no browser could be started: open the file yourself")


def written(
    run: Path | VehicleArgument, drive: Drive, texts: tuple[str, ...], params: Path | None, out: Path | None
) -> Path:
    """The page of a source, in ``out`` or in the folder of temporary files."""
    import powertrain as pt
    from powertrain.saved import Saved
    from powertrain.viewer.document import temporary, write
    from powertrain.viewer.recording import recorded

    if isinstance(run, Path) and not (drive or texts or params):
        return write([recorded(Saved(pt.load(run)), run.stem)], out or temporary(run.stem))
    done = driven(model_of(run, params, texts), drive, name_of(run))
    return done.explore(out or temporary(f"{done.name}-{done.cycle.name}"))
