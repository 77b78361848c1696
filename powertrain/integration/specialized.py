"""Step functions for one combination of modes: half the instructions of the one that serves all combinations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import casadi as ca
import numpy as np

from powertrain.numerics.buffers import Array
from powertrain.numerics.folding import folded

Calls: TypeAlias = list[Callable[[], None]]
"""A step in both directions of the double buffer; machine code takes its place in the list when it is there."""
OFTEN = 5000
"""Steps in the same modes after which these have a function of their own: building one costs as much as it saves in so many."""


HELD = 2
"""The place of the held values among the arguments of a step."""


def for_modes(step: ca.Function, places: Sequence[int], modes: Sequence[float]) -> ca.Function:
    """A step function with numbers in these places of its held values, with the same results."""
    return folded(step, {(HELD, place): mode for place, mode in zip(places, modes, strict=True)})


class SpecialSteps:
    """Counts the steps in every combination of modes and gives the frequent ones a step function of their own.

    It is kept from run to run, and when it is taken makes no difference to the results. ``build(method, modes)`` makes one.
    """

    def __init__(self, places: Sequence[int], build: Callable[[str, list[float]], Calls]) -> None:
        self._places, self._build = np.array(places, dtype=np.intp), build
        self._built: dict[tuple[str, bytes], Calls] = {}
        self._taken: dict[bytes, int] = {}
        self._code = b""

    def get(self, method: str, m: Array, general: Calls) -> Calls:
        """The steps for the modes in ``m``; ``general`` until they are frequent."""
        modes = m.take(self._places)
        self._code = code = modes.tobytes()
        if self._taken.get(code, 0) < OFTEN:
            return general
        if (method, code) not in self._built:
            self._built[method, code] = self._build(method, modes.tolist())
        return self._built[method, code]

    def count(self, steps: int) -> None:
        """So many steps were taken with the modes of the last ``get``."""
        self._taken[self._code] = self._taken.get(self._code, 0) + steps
