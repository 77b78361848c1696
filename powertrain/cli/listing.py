"""``powertrain list``: the components by family, and the vehicles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from powertrain.cli.options import Command
from powertrain.cli.text import columns, first_line

if TYPE_CHECKING:
    from powertrain.presets.catalogue import Entry


@click.command(
    "list",
    cls=Command,
    short_help="Vehicles, components by family, drive cycles, papers.",
    examples=("list", "list vehicles", "list --family differentials"),
)
@click.argument("what", type=click.Choice(["all", "vehicles", "components", "cycles", "papers"]), default="all")
@click.option("--family", help="Only components of this family, such as differentials.")
def command(what: str, family: str | None) -> None:
    """List vehicles, components by family, drive cycles and papers, with one line each.

    `powertrain info NAME` describes one of them in detail.
    """
    from powertrain.components.cycles import CYCLES
    from powertrain.presets import catalogue
    from powertrain.presets.named import measured

    if family is not None:
        what = "components"
    if what in ("all", "vehicles"):
        _section("Vehicles (powertrain run)", list(catalogue.vehicles()))
        click.echo("Measured cars\n" + columns((name, "") for name in measured()) + "\n")
        _section("Test benches", [e for e in catalogue.assembled() if not catalogue.is_vehicle(e.kind)])
    if what in ("all", "cycles"):
        click.echo("Drive cycles\n" + columns(CYCLES.items()) + "\n")
    if what in ("all", "papers"):
        from powertrain.reproductions import PAPERS

        click.echo("Papers (powertrain reproduce)\n  " + "\n  ".join(PAPERS) + "\n")
    if what in ("all", "components"):
        _components(family)


def _components(family: str | None) -> None:
    from powertrain.errors import suggestion
    from powertrain.presets import catalogue

    known = sorted({entry.family for entry in catalogue.components()})
    shown = [name for name in known if family in (None, name, name.partition(".")[0])]
    if not shown:
        raise click.BadParameter(
            f"unknown family {family!r}{suggestion(str(family), known)} (families: {', '.join(known)})",
            param_hint="--family",
        )
    for name in shown:
        _section(name, [entry for entry in catalogue.components() if entry.family == name])


def _section(heading: str, entries: Sequence[Entry]) -> None:
    if entries:
        click.echo(f"{heading}\n{columns([(entry.name, first_line(entry.kind)) for entry in entries])}\n")
