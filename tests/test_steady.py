"""Steady operating points: the paper's worked example, closed forms, the same points by simulation, and points that are not ok."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from cases import few
from joined import joined
from split_path import closed_form

import powertrain as pt
from powertrain.components.blocks import Constant
from powertrain.components.cvu import CVU
from powertrain.components.differentials import FundamentalDifferential, PlanetaryGear
from powertrain.components.rotational import (
    BearingFriction,
    Brake,
    Clutch,
    ConstantSpeed,
    ConstantTorque,
    Damper,
    Fixed,
    Gear,
    IdealGear,
    Inertia,
    LossyGear,
    OneWayClutch,
    QuadraticSpeedDependentTorque,
    SpringDamper,
    Torque,
)
from powertrain.components.transmissions import TYPES, SplitPathTransmission
from powertrain.dae.hybrid import OperatingPoint
from powertrain.design import SplitPathBench
from powertrain.modes.complementarity import Complementarity

OUTPUTS = ["V", "efficiency", "K", "transmission.flange_a.tau", "transmission.differential.*.tau"]
OK, STUCK, SEVERAL, NONE, IMMOVABLE, OUTSIDE, DIVERGED, UNDEFINED = range(8)


@pytest.fixture(scope="module")
def bench() -> pt.Plant[SplitPathBench]:
    return pt.compile(SplitPathBench())


def test_worked_example_to_the_printed_digits(bench: pt.Plant[SplitPathBench]) -> None:
    point = pt.steady(bench, {"r": -0.13, "load": 10.0}, outputs=[*OUTPUTS, "transmission.*Power"])
    torque = {m: float(point[f"transmission.differential.{m}.tau"]) for m in ("a", "b", "carrier")}
    speed = {"a": -13.0, "b": 100.0, "carrier": 100 * float(point.V)}
    power = {m: torque[m] * speed[m] for m in torque}
    lost = float(point["transmission.differential.lossPower"]), float(point["transmission.cvu.lossPower"])
    assert f"{point.V:.3f}" == "0.581"
    assert f"{speed['carrier'] / speed['a']:.2f}" == "-4.47"
    assert f"{torque['b'] / torque['a']:.3f}" == "1.789"
    assert f"{torque['carrier'] / torque['a']:.3f}" == "-2.789"
    assert f"{power['b'] / power['a']:.2f}" == "-13.77"
    assert f"{power['carrier'] / power['a']:.2f}" == "12.48"
    assert f"{lost[0] / -power['a']:.3f}" == "0.288"
    assert f"{lost[1] / -power['a']:.3f}" == "1.248"
    assert f"{-(power['a'] + power['carrier']) / power['b']:.3f}" == "0.979"
    assert f"{point.efficiency:.3f}" == "0.394"
    assert f"{point.K:.2f}" == "-4.92"
    assert int(point.status) == OK


@pytest.mark.parametrize("layout", [TYPES[n] for n in (1, 2, 5, 6)])
def test_closed_form(layout: Any) -> None:
    plant = pt.compile(SplitPathBench(transmission=SplitPathTransmission(layout=layout)))
    r = np.linspace(-2, 3, 41)
    load = np.array([-50.0, -1.0, 2.0, 30.0])
    found = pt.steady(plant, {"r": r, "load": load}, outputs=OUTPUTS)
    exact = closed_form(layout, -1.7, 0.95, 0.9, r[:, None], load[None, :])
    good = (np.abs(r[:, None] - 1) > 1e-9) & (found.status.values == OK)
    with np.errstate(divide="ignore"):  # in overrun the output supplies
        delivered = np.where(exact.tau >= 0, exact.efficiency, 1 / exact.efficiency)
    assert (found.status.values == OK)[np.abs(r - 1) > 1e-9].all()
    for name, value in (
        ("V", exact.V),
        ("efficiency", delivered),
        ("K", exact.K),
        ("transmission.flange_a.tau", exact.tau),
    ):
        np.testing.assert_allclose(
            found[name].values[good], np.broadcast_to(value, good.shape)[good], rtol=1e-9, atol=1e-9
        )
    for member, value in exact.T.items():
        torque = found[f"transmission.differential.{member}.tau"].values
        np.testing.assert_allclose(torque[good], np.broadcast_to(value, good.shape)[good], rtol=1e-9)


@pytest.mark.parametrize("layout", few([TYPES[1], TYPES[3], TYPES[6]]))
@pytest.mark.parametrize("lines", [(61, 200), (200, 61)])
def test_large_maps_are_the_small_ones(layout: Any, lines: tuple[int, int]) -> None:
    """By rows, as a list of points and point by point."""
    plant = pt.compile(SplitPathBench(transmission=SplitPathTransmission(layout=layout)))
    r, load = np.linspace(-2, 3, lines[0]), np.linspace(-40, 40, lines[1])
    whole = pt.steady(plant, {"r": r, "load": load}, outputs=OUTPUTS)
    walked = pt.steady(
        plant,
        {"r": xr.DataArray(r, dims="r"), "load": xr.DataArray(load[None, :] + 0 * r[:, None], dims=("r", "load"))},
        outputs=OUTPUTS,
    )
    for k in range(0, r.size, 7):
        row = pt.steady(plant, {"r": r[k], "load": load}, outputs=OUTPUTS)
        for large in (whole, walked):
            same(large.isel(r=k), row)


@pytest.mark.parametrize("axes", [("ratio", "w_a"), ("ratio", "tau")])
def test_large_maps_through_tables_are_the_small_ones(axes: tuple[str, str]) -> None:
    """Efficiencies by interpolation: explicit along rows over speed, implicit over torque."""
    units = {"ratio": "1", "w_a": "rad/s", "tau": "N.m"}
    points = {"ratio": [-3.0, 0.0, 0.7, 3.0], "w_a": [0.0, 60.0, 200.0], "tau": [0.0, 5.0, 300.0]}
    values = np.random.default_rng(1).uniform(0.6, 0.95, [len(points[a]) for a in axes])
    table = pt.Map([pt.Axis(a, units[a], points[a], "clip") for a in axes], values, "1")
    plant = pt.compile(SplitPathBench(transmission=SplitPathTransmission(cvu=CVU(map_ab=table, map_ba=table))))
    r, load = np.linspace(-1.4, 2.4, 39), np.linspace(-40, 40, 80)
    whole = pt.steady(plant, {"r": r, "load": load}, outputs=OUTPUTS)
    for k in range(0, r.size, 9):
        same(whole.isel(r=k), pt.steady(plant, {"r": r[k], "load": load}, outputs=OUTPUTS))
    k, i = 30, 20
    V, T = float(whole["V"][k, i]), float(whole["transmission.flange_a.tau"][k, i])
    b = float(whole["transmission.differential.b.tau"][k, i])
    unit_a, unit_b = T - b, -float(whole["transmission.differential.carrier.tau"][k, i])
    eta = table(V, 100.0 if axes[1] == "w_a" else abs(unit_a))
    assert -unit_b * V / unit_a == pytest.approx(eta if unit_a > 0 else 1 / eta, rel=1e-9)


def test_few_and_many_combinations_give_the_same_points(monkeypatch: pytest.MonkeyPatch) -> None:
    """All combinations of modes tried, and modes solved for."""
    grid: dict[str, Any] = {"r": np.linspace(-1.9, 2.9, 24), "load": [-20.0, -1.0, 5.0]}
    tried = pt.steady(pt.compile(SplitPathBench()), grid, outputs=OUTPUTS)
    monkeypatch.setattr("powertrain.equilibrium.operating.COMBINATIONS", 0)
    solved = pt.steady(pt.compile(SplitPathBench()), grid, outputs=OUTPUTS)
    same(solved, tried)


def same(found: xr.Dataset, expected: xr.Dataset) -> None:
    np.testing.assert_array_equal(found.status, expected.status)
    for name in OUTPUTS[:4]:
        np.testing.assert_allclose(found[name], expected[name], rtol=1e-9, atol=1e-12)
        if f"{name}_low" in expected:
            np.testing.assert_allclose(found[f"{name}_low"], expected[f"{name}_low"], rtol=1e-9, atol=1e-12)
            np.testing.assert_allclose(found[f"{name}_high"], expected[f"{name}_high"], rtol=1e-9, atol=1e-12)


def test_block_is_stuck_with_an_interval(bench: pt.Plant[SplitPathBench]) -> None:
    """At r = 1 the torques lie between the limits from both sides."""
    found = pt.steady(bench, {"r": [1 - 1e-9, 1.0, 1 + 1e-9], "load": -10.0}, outputs=OUTPUTS)
    assert found.status.values.tolist() == [OK, STUCK, OK]
    for name in OUTPUTS[1:4]:
        sides = sorted(found[name].values[[0, 2]])
        assert np.isnan(found[name].values[1])
        np.testing.assert_allclose([found[f"{name}_low"][1], found[f"{name}_high"][1]], sides, rtol=1e-6)
        np.testing.assert_array_equal(found[f"{name}_low"].values[[0, 2]], found[name].values[[0, 2]])
    assert "transmission.differential.mode" in found.status_laws.attrs["flag_meanings"].split()
    assert "transmission.differential.mode" in found.attrs["problems"]


def test_status_is_documented(bench: pt.Plant[SplitPathBench]) -> None:
    found = pt.steady(bench, {"r": [0.3, 0.4], "load": [1.0, 2.0]}, outputs=["efficiency"])
    meanings = found.status.attrs["flag_meanings"].split()
    assert len(meanings) == len(found.status.attrs["flag_values"]) == 8
    assert found.efficiency.dims == ("r", "load")
    assert found.efficiency.attrs == {"units": "1", "long_name": "Power delivered over power supplied"}
    assert found["load"].attrs["units"] == "N.m"


def test_efficiency_at_zero_power_is_undefined(bench: pt.Plant[SplitPathBench]) -> None:
    found = pt.steady(bench, {"r": 0.3, "load": [0.0, -1.0]}, outputs=["efficiency", "transmission.flange_a.tau"])
    assert found.status.values.tolist() == [UNDEFINED, OK]
    assert np.isnan(found.efficiency[0])
    assert found["transmission.flange_a.tau"][0] == 0


def test_undefined_line_in_a_large_map(bench: pt.Plant[SplitPathBench]) -> None:
    load = np.linspace(-10, 10, 101)
    found = pt.steady(bench, {"r": np.linspace(0.1, 0.5, 101), "load": load}, outputs=["efficiency"])
    assert (found.status.values[:, load == 0] == UNDEFINED).all()
    assert (found.status.values[:, load != 0] == OK).all()


class LockedBench(pt.Component):
    """A differential of given speeds at a and b, and a given torque on the carrier."""

    torque: pt.Input = pt.signal_input("N.m", "Torque on the carrier")
    differential: FundamentalDifferential = FundamentalDifferential(ratio=1.02, eta_ab=0.95, eta_ba=0.95)
    drive: ConstantSpeed = ConstantSpeed(w_fixed=10)
    load: Torque = Torque()
    other: ConstantSpeed = ConstantSpeed(w_fixed=0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.differential.a)
        yield pt.connect(self.other.flange, self.differential.b)
        yield pt.connect(self.load.flange, self.differential.carrier)
        yield pt.connect(self.torque, self.load.tau)


def test_self_locking_has_no_or_several_solutions() -> None:
    """For eta < R_o < 1/eta the carrier cannot be turned: one direction has both modes, the other none."""
    plant = pt.compile(LockedBench())
    found = pt.steady(plant, {"torque": [-5.0, 5.0]}, outputs=["differential.a.tau"])
    assert sorted(found.status.values.tolist()) == [SEVERAL, NONE]
    assert np.isnan(found["differential.a.tau"]).all()
    assert "differential" in found.attrs["problems"]
    easy = pt.steady(plant, {"torque": [-5.0, 5.0], "differential.ratio": 2.0}, outputs=["differential.a.tau"])
    assert (easy.status == OK).all()


@pytest.mark.parametrize("compile", [False, True])
@pytest.mark.parametrize("ratio", [0.97, 1.02, 1.2, 2.0, -2.0])
def test_self_locking_is_said_also_where_the_efficiency_depends_on_torque(ratio: float, compile: bool) -> None:
    """Against all roots of T_a (1 - R_o eta) + T = 0, with R_o eta_ab if a drives and R_o/eta_ba if b drives."""
    size = np.array([0.0, 5.0, 50.0, 1e5])
    etas = np.array([[0.94, 0.955, 0.96, 0.96], [0.93, 0.94, 0.95, 0.95]])
    map_ab, map_ba = (pt.Map([pt.Axis("tau", "N.m", size)], eta, unit="1") for eta in etas)
    bench = LockedBench(differential=FundamentalDifferential(ratio=ratio, map_ab=map_ab, map_ba=map_ba))
    torques = np.array([-50.0, -5.0, -1.0, 1.0, 5.0, 50.0])
    found = pt.steady(bench, {"torque": torques}, outputs=["differential.a.tau"], compile=compile)
    place = np.concatenate([-np.geomspace(1e5, 1e-5, 100001), np.geomspace(1e-5, 1e5, 100001)])
    a_drives = place * ratio / (ratio - 1) > 0
    eta = np.where(a_drives, np.interp(abs(place), size, etas[0]), 1 / np.interp(abs(place), size, etas[1]))
    for torque, status, T_a in zip(torques, found.status.values, found["differential.a.tau"].values, strict=True):
        balance = place * (1 - ratio * eta) + torque
        roots = place[1:][balance[1:] * balance[:-1] <= 0]
        assert status == {0: DIVERGED, 1: OK, 2: SEVERAL}[len(roots)], torque
        np.testing.assert_allclose(T_a, roots[0] if status == OK else np.nan, rtol=3e-4)


def flat(eta: float) -> pt.Map:
    """An efficiency that is written as one that depends on torque."""
    return pt.Map([pt.Axis("tau", "N.m", [0.0, 1.0, 1e7])], [eta, eta * (1 - 1e-9), eta], unit="1")


class LockedTrain(pt.Component):
    """Three differentials that share shafts, between a given speed and a given torque."""

    torque: pt.Input = pt.signal_input("N.m", "Torque on the output")
    one: FundamentalDifferential = FundamentalDifferential(ratio=3.45, map_ab=flat(0.99), map_ba=flat(0.86))
    two: FundamentalDifferential = FundamentalDifferential(ratio=2.19, map_ab=flat(0.84), map_ba=flat(0.81))
    three: FundamentalDifferential = FundamentalDifferential(ratio=-1.61, map_ab=flat(0.83), map_ba=flat(0.86))
    drive: ConstantSpeed = ConstantSpeed(w_fixed=2)
    load: Torque = Torque()
    ground: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.one.a, self.two.carrier)
        yield pt.connect(self.load.flange, self.one.carrier, self.two.b)
        yield pt.connect(self.one.b, self.three.carrier)
        yield pt.connect(self.two.a, self.three.a)
        yield pt.connect(self.three.b, self.ground.flange)
        yield pt.connect(self.torque, self.load.tau)


def test_a_train_that_is_self_locking_as_a_whole() -> None:
    """The other solution has the other side driving in all three. With 5 N.m on the output, all directions tried one by one leave these two
    torques; with -5 N.m none.
    """
    found = pt.steady(LockedTrain(), {"torque": [-5.0, 5.0]}, outputs=["one.a.tau"], first=True)
    np.testing.assert_array_equal(found.status, [DIVERGED, SEVERAL])
    assert np.isclose(found["one.a.tau"].values[1], [-3.252842, 11.3084786], rtol=1e-5).any()


def test_a_point_without_a_solution_is_soon_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing moves with given speeds, so a shorter step poses the same problem again."""
    asked, solve = list[OperatingPoint](), Complementarity.solve

    def counted(self: Complementarity, point: OperatingPoint, *args: Any, **more: Any) -> Any:
        asked.append(point)
        return solve(self, point, *args, **more)

    monkeypatch.setattr(Complementarity, "solve", counted)
    eta = pt.Map([pt.Axis("tau", "N.m", [0.0, 1e5])], [0.94, 0.96], unit="1")
    bench = LockedBench(differential=FundamentalDifferential(ratio=1.02, map_ab=eta, map_ba=eta))
    assert pt.steady(bench, {"torque": 5.0}).status == DIVERGED
    assert 0 < len(asked) < 30


