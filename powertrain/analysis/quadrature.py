"""Gauss quadrature over the steps of a run, in pieces as fine as the integrand requires.

The integrator's steps follow the states. Quantities that depend on time alone may oscillate many times within one step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from powertrain.engine.trajectory import Samples, Trajectory
from powertrain.language.reals import Array

NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)
_OUTER = [0, 1, 3, 4]
_COARSE = np.zeros(5)
_COARSE[_OUTER] = np.linalg.solve(np.vander(NODES[_OUTER], increasing=True).T, [2.0, 0.0, 2.0 / 3.0, 0.0])
_FEWEST = 64
"""Minimum number of pieces of a run; otherwise the nodes could synchronise with an oscillation."""
_ROUGH = 1e-5
"""Share of the integral by which the rules with and without the middle node may differ; the error is about its square."""
_MOST = 20
"""Halvings, after which a jump is accepted."""


@dataclass(frozen=True)
class Pieces:
    """Time intervals, each within one step, created from steps by ``halvings``."""

    first: Array
    length: Array
    step: NDArray[np.int_]
    halvings: int = 0

    @classmethod
    def of(cls, trajectory: Trajectory, cuts: Sequence[float] = ()) -> Pieces:
        """The steps of a run; long ones are divided, and all are cut at the given instants."""
        if not len(trajectory.times):
            return cls(np.zeros(0), np.zeros(0), np.zeros(0, int))
        lengths = np.diff(np.append(trajectory.times, trajectory.end))
        count = np.maximum(1, np.ceil(_FEWEST * lengths / (trajectory.end - trajectory.start))).astype(int)
        step = np.repeat(np.arange(len(lengths)), count)
        within = np.arange(len(step)) - (np.cumsum(count) - count)[step]
        first = trajectory.times[step] + within * (lengths / count)[step]
        first = np.union1d(first, [t for t in cuts if trajectory.start < t < trajectory.end])
        length = np.diff(np.append(first, trajectory.end))
        return cls(first, length, np.searchsorted(trajectory.times, first, side="right") - 1)

    def blocks(self, nodes: int) -> list[Pieces]:
        """Groups of about ``nodes`` nodes, the last one first."""
        size = max(1, nodes // len(NODES))
        return [self._some(slice(i, i + size)) for i in range(0, len(self.first), size)][::-1]

    def _some(self, which: slice | NDArray[np.bool_]) -> Pieces:
        return Pieces(self.first[which], self.length[which], self.step[which], self.halvings)

    def halves(self, which: NDArray[np.bool_]) -> Pieces:
        """The two halves of each of these pieces."""
        some, again = self._some(which), np.concatenate
        half = some.length / 2
        first, length, step = again((some.first, some.first + half)), again((half, half)), again((some.step, some.step))
        return Pieces(first, length, step, self.halvings + 1)

    def samples(self, trajectory: Trajectory) -> Samples:
        """The nodes in every piece, from the dense output of its step."""
        t = self.first[:, None] + self.length[:, None] * (NODES + 1) / 2
        return trajectory.in_steps(t.ravel(), np.repeat(self.step, len(NODES)))

    @property
    def weights(self) -> Array:
        """The weights of the nodes."""
        return (self.length[:, None] * WEIGHTS / 2).ravel()

    def rough(self, values: NDArray[np.float64], whole: float) -> NDArray[np.bool_]:
        """Where the two rules differ by more than their share of ``whole``. ``values``: one row per node."""
        if self.halvings == _MOST:
            return np.zeros(len(self.first), bool)
        difference = np.tensordot(values.reshape(len(self.first), len(NODES), -1), WEIGHTS - _COARSE, (1, 0))
        return np.asarray(self.length / 2 * np.abs(difference).sum(axis=1) > _ROUGH * whole, bool)
