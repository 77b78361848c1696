"""Hills: an automatic car that rolls back in drive as its brakes are released, and the speeds at which a retarder holds a truck."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq

import powertrain as pt
from powertrain.components.body import LumpedAxle, RoadProfile, RollingAxle, VehicleBody
from powertrain.components.control import OpenPedals
from powertrain.components.differentials import CrownGear
from powertrain.components.engines import WillansEngine
from powertrain.components.rotational import IdealGear, Retarder
from powertrain.components.transmissions import Automatic
from powertrain.components.wheels import RigidWheel
from powertrain.vehicles.automatic_car import AutomaticCar


def rolled_back(grade: float, released: tuple[float, float], stop: float) -> pt.Result[AutomaticCar]:
    """The engine idles in first gear; the brake pedal goes from half to zero between two times."""
    road = RoadProfile(profile=pt.Map.constant(grade, x="s", x_unit="m", name="grade"))
    car = AutomaticCar.with_gearset(Automatic.eight_speed(), driver=OpenPedals(), road=road)
    brake = [0.0, *released, stop], [0.5, 0.5, 0.0, 0.0]
    return pt.simulate(car, stop, inputs={"driver.brake_pedal": brake}, rtol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("grade", [0.25])
def test_a_gradual_release_ends_in_the_same_motion_as_a_sudden_one(grade: float) -> None:
    """While the brakes ease, meshes, tyres and brakes reach their limits one after the other, and two planetary sets carry nothing.

    The same motion: the speed of the turbine at which the torque of the converter balances the weight.
    """
    gradual, sudden = rolled_back(grade, (1.0, 1.5), 9.0), rolled_back(grade, (1.0, 1.001), 9.0)
    assert np.max(gradual["body.v"][gradual.time > 2.0]) < 0
    assert gradual["body.v"][-1] == pytest.approx(sudden["body.v"][-1], rel=2e-3)
    assert pt.energy_audit(gradual).closure < 1e-6


MASS, RADIUS, CR, CD_A, FINAL, ETA, GEAR = 40e3, 0.5, 0.006, 5.4, 2.8, 0.97, 1.6


class Truck(pt.Component):
    """40 t on a slope, in gear with a closed throttle, and with the retarder at the propeller shaft fully applied."""

    grade: pt.Parameter = pt.parameter("1", "Slope", default=-0.06)
    body: VehicleBody = VehicleBody(m=MASS, A=9.0, Cd=CD_A / 9, wheelbase=5.0)
    rear: LumpedAxle = LumpedAxle(
        final_drive=CrownGear(ratio=FINAL, eta_ab=ETA, eta_ba=ETA), wheels=RigidWheel(radius=RADIUS, J=60, Cr=CR)
    )
    front: RollingAxle = RollingAxle(wheels=RigidWheel(radius=RADIUS, J=60, Cr=CR))
    retarder: Retarder = Retarder()
    gear: IdealGear = IdealGear(ratio=GEAR)
    engine: WillansEngine = WillansEngine.of_displacement("12.7 l", w_idle=55, w_fire=30)

    def equations(self) -> pt.Equations:
        for axle, flange, load in (
            (self.rear, self.body.rear, self.body.rear_load),
            (self.front, self.body.front, self.body.front_load),
        ):
            yield pt.connect(axle.axle, flange)
            yield pt.connect(load, axle.load)
        yield pt.connect(self.rear.pinion, self.retarder.flange, self.gear.flange_b)
        yield pt.connect(self.gear.flange_a, self.engine.crank)
        yield self.engine.throttle.value == 0
        yield self.body.grade.value == self.grade
        yield self.retarder.command.value == 1


def speeds(grade: float) -> list[float]:
    """The speeds at which the forces along the slope balance, with the engine above its idle speed."""
    engine = Truck().engine

    def excess(v: float) -> float:
        w = v * FINAL / RADIUS
        weight = MASS * 9.80665 / math.hypot(1, grade)
        driving = -weight * grade - CR * weight - 1.2 / 2 * CD_A * v**2
        held = min(3500 * min(w / 70, 1) ** 2, 350e3 / w) + GEAR * float(engine.motoring(GEAR * w))
        return driving * RADIUS / FINAL * ETA - held

    steps = np.linspace(7, 100, 1000)
    return [brentq(excess, low, high) for low, high in pairwise(steps) if excess(low) * excess(high) < 0]


@pytest.mark.slow
def test_a_retarder_with_a_limit_of_power_holds_a_truck_at_several_speeds() -> None:
    """It holds at a low speed and lets the truck run away from a higher one, up to that at which the air holds it.

    The laws of gears and brakes have nothing to do with it, so the message names none.
    """
    expected, plant = speeds(-0.055), pt.compile(Truck())
    assert len(expected) == 3
    found = pt.steady(plant, {"grade": [-0.03, -0.055]}, outputs=["body.v"])
    assert found["status"].values.tolist() == [0, 2]
    assert found["body.v"].values[0] == pytest.approx(speeds(-0.03)[0], rel=1e-9)
    assert "torques balance at several speeds" in found.attrs["problems"]
    assert ".mode" not in found.attrs["problems"]
    for near in expected:
        one = pt.steady(plant, {"grade": [-0.055]}, outputs=["body.v"], guesses={"body.v": near + 0.5}, first=True)
        assert one["body.v"].values[0] == pytest.approx(near, rel=1e-9)