@pytest.mark.parametrize("first", [False, True])
def test_infinite_torque_is_no_solution_beside_a_finite_one(first: bool) -> None:
    """At R_o = eta_ba the carrier turns with T_a = -T/(1 - R_o eta_ab) if a drives, and would need an infinite torque if b drives."""
    edge = {"differential.ratio": 0.97, "differential.eta_ab": 0.99, "differential.eta_ba": 0.97}
    torque = np.array([-5.0, 5.0])
    found = pt.steady(LockedBench(), {"torque": torque}, outputs=["differential.a.tau"], parameters=edge, first=first)
    expected = -torque / (1 - 0.97 * 0.99)
    drives = expected < 0  # w_a - w_h = -R_o/(1 - R_o) w_a, with b at rest
    np.testing.assert_array_equal(found.status, np.where(drives, OK, NONE))
    np.testing.assert_allclose(found["differential.a.tau"], np.where(drives, expected, np.nan), rtol=1e-9)


@pytest.mark.parametrize("alternatives", [64, 0])
def test_large_maps_tell_several_solutions_from_one(monkeypatch: pytest.MonkeyPatch, alternatives: int) -> None:
    """Also where laws have too many other combinations of modes for a tape: every point is solved on its own then, and only so."""
    monkeypatch.setattr("powertrain.steadystate.known_modes._ALTERNATIVES", alternatives)
    if not alternatives:
        monkeypatch.delattr("powertrain.steadystate.known_modes.KnownModes.parts")
    large = pt.steady(
        pt.compile(LockedBench()),
        {"torque": np.linspace(-5, 5, 64), "differential.ratio": np.linspace(1.01, 1.2, 64)},
        outputs=["differential.a.tau"],
    )
    ratio, eta = large["ratio"].values, 0.95
    locked = (eta < ratio) & (ratio < 1 / eta)
    assert (large.status.values[:, ~locked] == OK).all()
    assert set(large.status.values[:, locked].ravel()) == {SEVERAL, NONE}


