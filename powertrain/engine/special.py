"""Step functions for one combination of modes: a fraction of the instructions of the one that serves all combinations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import casadi as ca
import numpy as np

from powertrain.engine.buffers import Array

Calls: TypeAlias = tuple[Callable[[], None], Callable[[], None]]
OFTEN = 2000
"""Steps in the same modes that cost about as much as building a function for these modes."""
OFTEN_COMPILED = 10_000
"""The same where functions go through the C compiler, which takes seconds, but once for all runs."""


class SpecialSteps:
    """Counts the steps in every combination of modes and gives the frequent ones a step function of their own.

    ``build(method, held)`` makes one from the held values with numbers in the places of modes.
    """

    def __init__(
        self, m: ca.SX, modes: Sequence[int], build: Callable[[str, ca.SX], Calls], compiled: bool = False
    ) -> None:
        self._m, self._modes, self._build = m, np.array(modes, dtype=np.intp), build
        self._often, self._code = OFTEN_COMPILED if compiled else OFTEN, b""
        self._built: dict[tuple[str, bytes], Calls] = {}
        self._taken: dict[bytes, int] = {}

    def get(self, method: str, m: Array, general: Calls) -> Calls:
        """The steps for the modes in ``m``; ``general`` until they are frequent."""
        modes = m.take(self._modes)
        self._code = code = modes.tobytes()
        if self._taken.get(code, 0) < self._often:
            return general
        if (method, code) not in self._built:
            held = ca.SX(self._m)
            for index, mode in zip(self._modes.tolist(), modes.tolist(), strict=True):
                held[index] = mode
            try:
                self._built[method, code] = self._build(method, held)
            except KeyError:  # these modes take a pivot away
                self._built[method, code] = general
        return self._built[method, code]

    def count(self, steps: int) -> None:
        """Steps were taken with the modes of the last ``get``."""
        self._taken[self._code] = self._taken.get(self._code, 0) + steps
