"""Gear sets with several meshes, built from pairs of wheels around explicit planets."""

from __future__ import annotations

from typing import Self

from powertrain import Component, Equations, Parameter, Symbol, connect, parameter, port, support
from powertrain.components.differentials.interfaces import Epicyclic
from powertrain.components.differentials.mesh import Mesh
from powertrain.components.differentials.teeth import Pairs, Planets, Ring, Sun, basic_ratio, pair_ratio
from powertrain.components.rotational.inertia import Inertia
from powertrain.components.rotational.interfaces import Flange
from powertrain.components.thermal import HeatPort


class PlanetTrain(Epicyclic):
    """A planetary gear with two explicit meshes, sun with planet and planet with ring, and planets with inertia.

    w_sun - w_carrier = -sun_ratio (w_planet - w_carrier),  sun_ratio = Z_planet/Z_sun  (external)
    w_planet - w_carrier = ring_ratio (w_ring - w_carrier),  ring_ratio = Z_ring/Z_planet  (internal; on stepped planets of the second
    wheel)

    Each mesh has its own loss, so with the carrier fixed eta = eta_sun eta_ring; R_o = -sun_ratio ring_ratio. ``J``: all
    planets about their own axes; their mass around the centre, m e^2 each, belongs to the carrier's inertia.
    """

    sun_ratio: Parameter = parameter("1", "Teeth of the planet over teeth of the sun", above=0)
    ring_ratio: Parameter = parameter("1", "Teeth of the ring over teeth of the planet", above=1)
    eta_sun: Parameter = parameter(
        "1", "Efficiency of the mesh of sun and planet in both directions", default=1.0, above=0, max=1
    )
    eta_ring: Parameter = parameter(
        "1", "Efficiency of the mesh of planet and ring in both directions", default=1.0, above=0, max=1
    )
    J: Parameter = parameter("kg.m2", "Moment of inertia of all planets about their own axes", default=0.0, min=0)
    heat_port: HeatPort = support(HeatPort)
    at_sun: Mesh = Mesh(ratio=-1)
    at_ring: Mesh = Mesh(ratio=2)
    planet: Inertia = Inertia(J=0)

    def equations(self) -> Equations:
        """Two pairs of wheels."""
        yield self.at_sun.ratio == -self.sun_ratio
        yield self.at_ring.ratio == self.ring_ratio
        yield from _both_ways(self.at_sun, self.eta_sun)
        yield from _both_ways(self.at_ring, self.eta_ring)
        yield self.planet.J == self.J
        yield connect(self.sun, self.at_sun.a)
        yield connect(self.at_sun.b, self.planet.flange_a)
        yield connect(self.planet.flange_b, self.at_ring.a)
        yield connect(self.at_ring.b, self.ring)
        yield connect(self.carrier, self.at_sun.carrier, self.at_ring.carrier)
        yield connect(self.heat_port, self.at_sun.heat_port, self.at_ring.heat_port)

    @classmethod
    def from_teeth(
        cls,
        sun: int,
        ring: int,
        first: int,
        second: int | None = None,
        n: int = 3,
        *,
        eta_sun: float = 1.0,
        eta_ring: float = 1.0,
        J: float = 0.0,
    ) -> Self:
        """Sun, ring and planets from their numbers of teeth.

        Parameters
        ----------
        sun, ring : int
            Numbers of teeth of the central wheels.
        first : int
            Teeth of the planet at the sun.
        second : int, optional
            Teeth of the wheel at the ring if the planets are stepped.
        n : int
            Number of planets.
        eta_sun, eta_ring : float
            Efficiencies of the meshes with the sun and with the ring [1].
        J : float
            Moment of inertia of all n planets about their own axes, as the parameter J [kg.m2].

        Raises
        ------
        ParameterError
            If the wheels do not fit.
        """
        planets = Planets(first, second, n)
        basic_ratio(Sun(sun), Ring(ring), planets)
        return cls(sun_ratio=first / sun, ring_ratio=ring / planets.at_b, eta_sun=eta_sun, eta_ring=eta_ring, J=J)


