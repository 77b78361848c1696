"""Operating points and their status; the iterates and solutions of many points, one per row."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from powertrain.language.reals import Array
from powertrain.numerics.batch import Rows

Mask = NDArray[np.bool_]
Index = NDArray[np.intp]

T = TypeVar("T", bound=np.generic)

LARGEST = 16384
"""The number of points that are solved together at most."""
OK, STUCK_POINT, SEVERAL, NONE, IMMOVABLE, OUTSIDE, DIVERGED, UNDEFINED = range(8)


def taken(values: NDArray[T], which: Index | Mask) -> NDArray[T]:
    """Some rows; the columns of the result are contiguous, as those of all arrays with one row per point should be, for speed."""
    index = np.flatnonzero(which) if which.dtype == bool else which
    return values.T.take(index, axis=-1).T


class OfPoints:
    """A record of arrays with one row per point."""

    def some(self, which: Index | Mask) -> Self:
        """The values of some of the points."""
        each: Any = self
        return type(self)(*(taken(getattr(self, f.name), which) for f in fields(each)))

    def put(self, which: Index | Mask, found: Self) -> None:
        """Replace some of the points."""
        each: Any = self
        for f in fields(each):
            getattr(self, f.name)[which] = getattr(found, f.name)


@dataclass(frozen=True)
class Iterates(OfPoints):
    """Iterates: grid values, unknowns, modes (of frictions, switches, contacts), torques (minus forces)."""

    grid: Array
    y: Array
    modes: Array
    tau: Array

    @property
    def z(self) -> Array:
        """Unknowns and torques."""
        return np.concatenate([self.y, self.tau], axis=1)


@dataclass(frozen=True)
class AtRest(OfPoints):
    """Laws at rest: those whose motion is ``given`` rest at the ``side`` (1 or -1) from which rest is approached.

    ``yields`` are the compliances of the others.
    """

    given: Mask
    yields: Array
    side: Array


@dataclass
class SolvedPoints(OfPoints):
    """Solutions, with what their neighbours start from; nan where there is none."""

    done: Mask
    y: Array
    modes: Array
    tau: Array
    given: Mask
    yields: Array

    def at(self, grid: Array) -> Iterates:
        """The solutions as iterates at points of ``grid``."""
        return Iterates(grid, self.y, self.modes, self.tau)

    def at_rest(self, side: Array) -> AtRest:
        """What their laws do at rest."""
        return AtRest(self.given, self.yields, side)

    def take(self, which: Mask, other: SolvedPoints) -> None:
        """Copy some of the other solutions, of as many points: faster than to ``put`` ``some`` of them."""
        for f in fields(self):
            mine = getattr(self, f.name)
            np.copyto(mine, getattr(other, f.name), where=which.reshape(-1, *[1] * (mine.ndim - 1)))


@dataclass
class Points:
    """Operating points: unknowns, modes, status, the laws that it is about, and those at rest under a prescribed motion.

    ``solved``: for implicit unknowns, the unknowns, torques and modes before symbolic elimination.
    """

    u: Rows
    modes: Rows
    status: NDArray[np.int8]
    involved: Mask
    rest: Mask
    solved: SolvedPoints | None = None
