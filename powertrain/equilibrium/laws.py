"""The laws of a steady problem at many points: their equations in given modes, the modes that follow, and motions with their slopes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from powertrain.equilibrium.balance import Balance
from powertrain.equilibrium.equations import HELD, LEAST, LOWER, NOTHING, UPPER, Equations
from powertrain.equilibrium.points import Iterates, Mask
from powertrain.equilibrium.rules import NextModes, SteadyRules
from powertrain.modes.friction import FORWARD, FREE, STUCK
from powertrain.numerics.buffers import Array


@dataclass(frozen=True)
class Motion:
    """Rows and speeds (point, quantity), and their derivatives by (y, tau) (point, quantity, unknown)."""

    rows: Array
    speed: Array
    rows_: Array
    speed_: Array


class SteadyLaws:
    """The laws of one steady problem. Serves one thread."""

    def __init__(self, balance: Balance, compile: bool = False) -> None:
        dae, b = balance.dae, _of_torques(balance)
        self.balance, self.count, self.unknowns = b, b.tau.numel(), b.y.numel()
        self.frictions, switches = len(dae.frictions), len(dae.switches)
        laws = np.arange(self.count)
        self.contact = laws >= self.frictions
        self.may_free = np.array([f.may_free for f in dae.frictions] + [False] * len(dae.contacts), bool)
        self.tied = ~self.may_free & ~self.contact
        # places among all modes: frictions, switches, contacts
        self.law_modes = np.where(self.contact, laws + switches, laws)
        self.tied_modes = self.law_modes[self.tied]
        self.switch_modes = self.frictions + np.arange(switches)
        self.rate_of, self.rates = b.rate_of, np.flatnonzero(b.rate_of >= 0)
        self.common = np.zeros(b.common.numel())
        self.equations, self._rules = Equations(b, compile), SteadyRules(b, compile)

    def set_common(self, values: Array) -> None:
        """Parameters and inputs that are the same for all points."""
        self.common = values.copy()
        self._rules.set_common(values)
        self.equations.set_common(values)

    def next_modes(
        self, at: Iterates, given: Mask, side: Array, drive: Array | None = None, lossless: bool = False
    ) -> NextModes:
        """The modes that follow.

        ``given`` are laws whose motion is given; ``side`` is the side from which their rest is approached. ``drive`` is the rate of each
        law against its own compliance, where it matters. ``lossless``: torques that depend on others are left out.
        """
        return self._rules(at, given, side, drive, lossless)

    def motion(self, at: Iterates) -> Motion:
        """Rows and speeds at the points, and their slopes."""
        return self.motion_of(*self.held(at))

    def held(self, at: Iterates) -> tuple[Array, Array]:
        """The equations with all laws stuck: entries of the matrix and values, one row per point."""
        kinds, none = np.full_like(at.tau, HELD), np.zeros_like(at.tau)
        return self.equations(self.equations.given(at.grid, at.modes, kinds, none, np.inf), at.z)

    def motion_of(self, entries: Array, value: Array) -> Motion:
        """The motion of which these are the equations."""
        n, matrix = self.unknowns, self.equations.pattern.dense(entries)
        return Motion(value[:, :n], value[:, n:], matrix[:, :n], matrix[:, n:])

    def kinds(self, at: Iterates, given: Mask, side: Array, lossless: bool = False) -> Array:
        """The equation of each law in its mode, as a number of ``equations``; ``given`` and ``side`` as in ``following``."""
        mode = at.modes.T[self.law_modes].T
        mode = np.where(given & (mode == STUCK), side, mode)
        held = np.where(self.contact, mode == 1.0, mode == STUCK) & ~given
        upper = self.contact | (mode == FORWARD) | (mode == FREE)
        kinds = np.where(upper, float(UPPER), float(LOWER))
        kinds = np.where(given & (mode == STUCK), LEAST, kinds)
        kinds = np.where(self.tied & lossless, NOTHING, kinds)
        return np.where(held, HELD, kinds)


def _of_torques(b: Balance) -> Balance:
    """The same with torques only: minus the forces of contacts."""
    if not b.dae.contacts:
        return b
    sign = ca.DM([1.0] * len(b.dae.frictions) + [-1.0] * len(b.dae.contacts))
    given = [b.rows, b.speed, b.lower, b.upper, b.conditions]
    rows, speed, lower, upper, conditions = ca.substitute(given, [b.tau], [sign * b.tau])
    return replace(b, rows=rows, speed=speed, lower=lower, upper=upper, conditions=conditions)
