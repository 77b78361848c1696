"""Detents that hold a rod in one of several positions."""

from __future__ import annotations

import math

import casadi as ca

from powertrain import Equations, Parameter, Symbol, parameter
from powertrain.components.translational.interfaces import OneFlangeAndSupport


class Detent(OneFlangeAndSupport):
    """A spring-loaded ball in equally spaced notches: it holds at a notch and pulls towards the nearest one.

    s = flange.s - support.s,  flange.f = f_max sin(2 pi (s - s_0)/pitch),  flange.f + support.f = 0

    A rod leaves a notch at the force f_max, reached at pitch/4 from it, and needs the energy f_max pitch/pi. The force has a
    potential, so the detent loses nothing: the spring returns the energy that it stored.
    """

    f_max: Parameter = parameter("N", "Force at which it lets go", default=50.0, min=0)
    pitch: Parameter = parameter("m", "Distance from notch to notch", default=9e-3, above=0)
    s_0: Parameter = parameter("m", "Position of a notch", default=0.0)

    def equations(self) -> Equations:
        """A row of notches."""
        yield from self._against_support()
        yield self.flange.f == self.f_max * ca.sin(self._phase())

    def _phase(self) -> Symbol:
        return 2 * math.pi * (self.s - self.s_0) / self.pitch

    def energy(self) -> Symbol:
        """Energy of the spring, 0 in a notch."""
        return self.f_max * self.pitch / (2 * math.pi) * (1 - ca.cos(self._phase()))
