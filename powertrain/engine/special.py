"""Step functions for one combination of modes: a fraction of the instructions of the one that serves all combinations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import casadi as ca
import numpy as np

from powertrain.engine.buffers import Array

Calls: TypeAlias = tuple[Callable[[], None], Callable[[], None]]
Build: TypeAlias = Callable[[str, ca.SX, float], tuple[Calls, bool]]
OFTEN = 1000
"""Steps in the same modes that cost about as much as building a function for these modes."""
OFTEN_COMPILED = 5000
"""The same where functions go through the C compiler, which takes seconds, but once for all runs."""


class SpecialSteps:
    """Counts the steps in every combination of modes and gives the frequent ones a step function of their own.

    ``build(method, held, size)`` makes one from the held values with numbers in the places of modes, for steps of about this size, and
    says whether it is explicit though the method is not.
    """

    def __init__(self, m: ca.SX, modes: Sequence[int], build: Build, compiled: bool = False) -> None:
        self._m, self._modes, self._build = m, np.array(modes, dtype=np.intp), build
        self._often, self._code = OFTEN_COMPILED if compiled else OFTEN, b""
        self._built: dict[tuple[str, bytes], tuple[Calls, bool]] = {}
        self._taken: dict[bytes, list[float]] = {}
        self._now = [0.0, 0.0]
        self.explicit = False

    def get(self, method: str, m: Array, general: Calls) -> Calls:
        """The steps for the modes in ``m``; ``general`` until they are frequent. ``explicit`` says if they are where the method is not."""
        modes = m.take(self._modes)
        self._code = code = modes.tobytes()
        steps, span = self._now = self._taken.setdefault(code, [0.0, 0.0])
        self.explicit = False
        if steps < self._often:
            return general
        if (method, code) not in self._built:
            self._built[method, code] = self._make(method, modes.tolist(), span / max(steps, 1), general)
        found, self.explicit = self._built[method, code]
        return found

    def _make(self, method: str, modes: list[float], size: float, general: Calls) -> tuple[Calls, bool]:
        held = ca.SX(self._m)
        for index, mode in zip(self._modes.tolist(), modes, strict=True):
            held[index] = mode
        try:
            return self._build(method, held, size)
        except KeyError:  # these modes take a pivot away
            return general, False

    def refuse(self, method: str, general: Calls) -> None:
        """The explicit steps of the last ``get`` are too short: ``general`` ones in these modes from now on."""
        self._built[method, self._code] = general, False

    def count(self, steps: int, span: float) -> None:
        """Steps were taken over this time with the modes of the last ``get``."""
        self._now[0] += steps
        self._now[1] += span