class Fan(pt.Component):
    """A torque on an inertia, through a lossy gear, to a fan that brakes either way."""

    tau: pt.Input = pt.signal_input("N.m", "Driving torque")
    torque: Torque = Torque()
    J: Inertia = Inertia(J=0.1)
    gear: Gear = Gear(ratio=2.0, efficiency=0.9)
    shaft: SpringDamper = SpringDamper(c=1e3, d=1.0)
    J2: Inertia = Inertia(J=0.2)
    fan: QuadraticSpeedDependentTorque = QuadraticSpeedDependentTorque(
        tau_nominal=-20, w_nominal=50, TorqueDirection=False
    )

    def equations(self) -> pt.Equations:
        yield pt.connect(self.tau, self.torque.tau)
        yield pt.connect(self.torque.flange, self.J.flange_a)
        yield pt.connect(self.J.flange_b, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.J2.flange_a)
        yield pt.connect(self.J2.flange_b, self.fan.flange)


def test_speed_of_a_fan() -> None:
    """0.9 * 2 tau = 20 (w/50)^2."""
    plant = pt.compile(Fan())
    tau = np.array([1.0, 4.0, 9.0])
    found = pt.steady(plant, {"tau": tau}, outputs=["J2.w", "J.w", "shaft.tau"])
    assert (found.status == OK).all()
    np.testing.assert_allclose(found["J2.w"], 50 * np.sqrt(1.8 * tau / 20), rtol=1e-9)
    np.testing.assert_allclose(found["J.w"], 2 * found["J2.w"], rtol=1e-9)
    result = plant.simulate(30.0, inputs={"tau": 4.0}, starts={"J.w": 1.0})
    np.testing.assert_allclose(result["J2.w"][-1], found["J2.w"][1], rtol=1e-5)
    np.testing.assert_allclose(result["shaft.phi_rel"][-1], -4 * 1.8 / 1e3, rtol=1e-5)


def test_fan_that_also_drives() -> None:
    """Its torque has one direction: 0.9 * 2 tau = 20 (w/50)^2 forward, tau * 2/0.9 = 20 (w/50)^2 backward."""
    fan = QuadraticSpeedDependentTorque(tau_nominal=-20, w_nominal=50)
    plant = pt.compile(pt.replace(Fan(), fan=fan))
    tau = np.array([1.0, 4.0, 9.0])
    found = pt.steady(plant, {"tau": tau}, outputs=["J2.w"])
    assert (found.status == SEVERAL).all()
    assert np.isnan(found["J2.w"]).all()
    first = pt.steady(plant, {"tau": tau}, outputs=["J2.w"], first=True)
    assert (first.status == SEVERAL).all()
    np.testing.assert_allclose(first["J2.w"], 50 * np.sqrt(1.8 * tau / 20), rtol=1e-9)
    backward = pt.steady(plant, {"J2.w": -50 * np.sqrt(tau / 9)}, outputs=["tau"])
    np.testing.assert_allclose(backward["tau"], tau, rtol=1e-9)


def test_torque_that_keeps_a_speed() -> None:
    plant = pt.compile(Fan())
    w = np.array([10.0, 40.0])
    found = pt.steady(plant, {"J2.w": w}, outputs=["tau"])
    assert (found.status == OK).all()
    np.testing.assert_allclose(found["tau"], 20 * (w / 50) ** 2 / 1.8, rtol=1e-9)


