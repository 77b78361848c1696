"""A split-path transmission on a test bench, and its closed form by Yu & Beachley 1986."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

import powertrain as pt
from powertrain.components.rotational import ConstantSpeed, Torque
from powertrain.components.transmissions import SplitPathTransmission, members, relative_ratio


class Bench(pt.Component):
    """A transmission driven at a constant speed and loaded by a torque."""

    V: pt.Input = pt.signal_input("1", "Ratio of the variable unit")
    load: pt.Input = pt.signal_input("N.m", "Accelerating torque on the output")
    r: pt.Variable = pt.variable("1", "Speed of the output over speed of the input")
    efficiency: pt.Variable = pt.variable("1", "Output power over input power")
    K: pt.Variable = pt.variable("1", "Power into the variable unit over input power, negative from 2 to 1")
    drive: ConstantSpeed = ConstantSpeed(w_fixed=100.0)
    transmission: SplitPathTransmission = SplitPathTransmission()
    torque: Torque = Torque()

    def equations(self) -> pt.Equations:
        """Connections, and what the paper looks at."""
        yield pt.connect(self.drive.flange, self.transmission.flange_a)
        yield pt.connect(self.torque.flange, self.transmission.flange_b)
        yield pt.connect(self.V, self.transmission.ratio)
        yield pt.connect(self.load, self.torque.tau)
        yield self.r * self.drive.w == pt.der(self.torque.phi)
        power, unit = self.transmission.flange_a.power(), self.transmission.cvu
        yield self.efficiency * power == -self.transmission.flange_b.power()
        at_2 = -unit.flange_b.power()
        yield self.K * power == pt.switch(at_2 >= 0, unit.flange_a.power(), at_2)


class Solution(NamedTuple):
    """Ratio of the unit, total efficiency, K by eq. (29), input torque, torques of a, b and carrier."""

    V: Any
    efficiency: Any
    K: Any
    tau: Any
    T: dict[str, Any]


def closed_form(layout: str, R_o: float, eta: float, eta_v: float, r: Any, load: Any) -> Solution:
    """Input-coupled, at positive input speed, output not on the carrier; eqs. (5)-(29)."""
    one, two, three = members(layout)
    R = relative_ratio(layout, R_o)
    V = (r - R) / (1 - R)
    speed = {one: 1.0, two: V, three: r}
    latent = load * (speed[three] - speed["carrier"])
    if three == "a":
        T_a = load
        T_b = -R_o * np.where(latent > 0, eta, 1 / eta) * T_a
    else:
        T_b = load
        T_a = -np.where(latent > 0, eta, 1 / eta) * T_b / R_o
    T = {"a": T_a, "b": T_b, "carrier": -T_a - T_b}
    P_2 = T[two] * V
    unit = P_2 * np.where(P_2 > 0, 1 / eta_v, eta_v)
    tau = T[one] + unit
    return Solution(V, -load * r / tau, np.where(P_2 > 0, unit, P_2) / tau, tau, T)
