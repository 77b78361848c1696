"""Common interfaces of differentials: the members of a fundamental differential, and the shafts of an axle differential."""

from __future__ import annotations

from powertrain import Component, ModelError, Symbol, port
from powertrain.components.rotational.interfaces import Flange


class ThreeMembers(Component):
    """Partial: the three members of a fundamental differential, which has two degrees of freedom.

    Sources: D. Yu, N. Beachley, Mechanical efficiency of differential gearing, Gear Technology, July/August 1986, p. 9 and Fig. 2.
    """

    a: Flange = port(Flange)
    b: Flange = port(Flange)
    carrier: Flange = port(Flange)


class Epicyclic(Component):
    """Partial: sun, ring and planet carrier of a planetary gear."""

    sun: Flange = port(Flange)
    ring: Flange = port(Flange)
    carrier: Flange = port(Flange)


class Differential(Component):
    """Partial: an axle differential, from the crown wheel on its cage to the left and the right half shaft.

    w_crown = share w_left + (1 - share) w_right; without friction the left side takes the ``share`` of the crown's torque.
    The kinds differ in how friction changes this.
    """

    crown: Flange = port(Flange)
    left: Flange = port(Flange)
    right: Flange = port(Flange)

    @property
    def share(self) -> Symbol | float:
        """The part of the torque of the crown that the left side takes without friction."""
        raise ModelError(
            f"{type(self).__name__} does not define share, the part of the crown's torque that its left side takes without friction: "
            "share = 0.5 for a differential of equal sides, 1/(1 + ratio) for a planetary gear with its left side at the sun"
        )


class SymmetricDifferential(Differential):
    """Partial: a differential with equal sides, (w_left + w_right)/2 = w_crown."""

    @property
    def share(self) -> Symbol | float:
        """Half."""
        return 0.5