def test_a_discrete_variable_has_the_value_that_is_given() -> None:
    """A damper that is doubled once the wheel has been fast: its start, and the other case."""

    class Wheel(pt.Component):
        tau: pt.Input = pt.signal_input("N.m", "Driving torque")
        torque: Torque = Torque()
        J: Inertia = Inertia(J=0.5)
        worn: pt.Discrete = pt.discrete("1", "Has been fast", start=0.0)

        def equations(self) -> pt.Equations:
            yield pt.when(self.J.w > 100.0, pt.reinit(self.worn, 1))
            yield pt.connect(self.torque.flange, self.J.flange_a)
            yield self.torque.tau.value == self.tau.value - 2.0 * (1 + self.worn) * self.J.w

    plant = pt.compile(Wheel())
    assert pt.steady(plant, {"tau": 4.0}, outputs=["J.w"])["J.w"].item() == pytest.approx(2.0)
    found = pt.steady(plant, {"tau": [4.0, 8.0], "worn": [0.0, 1.0]}, outputs=["J.w"])
    np.testing.assert_allclose(found["J.w"], [[2.0, 1.0], [4.0, 2.0]], rtol=1e-12)


def test_held_speed_reports_its_rate() -> None:
    """What torque and damper leave over accelerates."""

    class Wheel(pt.Component):
        tau: pt.Input = pt.signal_input("N.m", "Driving torque")
        torque: Torque = Torque()
        J: Inertia = Inertia(J=0.5)
        damper: Damper = Damper(d=2.0)
        ground: Fixed = Fixed()

        def equations(self) -> pt.Equations:
            yield pt.connect(self.tau, self.torque.tau)
            yield pt.connect(self.torque.flange, self.J.flange_a)
            yield pt.connect(self.J.flange_b, self.damper.flange_a)
            yield pt.connect(self.damper.flange_b, self.ground.flange)

    found = pt.steady(Wheel(), {"J.w": [1.0, 2.0], "tau": [0.0, 4.0]}, outputs=["damper.tau"])
    np.testing.assert_allclose(found["der(J.w)"], (np.array([[0.0, 4.0]]) - 2 * np.array([[1.0], [2.0]])) / 0.5)
    assert found["der(J.w)"].attrs["units"] == "rad/s2"


class Held(pt.Component):
    """A torque on an inertia that a brake and a bearing hold."""

    tau: pt.Input = pt.signal_input("N.m", "Driving torque")
    grip: pt.Input = pt.signal_input("1", "Brake")
    torque: Torque = Torque()
    J: Inertia = Inertia(J=0.5)
    brake: Brake = Brake(fn_max=10, mue_pos=((0.0, 1.0),), peak=1.0)
    bearing: BearingFriction = BearingFriction(tau_pos=((0.0, 1.0), (100.0, 11.0)), peak=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.tau, self.torque.tau)
        yield pt.connect(self.grip, self.brake.f_normalized)
        yield pt.connect(self.torque.flange, self.J.flange_a)
        yield pt.connect(self.J.flange_b, self.brake.flange_a)
        yield pt.connect(self.brake.flange_b, self.bearing.flange_a)


def test_coupled_laws_stick_and_slide_together() -> None:
    plant = pt.compile(Held())
    tau = np.array([-15.0, -5.0, 0.0, 5.0, 15.0, 30.0])
    found = pt.steady(plant, {"tau": tau, "grip": [0.0, 1.0]}, outputs=["J.w", "brake.tau", "bearing.tau"])
    assert (found.status == OK).all(), found.attrs["problems"]
    capacity = np.array([0.0, 10.0])
    w = np.sign(tau)[:, None] * np.maximum(np.abs(tau)[:, None] - 1 - capacity, 0) * 10
    np.testing.assert_allclose(found["J.w"], w, atol=1e-9)
    both = np.abs(found["brake.tau"] + found["bearing.tau"])
    np.testing.assert_allclose(both, np.abs(np.broadcast_to(tau[:, None], both.shape)), rtol=1e-9)


def test_rest_after_simulation() -> None:
    plant = pt.compile(Held())
    result = plant.simulate(5.0, inputs={"tau": 5.0, "grip": 1.0}, starts={"J.w": 3.0})
    point = pt.steady(plant, {"tau": 5.0, "grip": 1.0}, outputs=["J.w", "brake.tau", "bearing.tau"])
    for name in ("J.w", "brake.tau", "bearing.tau"):
        np.testing.assert_allclose(point[name], result[name][-1], atol=1e-6)


class Loaded(pt.Component):
    """A torque on an inertia, a transmission, and a fan with an inertia."""

    tau: pt.Input = pt.signal_input("N.m", "Driving torque")
    V: pt.Input = pt.signal_input("1", "Ratio of the variable unit")
    torque: Torque = Torque()
    J1: Inertia = Inertia(J=0.1)
    transmission: SplitPathTransmission = SplitPathTransmission()
    J2: Inertia = Inertia(J=0.1)
    fan: QuadraticSpeedDependentTorque = QuadraticSpeedDependentTorque(
        tau_nominal=-20, w_nominal=50, TorqueDirection=False
    )

    def equations(self) -> pt.Equations:
        yield pt.connect(self.tau, self.torque.tau)
        yield pt.connect(self.V, self.transmission.ratio)
        yield pt.connect(self.torque.flange, self.J1.flange_a)
        yield pt.connect(self.J1.flange_b, self.transmission.flange_a)
        yield pt.connect(self.transmission.flange_b, self.J2.flange_a)
        yield pt.connect(self.J2.flange_b, self.fan.flange)


@pytest.mark.parametrize("V", [0.8, 0.95])
def test_end_of_a_simulation(V: float) -> None:
    """Speeds are implicit here; the torques are the closed form's."""
    plant = pt.compile(Loaded())
    names = ["J1.w", "J2.w", "fan.tau", "transmission.differential.b.tau", "transmission.cvu.lossPower"]
    point = pt.steady(plant, {"tau": 5.0, "V": V}, outputs=names)
    assert int(point.status) == OK
    exact = closed_form("bHa", -1.7, 0.95, 0.9, -1.7 + 2.7 * V, -1.0)
    np.testing.assert_allclose(exact.tau * abs(point["fan.tau"]), 5.0, rtol=1e-9)
    result = plant.simulate(60.0, inputs={"tau": 5.0, "V": V}, starts={"J1.w": 1.0}, rtol=1e-8)
    for name in names:
        np.testing.assert_allclose(point[name], result[name][-1], rtol=1e-6)


class ShaftLine(pt.Component):
    """An engine, a reversing reduction gear, a stiff shaft and a propeller."""

    engine: ConstantTorque = ConstantTorque(tau_constant=21e3)
    J1: Inertia = Inertia(J=160.0)
    gear: IdealGear = IdealGear(ratio=-3.71)
    shaft: SpringDamper = SpringDamper(c=1e8, d=1e3)
    J2: Inertia = Inertia(J=8800.0)
    propeller: QuadraticSpeedDependentTorque = QuadraticSpeedDependentTorque(
        tau_nominal=-1e5, w_nominal=14.0, TorqueDirection=False
    )

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.flange, self.J1.flange_a)
        yield pt.connect(self.J1.flange_b, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.J2.flange_a)
        yield pt.connect(self.J2.flange_b, self.propeller.flange)


