"""Torque converter and fluid coupling against their tables: stall, drive, coupling, overrun, lock-up."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from joined import joined, run

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Constant, TimeTable
from powertrain.components.transmissions import FluidCoupling, NeutralIdleConverter, StartingConverter, TorqueConverter

ROWS = ((0.0, 17.0, 2.0), (0.4, 18.0, 1.5), (0.8, 20.0, 1.1), (0.86, 22.0, 1.0), (0.97, 40.0, 1.0))
CONVERTER = TorqueConverter(table=ROWS)


def held(part: pt.Component, w_a: float, w_b: float) -> tuple[float, float, float]:
    """Torques at pump, turbine and housing with both speeds given."""
    ends = rot.ConstantSpeed(w_fixed=w_a), rot.ConstantSpeed(w_fixed=w_b)
    result = run(joined(part, *ends, joints="0.flange_a=1.flange 2.flange=0.flange_b"), 0.1)
    tau_a, tau_b = (float(result[f"parts[0].{name}.tau"][-1]) for name in ("flange_a", "flange_b"))
    loss = float(result["parts[0].lossPower"][-1])
    assert loss == pytest.approx(tau_a * w_a + tau_b * w_b, abs=1e-9)
    assert loss >= 0
    if w_a * w_b >= 0:
        drive, coast = (float(result[f"parts[0].tau_{wheel}"][-1]) for wheel in ("drive", "coast"))
        assert tau_a == pytest.approx(drive - coast, rel=1e-9, abs=1e-9)
    return tau_a, tau_b, -tau_a - tau_b


@pytest.mark.parametrize(("nu", "K", "R"), ROWS)
@pytest.mark.parametrize("w_a", [100.0, 300.0, -100.0])
def test_rows_of_the_table(nu: float, K: float, R: float, w_a: float) -> None:
    tau_a, tau_b, tau_h = held(CONVERTER, w_a, nu * w_a)
    assert tau_a == pytest.approx(np.sign(w_a) * (w_a / K) ** 2, rel=1e-6)
    assert tau_b == pytest.approx(-R * tau_a, rel=1e-6)
    assert tau_h == pytest.approx((R - 1) * tau_a, rel=1e-6, abs=1e-6)


def test_beyond_and_against() -> None:
    """No torque at equal speeds; overrun is a coupling with the wheels exchanged; against each other the pump's torque is that of stall."""
    assert held(CONVERTER, 200.0, 200.0)[0] == pytest.approx(0, abs=1e-6)
    tau_a, tau_b, _ = held(CONVERTER, 100.0, 250.0)
    assert tau_b == pytest.approx((250 / 18.0) ** 2, rel=1e-6)
    assert tau_a == pytest.approx(-tau_b)
    tau_a, tau_b, _ = held(CONVERTER, 100.0, -50.0)
    assert tau_a == pytest.approx((100 / 17) ** 2)
    assert tau_b == pytest.approx(-2 * (100 / 17) ** 2)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("w_a", "w_b", "pump", "turbine"),
    [(100, -50, 1.0e4, 2.0e4), (100, -120, 1.44e4, 2.0e4), (100, -200, 4.0e4, 4.0e4), (0, -50, 2.5e3, 2.5e3)],
)
def test_wheels_against_each_other(sign: float, w_a: float, w_b: float, pump: float, turbine: float) -> None:
    """The faster wheel drives as at stall; the turbine has twice the torque that the pump gives, or its own if that is larger."""
    tau_a, tau_b, _ = held(CONVERTER, sign * w_a, sign * w_b)
    assert sign * tau_a == pytest.approx(pump / 17**2, rel=1e-6)
    assert sign * tau_b == pytest.approx(-turbine / 17**2, rel=1e-6)
    tau_a, tau_b, _ = held(FluidCoupling(table=((0.0, 2e-3), (1.0, 0.0)), D=0.4, rho=850), sign * w_a, sign * w_b)
    assert sign * tau_a == pytest.approx(2e-3 * 850 * 0.4**5 * max(abs(w_a), abs(w_b)) ** 2, rel=1e-6)
    assert tau_b == pytest.approx(-tau_a)


