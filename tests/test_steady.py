"""Steady operating points: the paper's worked example, closed forms, the same points by simulation, and points at rest."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from cases import few
from split_path import closed_form

import powertrain as pt
from powertrain.components.cvu import CVU
from powertrain.components.rotational import (
    BearingFriction,
    Brake,
    Damper,
    Fixed,
    Inertia,
    QuadraticSpeedDependentTorque,
    Torque,
)
from powertrain.components.transmissions import TYPES, SplitPathTransmission
from powertrain.design import SplitPathBench

OUTPUTS = ["V", "efficiency", "K", "transmission.flange_a.tau", "transmission.differential.*.tau"]
OK, STUCK, IMMOVABLE, UNDEFINED = 0, 1, 4, 7


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


def test_ratio_that_would_be_infinite() -> None:
    plant = pt.compile(SplitPathBench(transmission=SplitPathTransmission(coupling="output")))
    found = pt.steady(plant, {"r": [0.0, 0.5], "load": -1.0}, outputs=["efficiency", "V"])
    assert found.status.values.tolist() == [IMMOVABLE, OK]


def test_values_on_which_both_ends_agree_are_given(bench: pt.Plant[SplitPathBench]) -> None:
    found = pt.steady(bench, {"r": 1.0, "load": -10.0}, outputs=["V", "efficiency"])
    assert found.status.item() == STUCK
    assert found["V"].item() == pytest.approx(1.0)
    assert np.isnan(found["efficiency"].item())


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