def test_the_twist_of_a_stiff_shaft_is_steady() -> None:
    """Angles turn together at the ratio of the gear: their slopes of 1e8 N.m/rad cancel except for round-off."""
    tau = np.array([5e3, 21e3])
    found = pt.steady(ShaftLine(), {"engine.tau_constant": tau}, outputs=["shaft.tau", "shaft.phi_rel", "J2.w"])
    assert found["shaft.tau"].values == pytest.approx(3.71 * tau, rel=1e-9)
    assert found["shaft.phi_rel"].values == pytest.approx(3.71e-8 * tau, rel=1e-9)
    assert found["J2.w"].values == pytest.approx(-14.0 * np.sqrt(3.71 * tau / 1e5), rel=1e-9)
    with pytest.raises(pt.ParameterError, match=r"J2\.phi depends on an angle that only rotates"):
        pt.steady(ShaftLine(), {"engine.tau_constant": tau}, outputs=["J2.phi"])


class Twisted(pt.Component):
    """A spring between two of three inertias that turn together: two angles merely turn."""

    tau: pt.Input = pt.signal_input("N.m", "Driving torque")
    torque: Torque = Torque()
    J1: Inertia = Inertia(J=0.5)
    shaft: SpringDamper = SpringDamper(c=1e3, d=2.0)
    J2: Inertia = Inertia(J=0.3)
    clutch: Clutch = Clutch(fn_max=30.0, mue_pos=((0.0, 1.0),))
    J3: Inertia = Inertia(J=0.2)
    drag: Damper = Damper(d=0.3)
    ground: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.tau, self.torque.tau)
        yield pt.connect(self.torque.flange, self.J1.flange_a)
        yield pt.connect(self.J1.flange_b, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.J2.flange_a)
        yield pt.connect(self.J2.flange_b, self.clutch.flange_a)
        yield self.clutch.f_normalized.value == 1.0
        yield pt.connect(self.clutch.flange_b, self.J3.flange_a)
        yield pt.connect(self.J3.flange_b, self.drag.flange_a)
        yield pt.connect(self.drag.flange_b, self.ground.flange)


class TwoLines(pt.Component):
    """Two equal lines that have nothing to do with each other: a torque drives a damper through a spring."""

    drives: tuple[ConstantTorque, ...] = (ConstantTorque(tau_constant=10),) * 2
    shafts: tuple[Inertia, ...] = (Inertia(J=1),) * 4
    springs: tuple[SpringDamper, ...] = (SpringDamper(c=100, d=1),) * 2
    dampers: tuple[Damper, ...] = (Damper(d=2),) * 2
    ground: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        for k in range(2):
            yield pt.connect(self.drives[k].flange, self.shafts[2 * k].flange_a)
            yield pt.connect(self.shafts[2 * k].flange_b, self.springs[k].flange_a)
            yield pt.connect(self.springs[k].flange_b, self.shafts[2 * k + 1].flange_a)
            yield pt.connect(self.shafts[2 * k + 1].flange_b, self.dampers[k].flange_a)
            yield pt.connect(self.dampers[k].flange_b, self.ground.flange)


@pytest.mark.parametrize("line", [0, 1])
def test_which_angles_are_left_out_does_not_depend_on_the_grid(line: int) -> None:
    """Both ends of a line turn alike; which of them is left out was a matter of round-off, so the map was refused."""
    found = pt.steady(TwoLines(), {f"springs[{line}].c": [80.0, 120.0]}, outputs=["shafts[*].w", "springs[*].phi_rel"])
    assert found.status.values.tolist() == [0, 0]
    np.testing.assert_allclose([found[f"shafts[{k}].w"].values for k in range(4)], 5.0, rtol=1e-12)
    np.testing.assert_allclose(found[f"springs[{line}].phi_rel"], [-10 / 80, -10 / 120], rtol=1e-12)
    np.testing.assert_allclose(found[f"springs[{1 - line}].phi_rel"], -0.1, rtol=1e-12)


def test_several_angles_that_turn_together() -> None:
    found = pt.steady(Twisted(), {"tau": [-9.0, 6.0]}, outputs=["J1.w", "J2.w", "J3.w", "shaft.phi_rel"])
    assert (found.status == OK).all()
    for name in ("J1.w", "J2.w", "J3.w"):
        np.testing.assert_allclose(found[name], [-30.0, 20.0], rtol=1e-9)
    np.testing.assert_allclose(found["shaft.phi_rel"], [9e-3, -6e-3], rtol=1e-9)


class Geared(pt.Component):
    """A spring of 5 N.m/rad behind a gear; its twist is a state, or the difference of two."""

    declared: bool = False
    r: pt.Parameter = pt.parameter("1", "Ratio", default=2.0)
    d: pt.Parameter = pt.parameter("N.m.s/rad", "Damping of the slow side", default=2.0)
    tau: pt.Input = pt.signal_input("N.m", "Torque on the fast side", default=1.0)
    phi: pt.Variable = pt.variable("rad", "Fast angle")
    w: pt.Variable = pt.variable("rad/s", "Fast speed")
    psi: pt.Variable = pt.variable("rad", "Slow angle")
    u: pt.Variable = pt.variable("rad/s", "Slow speed")
    twist: pt.Variable = pt.variable("rad", "Twist", prefer=True)

    def equations(self) -> pt.Equations:
        yield pt.der(self.phi) == self.w
        yield pt.der(self.psi) == self.u
        if self.declared:
            yield pt.der(self.twist) == self.w - self.r * self.u
        else:
            yield self.twist == self.phi - self.r * self.psi
        yield pt.der(self.w) == self.tau.value - 5 * self.twist
        yield pt.der(self.u) == 5 * self.r * self.twist - self.d * self.u


@pytest.mark.parametrize("axis", ["d", "tau"])
def test_angles_that_turn_together_by_the_ratio_of_a_gear(axis: str) -> None:
    """u = r tau/d and w = r u."""
    found = pt.steady(Geared(), {axis: [1.0, 4.0]}, outputs=["w", "u"])
    u = np.array([2.0, 0.5]) if axis == "d" else np.array([1.0, 4.0])
    np.testing.assert_allclose([found.u, found.w], [u, 2 * u], rtol=1e-9)


def test_angles_that_turn_together_by_another_ratio_at_every_point() -> None:
    """Their twist is the same kind of state at every point."""
    found = pt.steady(Geared(declared=True), {"r": [1.0, 3.0]}, outputs=["w", "u"])
    np.testing.assert_allclose([found.u, found.w], [[0.5, 1.5], [0.5, 4.5]], rtol=1e-9)
    with pytest.raises(pt.ParameterError, match="turn together by ratios that change along the grid"):
        pt.steady(Geared(), {"r": [1.0, 3.0]}, outputs=["w"])


class InTurn(pt.Component):
    """Every condition depends on what the one before gives, and on x."""

    x: pt.Input = pt.signal_input("1", "Level")
    a: pt.Variable = pt.variable("1", "First")
    b: pt.Variable = pt.variable("1", "Second")
    c: pt.Variable = pt.variable("1", "Third")

    def equations(self) -> pt.Equations:
        yield self.a == pt.switch(self.x.value > 0, 1.0, -1.0)
        yield self.b == pt.switch(self.a > self.x.value, 5.0, 6.0)
        yield self.c == pt.switch(self.b + self.x.value > 5.5, 2.0, 3.0)


