"""What tells the modes of the laws apart at many points: margins, torques, speeds."""

from __future__ import annotations

import numpy as np

from powertrain.compiler.hybrid import Contact, Friction
from powertrain.engine.buffers import Array
from powertrain.steadystate.choices import Choice, breakaway, needs
from powertrain.steadystate.equilibrium import Equilibrium
from powertrain.steadystate.lanes import Rows, Tape
from powertrain.symbols import Symbol

LANES = 256


class Table:
    """All margins of all laws and what else tells modes apart, at many points."""

    def __init__(self, problem: Equilibrium, found: list[Choice], varying: list[Symbol]) -> None:
        rows: list[Symbol] = []
        self._first, self._extra = [], []
        self._found = found
        for c in found:
            self._first.append(len(rows))
            rows += c.margins
            self._extra.append(len(rows))
            rows.append(Symbol(-1) if c.rest is None else c.rest)
            if isinstance(c.law, Friction):
                rows += [c.law.torque, c.law.w, breakaway(c.law)]
            else:
                rows.append(c.law.force if isinstance(c.law, Contact) else c.law.g)
        self._speeds = len(rows)
        rows += problem.solved
        self._speed_rows = [self._extra[k] + 2 for k, c in enumerate(found) if isinstance(c.law, Friction)]
        self._speed_rows += list(range(self._speeds, len(rows)))
        self._needs = needs(found, problem.modes)
        self.tape = Tape("steady_laws", varying, problem.common, rows or [Symbol(0)], LANES)

    def needs(self, k: int, j: int) -> bool:
        """Whether the modes of law k depend on those of law j."""
        return bool(self._needs[k, j])

    def evaluate(self, grid: Rows, u: Rows, modes: Rows) -> Rows:
        """All of it, to be read with the other methods."""
        return self.tape(np.vstack([grid, u, modes]))

    def margins(self, table: Rows, k: int) -> Rows:
        """One row per mode of a law, not negative where it holds."""
        return table[self._first[k] : self._extra[k]]

    def rest(self, table: Rows, k: int) -> Array:
        """Not negative where a law rests under a prescribed motion."""
        return np.asarray(table[self._extra[k]])

    def signature(self, table: Rows, k: int) -> Rows:
        """The torque of a friction law, the force of a contact, the condition of a switch."""
        return table[self._extra[k] + 1 : self._extra[k] + 2]

    def motion(self, table: Rows, k: int) -> tuple[Array, Array]:
        """The speed of a friction law, and the direction in which a stuck one breaks away."""
        return table[self._extra[k] + 2], table[self._extra[k] + 3]

    def speeds(self, table: Rows) -> Rows:
        """All that has to be finite where the model can move."""
        return table[self._speed_rows]
