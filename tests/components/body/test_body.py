"""The body of a vehicle: resistances, loads of the axles, energy on slopes and in wind; the paths of wheels in a bend."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components import translational as tr
from powertrain.components.blocks import Constant, Sine
from powertrain.components.body import AxlePath, RoadProfile, VehicleBody
from powertrain.components.differentials import BevelDifferential, Differential, LimitedSlipDifferential
from powertrain.components.gearless.circular_cam import CircularCamDifferential
from powertrain.components.gearless.linkage import LinkageDifferential
from powertrain.components.gearless.spherical_cam import SphericalCamDifferential
from powertrain.components.wheels import RigidWheel

G = 9.80665


class Pulled(pt.Component):
    """A body on frictionless axles, pulled by one force at the front."""

    body: VehicleBody = VehicleBody()
    force: Constant = Constant(k=0)
    pull: tr.Force = tr.Force()
    grade: Constant = Constant(k=0)
    wind: Constant = Constant(k=0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.force.y, self.pull.f)
        yield pt.connect(self.pull.flange, self.body.front)
        yield pt.connect(self.grade.y, self.body.grade)
        yield pt.connect(self.wind.y, self.body.wind)


def run(model: pt.Component, stop: float, starts: dict[str, float] | None = None, **options: Any) -> Any:
    return pt.simulate(model, stop, starts=starts, **{"rtol": 1e-10, **options})


def test_coasting_against_the_air() -> None:
    """1/v grows in proportion to time: 1/v = 1/v0 + Cd A rho t/(2 m)."""
    result = run(Pulled(), 100.0, {"body.v": 50.0})
    rate = 0.3 * 2.2 * 1.2 / 2 / 1500
    np.testing.assert_allclose(1 / result["body.v"], 1 / 50 + rate * result.time, rtol=1e-8)
    np.testing.assert_allclose(result["body.s"], np.log(1 + 50 * rate * result.time) / rate, rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("wind", [-8.0, 12.0])
def test_final_speed_in_the_wind(wind: float) -> None:
    result = run(Pulled(force=Constant(k=300), wind=Constant(k=wind)), 3000.0)
    assert result["body.v"][-1] == pytest.approx(wind + np.sqrt(300 * 2 / (0.3 * 2.2 * 1.2)), rel=1e-8)
    audit = pt.energy_audit(result)
    assert audit.closure < 1e-9
    table = audit.components
    assert table.lost["body.chassis"] > 0
    assert np.sign(table.sources["body.surroundings"]) == -np.sign(wind)  # a wind against the car takes more


def test_wind_carries_a_car_along() -> None:
    result = run(Pulled(wind=Constant(k=10)), 20000.0)
    assert result["body.v"][-1] == pytest.approx(10, rel=0.02)


@pytest.mark.parametrize("grade", [0.08, -0.08])
def test_slope_and_height(grade: float) -> None:
    """Energy is conserved without air: what is lost in speed is gained in height."""
    result = run(Pulled(body=VehicleBody(Cd=0), grade=Constant(k=grade)), 10.0, {"body.v": 20.0})
    sine = grade / np.sqrt(1 + grade**2)
    np.testing.assert_allclose(result["body.v"], 20 - G * sine * result.time, rtol=1e-9)
    height = result["body.chassis.height"]
    np.testing.assert_allclose(height, result["body.s"] * sine, atol=1e-9)
    np.testing.assert_allclose(result["body.v"] ** 2 / 2 + G * height, 200, rtol=1e-9)


@pytest.mark.parametrize(("grade", "force"), [(0.0, 0.0), (0.0, 4000.0), (0.0, -6000.0), (0.2, 0.0), (0.2, 5000.0)])
def test_loads_of_the_axles(grade: float, force: float) -> None:
    """Moments about the rear contact: inertia, air and weight act at the height h."""
    body = VehicleBody(m=1400, wheelbase=2.6, h=0.5, front_share=0.6)
    result = run(Pulled(body=body, force=Constant(k=force), grade=Constant(k=grade)), 3.0, {"body.v": 30.0})
    cosine = 1 / np.sqrt(1 + grade**2)
    pitching = 1400 * result["body.chassis.a"] + result["body.chassis.drag"] + 1400 * G * grade * cosine
    front = 1400 * G * cosine * 0.6 - pitching * 0.5 / 2.6
    np.testing.assert_allclose(result["body.front_load"], front, rtol=1e-9)
    np.testing.assert_allclose(result["body.front_load"] + result["body.rear_load"], 1400 * G * cosine, rtol=1e-12)


def test_both_axles_push_alike() -> None:
    class Pushed(pt.Component):
        body: VehicleBody = VehicleBody()
        front: tr.ConstantForce = tr.ConstantForce(f_constant=500)
        rear: tr.ConstantForce = tr.ConstantForce(f_constant=700)

        def equations(self) -> pt.Equations:
            yield pt.connect(self.front.flange, self.body.front)
            yield pt.connect(self.rear.flange, self.body.rear)

    one, other = run(Pushed(), 10.0), run(Pulled(force=Constant(k=1200)), 10.0)
    np.testing.assert_allclose(one["body.v"], other["body.v"], rtol=1e-9)
    np.testing.assert_allclose(one["body.front_load"], other["body.front_load"], rtol=1e-9)


class Hill(pt.Component):
    """A body without drag on a road."""

    body: VehicleBody = VehicleBody(Cd=0)
    road: RoadProfile

    def equations(self) -> pt.Equations:
        yield pt.connect(self.body.s, self.road.s)
        yield pt.connect(self.road.grade, self.body.grade)


def test_road_profile_over_distance() -> None:
    """A hill of 20 m over a kilometre and down again: the car coasts over it as a pendulum would."""
    s = np.linspace(0, 2000, 201)
    heights = 10 * (1 - np.cos(np.pi * s / 500))
    result = run(Hill(road=RoadProfile.from_heights(s, heights)), 50.0, {"body.v": 30.0}, max_step=0.5)
    v, height = result["body.v"], result["body.chassis.height"]
    np.testing.assert_allclose(v**2 / 2 + G * height, 450, rtol=1e-7)
    np.testing.assert_allclose(height, np.interp(result["body.s"], s, heights), atol=0.02)
    assert height.max() == pytest.approx(20, abs=0.01)


ROADS = {
    "ramp": ([0, 1000, 1100, 2000], [0, 0, 10, 10]),
    "steep": ([0, 50, 80, 200, 1000], [0, 20, 35, 0, 100]),
    "straight": ([0, 100], [0, 8]),
}


@pytest.mark.parametrize("name", ROADS)
def test_a_road_has_the_heights_it_was_made_from(name: str) -> None:
    """The integral of sin(alpha) over the path is the height; it never leaves the range between two places."""
    places, heights = (np.asarray(row, float) for row in ROADS[name])
    profile = RoadProfile.from_heights(places, heights).profile
    for s_0, s_1, z_0, z_1 in zip(places, places[1:], heights, heights[1:], strict=False):
        nodes, weights = np.polynomial.legendre.leggauss(60)
        height = [z_0]
        for k in range(40):  # ten pieces to a quarter, where the slope has its corners
            s = s_0 + (s_1 - s_0) * (k + (1 + nodes) / 2) / 40
            height.append(height[-1] + (s_1 - s_0) / 80 * float(weights @ np.sin(np.arctan(profile(s)))))
        assert height[-1] == pytest.approx(z_1, abs=1e-9)
        assert min(height) > min(z_0, z_1) - 1e-9
        assert max(height) < max(z_0, z_1) + 1e-9


def test_a_car_on_a_ramp_climbs_its_height() -> None:
    result = run(Hill(road=RoadProfile.from_heights(*ROADS["ramp"])), 80.0, {"body.v": 30.0}, max_step=0.5)
    assert result["body.s"][-1] > 2000
    assert result["body.chassis.height"][-1] == pytest.approx(10, abs=1e-6)


def test_roads_that_are_none() -> None:
    crooked = pt.Map((pt.Axis("s", "m", [0, 1]), pt.Axis("t", "s", [0, 1])), np.zeros((2, 2)), "1")
    with pytest.raises(pt.ParameterError, match=r"road.profile takes one argument, the path s; this map takes s, t"):
        pt.compile(Hill(road=RoadProfile(profile=crooked)))
    heights = pt.Map.curve([0, 1000], [0, 5], x="s", x_unit="m", unit="m", name="height")
    with pytest.raises(
        pt.ParameterError, match=r"road.profile gives height \[m\]; .* tan\(alpha\) \[1\]; .*from_heights"
    ):
        pt.compile(Hill(road=RoadProfile(profile=heights)))
    with pytest.raises(pt.ParameterError, match=r"cannot rise by 30 m from s = 20 m to 40 m, over 20 m of its length"):
        RoadProfile.from_heights([0, 20, 40], [0, 0, 30])
    with pytest.raises(pt.ParameterError, match="places that increase: s = 20 m is followed by 10 m"):
        RoadProfile.from_heights([0, 20, 10], [0, 0, 1])
    with pytest.raises(pt.ParameterError, match="finite heights: at s = 20 m it is nan m"):
        RoadProfile.from_heights([0, 20, 40], [0, np.nan, 1])
    with pytest.raises(pt.ParameterError, match="as many heights as places, at least two: 1 and 2"):
        RoadProfile.from_heights([0, 20], [0])


class Bend(pt.Component):
    """The driven axle of a car in a bend, its wheels rigid, pulled along at a constant speed."""

    cage: rot.ConstantSpeed = rot.ConstantSpeed(w_fixed=88)
    differential: Differential
    path: AxlePath = AxlePath(track=1.4)
    left: RigidWheel = RigidWheel(load_nominal=3000)
    right: RigidWheel = RigidWheel(load_nominal=3000)
    body: VehicleBody = VehicleBody()
    curvature: Constant = Constant(k=1 / 7)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.cage.flange, self.differential.crown)
        yield pt.connect(self.differential.left, self.left.hub)
        yield pt.connect(self.differential.right, self.right.hub)
        yield pt.connect(self.left.road, self.path.left)
        yield pt.connect(self.right.road, self.path.right)
        yield pt.connect(self.path.axle, self.body.rear)
        yield pt.connect(self.curvature.y, self.path.curvature)


KINDS = [
    BevelDifferential(eta=0.95),
    LimitedSlipDifferential(preload=20),
    CircularCamDifferential(),
    CircularCamDifferential(mu=0.2),
    SphericalCamDifferential(),
    LinkageDifferential(),
]


@pytest.mark.slow
@pytest.mark.parametrize("differential", KINDS, ids=lambda kind: type(kind).__name__)
@pytest.mark.parametrize(("side", "outer", "inner"), [(1, "right", "left"), (-1, "left", "right")])
def test_wheel_speeds_in_a_bend(differential: Differential, side: int, outer: str, inner: str) -> None:
    """Madhavan, App. A: cage 88 rad/s, radius 7 m, track 1.4 m."""
    result = run(Bend(differential=differential, curvature=Constant(k=side / 7)), 0.5)
    np.testing.assert_allclose(result[f"{outer}.w"], 96.8, rtol=1e-12)
    np.testing.assert_allclose(result[f"{inner}.w"], 79.2, rtol=1e-12)
    assert result["body.v"][-1] == pytest.approx(88 * 0.3)


class Turning(pt.Component):
    """Forces on the three flanges of an axle's path, with masses."""

    path: AxlePath
    body: tr.Mass = tr.Mass(m=10)
    left: tr.Mass = tr.Mass(m=1)
    right: tr.Mass = tr.Mass(m=2)
    push: tr.ConstantForce = tr.ConstantForce(f_constant=30)
    curvature: Sine = Sine(amplitude=0.1, f=0.2)
    load: Constant = Constant(k=5000)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.body.flange_a, self.path.axle)
        yield pt.connect(self.left.flange_a, self.path.left)
        yield pt.connect(self.right.flange_a, self.path.right)
        yield pt.connect(self.push.flange, self.right.flange_b)
        yield pt.connect(self.curvature.y, self.path.curvature)
        yield pt.connect(self.load.y, self.path.load)


