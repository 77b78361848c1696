"""Step functions for one combination of modes, with half the instructions of the general step function."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import casadi as ca
import numpy as np

from powertrain.language.reals import Array
from powertrain.numerics.buffers import Call
from powertrain.numerics.folding import folded

Calls: TypeAlias = list[Call]
"""A step in both directions of the double buffer; machine code replaces it in the list when it is ready."""
OFTEN = 20_000
"""Steps in the same modes after which a special function is built: building one costs what it saves in so many steps."""


HELD = 2
"""The position of the held values among the arguments of a step."""


def for_modes(step: ca.Function, places: Sequence[int], modes: Sequence[float]) -> ca.Function:
    """A step function with constants at these positions of its held values, with the same results."""
    return folded(step, {(HELD, place): mode for place, mode in zip(places, modes, strict=True)})


class SpecialSteps:
    """Counts the steps in every combination of modes and builds special step functions for the frequent ones.

    They are kept from run to run; using them does not change the results. ``build(method, modes)`` builds one.
    """

    def __init__(self, places: Sequence[int], build: Callable[[str, list[float]], Calls]) -> None:
        self._places, self._build = np.array(places, dtype=np.intp), build
        self._built: dict[tuple[str, bytes], Calls] = {}
        self._taken: dict[bytes, int] = {}
        self._code = b""

    def get(self, method: str, m: Array, general: Calls) -> Calls:
        """The steps for the modes in ``m``; ``general`` until these modes are frequent."""
        modes = m.take(self._places)
        self._code = code = modes.tobytes()
        if self._taken.get(code, 0) < OFTEN:
            return general
        if (method, code) not in self._built:
            self._built[method, code] = self._build(method, modes.tolist())
        return self._built[method, code]

    def count(self, steps: int) -> None:
        """Count ``steps`` steps with the modes of the last ``get``."""
        self._taken[self._code] = self._taken.get(self._code, 0) + steps
