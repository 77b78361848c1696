"""A paper that is reproduced: its tables, its figures, and where to find it by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

from powertrain import ParameterError
from powertrain.errors import suggestion
from powertrain.reproductions.table import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAPERS = {
    "yu-beachley": "yu_beachley",
    "provatidis": "provatidis",
    "chaudhary": "chaudhary",
    "madhavan": "madhavan",
}
"""The names of the papers and the modules that reproduce them."""


@dataclass(frozen=True)
class Picture:
    """A figure of the paper drawn from the library's model; ``name`` is that of its file, ``caption`` tells source and data."""

    name: str
    caption: str
    draw: Callable[[], Figure]


@dataclass(frozen=True)
class Paper:
    """A reproduced paper. ``tables`` and the pictures compute when they are called."""

    name: str
    title: str
    citation: str
    summary: str
    tables: tuple[Callable[[], Table], ...]
    pictures: tuple[Picture, ...]


def paper(name: str) -> Paper:
    """The paper of a name in ``PAPERS``. Errors: ParameterError for another name, with those that are like it."""
    if name not in PAPERS:
        raise ParameterError(f"unknown paper {name!r}{suggestion(name, PAPERS)} (papers: {', '.join(PAPERS)})")
    found = import_module(f"powertrain.reproductions.{PAPERS[name]}").PAPER
    assert isinstance(found, Paper)
    return found
