"""The rear-wheel-drive car with every differential: which wheel spins on ice, who gets the torque, the bend, rest, and the comparison."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from cases import few
from differential_kinds import KINDS

import powertrain as pt
from powertrain.components.body import AxlePath, DrivenAxle, LumpedAxle, RoadProfile, RollingAxle
from powertrain.components.wheels import RigidWheel, SlipWheel
from powertrain.vehicles.rear_drive import RearDriveCar

RATIO = 3.5 * 3.9
ICE: dict[str, Any] = {"parameters": {"rear.left.mu": 0.15}, "inputs": {"driver.accelerator_pedal": 0.5}}
DRY: dict[str, Any] = {"inputs": {"driver.accelerator_pedal": 0.25, "curvature": 0.1}}


@lru_cache
def plant(name: str) -> pt.Plant[RearDriveCar]:
    return pt.compile(pt.replace(RearDriveCar.in_one_gear(), {"rear.differential": KINDS[name]}))


def drive(name: str, stop: float = 3.0, v: float = 3.0, **options: Any) -> Any:
    """From a speed with the clutch closed."""
    return plant(name).simulate(stop, starts={"body.v": v, "engine.w": v / 0.3 * RATIO}, **options)


def slope(grade: float) -> RoadProfile:
    return RoadProfile(profile=pt.Map.constant(grade, x="s", x_unit="m", name="grade"))


def torques(result: Any) -> tuple[Any, Any]:
    """What the half shafts get."""
    return -result["rear.differential.left.tau"], -result["rear.differential.right.tau"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["bevel", "locking cam"])
def test_wheel_speeds_in_a_bend(name: str) -> None:
    """Cage 88 rad/s, radius 7 m, track 1.4 m (Madhavan, App. A): 96.8 rad/s outside, 79.2 rad/s inside."""
    axle = DrivenAxle(differential=KINDS[name], left=RigidWheel(), right=RigidWheel(), path=AxlePath(track=1.4, roll=0))
    car = RearDriveCar.in_one_gear(1.0, rear=axle)
    result = pt.simulate(
        car,
        0.01,
        starts={"body.v": 88 * 0.3, "engine.w": 88 * 3.9},
        inputs={"curvature": 1 / 7, "driver.accelerator_pedal": 0.3},
        atol=1e-12,
    )
    for signal, speed in {"rear.cage.w": 88, "rear.right.w": 96.8, "rear.left.w": 79.2}.items():
        assert result[signal][0] == pytest.approx(speed, rel=1e-9)
    np.testing.assert_allclose(result["rear.right.w"] / result["rear.left.w"], 96.8 / 79.2, rtol=1e-9)


@pytest.mark.slow
def test_open_differential_spins_and_locking_cam_does_not() -> None:
    free, locked = drive("bevel", **ICE), drive("locking cam", **ICE)
    assert free["rear.left.v_slip"][-1] > 10
    assert np.abs(locked["rear.left.v_slip"]).max() < 0.5
    left, right = torques(free)
    late = free.time > 1.5
    np.testing.assert_allclose(left[late], 0.97 * right[late], rtol=1e-6)
    traction = [(r["rear.left.f"] + r["rear.right.f"])[-1] for r in (free, locked)]
    assert traction[1] > 3 * traction[0]
    assert locked["body.v"][-1] > 1.3 * free["body.v"][-1]
    assert set(np.unique(locked["rear.differential.mode"][locked.time > 0.5])) == {0}


@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
def test_the_wheel_that_grips_gets_what_the_law_says(name: str) -> None:
    """While the left wheel spins: T_right - T_left is the friction between the sides, of the torque of the crown."""
    result = drive(name, **ICE)
    left, right = torques(result)
    late = result.time > 1.5
    total = result["rear.differential.crown.tau"]
    if name == "limited slip":
        np.testing.assert_allclose((right - left)[late], (40 + 1.5 / 3.5 * total)[late], rtol=1e-6)
    elif name in ("cam", "spherical cam"):
        np.testing.assert_allclose((right - left)[late], (result["rear.differential.kappa"] * total)[late], rtol=1e-6)
        assert (right[late] / left[late]).mean() > 1.05
    elif name == "locking cam":
        assert (np.abs(right - left) <= result["rear.differential.kappa"] * np.abs(total) + 1e-6).all()
    else:
        assert (right[late] / left[late]).mean() > 1.0
    if name != "linkage":  # which has masses that take up torque
        np.testing.assert_allclose(left + right, total, atol=1e-6)
    assert total[-1] > 150


@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("road", ["ice", "bend"])
def test_energy_closes_and_mirrors(name: str, road: str) -> None:
    """Ice on the other side, a bend to the other side: the same motion with left and right exchanged."""
    options, mirrored = {
        "ice": (ICE, {**ICE, "parameters": {"rear.right.mu": 0.15}}),
        "bend": (DRY, {"inputs": {"driver.accelerator_pedal": 0.25, "curvature": -0.1}}),
    }[road]
    one, other = (drive(name, stop=1.5, rtol=1e-8, **o) for o in (options, mirrored))
    audit = pt.energy_audit(one)
    assert not audit.hidden
    assert audit.closure < 1e-6
    if name == "linkage":
        return  # its phase at the start is not the mirrored one
    for a, b in (("rear.left.w", "rear.right.w"), ("rear.right.f", "rear.left.f"), ("body.v", "body.v")):
        assert one[a][-1] == pytest.approx(other[b][-1], rel=1e-3)


@pytest.mark.parametrize("name", few(KINDS))
def test_in_a_bend_the_inner_wheel_gets_more(name: str) -> None:
    """Friction between the sides works against the faster outer wheel."""
    result = drive(name, **DRY)
    late = result.time > 2
    left, right = (t[late].mean() for t in torques(result))
    assert left > right
    np.testing.assert_allclose(result["rear.right.w"][late] / result["rear.left.w"][late], 1.075 / 0.925, rtol=0.02)
    assert pt.energy_audit(result).components.lost["rear.differential"] > 0


@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("grade", [0.1, -0.1])
def test_comes_to_rest_and_stands_on_a_slope(name: str, grade: float) -> None:
    hill = {"rear.differential": KINDS[name], "road": slope(grade)}
    car = pt.replace(RearDriveCar.in_one_gear(), hill)
    result = pt.simulate(car, 8.0, starts={"body.v": 3.0}, inputs={"driver.brake_pedal": 0.3})
    late = result.time > 6
    assert np.abs(result["body.v"][late]).max() < 1e-6
    assert pt.energy_audit(result).closure < 1e-6


@pytest.mark.slow
def test_starts_from_rest_with_its_clutch() -> None:
    car = RearDriveCar.in_one_gear(road=slope(0.05))
    result = pt.simulate(car, 6.0, inputs={"driver.accelerator_pedal": ([0, 1, 10], [0, 0.5, 0.5])})
    assert result["body.v"].min() > -1.0
    assert result["body.v"][-1] == pytest.approx(3.0, abs=0.3)
    assert result["clutch.mode"][-1] == 0
    assert result["engine.w"][-1] == pytest.approx(result["body.v"][-1] / 0.3 * RATIO, rel=0.02)


@pytest.mark.slow
def test_any_wheels_fit() -> None:
    """Rigid wheels on both sides and tyres with linear slip: the same car at small slip."""
    ends = []
    for wheel in (RigidWheel(), SlipWheel(C=5e5)):
        result = pt.simulate(
            RearDriveCar.in_one_gear(rear=DrivenAxle(left=wheel, right=wheel)),
            2.0,
            starts={"body.v": 3.0, "engine.w": 3 / 0.3 * RATIO},
            inputs={"driver.accelerator_pedal": 0.3},
        )
        ends.append(result["body.v"][-1])
    assert ends[0] == pytest.approx(ends[1], rel=1e-2)


def test_slot_takes_a_differential_only() -> None:
    with pytest.raises(pt.ModelError, match=r"DrivenAxle\.differential must be of class Differential, not RigidWheel"):
        pt.replace(RearDriveCar(), {"rear.differential": RigidWheel()})
    with pytest.raises(pt.ParameterError, match=r"rear\.left\.nu"):
        plant("bevel").simulate(1.0, parameters={"rear.left.nu": 0.1})


@pytest.mark.slow
def test_a_bend_takes_of_the_grip() -> None:
    """On a road of mu = 0.5, 20 m/s round 100 m: 4 of 4.9 m/s2 go into the bend, and braking has what is left."""
    car = pt.replace(RearDriveCar.in_one_gear(), {"rear.left.mu": 0.5, "rear.right.mu": 0.5})
    bends = [
        pt.simulate(car, 0.5, inputs={"driver.brake_pedal": 1.0, "curvature": k}, starts={"body.v": 20.0})
        for k in (0, 0.01)
    ]
    straight, bent = (-(r["rear.left.f"] + r["rear.right.f"])[r.time > 0.3].mean() for r in bends)
    assert bent < 0.75 * straight


@pytest.mark.slow
@pytest.mark.parametrize("driven", [False, True])
def test_a_bend_takes_of_the_grip_of_wheels_that_are_one(driven: bool) -> None:
    """Brakes that lock on a road of mu = 0.5, 20 m/s round 100 m: root(0.5^2 - (v^2/100/g)^2) of the load is left."""
    wheel = SlipWheel(mu=0.5, J=2)
    axle = LumpedAxle(wheels=wheel) if driven else RollingAxle(wheels=wheel)
    name = "rear" if driven else "front"
    car = pt.replace(RearDriveCar.in_one_gear(), {name: axle})
    result = pt.simulate(
        car, 0.6, inputs={"driver.brake_pedal": 1.0, "curvature": -0.01}, starts={"body.v": 20.0}, rtol=1e-8
    )
    side = result["body.v"] ** 2 / 100 / 9.80665
    slides = np.abs(result[f"{name}.wheels.v_slide"]) > 0.5
    grip = -(result[f"{name}.wheels.f"] / result[f"{name}.wheels.fn"])[slides]
    np.testing.assert_allclose(grip, np.sqrt(0.25 - side[slides] ** 2), rtol=1e-6)
    assert slides.sum() > 20
    fast = pt.simulate(car, 0.1, inputs={"curvature": 0.02}, starts={"body.v": 20.0})
    assert (
        sum(
            n
            for what, n in fast.statistics.items()
            if "side force" in what and "left" not in what and "right" not in what
        )
        > 0
    )


@pytest.mark.slow
@pytest.mark.parametrize("wheel", [SlipWheel(), RigidWheel()], ids=["tyre", "rigid"])
def test_bends_of_a_road(wheel: SlipWheel | RigidWheel) -> None:
    """Through 2.8 rad to the left and 1 rad to the right: the right wheel covers 1.8 track more than the left one, at any speed."""
    places, bends = [0, 20, 30, 90, 100, 105, 110, 130, 135], [0, 0, 0.04, 0.04, 0, 0, -0.04, -0.04, 0]
    road = RoadProfile(
        bends=pt.Map.curve(places, bends, x="s", x_unit="m", unit="1/m", name="curvature", outside="clip")
    )
    car = RearDriveCar.in_one_gear(1.0, rear=DrivenAxle(left=wheel, right=wheel, path=AxlePath(track=1.4)), road=road)
    for speed in 8.0, 11.0:
        result = pt.simulate(
            car,
            22.0,
            starts={"body.v": speed, "engine.w": speed / 0.3 * 3.9},
            inputs={"driver.accelerator_pedal": 0.2},
            rtol=1e-8,
        )
        assert result["body.s"][-1] > 140
        left, right = (np.diff(result[f"rear.path.{side}.s"][[0, -1]])[0] for side in ("left", "right"))
        assert right - left == pytest.approx(1.4 * (0.04 * 70 - 0.04 * 25), abs=1e-4)


def test_bends_that_are_none() -> None:
    radius = pt.Map.curve([0, 100], [1e9, 20], x="s", x_unit="m", unit="m", name="radius")
    with pytest.raises(pt.ParameterError, match=r"road.bends gives radius \[m\]; it must give the curvature in 1/m"):
        pt.compile(RearDriveCar(road=RoadProfile(bends=radius)))
