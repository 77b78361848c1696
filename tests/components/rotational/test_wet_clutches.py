"""Wet clutches: fill of the piston, friction over speed and temperature, and the drag of open plates, against closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from joined import joined, run
from scipy.integrate import quad

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Constant, TimeTable
from powertrain.components.thermal import FixedTemperature, HeatCapacitor


@pytest.mark.parametrize("supply", [1.5e5, 3e5, 8e5])
def test_fill_takes_its_time(supply: float) -> None:
    """dV/Q over both segments of the return spring, by quadrature and ``fill_time``; then fn = A p - F_0 - c s."""
    piston = rot.ClutchPiston(p_lam=0.1)
    result = run(joined(piston, Constant(k=supply), joints="1.y=0.p_supply"), 1.5)
    V, t = result["parts[0].V"], result.time
    full = 5e-7 + 0.01 * 2e-3
    touched = float(np.interp(full, V, t))

    def waits(volume: float) -> float:
        pressure = 800 / 0.01 * min(volume / 5e-7, 1.0) + 2e5 * max(volume - 5e-7, 0.0) / 0.01**2
        return 1 / (3e-4 * math.sqrt((supply - pressure) / 5e5))

    expected = quad(waits, 0, 5e-7)[0] + quad(waits, 5e-7, full)[0]
    assert piston.fill_time(supply) == pytest.approx(expected, rel=1e-9)
    assert touched == pytest.approx(expected, rel=2e-3)  # read off between two steps
    s = result["parts[0].s"][-1]
    assert result["parts[0].p"][-1] == pytest.approx(supply, rel=1e-6)
    assert result["parts[0].fn"][-1] == pytest.approx(0.01 * supply - 800 - 2e5 * s, rel=1e-4)
    assert result["parts[0].fn"][-1] == pytest.approx(2e7 * (s - 2e-3), rel=1e-9)


def test_below_the_kiss_point_nothing_is_pressed() -> None:
    piston = rot.ClutchPiston()
    assert piston.p_kiss == pytest.approx(1.2e5)
    assert piston.fill_time(1.19e5) == math.inf
    table = TimeTable(table=((0.0, 1.15e5), (2.0, 1.15e5), (2.0, -1e5)))
    result = run(joined(piston, table, joints="1.y=0.p_supply"), 4.0)
    assert not result["parts[0].fn"].any()
    assert result.at([1.9], "parts[0].s")[0] == pytest.approx((1150 - 800) / 2e5, rel=1e-4)
    assert result["parts[0].V"].min() > -1e-15
    assert result["parts[0].V"][-1] < 1e-8


@pytest.mark.parametrize("size", [1.0, 1e-2, 1e-5])
def test_pressure_is_that_of_the_spring_however_small_the_volume(size: float) -> None:
    """A hysteresis of 1e-10 m3 of the lift let the pressure of a volume of 5 mm3 overshoot by 1.3 kPa, and kept 5e-12 m3 from lifting."""
    piston = rot.ClutchPiston(V_0=5e-7 * size, Q_valve=3e-4 * size)
    result = run(joined(piston, Constant(k=3e5), joints="1.y=0.p_supply"), 0.02)
    filled, over = (
        np.minimum(result["parts[0].V"] / (5e-7 * size), 1.0),
        np.maximum(result["parts[0].V"] - 5e-7 * size, 0.0),
    )
    assert over[-1] > 0
    np.testing.assert_allclose(result["parts[0].p"], 800 / 0.01 * filled + 2e5 * over / 0.01**2, rtol=1e-8, atol=1e-3)


def rising(axis: str, unit: str, points: list[float], values: list[float]) -> pt.Map:
    return pt.Map.curve(points, values, x=axis, x_unit=unit, name="mue", outside="clip")


def slipping(clutch: rot.WetClutch, *heat: Any, joints: str = "", w: float = 100.0) -> Any:
    parts = clutch, rot.Inertia(J=0.5), rot.Fixed(), Constant(k=0.5), *heat
    wired = f"0.flange_a=2.flange 0.flange_b=1.flange_a 3.y=0.f_normalized {joints}"
    return run(joined(*parts, joints=wired), 0.5, {"1.w": w})


def test_friction_over_speed_decays_exponentially() -> None:
    """mue = 0.1 + w/1000: w + 100 falls with exp(-cgeo fn/(1000 J) t)."""
    mue = rising("w_rel", "rad/s", [0.0, 200.0], [0.1, 0.3])
    result = slipping(rot.WetClutch(mue=mue, cgeo=0.6, fn_max=2000))
    rate = 0.6 * 1000 / 1000 / 0.5
    np.testing.assert_allclose(result["parts[1].w"] + 100, 200 * np.exp(-rate * result.time), rtol=1e-8)


def test_warm_plates_rub_less() -> None:
    """At 353.15 K the clutch has the friction that the map has there."""
    mue = rising("T", "K", [293.15, 393.15], [0.14, 0.10])
    clutch = rot.WetClutch(mue=mue, cgeo=0.5, fn_max=400)
    result = slipping(clutch, FixedTemperature(T=353.15), joints="0.heat_port=4.port")
    assert result["parts[1].w"][-1] == pytest.approx(100 - 0.5 * 200 * 0.116 / 0.5 * 0.5, rel=1e-9)


def test_plates_take_the_heat_and_fade() -> None:
    """Adiabatic plates: T - T_0 = (J/2) (w_0^2 - w^2)/C at every instant, and friction follows it."""
    mue = rising("T", "K", [293.15, 393.15], [0.14, 0.04])
    clutch = rot.WetClutch(mue=mue, cgeo=0.5, fn_max=400)
    result = slipping(clutch, HeatCapacitor(C=50), joints="0.heat_port=4.port")
    w, T = result["parts[1].w"], result["parts[4].T"]
    np.testing.assert_allclose(T - 293.15, 0.5 / 2 * (100**2 - w**2) / 50, rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(result["parts[0].tau"], 0.5 * 200 * (0.14 - 0.001 * (T - 293.15)), rtol=1e-7)


def test_a_map_of_something_else() -> None:
    wrong = rising("speed", "rad/s", [0.0, 1.0], [0.1, 0.1])
    with pytest.raises(
        pt.ParameterError, match=r"mue: .* cannot depend on speed \[rad/s\], only on w_rel \[rad/s\], T \[K\]"
    ):
        slipping(rot.WetClutch(mue=wrong, fn_max=1))
    with pytest.raises(pt.ParameterError, match=r"mue: map \[N.m\] is not a coefficient of friction \[1\]"):
        slipping(rot.WetClutch(mue=pt.Map.constant(0.1, x="T", x_unit="K", unit="N.m"), fn_max=1))
    with pytest.raises(pt.ParameterError, match=r"falls to -0\.1"):
        slipping(rot.WetClutch(mue=rising("w_rel", "rad/s", [0.0, 1.0], [0.1, -0.1]), fn_max=1))


class Spun(pt.Component):
    """Plates at rest and plates that turn."""

    w: pt.Input = pt.signal_input("rad/s", "Speed")
    drag: rot.PlateDrag = rot.PlateDrag()
    turns: rot.Speed = rot.Speed(exact=True)
    held: rot.Fixed = rot.Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.w, self.turns.w_ref)
        yield pt.connect(self.turns.flange, self.drag.flange_b)
        yield pt.connect(self.held.flange, self.drag.flange_a)


def test_drag_of_open_plates() -> None:
    """Couette's torque up to the speed at which the film shrinks, where the drag peaks; none beyond r_o/r_i times this speed."""
    peak = math.sqrt(20 * 0.06 * 5e-6 / (math.pi * 850 * 0.2e-3**3 * 0.075**2))
    shear = 10 * math.pi * 0.06 * (0.075**4 - 0.060**4) / (2 * 0.2e-3)
    speed = np.array([0.5, 0.99, 1.0, 1.1, 1.2, 1.26, 2.0]) * peak
    plant = pt.compile(Spun())
    torque = np.array([pt.simulate(plant, 0.01, inputs={"w": w})["drag.tau"][-1] for w in speed])
    np.testing.assert_allclose(torque[:3], shear * speed[:3], rtol=1e-9)
    assert torque.argmax() == 2
    shrunk = 10 * math.pi * 0.06 * (0.075**4 / 1.1**4 - 0.060**4) / (2 * 0.2e-3) * speed[3]
    assert torque[3] == pytest.approx(shrunk, rel=1e-9)
    np.testing.assert_allclose(torque[5:], 0, atol=1e-12)