def test_path_keeps_power_while_the_bend_changes() -> None:
    result = run(Turning(path=AxlePath(track=1.6, h=0.4, roll=1.2)), 4.0, {"body.v": 5.0})
    curvature = 0.1 * np.sin(0.4 * np.pi * result.time)
    v = result["body.v"]
    np.testing.assert_allclose(result["left.v"], (1 - 0.8 * curvature) * v, rtol=1e-9)
    np.testing.assert_allclose(result["right.v"], (1 + 0.8 * curvature) * v, rtol=1e-9)
    kinetic = 5 * v**2 + result["left.v"] ** 2 / 2 + result["right.v"] ** 2
    np.testing.assert_allclose(kinetic - 30 * (result["right.s"] - result["right.s"][0]), kinetic[0], rtol=1e-8)
    transfer = 1.2 * 5000 / G * curvature * v**2 * 0.4 / 1.6
    np.testing.assert_allclose(result["path.right_load"], 2500 + transfer, rtol=1e-9)
    np.testing.assert_allclose(result["path.left_load"], 2500 - transfer, rtol=1e-9)


@pytest.mark.parametrize("radius", [6.0, -11.0])
def test_steered_wheels_run_on_circles_about_the_centre_of_the_bend(radius: float) -> None:
    """A rigid body that turns at w = v/radius: the hub at (2.7, +-0.75) m has the velocity v + w x r. The power is kept."""
    path = AxlePath(track=1.5, ahead=2.7)
    result = run(Turning(path=path, curvature=Sine(amplitude=0.0, f=1, offset=1 / radius)), 2.0, {"body.v": 5.0})
    v = result["body.v"]
    for name, y in ("left", 0.75), ("right", -0.75):
        speed = np.linalg.norm([v, 0 * v, 0 * v] + np.cross([0, 0, 1 / radius], [2.7, y, 0])[:, None] * v, axis=0)
        np.testing.assert_allclose(result[f"{name}.v"], speed, rtol=1e-9)
    kinetic = 5 * v**2 + result["left.v"] ** 2 / 2 + result["right.v"] ** 2
    np.testing.assert_allclose(kinetic - 30 * (result["right.s"] - result["right.s"][0]), kinetic[0], rtol=1e-8)


