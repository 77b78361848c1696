"""A flange held by the housing."""

from __future__ import annotations

from typing import ClassVar

from powertrain import Component, Equations, Parameter, parameter, port
from powertrain.components.rotational.interfaces import Flange


class Fixed(Component):
    """Holds a flange at a constant angle.

    flange.phi = phi0
    """

    boundary: ClassVar[bool] = True

    phi0: Parameter = parameter("rad", "Angle at which the flange is held", default=0.0)
    flange: Flange = port(Flange)

    def equations(self) -> Equations:
        """One angle."""
        yield self.flange.phi == self.phi0
