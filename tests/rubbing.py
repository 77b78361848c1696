"""A bearing that rests under a prescribed motion, and outputs of many kinds that depend on its torque."""

from __future__ import annotations

from typing import Any

import numpy as np

import powertrain as pt
from powertrain.components import rotational as rot

LIMIT = 2.0


class Rubbing(pt.Component):
    """A bearing on a shaft whose speed is given, under a load; what the motor has to give, and what is computed from that."""

    load: pt.Input = pt.signal_input("N.m", "Load")
    w: pt.Input = pt.signal_input("rad/s", "Speed")
    motor: rot.Speed = rot.Speed(exact=True)
    bearing: rot.BearingFriction = rot.BearingFriction(tau_pos=((0.0, LIMIT),))
    pull: rot.Torque = rot.Torque()
    tau: pt.Variable = pt.variable("N.m", "Torque of the motor")
    affine: pt.Variable = pt.variable("1", "Affine in the torque")
    parabola: pt.Variable = pt.variable("1", "With a minimum")
    bump: pt.Variable = pt.variable("1", "With a maximum")
    rising: pt.Variable = pt.variable("1", "Bent, without an extremum")
    size: pt.Variable = pt.variable("1", "With a kink")
    pole: pt.Variable = pt.variable("1", "With a pole whose sign changes")
    even: pt.Variable = pt.variable("1", "With a pole upwards from both sides")
    struck: pt.Variable = pt.variable("1", "With a pole at one of the torques that are tried")

    def equations(self) -> pt.Equations:
        yield pt.connect(self.w, self.motor.w_ref)
        yield pt.connect(self.motor.flange, self.bearing.flange_a)
        yield pt.connect(self.bearing.flange_b, self.pull.flange)
        yield pt.connect(self.load, self.pull.tau)
        yield self.tau == self.bearing.tau - self.load.value
        yield self.struck == 1 / (self.tau - 1)
        for name, formula in FORMULAS.items():
            yield getattr(self, name) == formula(self.tau)


FORMULAS: dict[str, Any] = {
    "affine": lambda tau: 3 * tau + 1,
    "parabola": lambda tau: (tau - 0.37) ** 2,
    "bump": lambda tau: 1 / (1 + (tau + 0.2) ** 2),
    "rising": lambda tau: tau**3 + 0.1 * tau,
    "size": lambda tau: (
        pt.switch(tau > 0.5, tau - 0.5, 0.5 - tau, continuous=True)
        if not isinstance(tau, np.ndarray)
        else np.abs(tau - 0.5)
    ),
    "pole": lambda tau: 1 / (tau - 0.1234567),
    "even": lambda tau: 1 / (tau - 0.1234567) ** 2,
}
