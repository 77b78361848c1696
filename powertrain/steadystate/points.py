"""Operating points and what became of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from powertrain.steadystate.lanes import Rows

Mask = NDArray[np.bool_]
Index = NDArray[np.intp]

OK, STUCK_POINT, SEVERAL, NONE, IMMOVABLE, OUTSIDE, DIVERGED, UNDEFINED = range(8)


@dataclass
class Points:
    """Operating points: unknowns, modes, status, the laws that it is about, and those at rest under a prescribed motion."""

    u: Rows
    modes: Rows
    status: NDArray[np.int8]
    blame: Mask
    rest: Mask

    @classmethod
    def empty(cls, unknowns: int, laws: int, count: int) -> Points:
        """Points of which nothing is known."""
        masks = [np.zeros((laws, count), bool) for _ in range(2)]
        return cls(np.zeros((unknowns, count)), np.zeros((laws, count)), np.zeros(count, np.int8), *masks)

    def some(self, which: Mask) -> Points:
        """Some of the points."""
        return Points(
            self.u[:, which], self.modes[:, which], self.status[which], self.blame[:, which], self.rest[:, which]
        )

    def put(self, where: Index, other: Points) -> None:
        """Takes over the other points."""
        for name in ("u", "modes", "blame", "rest"):
            getattr(self, name)[:, where] = getattr(other, name)
        self.status[where] = other.status
