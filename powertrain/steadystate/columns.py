"""Expressions at any number of points, by tapes for few and for many at a time."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from powertrain.engine.buffers import Array, zeros
from powertrain.steadystate.lanes import Rows, Tape, dependence
from powertrain.symbols import Symbol

_FEW, _MANY = 32, 1024


class Columns:
    """``outputs`` as functions of scalars that differ from point to point (``varying``) and of a column that is the same for all."""

    def __init__(self, name: str, varying: Sequence[Symbol], common: Symbol, outputs: Sequence[Symbol]) -> None:
        self._name, self._common, self._outputs = (
            name,
            common,
            ca.cse([ca.densify(o) for o in outputs]) if outputs else [],
        )
        self.needed = np.flatnonzero(dependence(outputs, varying).any(axis=0))
        self._arguments = [varying[int(i)] for i in self.needed]
        self._values = zeros(common.numel())
        self._tapes: dict[int, Tape] = {}

    def set_common(self, values: Array) -> None:
        """The values that are the same for all points."""
        self._values = values.copy()
        for tape in self._tapes.values():
            tape.set_common(values)

    def __call__(self, rows: Rows) -> Rows:
        """One row per output for one row per varying scalar."""
        return self.of_needed(rows[self.needed])

    def of_needed(self, rows: Rows) -> Rows:
        """The same for those rows only that are needed."""
        lanes = _MANY if rows.shape[1] > _MANY // 4 else _FEW
        if lanes not in self._tapes:
            self._tapes[lanes] = Tape(self._name, self._arguments, self._common, self._outputs, lanes)
            self._tapes[lanes].set_common(self._values)
        return self._tapes[lanes](rows)
