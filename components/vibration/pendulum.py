"""Centrifugal pendulum absorbers."""

from __future__ import annotations

from typing import Literal

import casadi as ca

from powertrain import Equations, Parameter, Symbol, Variable, der, parameter, port, unilateral, variable
from powertrain.components.rotational.interfaces import Flange, Lossy

Path = Literal["circle", "cycloid", "epicycloid"]


class CentrifugalPendulum(Lossy):
    """A centrifugal pendulum absorber: masses that swing along paths in a rotating carrier (flange) and cancel one vibration order.

    w = der(flange.phi),  r = c/(1 + n^2),  rho = r cos(lambda psi),  s = integral of rho over psi
    x = integral of rho cos(psi),  y = c - integral of rho sin(psi),  X = x^2 + y^2,  H = rho (y cos(psi) + x sin(psi))
    m (rho der(rho der(psi)) + H der(w) - w^2/2 dX/dpsi) = rho (behind - ahead - d der(s)),  flange.tau = der(m (X w + H der(psi)))
    circle: lambda = 0,  cycloid: lambda = 1,  epicycloid: lambda = n/root(1 + n^2)

    psi is the angle of the path's tangent, rho the radius of curvature, s the arc length from the vertex; x and y are the coordinates of
    the mass in the frame of the carrier, in the direction of rotation and outwards. The mass swings n times per revolution at any speed,
    n = root(R/r), where R = c - r is the distance of the point of suspension from the axis. In addition to its own moment of inertia the
    carrier has m c^2 n^2/(n^2 - k^2) at the order k, so it hardly vibrates at k = n. On a circle the frequency falls with the
    amplitude; on an epicycloid it does not (tautochrone of the centrifugal field).

    At the arc length s_max the mass hits a stop, with the coefficient of restitution e. The masses do not rotate against the carrier
    (bifilar suspension), so their own moment of inertia belongs to it. Gravity is neglected: the model holds where w^2 c is much
    greater than g. Errors: InitializationError for a start beyond a stop.

    Sources: H. H. Denman, Tautochronic bifilar pendulum torsion absorbers for reciprocating engines, J. Sound and Vibration 159
    (1992) 251-277; S. W. Shaw, B. Geist, Tuning for performance and stability in systems of nearly tautochronic torsional vibration
    absorbers, J. Vibration and Acoustics 132 (2010).
    """

    path: Path = "epicycloid"
    flange: Flange = port(Flange)
    m: Parameter = parameter("kg", "Mass of all pendulums together", default=1.0, above=0)
    c: Parameter = parameter("m", "Distance of their centres of mass from the axis at rest", default=0.1, above=0)
    n: Parameter = parameter("1", "Order, oscillations per revolution", default=1.5, above=0)
    d: Parameter = parameter("N.s/m", "Damping along the path", default=5.0, min=0)
    s_max: Parameter = parameter("m", "Arc length at the stops", default=0.03, above=0)
    e: Parameter = parameter("1", "Coefficient of restitution of the stops", default=0.3, min=0, max=1)
    w: Variable = variable("rad/s", "Speed of the carrier")
    psi: Variable = variable("rad", "Angle of the path's tangent", start=0.0, prefer=True)
    w_psi: Variable = variable("rad/s", "Rate of psi", start=0.0, prefer=True)
    s: Variable = variable("m", "Arc length from the vertex, in the direction of rotation")
    ahead: Variable = variable("N", "Force of the stop in the direction of rotation")
    behind: Variable = variable("N", "Force of the stop against it")

    def check(self) -> Equations:
        """The stops must be before the end of the path."""
        if self.path == "circle":
            yield self.s_max < 3 * self.c / (1 + self.n**2)  # where the path ends
        else:
            yield self._lambda() * self.s_max < 0.99 * self.c / (1 + self.n**2)  # where the path ends

    def equations(self) -> Equations:
        """Lagrange's equations of a point mass on a path in a rotating frame."""
        x, y = self._place()
        rho, bend = self._arc(), ca.jacobian(self._arc(), self.psi)
        square, lever = x**2 + y**2, rho * (y * ca.cos(self.psi) + x * ca.sin(self.psi))
        yield self.w == der(self.flange.phi)
        yield self.w_psi == der(self.psi)
        yield self.s == self._length()
        inertia = rho**2 * der(self.w_psi) + rho * bend * self.w_psi**2 + lever * der(self.w)
        field = rho * (x * ca.cos(self.psi) - y * ca.sin(self.psi)) * self.w**2
        yield self.m * (inertia - field) == rho * (self.behind - self.ahead - self.d * rho * self.w_psi)
        yield self.flange.tau == self.m * der(square * self.w + lever * self.w_psi)
        yield unilateral(self.s_max - self.s, self.ahead, restitution=self.e, name="stop_ahead")
        yield unilateral(self.s_max + self.s, self.behind, restitution=self.e, name="stop_behind")
        yield from self._dissipate()

    def energy(self) -> Symbol:
        """Kinetic energy m (rho^2 w_psi^2 + X w^2 + 2 H w w_psi)/2."""
        x, y = self._place()
        rho = self._arc()
        lever = rho * (y * ca.cos(self.psi) + x * ca.sin(self.psi))
        return self.m / 2 * ((rho * self.w_psi) ** 2 + (x**2 + y**2) * self.w**2 + 2 * lever * self.w * self.w_psi)

    def loss(self) -> Symbol:
        """Damping force times speed along the path; the loss at the stops is instantaneous."""
        return self.d * (self._arc() * self.w_psi) ** 2

    def _lambda(self) -> Symbol:
        """Shape of the path, from the circle at 0 to the cycloid at 1."""
        epicycloid = self.n / ca.sqrt(1 + self.n**2)
        return {"circle": Symbol(0), "cycloid": Symbol(1), "epicycloid": epicycloid}[self.path]

    def _radius(self) -> Symbol:
        """Radius of curvature at the vertex."""
        return self.c / (1 + self.n**2)

    def _arc(self) -> Symbol:
        """Radius of curvature, arc length over angle."""
        return self._radius() * ca.cos(self._lambda() * self.psi)

    def _length(self) -> Symbol:
        return self._radius() * self._integral(self._lambda())

    def _place(self) -> tuple[Symbol, Symbol]:
        """The mass in the frame of the carrier: in the direction of rotation and outwards, by integrating rho (cos(psi), -sin(psi))."""
        slow, fast = 1 - self._lambda(), 1 + self._lambda()
        ahead = self._radius() / 2 * (self._integral(slow) + self._integral(fast))
        drop = self._radius() / 2 * (self._rise(slow) + self._rise(fast))
        return ahead, self.c - drop

    def _integral(self, k: Symbol) -> Symbol:
        """The integral of cos(k psi) from 0."""
        return self.psi if k.is_zero() else ca.sin(k * self.psi) / k

    def _rise(self, k: Symbol) -> Symbol:
        """The integral of sin(k psi) from 0."""
        return Symbol(0) if k.is_zero() else (1 - ca.cos(k * self.psi)) / k
