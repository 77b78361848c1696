"""Wheels that do not slip."""

from __future__ import annotations

from powertrain import Equations, Symbol
from powertrain.components.wheels.interfaces import Wheel


class RigidWheel(Wheel):
    """A wheel, or the wheels of an axle combined, that rolls without slip.

    radius hub.phi = road.s, and the equations of every wheel

    The road supplies whatever force is required; f/fn is the coefficient of friction needed.
    """

    def equations(self) -> Equations:
        """Path = radius times angle."""
        yield from self._roll()
        yield self.radius * self.hub.phi == self.road.s

    def loss(self) -> Symbol:
        """Rolling resistance times speed."""
        return self.tau_roll * self.w