@pytest.mark.parametrize("w_b", [0.0, -100.0, -100 * math.sqrt(2), 100.0])
def test_torque_is_continuous_in_speed(w_b: float) -> None:
    """Where a wheel stops, where the other one becomes the faster one, and where its torque becomes the larger one."""
    low, high = (held(CONVERTER, 100.0, w_b + d) for d in (-1e-4, 1e-4))
    np.testing.assert_allclose(low, high, atol=1e-2)


def test_an_engine_stalls_at_its_k_factor() -> None:
    """150 N.m against a turbine that is held: w = K root(tau), twice the torque at the turbine."""
    parts = CONVERTER, rot.ConstantTorque(tau_constant=150), rot.Inertia(J=0.2), rot.Fixed()
    result = run(joined(*parts, joints="1.flange=2.flange_a 2.flange_b=0.flange_a 0.flange_b=3.flange"), 20.0)
    assert result["parts[2].w"][-1] == pytest.approx(17 * np.sqrt(150), rel=1e-6)
    assert result["parts[0].flange_b.tau"][-1] == pytest.approx(-300, rel=1e-6)


def test_a_converter_by_its_stall_has_the_torques_of_the_default_in_proportion() -> None:
    """1,200 N.m at 180 rad/s, and 1,200/150 times those of the default at 17 root(150) rad/s for every speed ratio."""
    made, like = TorqueConverter.of_stall(180, "1.2 kN.m"), TorqueConverter()
    assert held(made, 180, 0) == pytest.approx((1200, -2400, 1200))
    w = 17 * math.sqrt(150)
    for nu in (0.3, 0.9):
        assert held(made, 180, nu * 180) == pytest.approx([8 * tau for tau in held(like, w, nu * w)])
    assert float(made.tau_max) == 1800
    with pytest.raises(pt.ParameterError, match="of_stall: tau = 0"):
        TorqueConverter.of_stall(180, 0)


def driven_off(lockup: float, stop: float = 30.0) -> Any:
    """150 N.m move 10 kg.m2 at the turbine."""
    parts = CONVERTER, rot.ConstantTorque(tau_constant=150), rot.Inertia(J=0.2), rot.Inertia(J=10), Constant(k=lockup)
    wired = "1.flange=2.flange_a 2.flange_b=0.flange_a 0.flange_b=3.flange_a 4.y=0.lockup"
    return run(joined(*parts, joints=wired), stop)


def test_driving_off_multiplies_the_torque() -> None:
    result = driven_off(0.0)
    early = float(result.at([1.0], "parts[3].a")[0])
    assert 1.7 * 15 < early < 2 * 15
    late = result["parts[3].w"][-1] / result["parts[2].w"][-1]
    assert 0.95 < late < 1
    assert pt.energy_audit(result).closure < 1e-7


def test_lockup_joins_pump_and_turbine() -> None:
    result = driven_off(1.0, 5.0)
    np.testing.assert_allclose(result["parts[3].w"], 150 / 10.2 * result.time, rtol=1e-6, atol=1e-9)
    assert np.abs(result["parts[0].lossPower"]).max() < 1e-9


def test_the_lockup_fills_slowly_and_empties_at_once() -> None:
    """A turbine at 200 rad/s from 1 s to 3 s, above the speeds of closing: filling is 1 - exp(-t/T), and a slow turbine has no lock-up."""
    device = StartingConverter(converter=CONVERTER, w_lock=105, band=10, T_fill=0.5)
    turbine = rot.Speed(), TimeTable(table=((0.0, 50.0), (1.0, 50.0), (1.0001, 200.0), (3.0, 200.0), (3.0001, 50.0)))
    parts = device, rot.ConstantSpeed(w_fixed=220), *turbine
    result = run(joined(*parts, joints="1.flange=0.flange_a 0.flange_b=2.flange 3.y=2.w_ref"), 4)
    found = result.at([0.5, 1.5, 2.0, 3.1], "parts[0].converter.lockup")
    np.testing.assert_allclose(found, [0, 1 - math.exp(-1), 1 - math.exp(-2), 0], atol=3e-3)


