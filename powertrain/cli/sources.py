"""Runs that commands show and compare: saved ones from netCDF files, and vehicles driven over a cycle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from powertrain.cli.options import ArgumentType, Interruption, starts_of
from powertrain.cli.vehicle import VehicleArgument, VehicleName, configured

if TYPE_CHECKING:
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


@dataclass(frozen=True)
class Drive:
    """What a vehicle drives: a cycle, by default its own, or a part of it between two times [s], from values at the start."""

    cycle: DriveCycle | None
    span: tuple[float, float] | None
    begin: tuple[str, ...]

    def __bool__(self) -> bool:
        return bool(self.cycle or self.span or self.begin)


def model_of(source: Path | VehicleArgument, params: Path | None, texts: Sequence[str]) -> pt.Component:
    """The vehicle of a source with the values of a file and of the command line. Errors: UsageError for a saved run."""
    if isinstance(source, Path):
        raise click.UsageError(
            f"{source} is a saved run, which has no model: --set, --params, --cycle and --start need a vehicle"
        )
    return configured(source, params, texts)[0]


def name_of(source: Path | VehicleArgument) -> str:
    """The name of a saved run's file or of a vehicle."""
    return source.stem if isinstance(source, Path) else source.name


def driven(model: pt.Component, drive: Drive, name: str) -> CycleRun:
    """The run of a vehicle of this ``name``. One that ends early, or does not move, is an error."""
    import powertrain as pt
    from powertrain.cli.running import end, spanned
    from powertrain.trials import drive_cycle
    from powertrain.trials.cycle import so_far

    model, over = spanned(model, drive.cycle, drive.span)
    plant = pt.compile(model)
    starts = starts_of(drive.begin, plant)
    with Interruption(over, so_far(plant)) as watch:
        run = drive_cycle(plant, starts=starts, progress=watch, name=name)
    end(run, watch)
    return run
