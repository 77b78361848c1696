"""Springs of torsional dampers: staged springs, and arc springs whose coils rub in their channel."""

from __future__ import annotations

from itertools import pairwise

import casadi as ca

from powertrain import (
    Equations,
    Parameter,
    ParameterError,
    Symbol,
    Variable,
    connect,
    der,
    friction,
    parameter,
    port,
    variable,
)
from powertrain.components.limited import limited_at
from powertrain.components.rotational.interfaces import Compliant, Flange, Lossy, TwoFlanges


class StagedSpring(Compliant):
    """A torsion spring that becomes stiffer in stages, the same in both directions.

    tau = sum over the rows (phi_k, c_k) of c_k (phi_rel - phi_k) for phi_rel > phi_k,  c_k (phi_rel + phi_k) for phi_rel < -phi_k

    ``stages``: rows (angle in rad beyond which the spring acts, added stiffness in N.m/rad). The last row may be a stop. A first row at
    angle 0 has no play. Errors: ParameterError for negative values.
    """

    stages: tuple[tuple[float, float], ...] = ((0.0, 400.0),)

    def equations(self) -> Equations:
        """Springs in parallel, each behind its play."""
        yield from self._transmit()
        for play, c in self.stages:
            if play < 0 or c < 0:
                raise ParameterError(f"{self._label}.stages: {c:g} N.m/rad from {play:g} rad; neither can be negative")
        yield self.tau == sum(c * self._behind(play) for play, c in self.stages)

    def _behind(self, play: float) -> Symbol:
        """Compression of the spring."""
        return self.phi_rel - limited_at(self.phi_rel, -play, play) if play else self.phi_rel

    def energy(self) -> Symbol:
        """Elastic energy, the sum of c_k (|phi_rel| - phi_k)^2/2."""
        terms = [c * ca.fmax(ca.fabs(self.phi_rel) - play, 0) ** 2 / 2 for play, c in self.stages]
        return sum(terms, Symbol(0))


class Coil(TwoFlanges, Lossy):
    """A section of an arc spring that slides in its channel: half a spring, a mass, half a spring.

    w = der(phi),  w_rel = w - der(channel.phi),  tau_a = 2 c (phi - flange_a.phi),  tau_b = 2 c (flange_b.phi - phi)
    J der(w) = tau_b - tau_a - tau,  flange_a.tau = -tau_a,  flange_b.tau = tau_b,  channel.tau = -tau
    w_rel > 0: tau = limit;  w_rel < 0: tau = -limit;  w_rel = 0: |tau| <= limit
    limit = mue (J der(channel.phi)^2 + wrap (|tau_a| + |tau_b|)/2)

    Its inertia and the compressed spring, curved over the angle ``wrap``, press it against the channel.
    """

    channel: Flange = port(Flange)
    c: Parameter = parameter("N.m/rad", "Stiffness", default=800.0, above=0)
    J: Parameter = parameter("kg.m2", "Moment of inertia about the axis of the shaft", default=2e-3, above=0)
    mue: Parameter = parameter("1", "Coefficient of friction in the channel", default=0.1, min=0)
    wrap: Parameter = parameter("rad", "Angle of the arc that the piece takes up", default=1.2, min=0)
    phi: Variable = variable("rad", "Angle of the mass")
    w: Variable = variable("rad/s", "Speed of the mass")
    w_rel: Variable = variable("rad/s", "Speed of the mass against the channel")
    tau_a: Variable = variable("N.m", "Torque of the spring on the side of flange_a")
    tau_b: Variable = variable("N.m", "Torque of the spring on the side of flange_b")
    tau: Variable = variable("N.m", "Friction torque of the channel")

    def equations(self) -> Equations:
        """A mass between two springs on the inside of a rotating ring."""
        yield self.w == der(self.phi)
        yield self.w_rel == self.w - der(self.channel.phi)
        yield self.tau_a == 2 * self.c * (self.phi - self.flange_a.phi)
        yield self.tau_b == 2 * self.c * (self.flange_b.phi - self.phi)
        yield self.J * der(self.w) == self.tau_b - self.tau_a - self.tau
        yield self.flange_a.tau == -self.tau_a
        yield self.flange_b.tau == self.tau_b
        yield self.channel.tau == -self.tau
        spring = (ca.fabs(self.tau_a) + ca.fabs(self.tau_b)) / 2
        limit = self.mue * (self.J * der(self.channel.phi) ** 2 + self.wrap * spring)
        yield friction(self.w_rel, self.tau, -limit, limit)
        yield from self._dissipate()

    def energy(self) -> Symbol:
        """Kinetic and elastic energy J w^2/2 + (tau_a^2 + tau_b^2)/(4 c)."""
        return self.J * self.w**2 / 2 + (self.tau_a**2 + self.tau_b**2) / (4 * self.c)

    def loss(self) -> Symbol:
        """Friction torque times sliding speed."""
        return self.tau * self.w_rel


class ArcSpring(TwoFlanges):
    """A coil spring in the form of an arc, which rubs in a channel on flange_a; a series of N coils with c N, J/N and wrap/N each.

    Friction grows with the square of the speed and with the torque. Coils stick until the torque on them exceeds it, so the spring is
    stiffer for small amplitudes. With many coils the torque along the arc falls by exp(-mue wrap)
    (Eytelwein); with one coil and wrap = 0 a slow cycle of amplitude x dissipates T (2 x - T/c), T = mue J w^2. Several arcs in
    parallel count as one: stiffnesses and moments of inertia add up. Errors: ParameterError without coils.
    Source: A. Albers, Advanced development of dual mass flywheel (DMFW) design - noise control for today's automobiles, LuK Symposium.
    """

    coils: tuple[Coil, ...] = (Coil(), Coil())
    c: Parameter = parameter("N.m/rad", "Stiffness", default=400.0, above=0)
    J: Parameter = parameter("kg.m2", "Moment of inertia of the spring about the shaft", default=4e-3, above=0)
    mue: Parameter = parameter("1", "Coefficient of friction in the channel", default=0.1, min=0)
    wrap: Parameter = parameter("rad", "Angle of the arc", default=2.4, min=0)

    def check(self) -> Equations:
        """There is at least one coil."""
        yield len(self.coils) > 0  # it has coils

    def equations(self) -> Equations:
        """The coils in series."""
        share = len(self.coils)
        for coil in self.coils:
            yield coil.c == self.c * share
            yield self.J / share == coil.J
            yield coil.mue == self.mue
            yield coil.wrap == self.wrap / share
        yield connect(self.flange_a, self.coils[0].flange_a, *(coil.channel for coil in self.coils))
        for before, after in pairwise(self.coils):
            yield connect(before.flange_b, after.flange_a)
        yield connect(self.coils[-1].flange_b, self.flange_b)
