"""The planetary final drive before the differential."""

from __future__ import annotations

from typing import Self

from powertrain import Equations, Parameter, connect, parameter, support
from powertrain.components.differentials.planetary import PlanetaryGear
from powertrain.components.rotational.fixed import Fixed
from powertrain.components.rotational.interfaces import TwoFlanges
from powertrain.components.thermal import HeatPort

STANDARD_RATIOS = (3.05, 3.29, 3.73, 4.1, 4.56)
"""Final-drive ratios of the GM 4T65-E, from Chaudhary, Angeles & Morozov 2014, 4.3."""


class PlanetaryFinalDrive(TwoFlanges):
    """A speed reducer coaxial with the differential: a planetary gear, sun in (flange_a), ring held by the case, carrier out (flange_b).

    w_a = ratio w_b,  ratio = 1 + Z_ring/Z_sun;  flange_b.tau = -(1 + (ratio - 1) eta_ab) flange_a.tau if the sun drives

    The carrier drives the cage of the differential: connect flange_b to its crown. The planets turn against the sun, the carrier in its
    direction. The ratio is that of the final drive alone: no differential changes the mean speed of its sides. Source: Chaudhary, Angeles &
    Morozov 2014, 4.3. Errors: ParameterError for a ratio of 2 or less, for which the ring would be no larger than the sun.
    """

    ratio: Parameter = parameter("1", "Speed of the sun over speed of the carrier", above=2)
    eta_ab: Parameter = parameter("1", "Efficiency from sun to ring, carrier fixed", default=1.0, above=0, max=1)
    eta_ba: Parameter = parameter("1", "Efficiency from ring to sun, carrier fixed", default=1.0, above=0, max=1)
    heat_port: HeatPort = support(HeatPort)
    gear: PlanetaryGear = PlanetaryGear(ratio=2)
    case: Fixed = Fixed()

    def equations(self) -> Equations:
        """A planetary gear with its ring in the case."""
        yield self.gear.ratio == self.ratio - 1
        yield self.gear.eta_ab == self.eta_ab
        yield self.gear.eta_ba == self.eta_ba
        yield connect(self.flange_a, self.gear.sun)
        yield connect(self.case.flange, self.gear.ring)
        yield connect(self.gear.carrier, self.flange_b)
        yield connect(self.heat_port, self.gear.heat_port)

    @classmethod
    def from_teeth(
        cls, sun: int, ring: int, planet: int, n: int = 3, *, eta_ab: float = 1.0, eta_ba: float = 1.0
    ) -> Self:
        """A final drive from tooth numbers; its ratio is 1 + ring/sun.

        Parameters
        ----------
        sun, ring, planet : int
            Tooth numbers.
        n : int
            Number of planets.
        eta_ab, eta_ba : float
            Efficiencies from sun to ring and from ring to sun, carrier fixed [1].

        Raises
        ------
        ParameterError
            If the wheels cannot be assembled with n planets.
        """
        gear = PlanetaryGear.from_teeth(sun, ring, planet, n)
        return cls(ratio=1 + float(gear.ratio), eta_ab=eta_ab, eta_ba=eta_ba)
