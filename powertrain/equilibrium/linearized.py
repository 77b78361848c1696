"""The laws of a steady problem and their slopes, for continuation: more than Newton's method for given modes needs."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.equilibrium.laws import Motion, SteadyLaws
from powertrain.equilibrium.points import Iterates
from powertrain.equilibrium.rules import rest_zones
from powertrain.language.symbols import column
from powertrain.numerics.batch import Columns
from powertrain.numerics.buffers import Array


@dataclass(frozen=True)
class LawValues(Motion):
    """Also the limits and conditions, with their slopes; speeds below ``zone`` count as rest."""

    zone: Array
    lower: Array
    upper: Array
    g: Array
    lower_: Array
    upper_: Array
    g_: Array


class Linearized:
    """Values and slopes of the laws at points. Serves one thread."""

    def __init__(self, laws: SteadyLaws) -> None:
        b, self._tied = laws.balance, laws.tied
        moved, values = ca.vertcat(b.y, b.tau), [b.rows, b.speed, b.lower, b.upper, b.conditions]
        parts = [*values, *(ca.jacobian(e, moved) for e in values), column(rest_zones(b))]
        self._shapes = [e.shape for e in parts]
        self._ends = np.cumsum([0, *(e.numel() for e in parts)])
        self._places = np.concatenate([first + _by_rows(e) for first, e in zip(self._ends, parts, strict=False)])
        outputs = [e.nz[k] for e in parts for k in range(e.nnz())]
        scalars = [s for e in (b.grid, b.modes, moved) for s in (ca.vertsplit(e) if e.numel() else [])]
        self._columns = Columns("steady_balance", scalars, b.common, outputs)

    def set_common(self, values: Array) -> None:
        """Parameters and inputs that are the same for all points."""
        self._columns.set_common(values)

    def __call__(self, at: Iterates, lossless: bool) -> LawValues:
        """Everything at the points; ``lossless``: torques that depend on others are left out."""
        with np.errstate(all="ignore"):
            found = self._columns.of_points([at.grid, at.modes, at.y, at.tau])
        entries = np.zeros((int(self._ends[-1]), len(at.y)))
        entries[self._places] = found
        cuts = zip(self._shapes, pairwise(self._ends), strict=True)
        parts = [entries[first:last].reshape(*shape, len(at.y)).transpose(2, 0, 1) for shape, (first, last) in cuts]
        rows, speed, lower, upper, g, zone = (part[:, :, 0] for part in (*parts[:5], parts[-1]))
        rows_, speed_, lower_, upper_, g_ = parts[5:-1]
        if lossless:
            for each in (lower, upper, lower_, upper_):
                each[:, self._tied] = 0.0
        return LawValues(rows, speed, rows_, speed_, zone, lower, upper, g, lower_, upper_, g_)


def _by_rows(expression: ca.SX) -> NDArray[np.intp]:
    """The positions of its structural entries, counted row by row."""
    pattern = expression.sparsity()
    return np.array(pattern.row(), np.intp) * expression.shape[1] + np.array(pattern.get_col(), np.intp)
