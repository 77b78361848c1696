"""Bounds k |T| written with a switch stand the wrong way round until the switch has followed the torque."""

from __future__ import annotations

import powertrain as pt
from powertrain.components.rotational import ConstantTorque, Fixed, Flange, Inertia


class Half(pt.Component):
    """A differential that locks by its load."""

    crown: Flange = pt.port(Flange)
    left: Flange = pt.port(Flange)
    right: Flange = pt.port(Flange)
    kappa: pt.Parameter = pt.parameter("1", "Locking coefficient", default=1.94)
    w_rel: pt.Variable = pt.variable("rad/s", "Relative speed", prefer=True)
    tau: pt.Variable = pt.variable("N.m", "Friction torque")

    def equations(self) -> pt.Equations:
        yield self.left.phi + self.right.phi == 2 * self.crown.phi
        yield self.w_rel == pt.der(self.left.phi - self.right.phi)
        yield self.left.tau == self.tau - self.crown.tau / 2
        yield self.right.tau == -self.tau - self.crown.tau / 2
        limit = self.kappa / 2 * pt.switch(self.crown.tau >= 0, self.crown.tau, -self.crown.tau, continuous=True)
        yield pt.friction(self.w_rel, self.tau, -limit, limit)


class Bench(pt.Component):
    """One side clamped, a light one pushed, a heavy cage driven."""

    half: Half = Half()
    clamp: Fixed = Fixed()
    cage: Inertia = Inertia(J=10)
    drive: ConstantTorque = ConstantTorque(tau_constant=100)
    side: Inertia = Inertia(J=0.01)
    assist: ConstantTorque = ConstantTorque(tau_constant=20)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.half.right, self.clamp.flange)
        yield pt.connect(self.half.crown, self.cage.flange_a)
        yield pt.connect(self.cage.flange_b, self.drive.flange)
        yield pt.connect(self.half.left, self.side.flange_a)
        yield pt.connect(self.side.flange_b, self.assist.flange)


def test_stuck_law_does_not_break_loose_while_its_bounds_are_inverted() -> None:
    """Held, the friction torque is 20 N.m + 100 N.m/2 = 70 N.m, less than 0.97 of the load."""
    result = pt.simulate(Bench(), 1.0)
    assert result["half.mode"][-1] == 0
    assert abs(result["half.tau"][-1] - 70) < 1e-9
    assert abs(result["cage.w"][-1]) < 1e-12
