"""``powertrain info``: what a component or a vehicle is, and what can be set in it."""

from __future__ import annotations

import inspect
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

import click

import powertrain as pt
from powertrain.cli import completion
from powertrain.cli.options import PICTURE, Command, of_the_command_line
from powertrain.cli.text import columns, paragraphs, title

if TYPE_CHECKING:
    from powertrain.presets.catalogue import Entry


@click.command(
    "info",
    cls=Command,
    short_help="A component or vehicle: parameters, slots, ports, equations, source.",
    examples=(
        "info Clutch",
        "info rotational.Fixed",
        "info SplitPathCar",
        "info MappedEngine --text",
        "info SplitPathCar --schematic car.png",
    ),
)
@click.argument("name", shell_complete=completion.described)
@click.option("--text", is_flag=True, help="Print the complete source of the class.")
@click.option(
    "--schematic", type=PICTURE, help="Draw a schematic of its components and connections (.png, .pdf, .svg)."
)
def command(name: str, text: bool, schematic: Path | None) -> None:
    """Describe a component or vehicle: parameters with units, defaults and ranges, slots, ports, variables, equations, source.

    Set parameters and slots with `powertrain run VEHICLE --set PATH=VALUE`. If a name occurs in several families, put the family in front.
    Of a parameter file (.toml) or a measured car, the values that it sets are printed in place of the defaults.
    """
    from powertrain.presets import catalogue, named

    with of_the_command_line():
        model = None
        if name.lower().endswith(".toml"):
            model = named.of_file(Path(name))[0]
        elif name.lower() in named.measured():
            model = named.load(name.lower())
        name = name if model is None else type(model).__name__
        entry = catalogue.find(name, (*catalogue.assembled(), *catalogue.components()), "component")
    click.echo(described(entry, text, model))
    if schematic is not None:
        with of_the_command_line():
            draw(entry.kind() if model is None else model, schematic)
        click.echo(f"\nwrote {schematic}")


def draw(model: pt.Component, path: Path) -> None:
    """The schematic of a component. Errors: ParameterError if it has no parts."""
    figure = pt.schematic(model).get_figure(root=True)
    assert figure is not None
    figure.savefig(path, dpi=130)


def described(entry: Entry, text: bool = False, model: pt.Component | None = None) -> str:
    """All about a component, with its defaults or the values of a ``model``."""
    from powertrain.cli.facts import facts, text_of

    kind = entry.kind
    sections = [f"{entry.name} ({entry.family})\n\n{paragraphs(inspect.getdoc(kind) or '')}"]
    sections += [
        f"{title(table.title)}\n{columns(table.rows, table.head, table.right)}" for table in facts(kind, model)
    ]
    shown = inspect.getsource(kind) if text else textwrap.indent(text_of(kind), "  ")
    sections.append(f"{title('Equations')}\n{shown}")
    sections.append(f"{title('Source')}\n  {kind.__module__}, {inspect.getsourcefile(kind)}")
    return "\n".join(sections)
