"""Where the search for a start begins: guesses of signals as values of the unknowns."""

from __future__ import annotations

from collections.abc import Mapping

from powertrain.compiler.assemble import Compiled
from powertrain.compiler.operations import affine_root
from powertrain.errors import ParameterError, suggestion
from powertrain.language.reals import Array
from powertrain.language.symbols import free_symbols, key, scalars

_SHOWN = 12


class Guesses:
    """The signals of a model that guess an unknown each."""

    def __init__(self, compiled: Compiled) -> None:
        self._signals, dae = compiled.signals, compiled.dae
        self._position = {key(s): i for i, s in enumerate([*scalars(dae.x), *scalars(dae.z)])}

    def place(self, name: str, value: float = 0.0) -> tuple[int, float] | None:
        """The unknown that a signal guesses, by its index in y = (x, z), and its value where the signal has this ``value``.

        None if the signal is not an affine expression of a single unknown.
        """
        signal = self._signals.get(name)
        inside = free_symbols(signal.expression) if signal else []
        if signal is None or len(inside) != 1 or key(inside[0]) not in self._position:
            return None
        root = affine_root(signal.expression - value, inside[0])
        return None if root is None else (self._position[key(inside[0])], float(root))

    def put(self, guesses: Mapping[str, float], y: Array) -> None:
        """Put the guesses that have a place into ``y``."""
        for name, value in guesses.items():
            if place := self.place(name, value):
                y[place[0]] = place[1]

    def check(self, names: Mapping[str, float]) -> None:
        """ParameterError for a name that guesses nothing."""
        for name in names:
            if name not in self._signals:
                raise ParameterError(f"guesses: the model has no variable {name}{suggestion(name, self._signals)}")
            if self.place(name) is None:
                others = [other for other in self._signals if self.place(other)]
                raise ParameterError(
                    f"guesses: {name} is computed from others, a guess of it would change nothing; guess one of "
                    f"{', '.join(others[:_SHOWN])}, or give it a value with starts"
                )
