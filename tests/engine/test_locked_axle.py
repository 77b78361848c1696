"""A differential whose sides are tied to each other by the numbers: its friction moves nothing, its torque at rest is not determined."""

from __future__ import annotations

import pytest
from cases import few

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Ramp
from powertrain.components.body import VehicleBody
from powertrain.components.differentials import BevelDifferential, CrownGear, Differential
from powertrain.components.wheels import RigidWheel, Wheel, WheelBrake


class TwoWheels(pt.Component):
    """Two rigid wheels behind a differential on one body; they start, and brake to rest."""

    drive: rot.Torque = rot.Torque()
    pull: Ramp = Ramp(height=200, duration=1, startTime=0.5)
    stop: Ramp = Ramp(height=0.5, duration=0.2, startTime=2)
    cage: rot.Inertia = rot.Inertia(J=0.1)
    differential: Differential = BevelDifferential(eta=0.95)
    brakes: tuple[WheelBrake, WheelBrake] = (WheelBrake(tau_max=1500), WheelBrake(tau_max=1500))
    left: Wheel = RigidWheel(load_nominal=4000, J=1)
    right: Wheel = RigidWheel(load_nominal=4000, J=1)
    rear: Wheel = RigidWheel(load_nominal=4000, J=1)
    body: VehicleBody = VehicleBody()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.pull.y, self.drive.tau)
        yield pt.connect(self.drive.flange, self.cage.flange_a)
        yield pt.connect(self.cage.flange_b, self.differential.crown)
        hubs = (self.differential.left, self.differential.right)
        for side, brake, wheel in zip(hubs, self.brakes, (self.left, self.right), strict=True):
            yield pt.connect(side, brake.flange_a)
            yield pt.connect(brake.flange_b, wheel.hub)
            yield pt.connect(wheel.road, self.body.front)
            yield pt.connect(self.stop.y, brake.demand)
        yield pt.connect(self.rear.road, self.body.rear)


@pytest.mark.parametrize("eta", few([1.0, 0.95]))
def test_two_rigid_wheels_behind_a_differential(eta: float) -> None:
    """The torque is shared alike, and nothing chatters."""
    result = pt.simulate(pt.replace(TwoWheels(), differential=BevelDifferential(eta=eta)), 4.0)
    assert result["body.v"].max() > 0.3
    assert abs(result["body.v"][-1]) < 1e-9
    assert result["differential.left.tau"] == pytest.approx(result["differential.right.tau"], abs=1e-3)
    assert len(result.events) < 20


def test_the_lock_ends_with_other_parameters() -> None:
    """With ratios that differ by parameters of the run the same plant lets the mesh move."""
    plant = pt.compile(Tied())
    locked, free = plant.simulate(1.0), plant.simulate(1.0, parameters={"outer.ratio": 1.1, "inner.ratio": 0.9})
    assert locked["car.w"][-1] == pytest.approx(100 / 50, rel=1e-9)
    assert (locked["differential.mesh.mode"] == 0).all()
    assert (free["differential.mesh.mode"][1:] != 0).all()


class Tied(pt.Component):
    """Both sides drive one flywheel."""

    differential: Differential = BevelDifferential(eta=0.95)
    drive: rot.ConstantTorque = rot.ConstantTorque(tau_constant=100)
    outer: rot.IdealGear = rot.IdealGear(ratio=1.0)
    inner: rot.IdealGear = rot.IdealGear(ratio=1.0)
    car: rot.Inertia = rot.Inertia(J=50)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.differential.crown)
        yield pt.connect(self.differential.left, self.outer.flange_a)
        yield pt.connect(self.differential.right, self.inner.flange_a)
        yield pt.connect(self.outer.flange_b, self.inner.flange_b, self.car.flange_a)


class BetweenBrakes(pt.Component):
    """A torque on a shaft between two gears, both of which end at a brake."""

    left: rot.Brake = rot.Brake(fn_max=50, mue_pos=((0.0, 1.0),))
    right: rot.Brake = rot.Brake(fn_max=50, mue_pos=((0.0, 1.0),))
    one: CrownGear = CrownGear(ratio=-2)
    other: CrownGear = CrownGear(ratio=3)
    ends: tuple[rot.Inertia, rot.Inertia] = (rot.Inertia(J=0.1), rot.Inertia(J=0.1))
    shaft: rot.Inertia = rot.Inertia(J=1)
    torque: rot.ConstantTorque = rot.ConstantTorque(tau_constant=10)
    press: pt.Input = pt.signal_input("1", "Pressure of both brakes")

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque.flange, self.shaft.flange_a, self.one.flange_a)
        yield pt.connect(self.shaft.flange_b, self.other.flange_a)
        for gear, brake, end in zip((self.one, self.other), (self.left, self.right), self.ends, strict=True):
            yield pt.connect(gear.flange_b, brake.flange_a)
            yield pt.connect(brake.flange_b, end.flange_a)
            yield pt.connect(self.press, brake.f_normalized)


def test_brakes_behind_lossless_gears_share() -> None:
    """As equally compliant parts would: tau_i/ratio_i is the same for both, so each holds half of the torque on the shaft."""
    result = pt.simulate(BetweenBrakes(), 1.0, inputs={"press": 1.0})
    assert result["one.flange_a.tau"][-1] == pytest.approx(5.0, abs=1e-6)
    assert result["other.flange_a.tau"][-1] == pytest.approx(5.0, abs=1e-6)
