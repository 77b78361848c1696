"""Step functions for one combination of modes: a fraction of the instructions of the one that serves all combinations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import casadi as ca
import numpy as np

from powertrain.engine.buffers import Array

Calls: TypeAlias = tuple[Callable[[], None], Callable[[], None]]
Build: TypeAlias = Callable[[str, ca.SX, float], tuple[Calls, bool]]
OFTEN = 300
"""Steps of one run in the same modes after which it takes a function for these modes: cycles of a car gain most from some hundred."""


class SpecialSteps:
    """Counts the steps of a run in every combination of modes and gives the frequent ones a step function of their own.

    Functions are kept from run to run; when they are taken depends on the run alone, so that equal runs are equal to the last bit.
    ``build(method, held, size)`` makes one from the held values with numbers in the places of modes, for steps of about this size, and
    says whether it is explicit though the method is not.
    """

    def __init__(self, m: ca.SX, modes: Sequence[int], build: Build) -> None:
        self._m, self._modes, self._build = m, np.array(modes, dtype=np.intp), build
        self._built: dict[tuple[str, bytes], tuple[Calls, bool]] = {}
        self.begin()

    def begin(self) -> None:
        """Begin a run."""
        self._code = b""
        self._taken: dict[bytes, list[float]] = {}
        self._refused: set[tuple[str, bytes]] = set()
        self._now = [0.0, 0.0]
        self.explicit = False

    def get(self, method: str, m: Array, general: Calls) -> Calls:
        """The steps for the modes in ``m``; ``general`` until they are frequent. ``explicit`` says if they are where the method is not."""
        modes = m.take(self._modes)
        self._code = code = modes.tobytes()
        steps, span = self._now = self._taken.setdefault(code, [0.0, 0.0])
        self.explicit = False
        if steps < OFTEN or (method, code) in self._refused:
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

    def refuse(self, method: str) -> None:
        """The explicit steps of the last ``get`` are too short: general ones in these modes for the rest of the run."""
        self._refused.add((method, self._code))

    def count(self, steps: int, span: float) -> None:
        """Steps were taken over this time with the modes of the last ``get``."""
        self._now[0] += steps
        self._now[1] += span
