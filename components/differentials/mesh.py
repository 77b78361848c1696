"""The mesh law: one law for every differential with two degrees of freedom, from planetary gears to cam differentials.

D. Yu, N. Beachley, Mechanical efficiency of differential gearing, Gear Technology (July/August 1986) 9-16, 48.
"""

from __future__ import annotations

import casadi as ca

from powertrain import (
    Equations,
    Map,
    Parameter,
    ParameterError,
    Symbol,
    Variable,
    der,
    friction,
    parameter,
    variable,
)
from powertrain.components.differentials.interfaces import ThreeMembers
from powertrain.components.driving_side import mesh_losses
from powertrain.components.efficiency_map import mapped_efficiency
from powertrain.components.rotational.interfaces import Lossy

AXES = {"w_rel": "rad/s", "tau": "N.m", "angle": "rad", "T": "K"}
"""Arguments of an efficiency: |w_a - w_h|, |T_a|, the angle of a against the carrier, the temperature; with their units."""

JUMP = 1e-9
"""Efficiencies that differ by less are equal."""


class MeshLaw(ThreeMembers, Lossy):
    """Partial: members a and b in mesh, directly or through planets, on a carrier, with a loss determined by latent power.

    w_rel = w_a - w_h = R_o (w_b - w_h);  T_a + T_b + T_h = 0;  T_b = -R_o (T_a - tauLoss)

    The friction power is the same with the carrier imagined at rest, because neither torques nor relative speeds change (p. 12).
    P_a^h = T_a w_rel is then the latent power of a (eq. 5). If a drives (P_a^h > 0), the efficiency eta_ab gives T_b/T_a = -R_o eta_ab
    (eqs. 11-12); if b drives (P_a^h < 0), T_b/T_a = -R_o/eta_ba (eqs. 17-18). So tauLoss = (1 - eta_ab) T_a or (1 - 1/eta_ba) T_a, and the
    loss tauLoss w_rel is never negative. Without relative motion there is no loss: the mesh is stuck, tauLoss is between its values for
    forward and backward motion, and the members turn as a block.

    R_o < 0 is the type 2K-H(-), R_o > 0 the types 2K-H(+) and KHV. For eta_ba < R_o < 1/eta_ab the carrier can drive but not be driven:
    neither a nor b can move it while the other is held. The gear is self-locking. If a torque has to pass through it, there is no
    solution, or there are several, and the simulation reports this.

    ``map_ab``, ``map_ba``: efficiencies that depend on the operating point, in place of eta_ab, eta_ba. Their axes are any of
    w_rel [rad/s] (magnitude), tau [N.m] (magnitude of T_a), angle [rad] (of a against the carrier; periodic over the axis, with equal
    values at its ends), T [K] (of the heat port). Errors: ParameterError for other axes, or values outside (0, 1].
    """

    ratio: Parameter = parameter("1", "Basic speed ratio R_o = (w_a - w_h)/(w_b - w_h)", exclude=(0.0, 1.0))
    eta_ab: Parameter = parameter("1", "Efficiency from a to b, carrier fixed", default=1.0, above=0, max=1)
    eta_ba: Parameter = parameter("1", "Efficiency from b to a, carrier fixed", default=1.0, above=0, max=1)
    map_ab: Map | None = None
    map_ba: Map | None = None
    w_rel: Variable = variable("rad/s", "Speed of a against the carrier")
    tauLoss: Variable = variable("N.m", "Torque loss, counted at a")

    def _mesh(self) -> Equations:
        relative = self.a.phi - self.carrier.phi
        yield relative == self.ratio * (self.b.phi - self.carrier.phi)
        yield self.w_rel == der(relative)
        yield self.a.tau + self.b.tau + self.carrier.tau == 0
        yield self.b.tau == -self.ratio * (self.a.tau - self.tauLoss)
        eta_ab, eta_ba = self._efficiency("map_ab", self.eta_ab), self._efficiency("map_ba", self.eta_ba)
        yield friction(self.w_rel, self.tauLoss, *mesh_losses(self.a.tau, eta_ab, eta_ba))
        yield from self._dissipate()

    def _efficiency(self, name: str, constant: Symbol) -> Symbol:
        """The map if there is one, else the constant."""
        given: Map | None = getattr(self, name)
        values = {"w_rel": ca.fabs(self.w_rel), "tau": ca.fabs(self.a.tau), "T": self.heat_port.T}
        for axis in given.axes if given else ():
            if axis.name == "angle":
                turned, period = self.a.phi - self.carrier.phi - axis.low, axis.high - axis.low
                values["angle"] = axis.low + turned - period * ca.floor(turned / period)
        found = mapped_efficiency(self, name, constant, AXES, values)
        if given:
            _check_period(given, f"{self._label}.{name}")
        return found

    def loss(self) -> Symbol:
        """Torque loss times relative speed."""
        return self.tauLoss * self.w_rel


class Mesh(MeshLaw):
    """Two members a and b in mesh on a carrier, with a basic speed ratio: the law of every two-degree-of-freedom differential.

    w_a - w_h = R_o (w_b - w_h),  T_a + T_b + T_h = 0,  T_b = -R_o eta_ab T_a if a drives, -R_o T_a/eta_ba if b drives

    It also represents a single pair of wheels in more complex sets: teeth Z_a, Z_b give R_o = -Z_b/Z_a for an external pair, +Z_b/Z_a
    for an internal pair, and either member may be a planet (its flange turns with the planet's absolute speed).
    """

    def equations(self) -> Equations:
        """Kinematics, balance and the loss that opposes the relative motion."""
        yield from self._mesh()


def _check_period(given: Map, where: str) -> None:
    """Reject a map that jumps where the angle starts over."""
    for k, axis in enumerate(given.axes):
        jump = abs(given.values.take(-1, axis=k) - given.values.take(0, axis=k)).max()
        if axis.name == "angle" and jump > JUMP:
            raise ParameterError(
                f"{where}: over the angle the map is periodic, from {axis.low:g} rad to {axis.high:g} rad, and must end with the values it "
                f"begins with; they differ by up to {jump:g}"
            )
