"""Runs that commands show and compare: saved ones from netCDF files, and vehicles driven over a cycle."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from powertrain.cli.options import ArgumentType, Interruption, starts_of
from powertrain.cli.vehicle import VehicleArgument, VehicleName, configured

if TYPE_CHECKING:
    import xarray as xr
    from click.shell_completion import CompletionItem

    import powertrain as pt
    from powertrain.components.cycles import DriveCycle
    from powertrain.trials import CycleRun


class Source(ArgumentType):
    """A saved run (.nc), a parameter file (.toml), or the name of a vehicle."""

    name = "run"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path | VehicleArgument:
        """Files by their ending, everything else by the vehicle's name."""
        path = Path(str(value))
        if path.suffix.lower() != ".nc":
            return VehicleName().convert(value, param, ctx)
        if not path.is_file():
            self.fail(f"there is no file {str(value)!r}", param, ctx)
        return path

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """As for vehicles: their names, or files."""
        return VehicleName().shell_complete(ctx, param, incomplete)


def model_of(source: Path | VehicleArgument, params: Path | None, texts: Sequence[str]) -> pt.Component:
    """The vehicle of a source with the values of a file and of the command line. Errors: UsageError for a saved run."""
    if isinstance(source, Path):
        raise click.UsageError(
            f"{source} is a saved run, which has no model: --set, --params, --cycle and --start need a vehicle"
        )
    return configured(source, params, texts)[0]


def driven(
    model: pt.Component,
    cycle: DriveCycle | None,
    span: tuple[float, float] | None,
    begin: Sequence[str],
    name: str,
) -> CycleRun:
    """The run of a vehicle of this ``name`` over a cycle, or a part of one, from values at the start; by default the vehicle's own.

    A run that ends early is an error.
    """
    import powertrain as pt
    from powertrain.cli.running import spanned
    from powertrain.trials import drive_cycle
    from powertrain.trials.cycle import so_far

    model, over = spanned(model, cycle, span)
    plant = pt.compile(model)
    starts = starts_of(begin, plant)
    with Interruption(over, so_far(plant)) as watch:
        run = drive_cycle(plant, starts=starts, progress=watch, name=name)
    if run.message:
        raise click.ClickException(f"the run ended at {run.result.time[-1]:.4g} s. {run.message}")
    return run


def saved(path: Path) -> xr.Dataset:
    """A saved run."""
    import powertrain as pt

    return pt.load(path)
