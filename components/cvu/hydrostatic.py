"""A variable unit of a hydraulic pump and a motor."""

from __future__ import annotations

import casadi as ca

from powertrain import Equations, Parameter, Symbol, Variable, der, friction, parameter, variable
from powertrain.components.cvu.interfaces import VariableUnit
from powertrain.components.limited import limited, magnitude

NEVER = 1e12
"""A pressure [Pa] that nothing reaches."""


class HydrostaticUnit(VariableUnit):
    """A pump with variable displacement (flange_a) that feeds a motor with fixed displacement (flange_b) in a closed circuit.

    D_a = V D_b;  C der(p) = D_a w_a - D_b w_b - leakage p - q_relief              (p: pressure difference; oil and hoses give way)
    |p| > p_max: q_relief = relief (p - p_max sign(p)),  else q_relief = 0
    T_a = V D_b p + d_a w_a + tau_a,   T_b = -D_b p + d_b w_b + tau_b
    w_a > 0: tau_a = mue D_full |p|,  w_a < 0: tau_a = -mue D_full |p|,  w_a = 0: between them;  tau_b the same with D_b and w_b
    D_full = V_full D_b

    Leakage is the volumetric loss (the speed ratio falls under load); mechanical losses are viscous and dry friction, the latter in
    proportion to the pressure: W. E. Wilson's three coefficients (Positive-Displacement Pumps and Fluid Motors, 1950). The dry friction is
    that of full displacement even if less is used, because pistons and valve plate are under pressure anyway; a pump at small displacement
    is inefficient. A ratio above V_full counts as full displacement.

    Two relief valves, one for each direction, connect both lines above the pressure ``p_max`` and so limit the torque of the motor to about
    D_b p_max. By default they stay closed at any pressure. The charge pump, which replaces the leakage, is not included:
    an ``AccessoryPump`` on the shaft of the pump takes its power.

    Lost: leakage p^2 + q_relief p + d_a w_a^2 + d_b w_b^2 + tau_a w_a + tau_b w_b; stored: C p^2/2.
    """

    D_b: Parameter = parameter("m3/rad", "Displacement of the motor", default=8e-6, above=0)
    V_full: Parameter = parameter("1", "Ratio at which the pump has its full displacement", default=1.0, above=0)
    leakage: Parameter = parameter("m3/(s.Pa)", "Leakage flow over pressure", default=1e-12, min=0)
    C: Parameter = parameter("m3/Pa", "Compliance of oil and hoses", default=5e-13, above=0)
    p_max: Parameter = parameter("Pa", "Pressure difference at which a relief valve opens", default=NEVER, above=0)
    relief: Parameter = parameter(
        "m3/(s.Pa)", "Flow of a relief valve over pressure beyond p_max", default=5e-10, min=0
    )
    d_a: Parameter = parameter("N.m.s/rad", "Viscous friction of the pump", default=0.0, min=0)
    d_b: Parameter = parameter("N.m.s/rad", "Viscous friction of the motor", default=0.0, min=0)
    mue: Parameter = parameter(
        "1", "Dry friction torque over full displacement times pressure", default=0.0, min=0, max=0.99
    )
    p: Variable = variable("Pa", "Pressure difference, positive when the pump drives forward", start=0.0)
    tau_a: Variable = variable("N.m", "Dry friction torque of the pump")
    tau_b: Variable = variable("N.m", "Dry friction torque of the motor")

    def equations(self) -> Equations:
        """Flow balance, and the torques of both machines."""
        V = self._ratio()
        yield from self._turn()
        yield self.C * der(self.p) == self.D_b * (V * self.w_a - self.w_b) - self.leakage * self.p - self._relieved()
        yield self.flange_a.tau == V * self.D_b * self.p + self.d_a * self.w_a + self.tau_a
        yield self.flange_b.tau == -self.D_b * self.p + self.d_b * self.w_b + self.tau_b
        motor = self.mue * self.D_b * magnitude(self.p)
        pump = motor * ca.fmax(self.V_full, ca.fabs(V))
        yield friction(self.w_a, self.tau_a, -pump, pump, name="mode_a")
        yield friction(self.w_b, self.tau_b, -motor, motor, name="mode_b")
        yield from self._dissipate()

    def _relieved(self) -> Symbol:
        """The flow through the relief valves [m3/s]."""
        return self.relief * (self.p - limited(self.p, -self.p_max, self.p_max))

    def energy(self) -> Symbol:
        """Energy of the compressed oil."""
        return self.C * self.p**2 / 2

    def loss(self) -> Symbol:
        """Leakage, relief valves, viscous and dry friction."""
        viscous = self.d_a * self.w_a**2 + self.d_b * self.w_b**2
        return (
            (self.leakage * self.p + self._relieved()) * self.p
            + viscous
            + self.tau_a * self.w_a
            + self.tau_b * self.w_b
        )