def idling(brake: tuple[tuple[float, float], ...], w_b: float) -> Any:
    """A pump at 75 rad/s before a shaft at a given speed, with a brake pedal over time."""
    device = NeutralIdleConverter(converter=StartingConverter(converter=CONVERTER), T_fill=0.2)
    parts = device, rot.ConstantSpeed(w_fixed=75), rot.ConstantSpeed(w_fixed=w_b), TimeTable(table=brake)
    return run(joined(*parts, joints="1.flange=0.flange_a 0.flange_b=2.flange 3.y=0.brake"), 4)


def test_a_converter_does_not_drag_at_rest_with_the_brake_pressed() -> None:
    """Released, the pump takes (w/K)^2 as at stall; pressed, the turbine turns with it."""
    result = idling(((0.0, 0.0), (1.0, 0.0), (1.001, 0.3), (3.0, 0.3), (3.001, 0.0)), 0.0)
    pump = result.at([0.9, 2.9, 3.9], "parts[0].flange_a.tau")
    np.testing.assert_allclose(pump, [(75 / 17) ** 2, 0, (75 / 17) ** 2], atol=0.1)
    assert result.at([2.9], "parts[0].turbine.w")[0] == pytest.approx(75, rel=0.01)
    assert pt.energy_audit(result).closure < 1e-6


def test_a_brake_opens_no_clutch_while_the_car_moves() -> None:
    result = idling(((0.0, 0.0), (1.0, 0.0), (1.001, 0.3), (4.0, 0.3)), 20.0)
    early, late = result.at([0.9, 3.9], "parts[0].flange_a.tau")
    assert late == pytest.approx(early, rel=1e-6)


@pytest.mark.parametrize(
    ("table", "said"),
    [
        (((0.1, 17.0, 2.0), (0.8, 20.0, 1.1)), "is not a table of rows .nu, K, R. with nu starting at 0"),
        (((0.0, 17.0, 2.0), (0.8, -20.0, 1.1)), "a K factor of -20"),
        (((0.0, 17.0, -2.0), (0.5, 17.0, 1.0)), "a torque ratio R of -2; it must not be negative"),
        (((0.0, 17.0, 2.0), (0.8, 20.0, 1.3)), "between nu = 0 and 0.8 the torque ratio times nu rises to 1.04"),
        (((0.0, 17.0, 2.0), (0.8, 20.0, 1.24)), "between nu = 0.8 and 1 .* rises to 1.24"),
    ],
)
def test_tables_that_are_none(table: Any, said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        held(TorqueConverter(table=table), 100.0, 0.0)


def test_fluid_coupling() -> None:
    """lambda rho D^5 w^2 at the rows, half of it between two of 2 and 1, the same torque on both sides."""
    coupling = FluidCoupling(table=((0.0, 2e-3), (0.8, 1e-3), (1.0, 0.0)), D=0.4, rho=850)
    unit = 850 * 0.4**5
    for w_a, w_b, torque in (
        (150, 0, 2e-3 * 150**2),
        (150, 60, 1.5e-3 * 150**2),
        (150, 135, 5e-4 * 150**2),
        (60, 150, -1.5e-3 * 150**2),
    ):
        tau_a, tau_b, tau_h = held(coupling, w_a, w_b)
        assert tau_a == pytest.approx(torque * unit, rel=1e-6)
        assert tau_b == pytest.approx(-tau_a)
        assert tau_h == pytest.approx(0, abs=1e-9)
    for rows in (((0.0, 2e-3), (0.9, 0.0)), ((0.0, 2e-3), (0.8, 1e-3), (0.5, 1e-3), (1.0, 0.0))):
        with pytest.raises(pt.ParameterError, match=r"parts\[0\].table: .* not a table of rows"):
            held(FluidCoupling(table=rows), 1.0, 0.0)
