"""The base of all laws: what an equation section yields beside equations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Self

from powertrain.language.symbols import Symbol


class Law:
    """What a component yields beside equations."""

    def mapped(self, change: Callable[[list[Symbol]], list[Symbol]]) -> Self:
        """The same law with all its expressions changed."""
        values = vars(self)
        names = [name for name, value in values.items() if isinstance(value, Symbol)]
        changed = dict(zip(names, change([values[name] for name in names]), strict=True))
        return type(self)(**{**values, **changed})
