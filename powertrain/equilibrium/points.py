"""Operating points and their status; during the search, the solutions that are still possible."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from powertrain.numerics.batch import Rows
from powertrain.numerics.buffers import Array

Mask = NDArray[np.bool_]
Index = NDArray[np.intp]

T = TypeVar("T", bound=np.generic)

OK, STUCK_POINT, SEVERAL, NONE, IMMOVABLE, OUTSIDE, DIVERGED, UNDEFINED = range(8)


def taken(values: NDArray[T], which: Index | Mask) -> NDArray[T]:
    """Some rows; the columns of the result are contiguous, as those of all arrays with one row per point should be, for speed."""
    index = np.flatnonzero(which) if which.dtype == bool else which
    return values.T.take(index, axis=-1).T


@dataclass(frozen=True)
class Look:
    """Options of a search: ``side`` of laws at rest, ``first`` of several solutions."""

    side: int | None = None
    first: bool = False


@dataclass(frozen=True)
class Iterates:
    """Iterates, one per row: grid values, unknowns, modes (of frictions, switches, contacts), torques (minus forces)."""

    grid: Array
    y: Array
    modes: Array
    tau: Array

    @property
    def z(self) -> Array:
        """Unknowns and torques."""
        return np.concatenate([self.y, self.tau], axis=1)

    def some(self, which: Index | Mask) -> Iterates:
        """Some of them."""
        return Iterates(*(taken(getattr(self, f.name), which) for f in fields(self)))


@dataclass(frozen=True)
class SteadyPoint:
    """An operating point, with the values from which its neighbours are solved."""

    y: Array
    modes: Array
    tau: Array
    given: Mask
    yields: Array


@dataclass
class SolvedPoints:
    """The solutions from one start, one per row; nan where there is none."""

    done: Mask
    y: Array
    modes: Array
    tau: Array
    given: Mask
    yields: Array

    def some(self, which: Index | Mask) -> SolvedPoints:
        """A subset of them."""
        return SolvedPoints(*(taken(getattr(self, f.name), which) for f in fields(self)))

    def take(self, which: Mask, other: SolvedPoints) -> None:
        """Copy some of the other solutions."""
        for f in fields(self):
            mine = getattr(self, f.name)
            np.copyto(mine, getattr(other, f.name), where=which.reshape(-1, *[1] * (mine.ndim - 1)))

    def put(self, p: int | Index, found: SteadyPoint | SolvedPoints) -> None:
        """Copy one solution, or some."""
        self.done[p] = True
        for name in ("y", "modes", "tau", "given", "yields"):
            getattr(self, name)[p] = getattr(found, name)


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


@dataclass
class Trials:
    """Candidates for solutions, one per column: the point, the values so far, and what is known about it.

    ``values``: of the grid and the modes. ``rest``: laws at rest under a prescribed motion.
    """

    point: Index
    values: Rows
    rest: Mask

    @classmethod
    def of(cls, grid: Rows, laws: int) -> Trials:
        """One candidate for every point of ``grid``, with unknown modes."""
        count = grid.shape[1]
        return cls(np.arange(count), np.vstack([grid, np.zeros((laws, count))]), np.zeros((laws, count), bool))

    def some(self, which: Index | Mask) -> Trials:
        """Copies of some of them."""
        return Trials(self.point[which], self.values[:, which], self.rest[:, which])

    def per_point(self, count: int) -> Index:
        """The number of candidates of each point."""
        return np.bincount(self.point, minlength=count)

    @classmethod
    def joined(cls, parts: Sequence[Trials]) -> Trials:
        """All candidates, in the order of their points."""
        names = ("point", "values", "rest")
        whole = cls(*(np.concatenate([getattr(part, name) for part in parts], axis=-1) for name in names))
        return whole.some(np.argsort(whole.point, kind="stable"))
