"""A variable unit of two electric machines."""

from __future__ import annotations

import casadi as ca

from powertrain import Equations, Parameter, Symbol, Variable, der, parameter, variable, within
from powertrain.components.cvu.interfaces import VariableUnit


class ElectricVariator(VariableUnit):
    """Two electric machines on a common DC link: one at flange_b controls the speed ratio, one at flange_a keeps the link charged.

    T_b = -limited(k w_slide, tau_max_b),  w_slide = V w_a - w_b
    T_a = limited(P w_a/(w_a^2 + slow^2), tau_max_a),  P = -T_b w_b + copper T_b^2 + iron (w_a^2 + w_b^2) + k_E (E_0 - E)
    der(E) = T_a w_a + T_b w_b - losses,  losses = copper (T_a^2 + T_b^2) + iron (w_a^2 + w_b^2)
    limited(u, limit) = u/sqrt(1 + (u/limit)^2)

    The torque into each flange is positive if the machine generates. E is the energy in the link and E_0 its set point. P is what the link
    needs, without the copper loss of the machine at flange_a. At low speed of flange_a, and beyond its torque limit, the link discharges.
    An empty link ends a simulation with an error, and there is no operating point if copper T_a^2 - w_a T_a + (other losses - T_b w_b) = 0
    has no root within tau_max_a. The machines have quasi-static losses and no inertia. ``ratio`` may have any finite value, also zero
    (geared neutral); if flange_a passes rest, use ``ElectricPair``.
    """

    k: Parameter = parameter("N.m.s/rad", "Gain of the speed control", default=100.0, above=0)
    tau_max_a: Parameter = parameter("N.m", "Maximum torque of the machine at flange_a", default=300.0, above=0)
    tau_max_b: Parameter = parameter("N.m", "Maximum torque of the machine at flange_b", default=300.0, above=0)
    copper: Parameter = parameter("W/(N2.m2)", "Loss of each machine over its torque squared", default=0.05, min=0)
    iron: Parameter = parameter("W.s2/rad2", "Loss of each machine over its speed squared", default=2e-3, min=0)
    k_E: Parameter = parameter("1/s", "Gain of the control of the link's energy", default=50.0, above=0)
    E_0: Parameter = parameter("J", "Set point of the energy in the link", default=5e3, above=0)
    slow: Parameter = parameter(
        "rad/s", "Speed of flange_a below which the machine gives less power", default=1.0, above=0
    )
    E: Variable = variable("J", "Energy in the link")
    w_slide: Variable = variable("rad/s", "Error of the speed control at flange_b, V w_a - w_b", guess=0)
    tau_a: Variable = variable("N.m", "Torque of the machine at flange_a")
    tau_b: Variable = variable("N.m", "Torque of the machine at flange_b")

    def equations(self) -> Equations:
        """Speed control, link control, and energy balance of the link."""
        V = self._ratio()
        within(self.E, 0.0, ca.inf, name="energy in the link of the two machines", unit="J")
        yield from self._turn()
        yield self.w_slide == V * self.w_a - self.w_b
        yield self.tau_b == -_limited(self.k * self.w_slide, self.tau_max_b)
        rotating = self.copper * self.tau_b**2 + self.iron * (self.w_a**2 + self.w_b**2)
        needed = -self.tau_b * self.w_b + rotating + self.k_E * (self.E_0 - self.E)
        yield self.tau_a == _limited(needed * self.w_a / (self.w_a**2 + self.slow**2), self.tau_max_a)
        yield self.flange_a.tau == self.tau_a
        yield self.flange_b.tau == self.tau_b
        yield der(self.E) == self.tau_a * self.w_a + self.tau_b * self.w_b - self.loss()
        yield from self._dissipate()

    def initial(self) -> Equations:
        """The link is charged."""
        yield self.E == self.E_0

    def energy(self) -> Symbol:
        """Energy in the link."""
        return self.E

    def loss(self) -> Symbol:
        """Copper and iron losses of both machines."""
        return self.copper * (self.tau_a**2 + self.tau_b**2) + self.iron * (self.w_a**2 + self.w_b**2)


def _limited(value: Symbol, limit: Symbol) -> Symbol:
    return value / ca.sqrt(1 + (value / limit) ** 2)
