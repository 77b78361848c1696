"""Chain drives."""

from __future__ import annotations

import math

import casadi as ca

from powertrain import Equations, Parameter, ParameterError, Symbol, Variable, der, parameter, variable
from powertrain.components.limited import limited_by
from powertrain.components.rotational.interfaces import Lossy, TwoFlanges

HARMONICS = 3
"""Harmonics of the tooth frequency in the polygon effect."""
LEAST = 6
"""Minimum number of teeth of a sprocket."""


class ChainDrive(TwoFlanges, Lossy):
    """A roller chain on two sprockets: no slip, but elasticity, slack and the polygon effect.

    path(phi) = p z/(2 pi) (phi + sum over k of 2 (-1)^(k + 1)/(k z (k^2 z^2 - 1)) sin(k z phi))
    x = path_a(flange_a.phi) - path_b(flange_b.phi),  T = T_0 + c x + d der(x),  loose = T_0 - c x - d der(x), neither below 0
    flange_a.tau = path_a' (T - loose),  flange_b.tau = -path_b' (T - loose)

    A sprocket is a polygon: its chain moves at r cos(angle to the next joint), between r and r cos(pi/z); the series is that of this
    motion, of which ``polygon`` uses three terms or none. The mean ratio is teeth_b/teeth_a. Either strand may become slack; its damping
    then vanishes with its tension. The phase between the sprockets' joints is arbitrary and follows from the angles 0.
    Errors: ParameterError for fewer than 6 teeth.
    Source: N. Fuglede, J. J. Thomsen, Kinematic and dynamic modeling and approximate analysis of a roller chain drive, J. Sound and
    Vibration 366 (2016) 447-470.
    """

    teeth_a: int = 20
    teeth_b: int = 40
    polygon: bool = True
    p: Parameter = parameter("m", "Pitch", default=9.525e-3, above=0)
    T_0: Parameter = parameter("N", "Tension of each strand at rest", default=50.0, min=0)
    c: Parameter = parameter("N/m", "Stiffness of a strand", default=1e6, above=0)
    d: Parameter = parameter("N.s/m", "Damping of a strand", default=200.0, min=0)
    x: Variable = variable("m", "Stretch of the strand that pulls where flange_a drives forward")
    v: Variable = variable("m/s", "Rate of the stretch")
    tight: Variable = variable("N", "Tension of that strand")
    loose: Variable = variable("N", "Tension of the other strand")

    def equations(self) -> Equations:
        """Two strands between two polygonal rims."""
        for name, z in (("teeth_a", self.teeth_a), ("teeth_b", self.teeth_b)):
            if z < LEAST:
                raise ParameterError(f"{self._label}.{name} = {z}: a sprocket has at least {LEAST} teeth")
        a, b = self.flange_a.phi, self.flange_b.phi
        path_a, path_b = self._path_of(a, self.teeth_a), self._path_of(b, self.teeth_b)
        yield self.x == path_a - path_b
        yield self.v == der(self.x)
        yield self.tight == self._tension(self.x, self.v)
        yield self.loose == self._tension(-self.x, -self.v)
        pull = self.tight - self.loose
        yield self.flange_a.tau == self._lever(a, self.teeth_a) * pull
        yield self.flange_b.tau == -self._lever(b, self.teeth_b) * pull
        yield from self._dissipate()

    def energy(self) -> Symbol:
        """Elastic energy of both strands."""
        return (self._spring(self.x) ** 2 + self._spring(-self.x) ** 2) / (2 * self.c)

    def loss(self) -> Symbol:
        """Damping forces times speed."""
        tight, loose = self.tight - self._spring(self.x), self.loose - self._spring(-self.x)
        return (tight - loose) * self.v

    def _spring(self, x: Symbol) -> Symbol:
        return ca.fmax(self.T_0 + self.c * x, 0)

    def _tension(self, x: Symbol, v: Symbol) -> Symbol:
        spring = self._spring(x)
        return spring + limited_by(spring, self.d * v)

    def _path_of(self, phi: Symbol, z: int) -> Symbol:
        return self.p * z / (2 * math.pi) * (phi + sum(a / (k * z) * ca.sin(k * z * phi) for k, a in self._terms(z)))

    def _lever(self, phi: Symbol, z: int) -> Symbol:
        return self.p * z / (2 * math.pi) * (1 + sum(a * ca.cos(k * z * phi) for k, a in self._terms(z)))

    def _terms(self, z: int) -> list[tuple[int, float]]:
        """Harmonics of the tooth frequency in the ratio of chain speed to mean speed."""
        count = HARMONICS if self.polygon else 0
        return [(k, 2 * (-1) ** (k + 1) / ((k * z) ** 2 - 1)) for k in range(1, count + 1)]
