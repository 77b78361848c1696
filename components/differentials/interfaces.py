"""Common interfaces of differentials: the members of a fundamental differential, and the shafts of an axle differential."""

from __future__ import annotations

from powertrain import Component, port
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

    For all of them (w_left + w_right)/2 = w_crown. They differ in how they share the torque.
    """

    crown: Flange = port(Flange)
    left: Flange = port(Flange)
    right: Flange = port(Flange)
