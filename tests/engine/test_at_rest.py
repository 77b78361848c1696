"""Cars at rest: lossy gears in a row without torque, a law of no width beside others, laws that are about to slide."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from cases import few
from joined import joined

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Constant, Ramp, Sine, Step, TimeTable
from powertrain.components.body import AxlePath, DrivenAxle, RoadProfile, VehicleBody
from powertrain.components.differentials import BevelDifferential, CrownGear, Differential, PlanetaryGear
from powertrain.components.rotational import TwoFlanges
from powertrain.components.transmissions import Shiftable
from powertrain.components.wheels import RigidWheel, SlipWheel, Wheel
from powertrain.vehicles.rear_drive import RearDriveCar
from powertrain.vehicles.split_path_car import SplitPathCar

HILL = RoadProfile(profile=pt.Map.constant(0.1, x="s", x_unit="m", name="grade"))


def on(road: RoadProfile, gear: TwoFlanges, **axle: Any) -> RearDriveCar:
    """A car at rest with its clutch open: its engine idles."""
    return RearDriveCar.in_one_gear(gearbox=Geared(gear=gear), road=road, rear=DrivenAxle(**axle))


class Geared(Shiftable):
    """A gear as a gearbox."""

    gear: TwoFlanges
    input: rot.Inertia = rot.Inertia(J=0.02)

    @property
    def gear_count(self) -> int:
        """One."""
        return 1

    def equations(self) -> pt.Equations:
        """A shaft and a gear."""
        yield pt.connect(self.flange_a, self.input.flange_a)
        yield pt.connect(self.input.flange_b, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.flange_b)


@pytest.mark.slow
def test_two_lossy_gears_in_a_row_stand_still_without_torque() -> None:
    """With the clutch open nothing is left of the bounds of gearbox and crown gear: no fraction of them can be told."""
    lossy = rot.Gear(ratio=3.5, efficiency=0.97)
    for road in (RoadProfile(), HILL):
        result = pt.simulate(on(road, lossy), 1.0, inputs={"driver.brake_pedal": 0.3})
        assert abs(result["body.v"][-1]) < 1e-9
    assert pt.simulate(on(HILL, lossy), 1.0)["body.v"][-1] < -0.8


@pytest.mark.slow
def test_two_gears_without_loss_in_a_row_roll_back() -> None:
    crown = CrownGear(ratio=3.9)
    ways = [
        pt.simulate(on(HILL, gear, final_drive=crown), 1.0)["body.v"][-1]
        for gear in (rot.Gear(ratio=3.5), rot.IdealGear(ratio=3.5))
    ]
    assert ways[0] == pytest.approx(ways[1], rel=1e-6)
    assert ways[0] < -0.8


@pytest.mark.slow
def test_crown_gear_without_loss_and_wheels_with_slip_in_the_split_path_car() -> None:
    """Both cars start at 11 s; the loss of the crown gear and the slip change little of their speed."""
    lossless = pt.simulate(pt.replace(SplitPathCar(), {"front.final_drive": CrownGear(ratio=4.5)}), 16.0)
    wheels = {"front.wheels": SlipWheel(J=2.0), "rear.wheels": SlipWheel(J=2.0)}
    slipping = pt.simulate(pt.replace(SplitPathCar(), wheels), 16.0)
    usual = pt.simulate(SplitPathCar(), 16.0)
    for result in (lossless, slipping):
        assert np.abs(result["body.v"][result.time < 11.0]).max() < 1e-9
        assert result["body.v"][-1] == pytest.approx(usual["body.v"][-1], rel=0.02)


class CarInBend(pt.Component):
    """A car on two rigid wheels that enters a bend."""

    drive: rot.ConstantTorque = rot.ConstantTorque(tau_constant=0)
    body: VehicleBody = VehicleBody()
    differential: Differential = BevelDifferential(eta=0.95)
    path: AxlePath = AxlePath(track=1.4)
    left: Wheel = RigidWheel(load_nominal=4000)
    right: Wheel = RigidWheel(load_nominal=4000)
    curve: pt.Component = Ramp(height=1 / 7, duration=2, startTime=1)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.curve.y, self.path.curvature)  # type: ignore[attr-defined]
        yield pt.connect(self.drive.flange, self.differential.crown)
        yield pt.connect(self.differential.left, self.left.hub)
        yield pt.connect(self.differential.right, self.right.hub)
        yield pt.connect(self.path.left, self.left.road)
        yield pt.connect(self.path.right, self.right.road)
        yield pt.connect(self.path.axle, self.body.front)


@pytest.mark.parametrize(("torque", "speed"), few([(0.0, 0.0), (200.0, 0.0), (200.0, 5.0), (-200.0, 5.0)]))
def test_rigid_wheels_enter_a_bend(torque: float, speed: float) -> None:
    """At rest, or moving: the motion within the differential is prescribed by the path."""
    car = CarInBend(drive=rot.ConstantTorque(tau_constant=torque))
    result = pt.simulate(car, 4.0, starts={"body.v": speed})
    lead = 1.4 / 2 / 7
    assert result["right.w"][-1] * (1 - lead) == pytest.approx(result["left.w"][-1] * (1 + lead), abs=1e-9)
    assert (abs(result["body.v"][-1]) < 1e-9) == (torque == speed == 0.0)


class Ending(pt.Component):
    """A lossy gear between two inertias that a damper brings to rest: all torques and bounds end with the speed."""

    first: rot.Inertia = rot.Inertia(J=1.0)
    gear: rot.Gear = rot.Gear(ratio=2.0, efficiency=0.9)
    second: rot.Inertia = rot.Inertia(J=1.0)
    damper: rot.Damper = rot.Damper(d=1.0)
    wall: rot.Fixed = rot.Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.first.flange_b, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.second.flange_a)
        yield pt.connect(self.second.flange_b, self.damper.flange_a)
        yield pt.connect(self.damper.flange_b, self.wall.flange)


@pytest.mark.parametrize("w", [10.0, -10.0])
def test_exponential_end_of_a_motion(w: float) -> None:
    result = pt.simulate(Ending(), 400.0, starts={"first.w": w})
    assert abs(result["first.w"][-1]) < 1e-8
    assert len(result.events) < 50


@pytest.mark.parametrize("w", [1.0, 4.7])
def test_a_freewheel_between_shafts_that_come_to_rest(w: float) -> None:
    """The braked shaft ends exponentially; what the integration leaves of its speed, of either sign, does not block the freewheel."""
    braked, drag = rot.Inertia(J=0.5), rot.SignTorque(tau_nominal=-3.0)
    joints = "0.flange_a=1.flange_a=2.flange 1.flange_b=3.flange_a"
    model = joined(braked, rot.Freewheel(), drag, rot.Inertia(J=0.6), joints=joints)
    result = pt.simulate(model, 5.0, starts={"parts[1].w_rel": w, "parts[3].w": 0.0})
    assert len(result.events) == 0
    assert abs(result["parts[1].w_rel"][-1]) < 1e-7


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8])
def test_a_bearing_behind_a_filter_keeps_its_direction_while_the_speed_ends(rtol: float) -> None:
    """What is integrated passes zero any number of times within its error; the true speed never does."""
    bearing = rot.BearingFriction(tau_pos=((0.0, 1.0),))
    joints = "0.flange=1.flange_a=2.flange_a 3.y=0.w_ref"
    stopped = Step(offset=3.0, height=-3.0, startTime=0.1)
    model = joined(rot.Speed(), rot.Inertia(J=1.0), bearing, stopped, joints=joints)
    result = pt.simulate(model, 2.0, rtol=rtol)
    assert [e.name for e in result.events] == ["parts[3].switch0"]
    assert result["parts[2].tau"][-1] == 1.0


@pytest.mark.parametrize(("c", "d"), [(1e4, 300.0), (1e3, 300.0), (3e3, 1e3)])
def test_a_shaft_that_ends_at_the_limit_of_its_bearing(c: float, d: float) -> None:
    """An overdamped spring and the bearing balance the torque as the speed ends; the error of that speed does not reverse the bearing."""
    parts = rot.BearingFriction(tau_pos=((0.0, 1.0),)), rot.SpringDamper(c=c, d=d), rot.Fixed()
    joints = "0.flange_a=1.flange_a=2.flange_b=4.flange 2.flange_a=3.flange"
    model = joined(rot.Inertia(J=1.0), *parts, rot.ConstantTorque(tau_constant=3.0), joints=joints)
    for rtol in (1e-4, 1e-6):
        result = pt.simulate(model, 30.0, rtol=rtol, starts={"parts[0].w": 1.0})
        assert len(result.events) <= 1
        assert 2.0 - 1e-5 < result["parts[2].tau"][-1] < 4.0 + 1e-5
        assert abs(result["parts[0].w"][-1]) < 1e-9


@pytest.mark.parametrize("J", few([1e-5, 1e-3, 1e-7]))
def test_a_gearset_at_rest_takes_few_steps(J: float) -> None:
    """What is held by clutches on both sides shares nothing but noise through its meshes, which no step resolves."""
    sets = [PlanetaryGear(ratio=ratio, eta_ab=0.98, eta_ba=0.98) for ratio in (1.5, 3.2)]
    shafts = [rot.Inertia(J=J) for J in (1.0, 0.1, J, J)]
    drive = rot.Torque(), TimeTable(table=((0.0, 0.0), (0.25, 50.0)))
    brakes = [rot.Brake(fn_max=limit, mue_pos=((0.0, 1.0),)) for limit in (110.0, 15.0)]
    clutches = [rot.Clutch(fn_max=limit, mue_pos=((0.0, 1.0),)) for limit in (17.0, 40.0, 72.0)]
    joints = (
        "0.carrier=2.flange_a=10.flange_a 0.ring=1.ring=4.flange_a=12.flange_a 1.carrier=5.flange_a=11.flange_b 7.y=6.tau "
        "0.sun=1.sun=3.flange_a=6.flange=8.flange_a=9.flange_a=10.flange_b=11.flange_a=12.flange_b "
        "13.y=8.f_normalized 14.y=9.f_normalized=10.f_normalized=11.f_normalized=12.f_normalized"
    )
    parts = (*sets, *shafts, *drive, *brakes, *clutches, Constant(k=1.0), Sine(f=6.0))
    plant = pt.compile(joined(*parts, joints=joints))
    usual, fine = plant.simulate(0.3), plant.simulate(0.3, max_step=1e-3)
    assert usual.statistics["steps"] + usual.statistics["rejected"] < 100
    assert [(e.name, e.new) for e in usual.events] == [(e.name, e.new) for e in fine.events]
    np.testing.assert_allclose([e.time for e in usual.events], [e.time for e in fine.events], atol=1e-9)
    assert np.abs(usual["parts[3].w"]).max() < 1e-9
