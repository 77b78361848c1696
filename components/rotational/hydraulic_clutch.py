"""Hydraulically pressed clutches: a piston that must be filled before it presses."""

from __future__ import annotations

import math

import casadi as ca

from powertrain import (
    Component,
    Equations,
    Input,
    Output,
    Parameter,
    Symbol,
    Variable,
    connect,
    der,
    parameter,
    signal_input,
    signal_output,
    support,
    switch,
    variable,
)
from powertrain.components.rotational.interfaces import TwoFlanges
from powertrain.components.rotational.wet_clutch import PlateDrag, WetClutch
from powertrain.components.thermal import HeatCapacitor, HeatPort, ThermalConductor


class ClutchPiston(Component):
    """The piston of a hydraulic clutch, from the pressure at its valve to the force on the plates, with fill, kiss point and drain.

    der(V) = Q,  Q = Q_valve dp/sqrt(p_valve sqrt(dp^2 + p_lam^2)),  dp = p_supply - p
    0 <= V <= V_0: p = F_0/A V/V_0;  beyond: s = (V - V_0)/A,  A p = F_0 + c s + fn,  fn = c_plates (s - s_kiss) for s > s_kiss, else 0

    The valve is an orifice with the flow Q_valve sqrt(dp/p_valve), laminar below p_lam. The volume V_0 (oil taken up by seals and air)
    is filled before the piston lifts off its stop at p = F_0/A. It then travels against the return spring to the kiss point at
    p = (F_0 + c s_kiss)/A; until there the pressure is just that of the spring. From there on it presses the plates, and the pressure
    follows the valve.
    Output: f_normalized = fn/fn_max, for ``Clutch``, ``WetClutch`` or ``Brake`` with the same fn_max.
    """

    p_supply: Input = signal_input("Pa", "Pressure behind the valve; below 0 it counts as 0")
    f_normalized: Output = signal_output("1", "Force on the plates over fn_max")
    fn_max: Parameter = parameter("N", "Force at f_normalized = 1", default=10e3, above=0)
    A: Parameter = parameter("m2", "Area of the piston", default=0.01, above=0)
    F_0: Parameter = parameter("N", "Preload of the return spring", default=800.0, above=0)
    c: Parameter = parameter("N/m", "Stiffness of the return spring", default=2e5, min=0)
    s_kiss: Parameter = parameter("m", "Travel of the piston to the kiss point", default=2e-3, above=0)
    c_plates: Parameter = parameter("N/m", "Stiffness of the plates and their wave springs", default=2e7, above=0)
    V_0: Parameter = parameter("m3", "Volume that is filled before the piston lifts", default=5e-7, above=0)
    Q_valve: Parameter = parameter("m3/s", "Flow through the valve at the pressure drop p_valve", default=3e-4, above=0)
    p_valve: Parameter = parameter("Pa", "Pressure drop at which the valve passes Q_valve", default=5e5, above=0)
    p_lam: Parameter = parameter("Pa", "Pressure difference below which the flow is laminar", default=2e3, above=0)
    V: Variable = variable("m3", "Oil in the chamber", start=0.0, nominal=1e-5)
    p: Variable = variable("Pa", "Pressure in the chamber", nominal=1e5)
    Q: Variable = variable("m3/s", "Flow into the chamber", nominal=1e-4)
    s: Variable = variable("m", "Travel of the piston", nominal=1e-3)
    fn: Variable = variable("N", "Force on the plates")

    def equations(self) -> Equations:
        """Balances of volume and of the piston's forces."""
        yield der(self.V) == self.Q
        yield self._orifice(ca.fmax(self.p_supply.value, 0) - self.p) == self.Q
        lifted = self.V / self.V_0 > 1  # a share, as a hysteresis in m3 would be felt in the pressure of a small volume
        yield self.s == switch(lifted, (self.V - self.V_0) / self.A, 0.0, continuous=True)
        spring = switch(lifted, self.F_0 + self.c * self.s, self.F_0 * self.V / self.V_0, continuous=True)
        pressed = self.c_plates * (self.s - self.s_kiss)
        yield self.fn == switch(self.s > self.s_kiss, pressed, 0.0, continuous=True, name="kiss")
        yield self.A * self.p == spring + self.fn
        yield self.f_normalized.value == self.fn / self.fn_max

    def _orifice(self, dp: Symbol) -> Symbol:
        return self.Q_valve * dp / ca.sqrt(self.p_valve * ca.sqrt(dp**2 + self.p_lam**2))

    @property
    def p_kiss(self) -> float:
        """Pressure at the kiss point [Pa]."""
        return (float(self.F_0) + float(self.c) * float(self.s_kiss)) / float(self.A)

    def fill_time(self, p_supply: float) -> float:
        """Time from empty to the kiss point [s] at a constant pressure [Pa], with turbulent flow; infinite if it is never reached.

        >>> round(ClutchPiston().fill_time(3e5), 4)
        0.1079
        """
        if p_supply < self.p_kiss:
            return math.inf
        low, A = float(self.F_0) / float(self.A), float(self.A)
        parts = ((0.0, low, float(self.V_0)), (low, self.p_kiss, A * float(self.s_kiss)))
        waits = [2 * V / (math.sqrt(p_supply - p) + math.sqrt(p_supply - q)) for p, q, V in parts]
        return sum(waits) * math.sqrt(float(self.p_valve)) / float(self.Q_valve)


class HydraulicClutch(TwoFlanges):
    """A wet clutch with its piston, the drag of its open plates, and their temperature.

    ``piston`` presses ``friction``; ``drag`` acts in parallel. The heat of both warms ``plates``, which ``cooling`` connects to the oil
    at the heat port. ``p_supply`` is the pressure behind the valve. fn_max of ``piston`` and ``friction`` must be equal.
    """

    p_supply: Input = signal_input("Pa", "Pressure behind the valve")
    heat_port: HeatPort = support(HeatPort)
    piston: ClutchPiston = ClutchPiston()
    friction: WetClutch = WetClutch(fn_max=10e3, cgeo=0.675)
    drag: PlateDrag = PlateDrag()
    plates: HeatCapacitor = HeatCapacitor(C=600)
    cooling: ThermalConductor = ThermalConductor(G=80)

    def check(self) -> Equations:
        """Piston and plates must have the same fn_max."""
        yield self.piston.fn_max == self.friction.fn_max

    def equations(self) -> Equations:
        """Two torques between the flanges, and one thermal mass."""
        yield connect(self.p_supply, self.piston.p_supply)
        yield connect(self.piston.f_normalized, self.friction.f_normalized)
        yield connect(self.flange_a, self.friction.flange_a, self.drag.flange_a)
        yield connect(self.flange_b, self.friction.flange_b, self.drag.flange_b)
        yield connect(self.friction.heat_port, self.drag.heat_port, self.plates.port, self.cooling.port_a)
        yield connect(self.cooling.port_b, self.heat_port)