class RavigneauxGear(Component):
    """The Ravigneaux set: two suns and a ring on one carrier with long and short planets; two degrees of freedom, four shafts.

    Long planets mesh with the large sun, the ring and the short planets; short planets mesh with the small sun. Against the carrier:
    w_large = -large_ratio w_long,  w_long = ring_ratio w_ring,  w_small = -small_ratio w_short,  w_short = -pair_ratio w_long

    Hence w_large - w_h = -(Z_ring/Z_large) (w_ring - w_h) and w_small - w_h = +(Z_ring/Z_small) (w_ring - w_h). Each of the four meshes
    has the efficiency eta. ``J_long``, ``J_short``: all planets of a kind about their own axes; their mass around the centre belongs to
    the carrier's inertia.
    """

    large_ratio: Parameter = parameter("1", "Teeth of the long planet over teeth of the large sun", above=0)
    small_ratio: Parameter = parameter("1", "Teeth of the short planet over teeth of the small sun", above=0)
    pair_ratio: Parameter = parameter("1", "Teeth of the long planet over teeth of the short planet", above=0)
    ring_ratio: Parameter = parameter("1", "Teeth of the ring over teeth of the long planet", above=1)
    eta: Parameter = parameter("1", "Efficiency of each mesh in both directions", default=1.0, above=0, max=1)
    J_long: Parameter = parameter(
        "kg.m2", "Moment of inertia of the long planets about their own axes", default=0.0, min=0
    )
    J_short: Parameter = parameter(
        "kg.m2", "Moment of inertia of the short planets about their own axes", default=0.0, min=0
    )
    sun_large: Flange = port(Flange)
    sun_small: Flange = port(Flange)
    ring: Flange = port(Flange)
    carrier: Flange = port(Flange)
    heat_port: HeatPort = support(HeatPort)
    at_large: Mesh = Mesh(ratio=-1)
    at_small: Mesh = Mesh(ratio=-1)
    between: Mesh = Mesh(ratio=-1)
    at_ring: Mesh = Mesh(ratio=2)
    long: Inertia = Inertia(J=0)
    short: Inertia = Inertia(J=0)

    def equations(self) -> Equations:
        """Four pairs of wheels around two planets."""
        yield from self._data()
        meshes = (self.at_large, self.at_small, self.between, self.at_ring)
        yield connect(self.carrier, *(mesh.carrier for mesh in meshes))
        yield connect(self.heat_port, *(mesh.heat_port for mesh in meshes))
        yield connect(self.sun_large, self.at_large.a)
        yield connect(self.sun_small, self.at_small.a)
        yield connect(self.ring, self.at_ring.b)
        yield connect(self.short.flange_a, self.at_small.b, self.between.a)
        yield connect(self.long.flange_a, self.at_large.b, self.between.b, self.at_ring.a)

    def _data(self) -> Equations:
        yield self.at_large.ratio == -self.large_ratio
        yield self.at_small.ratio == -self.small_ratio
        yield self.between.ratio == -self.pair_ratio
        yield self.at_ring.ratio == self.ring_ratio
        for mesh in (self.at_large, self.at_small, self.between, self.at_ring):
            yield from _both_ways(mesh, self.eta)
        for planet, J in ((self.long, self.J_long), (self.short, self.J_short)):
            yield planet.J == J

    @classmethod
    def from_teeth(
        cls, large: int, small: int, ring: int, long: int, short: int, n: int = 3, *, eta: float = 1.0
    ) -> Self:
        """A Ravigneaux gear from its numbers of teeth.

        Parameters
        ----------
        large, small : int
            Teeth of both suns.
        ring : int
            Teeth of the ring.
        long, short : int
            Teeth of the long and of the short planets.
        n : int
            Number of planets of each kind.
        eta : float
            Efficiency of a mesh [1].

        Raises
        ------
        ParameterError
            If the wheels do not fit.
        """
        basic_ratio(Sun(large), Ring(ring), Planets(long, n=n))
        basic_ratio(Sun(small), Ring(ring), Pairs(short, long, n))
        return cls(
            large_ratio=pair_ratio(large, long),
            small_ratio=pair_ratio(small, short),
            pair_ratio=pair_ratio(short, long),
            ring_ratio=pair_ratio(long, ring),
            eta=eta,
        )


def _both_ways(mesh: Mesh, eta: Symbol) -> Equations:
    """The same efficiency whichever side drives."""
    yield mesh.eta_ab == eta
    yield mesh.eta_ba == eta
