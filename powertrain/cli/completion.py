"""Names that the shell completes: vehicles, components, cycles, papers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from click.shell_completion import CompletionItem

if TYPE_CHECKING:
    import click


def beginning(names: Iterable[str], incomplete: str) -> list[CompletionItem]:
    """The names that begin with what was typed; case does not matter."""
    return [CompletionItem(name) for name in names if name.lower().startswith(incomplete.lower())]


def or_file(items: list[CompletionItem], incomplete: str) -> list[CompletionItem]:
    """The names, or the shell's own completion of files where no name fits."""
    return items or [CompletionItem(incomplete, type="file")]


def vehicles(incomplete: str) -> list[CompletionItem]:
    """The library's vehicles."""
    from powertrain.presets import catalogue

    return beginning((entry.name for entry in catalogue.vehicles()), incomplete)


def described(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Everything that ``powertrain info`` describes."""
    from powertrain.presets import catalogue

    return beginning(sorted({e.name for e in (*catalogue.assembled(), *catalogue.components())}), incomplete)


def papers(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """The reproduced papers."""
    from powertrain.reproductions import PAPERS

    return beginning(PAPERS, incomplete)
