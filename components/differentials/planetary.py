"""Planetary gears of sun, ring and carrier: with simple, double (pairs of) and stepped planets."""

from __future__ import annotations

from typing import Self

from powertrain import Equations, Parameter, Symbol, connect, parameter, support
from powertrain.components.differentials.interfaces import Epicyclic
from powertrain.components.differentials.mesh import Mesh
from powertrain.components.differentials.teeth import Pairs, Planets, Ring, Sun, basic_ratio
from powertrain.components.thermal import HeatPort


class _SunAndRing(Epicyclic):
    """Partial: sun and ring in mesh through planets without a flange of their own."""

    ratio: Parameter = parameter(
        "1", "Magnitude of the basic speed ratio: teeth of the ring over teeth of the sun", above=0
    )
    eta_ab: Parameter = parameter("1", "Efficiency from sun to ring, carrier fixed", default=1.0, above=0, max=1)
    eta_ba: Parameter = parameter("1", "Efficiency from ring to sun, carrier fixed", default=1.0, above=0, max=1)
    heat_port: HeatPort = support(HeatPort)
    mesh: Mesh = Mesh(ratio=-1)

    def _members(self, basic: Symbol) -> Equations:
        yield self.mesh.ratio == basic
        yield self.mesh.eta_ab == self.eta_ab
        yield self.mesh.eta_ba == self.eta_ba
        yield connect(self.sun, self.mesh.a)
        yield connect(self.ring, self.mesh.b)
        yield connect(self.carrier, self.mesh.carrier)
        yield connect(self.heat_port, self.mesh.heat_port)


class PlanetaryGear(_SunAndRing):
    """A simple planetary gear without inertia: a sun and a ring, connected by planets on a carrier.

    (1 + ratio) w_carrier = w_sun + ratio w_ring,  R_o = -ratio = -Z_ring/Z_sun (type 2K-H(-))
    sun.tau + ring.tau + carrier.tau = 0,  ring.tau = ratio eta_ab sun.tau if the sun drives relative to the carrier, else ratio
    sun.tau/eta_ba

    Without loss it is rotational.IdealPlanetary. Source: the mesh law, Yu & Beachley 1986, eqs. (1)-(21).
    """

    def equations(self) -> Equations:
        """The mesh of sun and ring."""
        yield from self._members(-self.ratio)

    @classmethod
    def from_teeth(
        cls, sun: int, ring: int, planet: int, n: int = 3, *, eta_ab: float = 1.0, eta_ba: float = 1.0
    ) -> Self:
        """A planetary gear of ratio ring/sun.

        Parameters
        ----------
        sun, ring, planet : int
            Numbers of teeth.
        n : int
            Number of planets.
        eta_ab, eta_ba : float
            Efficiencies from sun to ring and from ring to sun, carrier fixed [1].

        Raises
        ------
        ParameterError
            If the wheels cannot be assembled with n planets.
        """
        ratio = -basic_ratio(Sun(sun), Ring(ring), Planets(planet, n=n))
        return cls(ratio=ratio, eta_ab=eta_ab, eta_ba=eta_ba)


class SteppedPlanetaryGear(_SunAndRing):
    """A planetary gear whose planets have two wheels on one shaft: one in mesh with the sun, the other with the ring.

    w_sun - w_carrier = -ratio (w_ring - w_carrier),  ratio = Z_ring Z_first/(Z_second Z_sun)
    """

    def equations(self) -> Equations:
        """The mesh of sun and ring."""
        yield from self._members(-self.ratio)

    @classmethod
    def from_teeth(
        cls, sun: int, ring: int, first: int, second: int, n: int = 3, *, eta_ab: float = 1.0, eta_ba: float = 1.0
    ) -> Self:
        """A planetary gear with stepped planets.

        Parameters
        ----------
        sun, ring : int
            Numbers of teeth of the central wheels.
        first, second : int
            Numbers of teeth of the planets: ``first`` meshes with the sun, ``second`` with the ring.
        n : int
            Number of planets.
        eta_ab, eta_ba : float
            Efficiencies from sun to ring and from ring to sun, carrier fixed [1].

        Raises
        ------
        ParameterError
            If the wheels cannot be assembled.
        """
        ratio = -basic_ratio(Sun(sun), Ring(ring), Planets(first, second, n))
        return cls(ratio=ratio, eta_ab=eta_ab, eta_ba=eta_ba)


class DoublePinionPlanetaryGear(_SunAndRing):
    """A planetary gear with pairs of planets: inner ones at the sun, outer ones at the ring, in mesh with each other.

    w_sun - w_carrier = +ratio (w_ring - w_carrier),  R_o = ratio = Z_ring/Z_sun > 1 (type 2K-H(+))

    With ratio = 2, driven at the ring, it is a differential with equal torques at sun and carrier. For eta_ba < ratio < 1/eta_ab the sun
    cannot drive the carrier while the ring is held, nor the ring the carrier while the sun is held; the carrier can drive either. The gear
    is self-locking.
    """

    def equations(self) -> Equations:
        """The mesh of sun and ring."""
        yield from self._members(self.ratio)

    @classmethod
    def from_teeth(
        cls, sun: int, ring: int, inner: int, outer: int, n: int = 3, *, eta_ab: float = 1.0, eta_ba: float = 1.0
    ) -> Self:
        """A planetary gear with pairs of planets, of ratio ring/sun.

        Parameters
        ----------
        sun, ring : int
            Numbers of teeth of the central wheels.
        inner, outer : int
            Numbers of teeth of the planets at the sun and at the ring.
        n : int
            Number of pairs.
        eta_ab, eta_ba : float
            Efficiencies from sun to ring and from ring to sun, carrier fixed [1].

        Raises
        ------
        ParameterError
            If the wheels cannot be assembled with n pairs of planets.
        """
        ratio = basic_ratio(Sun(sun), Ring(ring), Pairs(inner, outer, n))
        return cls(ratio=ratio, eta_ab=eta_ab, eta_ba=eta_ba)
