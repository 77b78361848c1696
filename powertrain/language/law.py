"""The base of all laws: what an equation section yields beside equations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Self

from powertrain.language.symbols import Symbol, mapped


class Law:
    """What a component yields beside equations."""

    def mapped(self, change: Callable[[list[Symbol]], list[Symbol]]) -> Self:
        """The same law with all its expressions changed."""
        return mapped(self, change)
