"""Operating points with the torque of a law anywhere between its limits, where it rests under a prescribed motion.

Equilibrium leaves such a torque open. Given as a share of the way from one limit to the other, it is a law whose limits are both there, and
all else is solved for as at any point.
"""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np

from powertrain.equilibrium.balance import Balance
from powertrain.equilibrium.corrector import CHANGES, Near, corrected
from powertrain.equilibrium.laws import Iterates, Mask, SteadyLaws
from powertrain.equilibrium.points import SolvedPoints
from powertrain.numerics.buffers import Array

_OPEN = 2.0
"""Stands for the share of a law that does not rest."""


class Between:
    """The laws of one steady problem with shares. Serves one thread."""

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
        """The points of ``grid`` next to solved ones, a row each; laws that ``rest`` are at ``side``, from -1 at the lower limit to 1."""
        share = np.where(rest, side, _OPEN)
        start = Iterates(np.hstack([grid, share]), near.y, near.modes, near.tau)
        end, done = corrected(self._laws, start, Near(near.given, near.yields), np.ones_like(side), changes=CHANGES)
        modes = end.modes.copy()
        places = self._laws.law_modes
        modes[:, places] = np.where(rest, side, modes[:, places])
        return SolvedPoints(done, end.y, modes, end.tau, near.given, near.yields)
