"""Yu & Beachley 1986: every printed number from the closed form, and the closed form against the acausal model, at rest and in motion."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr
from cases import few
from yu_beachley import CONNECTIONS, Point, basic_ratio, lossless_fraction, only, relative_ratio, solutions, unit_ratio

import powertrain as pt
from powertrain.components.differentials import FundamentalDifferential, Planets, Ring, Sun
from powertrain.components.rotational import ConstantSpeed, Inertia, SpringDamper, Torque
from powertrain.components.transmissions import (
    COMBINATIONS,
    TYPES,
    SplitPathTransmission,
    SwitchedSplitPathTransmission,
)
from powertrain.design import SplitPathBench

ETA, ETA_V, R_O = 0.95, 0.9, -1.7
COUPLINGS = ("input", "output")
OK, STUCK, SEVERAL, NONE = range(4)
GEAR = "transmission.differential"


def example(r: float = -0.13) -> Point:
    """The worked example: b at 1, H at 2, a at 3."""
    return only(solutions(CONNECTIONS[1], R_O, r, ETA, ETA_V))


def test_worked_example_in_closed_form() -> None:
    p = example()
    N_H_a = p.V / -0.13
    assert basic_ratio((90, 31), (31, 153), external=1) == pytest.approx(R_O, rel=1e-15)
    assert f"{p.V:.3f}" == "0.581"
    assert f"{N_H_a:.2f}" == "-4.47"
    assert f"{1 - N_H_a:.2f}" == "5.47"
    assert f"{p.torque['b'] / p.torque['a']:.3f}" == "1.789"
    assert f"{p.torque['H'] / p.torque['a']:.3f}" == "-2.789"
    assert f"{-p.P[1]:.2f}" == "-13.77"
    assert f"{-p.P[2]:.2f}" == "12.48"
    assert f"{-p.P_f:.3f}" == "0.288"
    assert (
        f"{100 * (1 - p.P[2]) / -p.P[1]:.1f}" != "97.9"
    )  # step 5 as printed, with P_b in the place of P_H, is a misprint
    assert f"{100 * (1 - p.P[2]) / p.P[1]:.1f}" == "97.9"
    assert f"{-p.P_fv:.3f}" == "1.248"
    assert f"{-p.P_f - p.P_fv:.3f}" == "1.536"
    assert f"{-p.P_in:.3f}" == "-2.536"
    assert f"{100 * p.efficiency:.1f}" == "39.4"
    assert f"{p.K:.2f}" == "-4.92"
    assert p.regime == "negative recirculation"


@pytest.mark.parametrize(("r", "P_b", "P_H"), [(-0.03, "-59.6", "57.5"), (0.03, "53.8", "-55.9")])
def test_figure_6(r: float, P_b: str, P_H: str) -> None:
    """Fig. 6b is printed with 0.05; its powers are those of 0.03."""
    p = example(r)
    assert f"{-p.P[1]:.1f}" == P_b
    assert f"{-p.P[2]:.1f}" == P_H


def test_six_ratios_and_ranges_of_the_unit() -> None:
    printed = [-1.7, 2.7, 0.630, 0.37, 1.59, -0.59]
    assert [relative_ratio(c, R_O) for c in CONNECTIONS.values()] == pytest.approx(printed, abs=0.005)
    assert f"{unit_ratio(CONNECTIONS[6], R_O, 0.5):.3f}" == "0.685"  # printed: 0.69 to 1.66
    assert f"{unit_ratio(CONNECTIONS[6], R_O, 2.0):.3f}" == "1.630"


@pytest.fixture(scope="module")
def plants() -> dict[tuple[str, int], pt.Plant[SplitPathBench]]:
    differential = FundamentalDifferential.from_teeth(Sun(90), Ring(153), Planets(31), eta_ab=ETA, eta_ba=ETA)
    kinds: list[tuple[Any, int]] = [(c, n) for c in COUPLINGS for n in TYPES]
    return {
        (c, n): pt.compile(
            SplitPathBench(transmission=SplitPathTransmission(layout=TYPES[n], coupling=c, differential=differential))
        )
        for c, n in kinds
    }


def against_motion(r: np.ndarray[Any, Any]) -> dict[str, Any]:
    """A grid over r with a load of 10 N.m that takes power."""
    return {"r": xr.DataArray(r, dims="r"), "load": xr.DataArray(np.where(r < 0, 10.0, -10.0), dims="r")}


@pytest.mark.parametrize("coupling", COUPLINGS)
@pytest.mark.parametrize("number", TYPES)
@pytest.mark.parametrize("ratio", [-1.7, -0.4, 3.0, 1.02])
def test_steady_points_are_the_closed_form(plants: Any, coupling: str, number: int, ratio: float) -> None:
    """Also where self-locking leaves none or several (R_o = 1.02), or power that recirculates is more than the gears can pass."""
    plant = plants[coupling, number]
    r = np.setdiff1d(np.linspace(-2, 3, 51).round(6), [0.0, 1.0])
    signals = ["V", "efficiency", "K", "P_1", "P_2", "P_3"]
    grid = {**against_motion(r), f"{GEAR}.ratio": ratio}
    found = pt.steady(plant, grid, outputs=[*signals, f"{GEAR}.*.tau"])
    every = [solutions(CONNECTIONS[number], ratio, x, ETA, ETA_V, coupling) for x in r]
    assert found.status.values.tolist() == [{0: NONE, 1: OK}.get(len(points), SEVERAL) for points in every]
    good = found.status.values == OK
    assert good.all() or ratio != R_O
    found, r, exact = found.isel(r=good), r[good], [points[0] for points in every if len(points) == 1]
    output = 1000.0 * np.abs(r)
    values = {
        "V": [p.V for p in exact],
        "efficiency": [p.efficiency for p in exact],
        "K": [p.K for p in exact],
        **{f"P_{i}": [p.P[i] * w for p, w in zip(exact, output, strict=True)] for i in (1, 2, 3)},
    }
    for member, short in (("a", "a"), ("b", "b"), ("carrier", "H")):
        values[f"{GEAR}.{member}.tau"] = [p.torque[short] * w / 100 for p, w in zip(exact, output, strict=True)]
    for name, value in values.items():
        np.testing.assert_allclose(found[name], value, rtol=1e-9, atol=1e-9, err_msg=name)


@pytest.mark.parametrize("number", TYPES)
def test_without_losses(plants: Any, number: int) -> None:
    """K_o, Fig. 14; without a loss no torque is left open at r = 1 either."""
    r = np.setdiff1d(np.linspace(-2, 3, 26).round(6), [0.0])
    ideal = {f"{part}.eta_{way}": 1.0 for part in (GEAR, "transmission.cvu") for way in ("ab", "ba")}
    found = pt.steady(plants["input", number], against_motion(r), outputs=["K", "efficiency"], parameters=ideal)
    assert (found.status == OK).all(), found.attrs["problems"]
    exact = [lossless_fraction(CONNECTIONS[number], R_O, x) for x in r]
    np.testing.assert_allclose(found["efficiency"], 1.0, rtol=1e-12)
    np.testing.assert_allclose(found["K"], exact, rtol=1e-9, atol=1e-12)


def test_interval_at_one(plants: Any) -> None:
    """Where all turns as one block the values of both sides are the ends of the interval."""
    for (coupling, number), plant in plants.items():
        found = pt.steady(plant, against_motion(np.array([1.0])), outputs=["efficiency", "K"])
        assert found.status.item() == STUCK
        sides = [only(solutions(CONNECTIONS[number], R_O, 1 + e, ETA, ETA_V, coupling)) for e in (-1e-9, 1e-9)]
        for name, ends in (("efficiency", [p.efficiency for p in sides]), ("K", [p.K for p in sides])):
            interval = [found[f"{name}_low"].item(), found[f"{name}_high"].item()]
            np.testing.assert_allclose(interval, sorted(ends), rtol=1e-6)


class Moving(pt.Component):
    """The transmission between small inertias, driven through an elastic shaft, until it has settled."""

    V: pt.Input = pt.signal_input("1", "Ratio of the variable unit")
    load: pt.Input = pt.signal_input("N.m", "Accelerating torque on the output")
    drive: ConstantSpeed = ConstantSpeed(w_fixed=100.0)
    shaft: SpringDamper = SpringDamper(c=1e4, d=20)
    J1: Inertia = Inertia(J=1e-2)
    J3: Inertia = Inertia(J=1e-2)
    transmission: SplitPathTransmission = SplitPathTransmission()
    torque: Torque = Torque()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.J1.flange_a)
        yield pt.connect(self.J1.flange_b, self.transmission.flange_a)
        yield pt.connect(self.transmission.flange_b, self.J3.flange_a)
        yield pt.connect(self.J3.flange_b, self.torque.flange)
        yield pt.connect(self.V, self.transmission.ratio)
        yield pt.connect(self.load, self.torque.tau)


@pytest.mark.parametrize("coupling", few(COUPLINGS))
@pytest.mark.parametrize("number", TYPES)
def test_simulations_end_at_the_closed_form(coupling: Any, number: int) -> None:
    plant = pt.compile(Moving(transmission=SplitPathTransmission(layout=TYPES[number], coupling=coupling)))
    for r in (-0.13, 0.03, 0.6, 1.8):
        exact = only(solutions(CONNECTIONS[number], R_O, r, ETA, ETA_V, coupling))
        load = ([0.0, 0.2], [0.0, math.copysign(10.0, -r)])
        end = plant.simulate(stop=1.0, inputs={"V": exact.V, "load": load}, starts={"J1.w": 100.0}, rtol=1e-10)
        assert end["J3.w"][-1] == pytest.approx(100 * r, rel=1e-9)
        power = end["transmission.flange_a.tau"][-1] * 100
        assert power == pytest.approx(exact.P_in * 1000 * abs(r), rel=1e-9)
        for member, short in (("a", "a"), ("b", "b"), ("carrier", "H")):
            torque = end[f"{GEAR}.{member}.tau"][-1]
            assert torque == pytest.approx(exact.torque[short] * 10 * abs(r), rel=1e-9)


class Switching(pt.Component):
    """The switched transmission with its clutches, between small inertias."""

    V: pt.Input = pt.signal_input("1", "Ratio of the variable unit")
    load: pt.Input = pt.signal_input("N.m", "Accelerating torque on the output")
    shift: pt.Input = pt.signal_input("1", "0: first layout, 1: second")
    drive: ConstantSpeed = ConstantSpeed(w_fixed=100.0)
    shaft: SpringDamper = SpringDamper(c=1e4, d=20)
    J1: Inertia = Inertia(J=1e-2)
    J3: Inertia = Inertia(J=1e-2)
    transmission: SwitchedSplitPathTransmission
    torque: Torque = Torque()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.J1.flange_a)
        yield pt.connect(self.J1.flange_b, self.transmission.flange_a)
        yield pt.connect(self.transmission.flange_b, self.J3.flange_a)
        yield pt.connect(self.J3.flange_b, self.torque.flange)
        yield pt.connect(self.V, self.transmission.ratio)
        yield pt.connect(self.load, self.torque.tau)
        yield pt.connect(self.shift, self.transmission.shift)


@pytest.mark.slow
@pytest.mark.parametrize("name", COMBINATIONS)
def test_combinations_with_real_clutches_are_their_two_types(name: str) -> None:
    """Both layouts of a switched transmission, as its clutches hold them, have the efficiency of the plain ones."""
    pair = COMBINATIONS[name]
    gear = SwitchedSplitPathTransmission(first=TYPES[pair[0]], second=TYPES[pair[1]])
    plant = pt.compile(Switching(transmission=gear))
    for shift, number, r in ((0.0, pair[0], 0.6), (1.0, pair[1], 1.8)):
        exact = only(solutions(CONNECTIONS[number], R_O, r, ETA, ETA_V))
        speeds = dict(zip(CONNECTIONS[number], (100.0, 100 * exact.V, 100 * r), strict=True))
        starts = {f"transmission.shafts[{k}].w": speeds[m] for k, m in enumerate("abH")} | {"J1.w": 100.0}
        point = pt.steady(
            plant, {"V": exact.V, "load": -10.0, "shift": shift}, outputs=["J3.w", "transmission.flange_a.tau"]
        )
        assert point.status == 0, point.attrs["problems"]
        assert point["J3.w"].item() == pytest.approx(100 * r, rel=1e-9)
        assert point["transmission.flange_a.tau"].item() == pytest.approx(exact.P_in * 10 * r, rel=1e-9)
        inputs: dict[str, Any] = {"V": exact.V, "load": ([0.0, 0.2], [0.0, -10.0]), "shift": shift}
        end = plant.simulate(stop=1.0, inputs=inputs, starts=starts, rtol=1e-9, atol=1e-12)
        assert end["J3.w"][-1] == pytest.approx(100 * r, rel=1e-8)
        assert end["transmission.flange_a.tau"][-1] == pytest.approx(exact.P_in * 10 * r, rel=1e-8)


def test_a_load_that_is_there_at_the_start() -> None:
    """The torques' implicit equations have a solution for the right modes only, which the start has to find with them."""
    plant = pt.compile(Moving(transmission=SplitPathTransmission(layout="aHb", coupling="output")))
    V = only(solutions("aHb", -1.7, 0.03, 0.95, 0.9, "output")).V
    result = plant.simulate(stop=0.1, inputs={"V": V, "load": -10.0}, starts={"J1.w": 100.0}, rtol=1e-8, atol=1e-11)
    assert result["J1.w"][0] == pytest.approx(100.0)
    assert pt.energy_audit(result).closure < 1e-6


@pytest.mark.slow
def test_power_flow_at_both_ends_of_the_interval(plants: Any) -> None:
    """At r = 1, K and the efficiency of the power flow are those of the closed form on either side."""
    for (coupling, number), plant in plants.items():
        found = []
        for side in (1, -1):
            flow = pt.power_flow(plant, against_motion(np.array([1.0])), side=side)
            assert flow.data["status"].item() == STUCK
            assert abs(flow.imbalance).max() < 1e-9
            found.append((flow.variator("transmission.cvu").K.item(), flow.efficiency.item()))
        exact = [only(solutions(CONNECTIONS[number], R_O, 1 + e, ETA, ETA_V, coupling)) for e in (-1e-9, 1e-9)]
        expected = sorted((p.efficiency, p.K) for p in exact)
        for (share, efficiency), (right, K) in zip(sorted(found, key=lambda f: f[1]), expected, strict=True):
            assert efficiency == pytest.approx(right, rel=1e-6)
            if coupling == "input":
                assert share == pytest.approx(K, rel=1e-6)
