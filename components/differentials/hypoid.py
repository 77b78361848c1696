"""Hypoid gears, with an efficiency from their spiral angles or from a measured map."""

from __future__ import annotations

import math

import casadi as ca

from powertrain import Equations, Map, Parameter, Symbol, parameter
from powertrain.components.driving_side import mesh_losses
from powertrain.components.efficiency_map import mapped_efficiency
from powertrain.components.rotational.gear import LossyPair

AXES = {"w": "rad/s", "tau": "N.m", "T": "K"}
"""Arguments of a measured efficiency: |w_a|, |flange_a.tau|, the temperature of the heat port."""


class HypoidGear(LossyPair):
    """A hypoid pinion (flange_a) and its ring gear (flange_b), with the friction of their spiral angles or a map of efficiencies.

    phi_a = ratio phi_b,  flange_b.tau = -ratio (flange_a.tau - tauLoss)
      pinion drives: tauLoss = (1 - eta_ab) flange_a.tau,  ring gear drives: tauLoss = (1 - 1/eta_ba) flange_a.tau;
      w_a = 0: between the two
    eta_ab = (cos(alpha) + mue tan(beta_2))/(cos(alpha) + mue tan(beta_1))
    eta_ba = (cos(alpha) - mue tan(beta_1))/(cos(alpha) - mue tan(beta_2))

    The offset makes the spiral angle of the pinion beta_1 larger than that of the ring gear beta_2, and the teeth slide along their length
    at v_n (tan(beta_1) - tan(beta_2)). The loss is the friction of this sliding under the normal force; with beta_1 = beta_2 there is no
    offset (a spiral bevel gear) and no such loss. ``map_ab``, ``map_ba``: measured efficiencies in place of the formula, over any
    of w [rad/s] (magnitude of w_a), tau [N.m] (magnitude of flange_a.tau) and T [K] (heat port). The housing takes the torques.
    Source: G. Niemann, H. Winter, Maschinenelemente III, 2nd ed., Springer 1986 (gears with crossed axes and friction).

    Errors: ParameterError if beta_2 > beta_1, if the ring gear cannot drive, and for efficiencies outside (0, 1].

    >>> [round(eta, 4) for eta in HypoidGear(ratio=3.7).efficiencies()]
    [0.9732, 0.9707]
    """

    beta_1: Parameter = parameter("rad", "Spiral angle of the pinion", default=math.radians(48), min=0, max=1.4)
    beta_2: Parameter = parameter("rad", "Spiral angle of the ring gear", default=math.radians(30), min=0, max=1.4)
    alpha: Parameter = parameter("rad", "Pressure angle in the normal section", default=math.radians(20), min=0, max=1)
    mue: Parameter = parameter("1", "Coefficient of friction in the mesh", default=0.05, min=0, max=1)
    map_ab: Map | None = None
    map_ba: Map | None = None

    def check(self) -> Equations:
        """The pinion has the larger spiral angle, and the ring gear can drive it."""
        yield self.beta_1 >= self.beta_2
        yield self.mue * ca.tan(self.beta_1) < ca.cos(self.alpha)  # else the ring gear cannot drive

    def equations(self) -> Equations:
        """Kinematics, and the loss depending on the driving side."""
        values = {"w": ca.fabs(self.w_a), "tau": ca.fabs(self.flange_a.tau), "T": self.heat_port.T}
        ab, ba = self._formula()
        eta_ab = mapped_efficiency(self, "map_ab", ab, AXES, values)
        eta_ba = mapped_efficiency(self, "map_ba", ba, AXES, values)
        yield from self._mesh(*mesh_losses(self.flange_a.tau, eta_ab, eta_ba))

    def efficiencies(self) -> tuple[float, float]:
        """Efficiencies by the formula, pinion driving and ring gear driving."""
        ab, ba = self._formula()
        return float(ab), float(ba)

    def _formula(self) -> tuple[Symbol, Symbol]:
        normal, one, two = ca.cos(self.alpha), self.mue * ca.tan(self.beta_1), self.mue * ca.tan(self.beta_2)
        return (normal + two) / (normal + one), (normal - one) / (normal - two)