def test_conditions_that_depend_on_each_other_in_turn() -> None:
    x = np.array([-3.0, -0.6, -0.4, 0.2, 0.7, 2.0])
    found = pt.steady(InTurn(), {"x": x})
    a = np.where(x > 0, 1, -1)
    b = np.where(a > x, 5, 6)
    np.testing.assert_array_equal([found.a, found.b, found.c], [a, b, np.where(b + x > 5.5, 2, 3)])


def test_nothing_balances() -> None:
    class Runaway(pt.Component):
        torque: ConstantTorque = ConstantTorque(tau_constant=1.0)
        J: Inertia = Inertia(J=0.5)
        brake: Brake = Brake(fn_max=10, mue_pos=((0.0, 1.0),))
        grip: pt.Input = pt.signal_input("1", "Brake")

        def equations(self) -> pt.Equations:
            yield pt.connect(self.torque.flange, self.J.flange_a)
            yield pt.connect(self.grip, self.brake.f_normalized)
            yield pt.connect(self.J.flange_b, self.brake.flange_a)

    found = pt.steady(Runaway(), {"grip": [0.01, 1.0]}, outputs=["J.w"])
    assert found.status.values.tolist() == [DIVERGED, OK]
    assert "brake" in found.attrs["problems"]


def test_ratio_that_would_be_infinite() -> None:
    plant = pt.compile(SplitPathBench(transmission=SplitPathTransmission(coupling="output")))
    found = pt.steady(plant, {"r": [0.0, 0.5], "load": -1.0}, outputs=["efficiency", "V"])
    assert found.status.values.tolist() == [IMMOVABLE, OK]


def test_ratio_outside_its_range(bench: pt.Plant[SplitPathBench]) -> None:
    limits = {"transmission.cvu.ratio_min": 0.5, "transmission.cvu.ratio_max": 2.0}
    found = pt.steady(bench, {"V": [0.4, 1.5, 2.1], "load": -1.0}, parameters=limits, outputs=["efficiency"])
    assert found.status.values.tolist() == [OUTSIDE, OK, OUTSIDE]
    assert "speed ratio of the variable unit" in found.attrs["problems"]
    large = pt.steady(
        bench, {"V": np.linspace(0, 3, 301), "load": np.linspace(-9, -1, 70)}, parameters=limits, outputs=["efficiency"]
    )
    inside = (large.V >= 0.5 - 1e-9) & (large.V <= 2 + 1e-9) & (abs(large.V - 1) > 1e-9)
    assert (large.status.where(inside, OK) == OK).all()
    assert (large.status.where((large.V < 0.49) | (large.V > 2.01), OUTSIDE) == OUTSIDE).all()


def test_parameters_and_arrays_as_axes(bench: pt.Plant[SplitPathBench]) -> None:
    r = xr.DataArray([0.3, 0.5, 2.0], dims="case")
    load = xr.DataArray([-1.0, -2.0, 3.0], dims="case")
    found = pt.steady(bench, {"r": r, "load": load, "transmission.cvu.eta_ab": [0.8, 0.9]}, outputs=["efficiency"])
    assert found.efficiency.dims == ("case", "eta_ab")
    exact = closed_form("bHa", -1.7, 0.95, 0.9, r.values, load.values)
    delivered = np.where(exact.tau >= 0, exact.efficiency, 1 / exact.efficiency)
    np.testing.assert_allclose(found.efficiency[:, 1], delivered, rtol=1e-9)


def test_coordinates_of_arrays_stay(bench: pt.Plant[SplitPathBench]) -> None:
    cases = {"case": ["slow", "fast"], "number": ("case", [7, 9])}
    r = xr.DataArray([0.3, 0.5], dims="case", coords=cases)
    found = pt.steady(bench, {"r": r, "load": [-1.0, -2.0]}, outputs=["efficiency"])
    assert found["case"].values.tolist() == ["slow", "fast"]
    assert found["number"].values.tolist() == [7, 9]
    assert found["efficiency"].sel(case="fast", load=-2.0).item() == found["efficiency"].values[1, 1]
    large = pt.steady(bench, {"r": r, "load": np.linspace(-9, -1, 2000)}, outputs=["efficiency"])
    assert large["case"].values.tolist() == ["slow", "fast"]


