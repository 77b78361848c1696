"""Shafts with distributed inertia and elasticity."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any, Self

from powertrain import (
    Equations,
    Parameter,
    ParameterError,
    Symbol,
    Variable,
    arguments_checked,
    connect,
    der,
    parameter,
    variable,
)
from powertrain.components.rotational.interfaces import Lossy, TwoFlanges

LENGTH, BORE = parameter("m", "Length or diameter", above=0), parameter("m", "Inner diameter", min=0)
MODULUS, DENSITY = parameter("Pa", "Shear modulus", above=0), parameter("kg/m3", "Density", above=0)


class ShaftElement(TwoFlanges, Lossy):
    """A piece of a shaft: a spring and a damper between two halves of its inertia.

    phi_rel = flange_b.phi - flange_a.phi,  w_rel = der(phi_rel),  tau = c phi_rel + d w_rel
    J/2 der(der(flange_a.phi)) = flange_a.tau + tau,  J/2 der(der(flange_b.phi)) = flange_b.tau - tau

    Elements with different parameters in a row form a stepped shaft.
    """

    c: Parameter = parameter("N.m/rad", "Stiffness", default=1e5, above=0)
    d: Parameter = parameter("N.m.s/rad", "Damping of the twist", default=0.0, min=0)
    J: Parameter = parameter("kg.m2", "Moment of inertia", default=1e-3, above=0)
    phi_rel: Variable = variable("rad", "Twist, flange_b.phi - flange_a.phi")
    w_rel: Variable = variable("rad/s", "Rate of the twist")
    tau: Variable = variable("N.m", "Torque of the spring and the damper")

    def equations(self) -> Equations:
        """Newton's law of both halves."""
        yield self.phi_rel == self.flange_b.phi - self.flange_a.phi
        yield self.w_rel == der(self.phi_rel)
        yield self.tau == self.c * self.phi_rel + self.d * self.w_rel
        yield self.J / 2 * der(der(self.flange_a.phi)) == self.flange_a.tau + self.tau
        yield self.J / 2 * der(der(self.flange_b.phi)) == self.flange_b.tau - self.tau
        yield from self._dissipate()

    def energy(self) -> Symbol:
        """Kinetic energy of both halves, and elastic energy."""
        ends = (self.flange_a.phi, self.flange_b.phi)
        return sum((self.J * der(phi) ** 2 / 4 for phi in ends), self.c * self.phi_rel**2 / 2)

    def loss(self) -> Symbol:
        """Damping torque times the rate of the twist."""
        return self.d * self.w_rel**2


class FlexibleShaft(TwoFlanges):
    """A uniform shaft that twists along its length: N equal ``elements`` in a row, each with c N, d N and J/N.

    f_k = N/pi root(c/J) sin(k pi/(2 N)),  zeta_k = pi d f_k/c,  k = 1 to N

    These are its natural frequencies in hertz and damping ratios with free ends. The continuous shaft has f_k = k/2 root(c/J), higher by
    the factor 1 + (k pi/(2 N))^2/6 approximately: 0.6 % for the first frequency of eight elements. Sixteen elements are
    ``FlexibleShaft(elements=(ShaftElement(),) * 16, c=c, J=J)``; their parameters follow from those of the shaft. Bending and the friction
    of bearings are not included; for the latter use ``BearingFriction``.

    Errors: ParameterError without elements.
    """

    elements: tuple[ShaftElement, ...] = (ShaftElement(),) * 8
    c: Parameter = parameter("N.m/rad", "Stiffness of the whole shaft", above=0)
    d: Parameter = parameter("N.m.s/rad", "Damping of the twist of the whole shaft", default=0.0, min=0)
    J: Parameter = parameter("kg.m2", "Moment of inertia of the whole shaft", above=0)

    def check(self) -> Equations:
        """There is at least one element."""
        yield len(self.elements) > 0  # it has elements

    @classmethod
    @arguments_checked
    def of_tube(
        cls,
        *,
        length: float | str,
        outer: float | str,
        inner: float | str = 0.0,
        G: float | str,
        rho: float | str,
        n: int = 8,
        **parameters: Any,
    ) -> Self:
        """A round shaft from its dimensions and its material: c = G I_p/length, J = rho I_p length, I_p = pi (outer^4 - inner^4)/32.

        Parameters
        ----------
        length, outer, inner : float or str
            Length, outer and inner diameter [m].
        G, rho : float or str
            Shear modulus [Pa] and density [kg/m3].
        n : int
            Number of elements.
        **parameters
            Other parameters of the shaft, such as ``d``.

        Raises
        ------
        ParameterError
            For values that are not positive, and a bore that is not smaller than the shaft.
        """
        where = f"{cls.__name__}.of_tube"
        L, D, d = (
            LENGTH.check(length, f"{where}: length"),
            LENGTH.check(outer, f"{where}: outer"),
            BORE.check(inner, f"{where}: inner"),
        )
        modulus, density = MODULUS.check(G, f"{where}: G"), DENSITY.check(rho, f"{where}: rho")
        if not d < D:
            raise ParameterError(f"{where}: the inner diameter {d:g} m is not smaller than the outer diameter {D:g} m")
        polar = math.pi * (D**4 - d**4) / 32
        return cls(elements=(ShaftElement(),) * n, c=modulus * polar / L, J=density * polar * L, **parameters)

    def equations(self) -> Equations:
        """The elements in series."""
        n = len(self.elements)
        for element in self.elements:
            yield element.c == self.c * n
            yield element.d == self.d * n
            yield self.J / n == element.J
        yield connect(self.flange_a, self.elements[0].flange_a)
        for before, after in pairwise(self.elements):
            yield connect(before.flange_b, after.flange_a)
        yield connect(self.elements[-1].flange_b, self.flange_b)
