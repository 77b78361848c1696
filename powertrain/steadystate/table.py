"""What tells the modes of the laws of a group apart at many points: margins, torques, speeds."""

from __future__ import annotations

import numpy as np

from powertrain.compiler.hybrid import Contact, Friction
from powertrain.engine.buffers import Array
from powertrain.steadystate.choices import Choice, breakaway
from powertrain.steadystate.columns import Columns
from powertrain.steadystate.equilibrium import Equilibrium
from powertrain.steadystate.lanes import Rows
from powertrain.symbols import Symbol


class Table:
    """All margins of some laws and what else tells modes apart, at many points; ``k`` is the number of a law among them."""

    def __init__(self, problem: Equilibrium, found: list[Choice]) -> None:
        rows: list[Symbol] = []
        self._first, self._extra = [], []
        for c in found:
            self._first.append(len(rows))
            rows += c.margins
            self._extra.append(len(rows))
            rows.append(Symbol(-1) if c.rest is None else c.rest)
            if isinstance(c.law, Friction):
                rows += [c.law.torque, c.law.w, breakaway(c.law)]
            else:
                rows.append(c.law.force if isinstance(c.law, Contact) else c.law.g)
        varying = [*problem.grid, *problem.u, *problem.modes]
        self._columns = Columns("steady_laws", varying, problem.common, rows)

    def set_common(self, values: Array) -> None:
        """Parameters and inputs that are the same for all points."""
        self._columns.set_common(values)

    def evaluate(self, values: Rows) -> Rows:
        """All of it for the values of grid, unknowns and modes, to be read with the other methods."""
        return self._columns(values)

    def margins(self, table: Rows, k: int) -> Rows:
        """One row per mode of a law, not negative where it holds."""
        return table[self._first[k] : self._extra[k]]

    def rest(self, table: Rows, k: int) -> Array:
        """Not negative where a law rests under a prescribed motion."""
        return np.asarray(table[self._extra[k]])

    def signature(self, table: Rows) -> Rows:
        """The torques of friction laws, the forces of contacts, the conditions of switches."""
        return table[[extra + 1 for extra in self._extra]]

    def motion(self, table: Rows, k: int) -> tuple[Array, Array]:
        """The speed of a friction law, and the direction in which a stuck one breaks away."""
        return table[self._extra[k] + 2], table[self._extra[k] + 3]