@pytest.mark.parametrize(
    ("grid", "message"),
    [
        (
            {"load": xr.DataArray([0.01], dims="load", attrs={"units": "kN.m"})},
            "grid: load: the values are in 'kN.m'.* must be in N.m",
        ),
        (
            {
                "r": xr.DataArray([0.3, 0.4], dims="n", coords={"n": [1, 2]}),
                "load": xr.DataArray([5.0, 6.0], dims="n", coords={"n": [2, 1]}),
            },
            "load and r have different values of n",
        ),
        ({"r": xr.DataArray([0.3, 0.4], dims="load", coords={"load": [1, 2]}), "load": [5.0, 6.0]}, "values of load"),
        (
            {"r": xr.DataArray([0.3, 0.4], dims="n", coords={"V": ("n", [1, 2])})},
            "r has a coordinate V, .* name of a result",
        ),
        ({"r": xr.DataArray([0.3, 0.4], dims="status")}, "r has a coordinate status, .* name of a result"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(bench: pt.Plant[SplitPathBench], grid: Any, message: str) -> None:
    with pytest.raises(pt.ParameterError, match=message):
        pt.steady(bench, {"r": 0.3, "load": 5.0, **grid}, outputs=["V"])


def test_a_coordinate_does_not_take_the_name_of_an_output() -> None:
    class Displayed(pt.Component):
        """A rotor with a display of its speed in other units."""

        rotor: Inertia = Inertia(J=1.0)
        w: pt.Variable = pt.variable("rpm", "Speed on the display")

        def equations(self) -> pt.Equations:
            yield self.w == self.rotor.w * (30.0 / np.pi)

    plant = pt.compile(Displayed())
    found = pt.steady(plant, {"rotor.w": [np.pi, 2 * np.pi]}, outputs=["w"])
    assert found["w"].dims == ("rotor.w",)
    np.testing.assert_allclose(found["w"], [30.0, 60.0])
    for outputs in ({"w": "w"}, {"status": "w"}):
        with pytest.raises(pt.ParameterError, match=f"outputs: {next(iter(outputs))} is also the name of"):
            pt.steady(plant, {"rotor.w": xr.DataArray([1.0, 2.0], dims="w")}, outputs=outputs)


def test_a_result_is_a_grid(bench: pt.Plant[SplitPathBench]) -> None:
    found = pt.steady(bench, {"r": [0.3, 0.5], "load": [5.0, 6.0]}, outputs=OUTPUTS)
    assert pt.steady(bench, {"r": found["r"], "load": found["load"]}, outputs=OUTPUTS).equals(found)


def test_values_on_which_both_ends_agree_are_given(bench: pt.Plant[SplitPathBench]) -> None:
    found = pt.steady(bench, {"r": 1.0, "load": -10.0}, outputs=["V", "efficiency"])
    assert found.status.item() == STUCK
    assert found["V"].item() == pytest.approx(1.0)
    assert np.isnan(found["efficiency"].item())


def test_torques_without_limit_are_not_ok() -> None:
    """On the border of self-locking, R_o = 1/eta, the torque is infinite if a drives; if b drives, T_a = -T/(1 - R_o/eta) < 0."""
    torque = np.array([-5.0, 5.0])
    found = pt.steady(LockedBench(), {"torque": torque, "differential.ratio": 1 / 0.95}, outputs=["differential.a.tau"])
    np.testing.assert_array_equal(found.status, [OK, NONE])
    np.testing.assert_allclose(found["differential.a.tau"], [5.0 / (1 - 1 / 0.95**2), np.nan], rtol=1e-9)
    other = pt.steady(
        LockedBench(), {"torque": [-5.0, 5.0], "differential.ratio": 0.95}, outputs=["differential.a.tau"]
    )
    assert np.nanmax(np.abs(other["differential.a.tau"])) < 1e3


def test_selectors_and_names(bench: pt.Plant[SplitPathBench]) -> None:
    found = pt.steady(
        bench, {"r": 0.3, "load": -1.0}, outputs={"twice": lambda m: 2 * m.load.value, "gain": "efficiency"}
    )
    assert float(found.twice) == -2
    assert set(found.data_vars) == {"twice", "gain", "status"}


def test_everything_by_default(bench: pt.Plant[SplitPathBench]) -> None:
    found = pt.steady(bench, {"r": 0.3, "load": -1.0})
    assert "transmission.differential.mode" in found
    assert "transmission.flange_a.phi" not in found
    assert all("units" in v.attrs and "long_name" in v.attrs for v in found.variables.values())


@pytest.mark.parametrize(
    ("grid", "options", "message"),
    [
        ({"rr": 1.0}, {}, "no input, parameter or variable rr; did you mean"),
        ({"r": [0.1], "V": 0.3, "load": 1.0}, {}, r"prescribes 1 variable \(r\), and no input or parameter to be found"),
        ({"r": [0.1]}, {}, "Name as many as are prescribed"),
        ({"r": [float("nan")], "load": 1.0}, {}, r"grid: r: nan at \[0\] is not a finite number"),
        ({"r": [[0.1]], "load": 1.0}, {}, "2 dimensions"),
        ({"r": 0.1, "load": 1.0}, {"free": ["load"]}, "already has a value"),
        ({"r": 0.1, "load": 1.0}, {"free": ["vv"]}, "no input or parameter vv"),
        ({"V": 0.1, "load": 1.0}, {"inputs": {"W": 1}}, "no input W"),
        ({"V": 0.1, "load": 1.0}, {"outputs": "transmission.flange_a.phi"}, "only rotates"),
        ({"V": 0.1, "load": 1.0, "transmission.cvu.eta_ab": [0.5, 1.5]}, {}, "eta_ab"),
        ({"efficiency": 0.5, "load": -1.0}, {"free": ["transmission.cvu.ratio_max"]}, "the conditions efficiency as the grid says"),
    ],
)  # fmt: skip
def test_what_is_wrong(
    bench: pt.Plant[SplitPathBench], grid: dict[str, Any], options: dict[str, Any], message: str
) -> None:
    with pytest.raises(pt.ParameterError, match=message):
        pt.steady(bench, grid, **options)


def test_no_condition_for_a_speed() -> None:
    class Free(pt.Component):
        torque: ConstantTorque = ConstantTorque(tau_constant=1.0)
        J: Inertia = Inertia(J=0.5)

        def equations(self) -> pt.Equations:
            yield pt.connect(self.torque.flange, self.J.flange_a)

    with pytest.raises(pt.ParameterError, match=r"der\(J.w\) = 0 cannot be met"):
        pt.steady(Free(), {}, outputs=["J.w"])


def test_roots_of_fractions_that_are_not_written_so() -> None:
    """A product of two ratios that is one ratio; nothing with a kink or of a higher degree."""
    import casadi as ca

    from powertrain.equilibrium.elimination import root_of_fraction

    x, p = ca.SX.sym("x"), ca.SX.sym("p")
    ratio = (1 + 2 * x) / (3 - p * x)
    root = root_of_fraction(ratio * (2 - x) / (2 - x) - 4 + ratio, x)
    assert root is not None
    found = float(ca.Function("root", [p], [root])(0.5))
    assert (1 + 2 * found) / (3 - 0.5 * found) == pytest.approx(2.0, rel=1e-12)
    for other in (ratio * (1 + x), ratio + ca.fmax(x - 10, 0), ca.sqrt(x * x) * ratio):
        assert root_of_fraction(other, x) is None


class HeldByItsPeak(pt.Component):
    """A brake that holds half as much again as it takes while it slides, against a torque that a damper takes at some speed."""

    torque: Torque = Torque()
    J: Inertia = Inertia(J=1.0)
    brake: Brake = Brake(fn_max=10.0, mue_pos=((0.0, 1.0),), peak=1.5)
    damper: Damper = Damper(d=0.1)
    ground: Fixed = Fixed()
    tau: pt.Input = pt.signal_input("N.m", "Torque", default=12.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.tau, self.torque.tau)
        yield pt.connect(self.torque.flange, self.J.flange_a, self.brake.flange_a, self.damper.flange_a)
        yield pt.connect(self.damper.flange_b, self.ground.flange)
        yield self.brake.f_normalized.value == 1.0


def test_a_brake_that_its_peak_holds_may_slide_as_well() -> None:
    """It ends where it began: at rest, or sliding at (tau - 10)/0.1. With another peak as the grid says."""
    plant = pt.compile(HeldByItsPeak())
    rest, slide = (plant.simulate(300.0, starts={"J.w": w})["J.w"][-1] for w in (0.0, 5.0))
    assert rest == 0.0
    assert slide == pytest.approx(20.0, rel=1e-6)
    tau = np.array([-14.0, -9.0, 5.0, 9.9, 10.5, 14.9, 15.5, 20.0])
    found = pt.steady(plant, {"tau": tau}, outputs="J.w")
    assert found.status.values.tolist() == [SEVERAL, OK, OK, OK, SEVERAL, SEVERAL, OK, OK]
    np.testing.assert_allclose(found["J.w"][-2:], (tau[-2:] - 10.0) / 0.1, rtol=1e-9)
    held = pt.steady(plant, {"tau": tau}, outputs="J.w", first=True)
    np.testing.assert_allclose(
        held["J.w"], np.where(np.abs(tau) < 15.0, 0.0, (tau - 10.0) / 0.1), rtol=1e-9, atol=1e-12
    )
    peaks = pt.steady(plant, {"brake.peak": [1.0, 1.1, 1.3], "tau": 12.0}, outputs="J.w")
    assert peaks.status.values.tolist() == [OK, OK, SEVERAL]


@pytest.mark.parametrize("eta", [1.0, 0.95])
def test_an_unloaded_planetary_gear_on_a_held_carrier_may_spin(eta: float) -> None:
    """Nothing slows sun and ring down, so every speed is an operating point; a bearing that the sun cannot overcome holds them."""
    parts = PlanetaryGear(ratio=2.0, eta_ab=eta, eta_ba=eta), *[Inertia(J=1.0)] * 3, Brake(fn_max=10.0), Constant(k=1.0)
    ends = "0.carrier=1.flange_a=4.flange_a 0.sun=2.flange_a 0.ring=3.flange_a 5.y=4.f_normalized"
    free, held = (
        joined(*parts, joints=ends),
        joined(*parts, BearingFriction(tau_pos=((0.0, 1.0),)), joints=f"{ends} 2.flange_b=6.flange_a"),
    )
    spinning = pt.simulate(free, 50.0, starts={"parts[2].w": 10.0, "parts[1].w": 0.0})
    assert spinning["parts[2].w"][-1] == pytest.approx(10.0)
    found, first, fixed = (
        pt.steady(model, {}, outputs="parts[2].w", first=one)
        for model, one in ((free, False), (free, True), (held, False))
    )
    assert found.status == SEVERAL
    assert first["parts[2].w"] == fixed["parts[2].w"] == 0.0
    assert fixed.status == OK


@pytest.mark.parametrize("ratio", [1.5, 49.0])
@pytest.mark.parametrize("driven", [True, False])
def test_a_rig_in_which_torque_circulates(ratio: float, driven: bool) -> None:
    """A shaft is twisted by 0.01 rad between two gears whose ratios cancel, in round-off for 49. With others it would wind up."""
    drive = ConstantSpeed(w_fixed=100.0) if driven else ConstantTorque(tau_constant=3.0)
    parts = (
        drive,
        Inertia(J=0.1),
        IdealGear(ratio=ratio),
        SpringDamper(c=1e4, d=1.0, phi_rel0=0.01),
        IdealGear(ratio=1 / ratio),
    )
    ends = "0.flange=1.flange_a=2.flange_a=5.flange_a 2.flange_b=3.flange_a 3.flange_b=4.flange_a 4.flange_b=1.flange_b"
    plant = pt.compile(joined(*parts, BearingFriction(tau_pos=((0.0, 1.0), (100.0, 2.0))), joints=ends))
    outputs = ["parts[3].tau", "parts[1].w", "parts[0].flange.tau"]
    found = pt.steady(plant, {}, outputs=outputs)
    assert found.status == OK
    w, tau = (100.0, 2.0) if driven else (200.0, 3.0)
    np.testing.assert_allclose([found[name] for name in outputs], [-100.0, w, -tau], rtol=1e-9)
    if driven:
        with pytest.raises(pt.ParameterError, match=r"parts\[3\].tau depends on an angle that only rotates"):
            pt.steady(plant, {}, outputs=outputs, parameters={"parts[4].ratio": 1.0})


def test_a_law_without_a_limit_yields_before_others_that_share_its_torque() -> None:
    """Of 3 N.m at the carrier a lossless gear passes 2 N.m on to the sun, by Willis' equation; nothing accelerates.

    Sun and ring turn together through a freewheel and a gear, each of which could carry more.
    """
    parts = (
        *(ConstantTorque(tau_constant=-3.0), PlanetaryGear(ratio=0.5), OneWayClutch(fn_max=10.0), Constant(k=1.0)),
        *(
            LossyGear(ratio=2.0, lossTable=((0.0, 0.9, 0.8, 0.5, 1.0),)),
            *[Inertia(J=J) for J in (4.0, 0.5, 10.0, 0.5, 0.5)],
        ),
        QuadraticSpeedDependentTorque(tau_nominal=-5.0, w_nominal=10.0, TorqueDirection=False),
    )
    ends = "0.flange=1.carrier=6.flange_a 1.sun=5.flange_b 5.flange_a=2.flange_a 3.y=2.f_normalized 1.ring=4.flange_a=7.flange_a"
    model = joined(*parts, joints=f"{ends} 4.support=2.flange_b=8.flange_a 4.flange_b=9.flange_a=10.flange")
    found = pt.steady(model, {}, outputs=["parts[2].tau", *(f"parts[{k}].a" for k in range(5, 10))])
    assert found.status == OK
    assert found["parts[2].tau"] == pytest.approx(2.0, rel=1e-9)
    for k in range(5, 10):
        assert found[f"parts[{k}].a"] == pytest.approx(0.0, abs=1e-9)


class Windage(pt.Component):
    """A torque, and the drag of air, which has no slope at rest."""

    tau: pt.Input = pt.signal_input("N.m", "Torque")
    drive: Torque = Torque()
    rotor: Inertia = Inertia(J=1.0)
    drag: QuadraticSpeedDependentTorque = QuadraticSpeedDependentTorque(
        tau_nominal=-1.0, w_nominal=10.0, TorqueDirection=False
    )

    def equations(self) -> pt.Equations:
        yield pt.connect(self.tau, self.drive.tau)
        yield pt.connect(self.drive.flange, self.rotor.flange_a)
        yield pt.connect(self.rotor.flange_b, self.drag.flange)


def test_drag_holds_a_shaft_at_rest() -> None:
    """Without a torque the only speed is zero, and with a torque of 1e-12 N.m it is 1e-5 rad/s; without drag it is any speed."""
    torques = np.array([-1e-8, -1e-12, 0.0, 1e-12, 1e-8, 1.0])
    found = pt.steady(Windage(), {"tau": torques}, outputs="rotor.w")
    assert (found.status == 0).all()
    np.testing.assert_allclose(
        found["rotor.w"], np.sign(torques) * 10 * np.sqrt(np.abs(torques)), rtol=1e-6, atol=1e-12
    )
    loose = pt.steady(Windage(), {"tau": [0.0, 1.0], "drag.tau_nominal": 0.0}, outputs="rotor.w")
    assert loose.status.values.tolist() == [2, 6]


@pytest.mark.parametrize(("drags", "status"), [((1, 1), 0), ((1, 0), 2), ((0, 1), 2), ((0, 0), 2)])
def test_a_free_shaft_beside_one_that_drag_holds(drags: tuple[int, int], status: int) -> None:
    parts: list[pt.Component] = []
    for drag in drags:
        fan = QuadraticSpeedDependentTorque(tau_nominal=-drag, w_nominal=10.0, TorqueDirection=False)
        parts += [ConstantTorque(tau_constant=0.0), Inertia(J=1.0), fan]
    bearing = BearingFriction(tau_pos=((0.0, 0.0),))
    joints = "0.flange=1.flange_a 1.flange_b=2.flange=6.flange_a 3.flange=4.flange_a 4.flange_b=5.flange"
    found = pt.steady(joined(*parts, bearing, joints=joints), {"parts[0].tau_constant": 0.0}, outputs="parts[1].w")
    assert found.status.item() == status


@pytest.mark.parametrize("unit", [1e-8, 1.0, 1e8])
def test_torques_of_any_size_are_compared_with_friction(unit: float) -> None:
    """A bearing holds 1, and what exceeds it drives a fan to 10 rad/s times its square root."""
    bearing = BearingFriction(tau_pos=((0.0, unit),))
    fan = QuadraticSpeedDependentTorque(tau_nominal=-unit, w_nominal=10.0, TorqueDirection=False)
    joints = "0.flange=1.flange_a 1.flange_b=2.flange_a=3.flange"
    model = joined(ConstantTorque(tau_constant=0.0), Inertia(J=unit), bearing, fan, joints=joints)
    torques = np.array([-1.6, 0.0, 0.8, 1.5])
    found = pt.steady(model, {"parts[0].tau_constant": unit * torques}, outputs="parts[1].w")
    assert (found.status == 0).all()
    excess = np.maximum(np.abs(torques) - 1.0, 0.0)
    np.testing.assert_allclose(found["parts[1].w"], 10 * np.sign(torques) * np.sqrt(excess), rtol=1e-6, atol=1e-6)
