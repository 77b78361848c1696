"""Where the search for a start begins: guesses of signals as values of the unknowns."""

from __future__ import annotations

from collections.abc import Mapping

from powertrain.compiler.assemble import Compiled
from powertrain.errors import ParameterError, suggestion
from powertrain.language.reals import Array
from powertrain.language.symbols import affine_root, free_symbols, key, scalars

_SHOWN = 12


class Guesses:
    """The signals of a model that guess an unknown each."""

    def __init__(self, compiled: Compiled) -> None:
        self._signals, dae = compiled.signals, compiled.dae
        self._position = {key(s): i for i, s in enumerate([*scalars(dae.x), *scalars(dae.z)])}

    def place(self, name: str) -> int | None:
        """The index in y = (x, z) of the one unknown of which a signal is an affine expression; None if it is no such expression."""
        signal = self._signals.get(name)
        inside = free_symbols(signal.expression) if signal else []
        if signal is None or len(inside) != 1 or affine_root(signal.expression, inside[0]) is None:
            return None
        return self._position.get(key(inside[0]))

    def put(self, guesses: Mapping[str, float], y: Array) -> None:
        """Put the guesses that have a place into ``y``."""
        for name, value in guesses.items():
            if (place := self.place(name)) is not None:
                expression = self._signals[name].expression
                y[place] = float(affine_root(expression - value, free_symbols(expression)[0]))

    def check(self, names: Mapping[str, float]) -> None:
        """ParameterError for a name that guesses nothing."""
        for name in names:
            if name not in self._signals:
                raise ParameterError(f"guesses: the model has no variable {name}{suggestion(name, self._signals)}")
            if self.place(name) is None:
                others = [other for other in self._signals if self.place(other) is not None]
                raise ParameterError(
                    f"guesses: {name} is computed from others, a guess of it would change nothing; guess one of "
                    f"{', '.join(others[:_SHOWN])}, or give it a value with starts"
                )
