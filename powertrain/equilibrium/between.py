"""Operating points with the torque of a law between its limits, for laws at rest under a prescribed motion.

Equilibrium does not determine such a torque. It is prescribed as a fraction between the limits: both limits of the law are set to it, and
all else is solved for as at any point.
"""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np

from powertrain.equilibrium.balance import Balance
from powertrain.equilibrium.corrector import CHANGES, Near, corrected
from powertrain.equilibrium.laws import SteadyLaws
from powertrain.equilibrium.points import Iterates, Mask, SolvedPoints
from powertrain.numerics.buffers import Array

_OPEN = 2.0
"""Marks a law that does not rest."""


class Between:
    """The laws of one steady problem, with prescribed fractions. Serves one thread."""

    def __init__(self, balance: Balance, compile: bool = False) -> None:
        share = ca.SX.sym("share", balance.tau.numel())
        inside, part = ca.fabs(share) <= 1.0, (1.0 + share) / 2.0
        mixed = balance.lower + part * (balance.upper - balance.lower)
        lower, upper = (ca.if_else(inside, mixed, bound) for bound in (balance.lower, balance.upper))
        self._laws = SteadyLaws(
            replace(balance, grid=ca.vertcat(balance.grid, share), lower=lower, upper=upper), compile
        )

    def set_common(self, values: Array) -> None:
        """Parameters and inputs that are the same for all points."""
        self._laws.set_common(values)

    def solve(self, grid: Array, side: Array, rest: Mask, near: SolvedPoints) -> SolvedPoints:
        """The points of ``grid``, one per row, from solved ones nearby; laws that ``rest`` are at ``side`` (-1 and 1 are the limits)."""
        share = np.where(rest, side, _OPEN)
        start = Iterates(np.hstack([grid, share]), near.y, near.modes, near.tau)
        end, done = corrected(self._laws, start, Near(near.given, near.yields), np.ones_like(side), changes=CHANGES)
        modes = end.modes.copy()
        places = self._laws.law_modes
        modes[:, places] = np.where(rest, side, modes[:, places])
        return SolvedPoints(done, end.y, modes, end.tau, near.given, near.yields)
