"""The one-dimensional vehicle: its parts add up to one equation, read their signals, and pull trailers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from joined import joined, run
from scipy.integrate import solve_ivp

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components import translational as tr
from powertrain.components.blocks import Constant, Ramp
from powertrain.components.vehicle import G_N, Vehicle

DATA: dict[str, Any] = {"m": 900.0, "J": 4.0, "R": 0.3, "A": 2.0, "Cd": 0.4, "rho": 1.2, "CrConstant": 0.012}


def test_one_equation_of_motion_while_it_rolls() -> None:
    car = Vehicle(**DATA, inclinationConstant=0.04, vWindConstant=-6)
    parts = (rot.ConstantTorque(tau_constant=400), car, tr.ConstantForce(f_constant=-100))
    result = run(joined(*parts, joints="0.flange=1.flangeR 2.flange=1.flangeT"), 20.0, {"1.v": 12.0})
    cosine = 1 / np.sqrt(1 + 0.04**2)

    def law(v: Any) -> Any:
        drag = 0.4 * 2 * 1.2 * (v + 6) ** 2 / 2
        road = 900 * G_N * cosine * (0.012 + 0.04)
        return (400 / 0.3 - 100 - drag - road) / (900 + 4 / 0.3**2)

    np.testing.assert_allclose(result["parts[1].a"], law(result["parts[1].v"]), rtol=1e-10)
    other = solve_ivp(lambda t, y: law(y), (0, 20), [12.0], rtol=1e-10, atol=1e-12)
    assert result["parts[1].v"][-1] == pytest.approx(other.y[0, -1], rel=1e-8)
    np.testing.assert_allclose(result["parts[1].inertia.w"] * 0.3, result["parts[1].v"], rtol=1e-12)


@pytest.mark.parametrize("v", [10.0, -10.0])
def test_it_coasts_to_rest_on_the_flat(v: float) -> None:
    result = run(joined(Vehicle(**DATA), joints=""), 150.0, {"0.v": v})
    speed = result["parts[0].v"]
    assert abs(speed[-1]) < 1e-6
    assert (np.diff(np.abs(speed)) <= 1e-9).all()
    assert (speed * np.sign(v) > -1e-9).all()


def test_it_rolls_down_a_slope_to_a_steady_speed() -> None:
    result = run(joined(Vehicle(**DATA, inclinationConstant=-0.05), joints=""), 600.0, {"0.v": 1.0}, rtol=1e-8)
    cosine = 1 / np.sqrt(1 + 0.05**2)
    steady = np.sqrt(900 * G_N * cosine * (0.05 - 0.012) / (0.4 * 2 * 1.2 / 2))
    assert result["parts[0].v"][-1] == pytest.approx(steady, rel=1e-4)


def test_signals_take_the_place_of_constants() -> None:
    flags: dict[str, Any] = {"useWindInput": True, "useCrInput": True, "useInclinationInput": True}
    parts = (Vehicle(**DATA, **flags), Constant(k=-6), Constant(k=0.012), Ramp(height=0.04, duration=0))
    joints = "0.vWind=1.y 0.cr=2.y 0.inclination=3.y"
    one = run(joined(*parts, joints=joints), 10.0, {"0.v": 15.0}, points=20)
    other = run(
        joined(Vehicle(**DATA, inclinationConstant=0.04, vWindConstant=-6), joints=""), 10.0, {"0.v": 15.0}, points=20
    )
    np.testing.assert_allclose(one["parts[0].v"], other["parts[0].v"], rtol=1e-9)


def test_losses_are_drag_and_rolling_resistance() -> None:
    result = run(joined(Vehicle(**DATA), joints=""), 5.0, {"0.v": 20.0})
    v = result["parts[0].v"]
    lost = result["parts[0].fDrag.lossPower"] + result["parts[0].fRoll.lossPower"]
    np.testing.assert_allclose(-(900 + 4 / 0.09) * result["parts[0].a"] * v, lost, rtol=1e-9)


def test_a_trailer_halves_the_acceleration() -> None:
    data = {**DATA, "Cd": 0.0, "CrConstant": 0.0}
    alone = run(joined(rot.ConstantTorque(tau_constant=300), Vehicle(**data), joints="0.flange=1.flangeR"), 5.0)
    parts = (rot.ConstantTorque(tau_constant=300), Vehicle(**data), Vehicle(**data))
    pulled = run(joined(*parts, joints="0.flange=1.flangeR 1.flangeT=2.flangeT"), 5.0)
    assert pulled["parts[2].v"][-1] == pytest.approx(alone["parts[1].v"][-1] / 2, rel=1e-9)


def test_data_can_be_changed_without_a_new_compilation() -> None:
    plant = pt.compile(joined(Vehicle(**DATA), joints=""))
    heavy = plant.simulate(5.0, starts={"parts[0].v": 20.0}, parameters={"parts[0].m": 1800.0})
    light = plant.simulate(5.0, starts={"parts[0].v": 20.0})
    assert heavy["parts[0].v"][-1] > light["parts[0].v"][-1]
    with pytest.raises(pt.ParameterError, match=r"parts\[0\]\.m = -1 kg is outside its range"):
        plant.simulate(1.0, parameters={"parts[0].m": -1.0})