def test_a_bend_about_a_point_between_the_wheels_is_refused() -> None:
    """Such as a radius of 20 m that is given as curvature."""
    with pytest.raises(
        pt.SimulationError, match=r"curvature of the path \(path.*t = 0 s: 20 1/m; allowed is -1.32 to 1.32"
    ):
        run(Turning(path=AxlePath(track=1.5), curvature=Sine(amplitude=0.0, f=1, offset=20)), 1.0, {"body.v": 1.0})


def test_a_side_force_drags() -> None:
    """30 N, counted on the outer wheel, round a bend of 8 m under 200 N: load side^2 slip_angle takes them in the end."""
    path = AxlePath(track=1.6, slip_angle=0.1)
    model = Turning(path=path, curvature=Sine(amplitude=0.0, f=1, offset=1 / 8), load=Constant(k=200))
    result = run(model, 100.0, {"body.v": 5.0})
    v = result["body.v"][-1]
    drag = 0.1 * 200 * (v**2 / 8 / G) ** 2
    assert drag == pytest.approx(30 * 1.1, rel=1e-3)
    assert result["path.side"][-1] == pytest.approx(v**2 / 8 / G)
    assert result["path.lossPower"][-1] == pytest.approx(drag * v, rel=1e-9)
    audit = pt.energy_audit(result)
    assert audit.closure < 1e-7
    assert not audit.hidden


def test_values_are_checked() -> None:
    with pytest.raises(pt.ParameterError, match=r"VehicleBody.front_share = 1.2 is outside its range \[0, 1\]"):
        VehicleBody(front_share=1.2)
    with pytest.raises(pt.ParameterError, match=r"AxlePath.track = 0 m is outside its range \(0, inf\)"):
        AxlePath(track=0)
