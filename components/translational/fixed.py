"""A flange held by the housing."""

from __future__ import annotations

from typing import ClassVar

from powertrain import Component, Equations, Parameter, parameter, port
from powertrain.components.translational.interfaces import Flange


class Fixed(Component):
    """Holds a flange at a constant position.

    flange.s = s0
    """

    boundary: ClassVar[bool] = True
    s0: Parameter = parameter("m", "Position at which the flange is held", default=0.0)
    flange: Flange = port(Flange)

    def equations(self) -> Equations:
        """One position."""
        yield self.flange.s == self.s0
