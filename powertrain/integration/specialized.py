"""Step functions for one combination of modes: a fraction of the instructions of the one that serves all combinations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import casadi as ca
import numpy as np

from powertrain.numerics.buffers import Array

Calls: TypeAlias = list[Callable[[], None]]
"""A step in both directions of the double buffer; machine code takes its place in the list when it is there."""
Build: TypeAlias = Callable[[str, ca.SX], Calls]
OFTEN = 3000
"""Steps of one run in the same modes after which it takes a function for these modes: building one costs as much as it saves in so many."""


class SpecialSteps:
    """Counts the steps of a run in every combination of modes and gives the frequent ones a step function of their own.

    Functions are kept from run to run; when they are taken depends on the run alone, so that every run is the same to the last bit.
    ``build(method, held)`` makes one from the held values with numbers in the places of modes.
    """

    def __init__(self, m: ca.SX, modes: Sequence[int], build: Build) -> None:
        self._m, self._modes, self._build = m, np.array(modes, dtype=np.intp), build
        self._built: dict[tuple[str, bytes], Calls | None] = {}
        self.begin()

    def begin(self) -> None:
        """Begin a run."""
        self._taken: dict[bytes, int] = {}
        self._code = b""

    def get(self, method: str, m: Array, general: Calls) -> Calls:
        """The steps for the modes in ``m``; ``general`` until they are frequent."""
        modes = m.take(self._modes)
        self._code = code = modes.tobytes()
        if self._taken.get(code, 0) < OFTEN:
            return general
        if (method, code) not in self._built:
            self._built[method, code] = self._make(method, modes.tolist())
        return self._built[method, code] or general

    def _make(self, method: str, modes: list[float]) -> Calls | None:
        held = ca.SX(self._m)
        for index, mode in zip(self._modes.tolist(), modes, strict=True):
            held[index] = mode
        try:
            return self._build(method, held)
        except KeyError:  # these modes take a pivot away
            return None

    def count(self, steps: int) -> None:
        """So many steps were taken with the modes of the last ``get``."""
        self._taken[self._code] = self._taken.get(self._code, 0) + steps
