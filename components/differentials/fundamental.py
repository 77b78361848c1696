"""The fundamental differential and its tooth numbers."""

from __future__ import annotations

from typing import Self

from powertrain import Equations, arguments_checked
from powertrain.components.differentials.mesh import MeshLaw
from powertrain.components.differentials.teeth import Central, Pairs, Planets, basic_ratio, eccentric_ratio


class FundamentalDifferential(MeshLaw):
    """The fundamental geared differential with members a, b and carrier H; its basic speed ratio is R_o = (w_a - w_h)/(w_b - w_h).

    T_a + T_b + T_h = 0,  T_b = -R_o eta_ab T_a if a drives relative to the carrier, T_b = -R_o T_a/eta_ba if b drives

    R_o < 0 is the type 2K-H(-) (Fig. 3), R_o > 0 the type 2K-H(+) (Fig. 4) or KHV (Fig. 5, with the planet g as a).
    ``from_teeth`` and ``khv`` compute R_o from tooth numbers by eq. (3). Model inertias, bearings and churning as separate components
    at its flanges. Errors: ParameterError if the wheels of ``from_teeth`` cannot be assembled, if R_o is 0 or 1, or if an efficiency is
    not in (0, 1]. Source: D. Yu, N. Beachley, Gear Technology, July/August 1986, pp. 9-12, eqs. (1)-(3), (5)-(18), (21).
    """

    def equations(self) -> Equations:
        """The mesh law."""
        yield from self._mesh()

    @classmethod
    @arguments_checked
    def from_teeth(
        cls, a: Central, b: Central, planets: Planets | Pairs, *, eta_ab: float = 1.0, eta_ba: float = 1.0
    ) -> Self:
        """The differential with two central wheels and their planets.

        Parameters
        ----------
        a, b : Sun or Ring
            The central wheels, members a and b.
        planets : Planets or Pairs
            The planets between them.
        eta_ab, eta_ba : float
            Efficiencies with the carrier at rest if member a drives, and if b drives [1].

        Raises
        ------
        ParameterError
            If the wheels do not fit.

        Examples
        --------
        >>> from powertrain.components.differentials import Planets, Ring, Sun
        >>> float(FundamentalDifferential.from_teeth(Sun(90), Ring(153), Planets(31, n=3)).ratio)
        -1.7
        """
        return cls(ratio=basic_ratio(a, b, planets), eta_ab=eta_ab, eta_ba=eta_ba)

    @classmethod
    def khv(cls, planet: int, ring: int, *, eta_ab: float = 1.0, eta_ba: float = 1.0) -> Self:
        """A planet in a ring: R_o = ring/planet > 1.

        Parameters
        ----------
        planet : int
            Teeth of the planet, member a, through its angular velocity mechanism.
        ring : int
            Teeth of the ring, member b.
        eta_ab, eta_ba : float
            Efficiencies with the carrier at rest if member a drives, and if b drives [1].
        """
        return cls(ratio=eccentric_ratio(planet, ring), eta_ab=eta_ab, eta_ba=eta_ba)
