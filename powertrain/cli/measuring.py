"""``powertrain performance``: what a vehicle can do with a full accelerator."""

from __future__ import annotations

from pathlib import Path

import click

from powertrain.cli.options import (
    DATA,
    PICTURE,
    Command,
    of_the_command_line,
    progress,
    settings,
    starting,
    starts_of,
)
from powertrain.cli.text import columns, number
from powertrain.cli.vehicle import VehicleArgument, VehicleName, configured

DIGITS = 3


@click.command(
    "performance",
    cls=Command,
    short_help="Acceleration times, top speed and gradeability of a vehicle.",
    examples=(
        "performance ManualCar",
        "performance SplitPathCar --set 'engine=MappedEngine.diesel()' --plot acceleration.png",
        "performance PowerSplitHybrid --set body.m=1700 --out acceleration.csv",
        "performance ElectricCar --start battery.soc=0.1",
    ),
)
@click.argument("vehicle", type=VehicleName())
@settings
@starting
@click.option(
    "--out",
    type=DATA,
    help="Write the signals of the acceleration to a netCDF file (.nc), with units, or to a .csv file.",
)
@click.option("--plot", type=PICTURE, help="Plot speed and acceleration over time (.png, .pdf, .svg).")
def command(
    vehicle: VehicleArgument,
    texts: tuple[str, ...],
    params: Path | None,
    begin: tuple[str, ...],
    out: Path | None,
    plot: Path | None,
) -> None:
    """Accelerate a vehicle with the pedal fully pressed and print acceleration times, top speed and gradeability.

    The vehicle starts at rest with the engine idling and the stores at their initial charge, unless --start gives another one. The top
    speed is the highest speed reached, which a battery or a flywheel may increase for a short time. Gradeability is the steepest grade on
    which the vehicle moves off, to half a percent. Rigid wheels do not slip: if the ground limits traction, set `front=DrivenAxle`, which
    has tyres.
    """
    import powertrain as pt
    from powertrain.presets.settings import free_or_error
    from powertrain.trials import full_accelerator, performance

    model, paths = configured(vehicle, params, texts)
    plant = pt.compile(model)
    with of_the_command_line():
        free_or_error(paths, model, plant.parameters)
    starts = starts_of(begin, plant)
    run = full_accelerator(model, starts=starts, progress=progress())
    table = performance(model, run, starts=starts, progress=progress())
    rows = [(what, number(value, DIGITS), unit) for what, (value, unit) in zip(table.index, table.values, strict=True)]
    click.echo(f"{vehicle.name} with the accelerator fully pressed\n\n{columns(rows, right=[1])}")
    if out is not None:
        run.save(out)
    if plot is not None:
        from powertrain.trials.figures import acceleration_figure

        acceleration_figure(run, vehicle.name).savefig(plot, dpi=120)
    for path in (out, plot):
        if path is not None:
            click.echo(f"wrote {path}")
