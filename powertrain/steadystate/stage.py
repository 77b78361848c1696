"""One group of laws and unknowns with all that is evaluated for it."""

from __future__ import annotations

from collections.abc import Sequence

from powertrain.engine.buffers import Array
from powertrain.steadystate.choices import Choice, Group
from powertrain.steadystate.equilibrium import Equilibrium
from powertrain.steadystate.table import Table
from powertrain.steadystate.unknowns import Unknowns


class Stage:
    """A group, the choices of its laws, the places of their modes among the values of a trial, their margins, and the unknowns."""

    def __init__(self, problem: Equilibrium, found: Sequence[Choice], group: Group) -> None:
        first = len(problem.grid) + len(problem.u)
        self.group, self.choices = group, [found[k] for k in group.laws]
        self.places = [first + k for k in group.laws]
        self.start = problem.u_start[group.unknowns]
        self.table = Table(problem, self.choices)
        self.unknowns = Unknowns(problem, group) if group.unknowns else None

    def set_common(self, values: Array) -> None:
        """Parameters and inputs that are the same for all points."""
        self.table.set_common(values)
        if self.unknowns is not None:
            self.unknowns.set_common(values)