def test_the_film_carries_what_the_profile_says() -> None:
    """The flow at which the film shrinks is the integral of mu u'' = -rho w^2 r (z/h)^2 over the gap."""
    eta, rho, w, r, h = 0.06, 850.0, 60.0, 0.07, 0.2e-3
    profile = quad(lambda z: rho * w**2 * r / (12 * eta) * (h * z - z**4 / h**2), 0, h)[0]
    assert 2 * math.pi * r * profile == pytest.approx(math.pi * rho * w**2 * r**2 * h**3 / (20 * eta), rel=1e-9)


def test_a_hydraulic_clutch_starts_a_load() -> None:
    """Fill, slip and stick; what is lost is the heat of plates and oil."""
    table = TimeTable(table=((0.0, 0.0), (0.1, 0.0), (0.1, 3e5)))
    clutch = rot.HydraulicClutch()
    parts = clutch, rot.Inertia(J=0.5), rot.Inertia(J=1.0), table
    result = run(
        joined(*parts, joints="0.flange_a=1.flange_a 0.flange_b=2.flange_a 3.y=0.p_supply"), 2.0, {"1.w": 150.0}
    )
    stuck = next(e.time for e in result.events if e.name == "parts[0].friction.mode" and e.new == 0)
    assert 0.1 + clutch.piston.fill_time(3e5) < stuck < 1.0
    np.testing.assert_allclose(result["parts[2].w"][-1], 50, rtol=1e-9)
    heat = 600 * (result["parts[0].plates.T"][-1] - 293.15) + 80 * np.trapezoid(
        result["parts[0].plates.T"] - 293.15, result.time
    )
    assert heat == pytest.approx(0.5 * 150**2 / 2 * (1 - 0.5 / 1.5), rel=2e-3)
    assert pt.energy_audit(result).closure < 1e-8
    with pytest.raises(pt.ParameterError, match="fn_max"):
        rot.HydraulicClutch(friction=rot.WetClutch(fn_max=1))
