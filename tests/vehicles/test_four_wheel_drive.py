"""The 4x4: what its centre differential shares, ice under one axle, a bend, rest on a slope."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.body import CentreDifferential, RoadProfile
from powertrain.components.differentials import BevelDifferential, Differential, LimitedSlipDifferential
from powertrain.components.gearless.circular_cam import CircularCamDifferential
from powertrain.components.rotational import Inertia, Torque
from powertrain.vehicles.four_wheel_drive import FourWheelDriveCar

CENTRES: dict[str, Differential] = {
    "bevel": BevelDifferential(eta=0.97),
    "limited slip": LimitedSlipDifferential(preload=100, bias_drive=2.5, bias_coast=1.5),
    "locking cam": CircularCamDifferential(mu=0.2),
}
ICE = {f"front.{side}.mu": 0.1 for side in ("left", "right")}
WHEELS = [f"{axle}.{side}" for axle in ("front", "rear") for side in ("left", "right")]


@lru_cache
def plant(name: str) -> pt.Plant[FourWheelDriveCar]:
    return pt.compile(pt.replace(FourWheelDriveCar.in_one_gear(), {"transfer.differential": CENTRES[name]}))


def drive(name: str, stop: float = 3.0, v: float = 3.0, **options: Any) -> Any:
    return plant(name).simulate(stop, starts={"body.v": v, "engine.w": v / 0.3 * 3.5 * 3.9}, **options)


class Pulled(pt.Component):
    """The centre differential of the library, with a torque that turns the axles against each other."""

    against: pt.Parameter = pt.parameter("N.m", "Torque forward at the front and backward at the rear", default=1.0)
    case: CentreDifferential = CentreDifferential()
    engine: Inertia = Inertia(J=0.1)
    front: Inertia = Inertia(J=2.0)
    rear: Inertia = Inertia(J=2.0)
    forward: Torque = Torque()
    backward: Torque = Torque()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.flange_b, self.case.input)
        yield pt.connect(self.case.front, self.front.flange_a, self.forward.flange)
        yield pt.connect(self.case.rear, self.rear.flange_a, self.backward.flange)
        yield self.forward.tau.value == self.against
        yield self.backward.tau.value == -self.against


def test_the_centre_rests_without_load() -> None:
    """2 N.m of friction: less than half of it, which the shafts double, turns nothing; of a larger torque the rest accelerates."""
    plant = pt.compile(Pulled())
    options: Any = {"starts": {"engine.w": 0.0}, "rtol": 1e-9}
    assert abs(plant.simulate(1.0, parameters={"against": 0.9}, **options)["case.differential.w_rel"]).max() < 1e-12
    moved = plant.simulate(1.0, parameters={"against": 3.0}, **options)
    assert moved.at(1.0, lambda m: m.front.w - m.rear.w) == pytest.approx(
        2 * (3.0 - 2.0) / 2.0, rel=5e-2
    )  # the shafts still vibrate


@pytest.mark.slow
@pytest.mark.parametrize("name", CENTRES)
def test_ice_under_the_front(name: str) -> None:
    """An open centre differential lets the front spin; one that locks drives with the rear."""
    result = drive(name, parameters=ICE, inputs={"driver.accelerator_pedal": 0.8})
    front, rear = (-result[f"transfer.differential.{side}.tau"] for side in ("left", "right"))
    late = result.time > 1.5
    if name == "bevel":
        assert result["front.left.v_slip"][-1] > 5
        np.testing.assert_allclose(front[late], 0.97 * rear[late], rtol=1e-6)
    else:
        assert np.abs(result["front.left.v_slip"]).max() < 1
        assert (rear > front)[late].all()
        assert (
            result["body.v"][-1]
            > drive("bevel", parameters=ICE, inputs={"driver.accelerator_pedal": 0.8})["body.v"][-1]
        )


@pytest.mark.slow
@pytest.mark.parametrize("name", CENTRES)
def test_one_wheel_on_ice_goes_round_with_open_differentials(name: str) -> None:
    result = drive(name, inputs={"driver.accelerator_pedal": 0.4}, rtol=1e-8)
    audit = pt.energy_audit(result)
    assert not audit.hidden
    assert audit.closure < 1e-6
    for wheel in WHEELS:
        assert result[f"{wheel}.w"][-1] * 0.3 == pytest.approx(result["body.v"][-1], rel=0.02)
    forces = sum(result[f"{wheel}.f"] for wheel in WHEELS)
    loads = sum(result[f"{wheel}.fn"] for wheel in WHEELS)
    np.testing.assert_allclose(loads, 1700 * 9.80665, rtol=1e-9)
    push = 1700 * result["body.chassis.a"] + result["body.chassis.drag"]
    np.testing.assert_allclose(forces, push, atol=1e-6)


@pytest.mark.slow
def test_bend() -> None:
    """Wheels run on circles about a centre 10 m beside the rear axle; load shifts outwards by the height of the body."""
    result = drive("bevel", stop=2.0, inputs={"driver.accelerator_pedal": 0.2, "curvature": -0.1})
    for axle, ahead in ("front", 2.7), ("rear", 0.0):
        ratio = np.hypot(10.75, ahead) / np.hypot(9.25, ahead)
        assert result[f"{axle}.left.v"][-1] / result[f"{axle}.right.v"][-1] == pytest.approx(ratio, rel=1e-9)
        assert result[f"{axle}.left.w"][-1] / result[f"{axle}.right.w"][-1] == pytest.approx(ratio, rel=0.005)
        shift = result[f"{axle}.left.fn"][-1] - result[f"{axle}.right.fn"][-1]
        load = result[f"{axle}.load"][-1]
        assert shift == pytest.approx(2 * load / 9.80665 * 0.1 * result["body.v"][-1] ** 2 * 0.65 / 1.5, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("name", CENTRES)
def test_comes_to_rest_on_a_slope(name: str) -> None:
    hill = RoadProfile(profile=pt.Map.constant(0.1, x="s", x_unit="m", name="grade"))
    car = pt.replace(FourWheelDriveCar.in_one_gear(road=hill), {"transfer.differential": CENTRES[name]})
    result = pt.simulate(car, 8.0, starts={"body.v": 3.0}, inputs={"driver.brake_pedal": 0.5})
    assert np.abs(result["body.v"][result.time > 7]).max() < 1e-3
    assert pt.energy_audit(result).closure < 1e-6


@pytest.mark.slow
def test_the_centre_differential_works_in_a_bend() -> None:
    """6 m beside the rear axle the front wheels run on 6.58 m on average: their cage turns 1.097 times as fast."""
    result = drive("bevel", stop=2.0, v=3.0, inputs={"curvature": 1 / 6, "driver.accelerator_pedal": 0.02})
    assert result["body.v"][-1] > 1
    ratio = result["front.cage.w"][-1] / result["rear.cage.w"][-1]
    assert ratio == pytest.approx(np.hypot(6, 2.7) / 6, rel=2e-3)
    assert np.abs(result["transfer.differential.mesh.w_rel"]).min() > 1
