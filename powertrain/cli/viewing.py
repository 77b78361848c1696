"""``powertrain view``: the interactive page of a run."""

from __future__ import annotations

import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING

import click

from powertrain.cli.options import PAGE, Command, CycleName, Span, settings, starting
from powertrain.cli.sources import Source, driven, model_of, saved

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
@click.option("--cycle", type=CycleName(), help="The cycle of a vehicle; see run --help. Default: that of the vehicle.")
@click.option("--span", type=Span(), help="Only this part of the cycle, in seconds, such as 0:200.")
@settings
@starting
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
    path = written(run, cycle, span, texts, params, begin, out)
    click.echo(f"wrote {path}")
    if out is None and not webbrowser.open(path.resolve().as_uri()):
        click.echo("no browser could be started: open the file yourself")


def written(
    run: Path | VehicleArgument,
    cycle: DriveCycle | None,
    span: tuple[float, float] | None,
    texts: tuple[str, ...],
    params: Path | None,
    begin: tuple[str, ...],
    out: Path | None,
) -> Path:
    """The page of a source, in ``out`` or in the folder of temporary files."""
    from powertrain.saved import Saved
    from powertrain.viewer.document import temporary, write
    from powertrain.viewer.recording import recorded

    if isinstance(run, Path) and run.suffix.lower() == ".nc" and not (cycle or span or texts or params or begin):
        recording = recorded(Saved(saved(run)), run.stem)
        return write([recording], out or temporary(run.stem))
    model = model_of(run, params, texts)
    done = driven(model, cycle, span, begin, run.stem if isinstance(run, Path) else run.name)
    return done.explore(out or temporary(f"{done.name}-{done.cycle.name}"))
