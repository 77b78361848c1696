"""The vehicle that a command is about: one of the library, a measured car, or one from a parameter file, with what is set in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from powertrain import Component
from powertrain.cli import completion
from powertrain.cli.options import ArgumentType, of_the_command_line

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem


@dataclass(frozen=True)
class VehicleArgument:
    """A model by the name that was typed; ``paths`` are those that its parameter file has set."""

    name: str
    model: Component
    paths: tuple[str, ...] = ()


class VehicleName(ArgumentType):
    """The name of a vehicle, or a parameter file that names its class."""

    name = "vehicle"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> VehicleArgument:
        """A file by its ending, a vehicle by its class or name; case, - and _ do not matter."""
        from powertrain.presets import named

        text = str(value)
        if text.lower().endswith(".toml") and not Path(text).is_file():
            self.fail(f"there is no file {text!r}", param, ctx)
        with of_the_command_line():
            if text.lower().endswith(".toml"):
                model, paths = named.of_file(Path(text))
                return VehicleArgument(Path(text).stem, model, tuple(paths))
            model = named.load(text)
            return VehicleArgument(text.lower() if text.lower() in named.measured() else type(model).__name__, model)

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """The vehicles that begin so, or files."""
        return completion.or_file(completion.vehicles(incomplete), incomplete)


def configured(vehicle: VehicleArgument, params: Path | None, texts: Sequence[str]) -> tuple[Component, list[str]]:
    """The model with the values of a file, then of the command line, and the paths that were set. Prints likely mistakes."""
    from powertrain.presets import files
    from powertrain.presets.places import places
    from powertrain.presets.settings import assigned, assignments
    from powertrain.trials import notes

    model, paths = vehicle.model, [*vehicle.paths]
    with of_the_command_line():
        if params is not None:
            with files.naming(params):
                model, more = files.applied(model, files.read(params), params.parent)
            paths += more
        pairs = assignments(texts)
        model = assigned(model, pairs)
        paths += [path for path, _ in pairs]
        for note in notes(model):
            click.echo(f"Note: {note}.", err=True)
        there = {found.path for found in places(model)}  # a part that was exchanged took its parameters with it
        return model, [path for path in paths if path in there]
