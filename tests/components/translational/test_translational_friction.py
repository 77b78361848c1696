"""Guides, brakes, stops and resistances: closed forms, sticking, breaking loose, mirrored models."""

from __future__ import annotations

import math

import numpy as np
import pytest
from joined import joined, run

import powertrain as pt
from powertrain.components import translational as tr
from powertrain.components.blocks import Constant, Ramp, Sine, TimeTable
from powertrain.components.thermal import FixedTemperature, HeatCapacitor

JOINTS = "0.flange=1.flange_a 1.flange_b=2.flange_a"


def guided(guide: pt.Component, force: float = 0.0, rate: float = 0.0) -> pt.Component:
    """A mass of 2 kg in a guide under a force that grows at a rate."""
    parts = (tr.Force(), tr.Mass(m=2), guide, Ramp(height=10 * rate, duration=10, offset=force))
    return joined(*parts, joints=f"{JOINTS} 3.y=0.f")


@pytest.mark.parametrize("sign", [1, -1])
def test_guide_stops_a_mass_and_holds_it(sign: int) -> None:
    result = run(guided(tr.SupportFriction(f_pos=((0.0, 4.0),)), sign * 3.0), 6.0, {"1.v": sign * 2.0})
    t = result.time
    stop = 2.0 * 2 / (4 - 3)
    np.testing.assert_allclose(result["parts[1].v"], sign * np.maximum(2 - t / 2, 0), atol=1e-9)
    assert set(result["parts[2].mode"][t < stop - 1e-6]) == {sign}
    assert set(result["parts[2].mode"][t > stop + 1e-6]) == {0}
    np.testing.assert_allclose(result["parts[2].f"][t > stop + 1e-6], sign * 3.0, rtol=1e-9)
    assert result["parts[1].s"][-1] == pytest.approx(sign * 4.0, rel=1e-8)
    assert (result["parts[1].v"][t > stop + 1e-6] == 0).all()


@pytest.mark.parametrize("peak", [1.0, 1.5])
def test_guide_breaks_loose_at_its_peak(peak: float) -> None:
    result = run(guided(tr.SupportFriction(f_pos=((0.0, 4.0),), peak=peak), rate=2.0), 4.0, {"1.v": 0.0})
    loose, t = peak * 4 / 2, result.time
    assert result.events[0].time == pytest.approx(loose, abs=1e-8)
    after = np.maximum(t - loose, 0)
    expected = ((peak - 1) * 4 * after + after**2) / 2
    np.testing.assert_allclose(result["parts[1].v"], expected, atol=1e-8)


def test_guide_follows_its_table() -> None:
    """f = 4 - v below 2 m/s, 2 + (v - 2) up to 3 m/s and beyond: v' = -f/2 from 6 m/s."""
    result = run(guided(tr.SupportFriction(f_pos=((0.0, 4.0), (2.0, 2.0), (3.0, 3.0)))), 3.0, {"1.v": 6.0})
    t = result.time
    bend = 2 * math.log(6 / 2)
    expected = np.where(t < bend, 6 * np.exp(-t / 2), 4 - 2 * np.exp((t - bend) / 2))
    np.testing.assert_allclose(result["parts[1].v"], expected, atol=1e-8)


def test_stribeck_table() -> None:
    table = tr.stribeck_table(F_prop=1, F_Coulomb=5, F_Stribeck=10, fexp=2, v_max=12, rows=50)
    assert (len(table), table[0]) == (50, (0.0, 15.0))
    assert table[-1] == pytest.approx((12.0, 5 + 12 + 10 * math.exp(-24)))
    for v_max, rows in ((12.0, 1), (0.0, 50), (math.nan, 50), (math.inf, 50)):
        with pytest.raises(pt.ParameterError, match=f"stribeck_table: .* not {rows} and {v_max:g} m/s"):
            tr.stribeck_table(F_prop=1, F_Coulomb=5, F_Stribeck=10, fexp=2, v_max=v_max, rows=rows)


def braked(pressure: pt.Component, v: float, **brake: float) -> pt.Component:
    parts = (tr.Brake(fn_max=10, **brake), tr.Mass(m=2), pressure)  # type: ignore[arg-type]
    return joined(*parts, joints="0.flange_b=1.flange_a 2.y=0.f_normalized")


@pytest.mark.parametrize("v", [3.0, -3.0])
def test_brake_holds_only_while_it_is_pressed(v: float) -> None:
    """Open, then pressed with 2 * 0.5 * 10 N, then pulled apart."""
    table = TimeTable(table=((0.0, -1.0), (1.0, -1.0), (1.0, 1.0), (2.0, 1.0), (2.0, -0.5), (3.0, 0.0)))
    result = run(braked(table, v, cgeo=2), 3.0, {"1.v": v})
    t, sign = result.time, np.sign(v)
    assert set(result["parts[0].mode"][t < 1]) == {2}
    assert set(result["parts[0].mode"][t > 2]) == {2}
    expected = sign * np.where(t < 1, 3.0, np.maximum(3.0 - 5 * (t - 1), 0))
    np.testing.assert_allclose(result["parts[1].v"], expected, atol=1e-9)
    assert result.events[-1].time == 2.0
    assert result["parts[0].fn"][0] == -10


def test_brakes_heat_is_the_energy_of_the_mass() -> None:
    parts = (tr.Brake(fn_max=10), tr.Mass(m=2), Constant(k=1), HeatCapacitor(C=4))
    joints = "0.flange_b=1.flange_a 2.y=0.f_normalized 3.port=0.heat_port"
    result = run(joined(*parts, joints=joints), 3.0, {"1.v": 5.0})
    assert result["parts[3].T"][-1] - 293.15 == pytest.approx(2 * 25 / 2 / 4, rel=1e-9)
    assert result["parts[1].v"][-1] == 0


def test_a_brake_on_a_moving_support_pulls_along() -> None:
    parts = (tr.Mass(m=1), tr.Brake(fn_max=8), tr.Mass(m=3), Constant(k=1))
    result = run(
        joined(*parts, joints="0.flange_b=1.flange_a 1.support=2.flange_a 3.y=1.f_normalized"),
        2.0,
        {"0.v": 4.0, "2.v": 0.0},
    )
    assert result["parts[0].v"][-1] == pytest.approx(1.0, rel=1e-9)
    np.testing.assert_allclose(result["parts[0].v"] + 3 * result["parts[2].v"], 4.0, atol=1e-9)
    assert result["parts[1].mode"][-1] == 0


def stopped(F_Coulomb: float = 0.0, F_Stribeck: float = 0.0, F_prop: float = 0.0) -> tr.MassWithStopAndFriction:
    return tr.MassWithStopAndFriction(
        L=0.2, m=2, F_prop=F_prop, F_Coulomb=F_Coulomb, F_Stribeck=F_Stribeck, fexp=2, smin=-1, smax=1
    )


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("rub", [0.0, 3.0])
def test_a_mass_stays_at_its_stop_until_it_is_pulled_back(sign: int, rub: float) -> None:
    """Pushed against the stop with 10 N, then pulled back with growing force."""
    table = TimeTable(table=((0.0, sign * 10.0), (2.0, sign * 10.0), (6.0, -sign * 10.0), (9.0, -sign * 10.0)))
    result = run(joined(tr.Force(), stopped(rub), table, joints="0.flange=1.flange_a 2.y=0.f"), 9.0)
    t, s, v = result.time, sign * result["parts[1].s"], sign * result["parts[1].v"]
    arrival = math.sqrt(2 * 0.9 * 2 / (10 - rub))
    departure = 4 + 1.001 * rub / 5
    there = (t > arrival + 1e-6) & (t < departure - 1e-6)
    np.testing.assert_allclose(s[t < arrival], (10 - rub) / 4 * t[t < arrival] ** 2, atol=1e-8)
    np.testing.assert_allclose(s[there], 0.9, atol=1e-8)
    assert np.abs(v[there]).max() < 1e-14
    force = sign * (result["parts[1].f"] + result["parts[1].f_max"] - result["parts[1].f_min"])
    held = 10 - 5 * np.maximum(t - 2, 0)
    np.testing.assert_allclose(force[there], held[there], atol=1e-9)
    ahead, behind = ("stop_max", "stop_min") if sign > 0 else ("stop_min", "stop_max")
    assert set(result[f"parts[1].{ahead}"][there & (t < 4 - rub / 5 - 1e-6)]) == {1}
    if rub:
        changes = [event.time for event in result.events if event.name == "parts[1].mode" and event.time < 5]
        assert changes[-1] == pytest.approx(departure, abs=3e-7)  # 1e-7 of the 13 N that meet, at 5 N/s
    assert s[-1] == pytest.approx(-0.9, abs=1e-8)
    assert result[f"parts[1].{behind}"][-1] == 1
    assert s.max() < 0.9 + 1e-8


def test_a_mass_hits_its_stop_again_and_again() -> None:
    parts = (tr.Force(), stopped(F_Coulomb=1.0, F_prop=0.5), Sine(amplitude=20, f=0.5))
    result = run(joined(*parts, joints="0.flange=1.flange_a 2.y=0.f"), 20.0)
    s = result["parts[1].s"]
    assert (s.min(), s.max()) == pytest.approx((-0.9, 0.9), abs=1e-8)
    hits = [event.name for event in result.events if event.kind == "impact"]
    assert len(hits) == 20
    assert hits[::2] == ["parts[1].stop_max"] * 10
    assert hits[1::2] == ["parts[1].stop_min"] * 10
    assert result["parts[1].lossPower"].min() > -1e-7


def test_stribeck_friction_between_the_stops() -> None:
    """v' = -(F_prop v + F_Coulomb + F_Stribeck exp(-fexp v))/m against the same law given as a fine table."""
    formula = stopped(F_Coulomb=1, F_Stribeck=2, F_prop=0.5)
    table = tr.stribeck_table(F_prop=0.5, F_Coulomb=1, F_Stribeck=2, fexp=2, v_max=3, rows=3000)
    one = run(joined(formula, joints=""), 2.0, {"0.s": -0.8, "0.v": 1.2})
    parts = (tr.Mass(m=2), tr.SupportFriction(f_pos=table))
    two = run(joined(*parts, joints="0.flange_b=1.flange_a"), 2.0, {"0.s": -0.8, "0.v": 1.2})
    assert one["parts[0].s"][-1] == pytest.approx(two["parts[0].s"][-1], abs=1e-7)
    assert one.events[0].time == pytest.approx(two.events[0].time, abs=1e-6)


def test_a_mass_cannot_start_behind_its_stop() -> None:
    with pytest.raises(pt.InitializationError, match=r"stop_max .* overlap: the gap is -0\.1,"):
        run(joined(stopped(1.0), joints=""), 1.0, {"0.s": 1.0})


def test_a_mass_may_start_at_its_stop() -> None:
    parts = (tr.ConstantForce(f_constant=10), stopped(1.0))
    result = run(joined(*parts, joints="0.flange=1.flange_a"), 1.0, {"1.s": 0.9})
    assert np.abs(result["parts[1].v"]).max() < 1e-4
    np.testing.assert_allclose(result["parts[1].s"], 0.9, atol=1e-8)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("rub", [1.0, 3.0, 8.0])
@pytest.mark.parametrize("begins", [0.0, 0.9])
def test_a_mass_that_is_pressed_on_its_stop_is_stuck(sign: int, rub: float, begins: float) -> None:
    """Also where it is pressed harder than friction can take, which then is at its limit; as in the Modelica Standard Library."""
    parts = (tr.ConstantForce(f_constant=sign * 10), stopped(F_Coulomb=rub))
    result = run(joined(*parts, joints="0.flange=1.flange_a"), 4.0, {"1.s": sign * begins})
    mode, there = result["parts[1].mode"], np.abs(result["parts[1].s"]) > 0.9 - 1e-9
    assert (mode[there & (result["parts[1].v"] == 0.0)] == 0).all()
    assert (mode[~there] == sign).all()
    assert mode[-1] == 0
    assert abs(result["parts[1].f"][-1]) <= 1.001 * rub + 1e-9
    changes = [(event.old, event.new) for event in result.events if event.name == "parts[1].mode"]
    assert changes == ([] if begins else [(sign, 0)])


def test_a_mass_that_leaves_its_stop_slides() -> None:
    """Stuck while the stop holds it; the mode follows when it is pulled back."""
    table = TimeTable(table=((0.0, 10.0), (1.0, 10.0), (2.0, -10.0), (3.0, -10.0)))
    parts = (tr.Force(), stopped(F_Coulomb=3.0), table)
    result = run(joined(*parts, joints="0.flange=1.flange_a 2.y=0.f"), 2.0, {"1.s": 0.9})
    (leaves,) = [event for event in result.events if event.name == "parts[1].mode"]
    assert (leaves.old, leaves.new) == (0, -1)
    assert leaves.time == pytest.approx(1.65 + 1e-3 * 3 / 20, abs=1e-6)


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_what_is_rigidly_joined_to_a_mass_is_stopped_with_it(e: float) -> None:
    """A mass, a rod and a second mass rebound as one body; a third behind a spring goes on."""
    stop = tr.MassWithStopAndFriction(
        L=0.2, m=2, F_prop=0, F_Coulomb=0, F_Stribeck=0, fexp=0, smin=-1, smax=1, restitution=e
    )
    parts = (tr.Mass(m=3), tr.Rod(L=0.5), stop, tr.Mass(m=1), tr.Spring(c=1e-9))
    joints = "0.flange_b=1.flange_a 1.flange_b=2.flange_a 4.flange_a=2.flange_a 4.flange_b=3.flange_a"
    result = run(joined(*parts, joints=joints), 1.0, {"2.s": 0.5, "2.v": 1.0, "3.s": 0.0, "3.v": 1.0})
    after = result.time > 0.4 + 1e-6
    for mass in (0, 2):
        np.testing.assert_allclose(result[f"parts[{mass}].v"][after], -e, atol=1e-8)
    np.testing.assert_allclose(result["parts[3].v"], 1.0, atol=1e-8)


@pytest.mark.parametrize("reg", ["exp", "sine", "linear", "cosine"])
@pytest.mark.parametrize("sign", [1, -1])
def test_rolling_resistance_is_constant_away_from_standstill(reg: str, sign: int) -> None:
    rolling = tr.RollingResistance(fWeight=200, CrConstant=0.02, inclinationConstant=0.75, v0=1e-3, reg=reg)  # type: ignore[arg-type]
    result = run(joined(tr.Mass(m=2), rolling, joints="0.flange_b=1.flange"), 1.0, {"0.v": sign * 3.0})
    np.testing.assert_allclose(result["parts[0].v"], sign * (3 - 200 * 0.02 * 0.8 / 2 * result.time), atol=1e-9)
    np.testing.assert_allclose(result["parts[1].lossPower"], 3.2 * np.abs(result["parts[0].v"]), rtol=1e-9)


@pytest.mark.parametrize(
    ("reg", "shape"),
    [
        ("exp", lambda x: 2 / (1 + np.exp(-100 * x)) - 1),
        ("sine", lambda x: np.where(np.abs(x) < 1, np.sin(np.pi / 2 * x), np.sign(x))),
        ("linear", lambda x: np.clip(x, -1, 1)),
        ("cosine", lambda x: np.sign(x) * np.where(np.abs(x) < 1, 1 - np.cos(np.pi / 2 * x), 1)),
    ],
)
def test_smoothed_signs(reg: str, shape: np.ufunc) -> None:
    """The force of a source over an imposed speed from -2 v0 to 2 v0."""
    parts = (
        tr.SignForce(f_nominal=7, v0=0.5, reg=reg),  # type: ignore[arg-type]
        tr.Speed(exact=True),
        Ramp(height=2, duration=1, offset=-1),
        tr.RollingResistance(fWeight=7, CrConstant=1, v0=0.5, reg=reg),  # type: ignore[arg-type]
    )
    result = run(joined(*parts, joints="0.flange=1.flange=3.flange 2.y=1.v_ref"), 1.0)
    x = (2 * result.time - 1) / 0.5
    np.testing.assert_allclose(result["parts[0].f"], -7 * shape(x), atol=1e-9)
    np.testing.assert_allclose(result["parts[3].f"], 7 * shape(x), atol=1e-9)


def test_rolling_resistance_reads_its_signals() -> None:
    rolling = tr.RollingResistance(fWeight=100, useCrInput=True, useInclinationInput=True, reg="linear")
    parts = (rolling, tr.ConstantSpeed(v_fixed=2), Ramp(height=0.1, duration=1), Ramp(height=1, duration=1))
    result = run(joined(*parts, joints="0.flange=1.flange 2.y=0.cr 3.y=0.inclination"), 1.0)
    t = result.time
    np.testing.assert_allclose(result["parts[0].f"], 100 * 0.1 * t * np.cos(np.arctan(t)), atol=1e-12)


def test_a_negative_rolling_resistance_is_refused() -> None:
    """It would drive the wheel."""
    parts = (
        tr.RollingResistance(fWeight=100, useCrInput=True),
        tr.ConstantSpeed(v_fixed=2),
        Ramp(height=-0.1, duration=1),
    )
    with pytest.raises(pt.SimulationError, match=r"rolling resistance coefficient .* allowed is at least 0"):
        run(joined(*parts, joints="0.flange=1.flange 2.y=0.cr"), 1.0)


@pytest.mark.parametrize("sign", [1, -1])
def test_air_drag_decays_hyperbolically(sign: int) -> None:
    drag = tr.AirDrag(A=2, Cd=0.5, rho=1.2)
    result = run(joined(tr.Mass(m=3), drag, joints="0.flange_b=1.flange"), 10.0, {"0.v": sign * 20.0})
    k = 2 * 0.5 * 1.2 / 2 / 3
    np.testing.assert_allclose(result["parts[0].v"], sign * 20 / (1 + k * 20 * result.time), rtol=1e-8)


def test_eddy_current_brake_in_closed_form() -> None:
    """x' = -k 2x/(1 + x^2) with x = v/v_nominal: ln x + x^2/2 = ln x0 + x0^2/2 - 2 k t."""
    brake = tr.EddyCurrentForce(f_nominal=100, v_nominal=10)
    result = run(joined(tr.Mass(m=1), brake, joints="0.flange_b=1.flange"), 1.0, {"0.v": 20.0})
    x = result["parts[0].v"] / 10
    np.testing.assert_allclose(np.log(x) + x**2 / 2, math.log(2) + 2 - 2 * 10 * result.time, atol=1e-7)
    assert result["parts[1].f"].max() == pytest.approx(100, rel=1e-3)


def test_a_warm_eddy_current_brake_brakes_most_at_a_higher_speed() -> None:
    alpha = 0.004
    brake = tr.EddyCurrentForce(f_nominal=100, v_nominal=10, TRef=343.15, alpha20=alpha)
    result = run(joined(brake, tr.ConstantSpeed(v_fixed=5), joints="0.flange=1.flange"), 1.0)
    x = 5 / (10 * 1 / (1 + alpha * 50))
    np.testing.assert_allclose(result["parts[0].f"], 200 * x / (1 + x**2), rtol=1e-12)


def test_an_eddy_current_brake_has_a_resistance() -> None:
    """1 + alpha20 (T - 293.15 K) of copper is zero at 36.7 K: a brake so cold would drive."""
    with pytest.raises(pt.ParameterError, match=r"(?s)EddyCurrentForce: .*TRef = 30 K"):
        tr.EddyCurrentForce(f_nominal=100, v_nominal=10, TRef=30, alpha20=3.9e-3)
    brake = tr.EddyCurrentForce(f_nominal=100, v_nominal=10, alpha20=3.9e-3)
    for T, works in ((40.0, True), (30.0, False)):
        model = joined(
            brake, tr.ConstantSpeed(v_fixed=5), FixedTemperature(T=T), joints="0.flange=1.flange 0.heat_port=2.port"
        )
        if works:
            assert pt.simulate(model, 0.1)["parts[0].lossPower"].min() > 0
        else:
            with pytest.raises(pt.PowertrainError, match=r"resistance R\(T\)/R\(TRef\)"):
                pt.simulate(model, 0.1)


def test_a_guide_with_a_long_table() -> None:
    """Tables of more than some dozens of rows are functions that the model calls."""
    data = {"F_prop": 0.5, "F_Coulomb": 1.0, "F_Stribeck": 2.0, "fexp": 2.0, "v_max": 3.0}
    final = []
    for rows in (31, 3001):
        table = tr.stribeck_table(**data, rows=rows)
        parts = (tr.Mass(m=2), tr.SupportFriction(f_pos=table, peak=1.2), tr.Spring(c=10), tr.Mass(m=1))
        joints = "0.flange_b=1.flange_a 1.flange_b=2.flange_a 2.flange_b=3.flange_a"
        result = run(joined(*parts, joints=joints), 3.0, {"0.s": 0.0, "0.v": 2.5, "3.s": 0.0, "3.v": 0.0})
        final.append((result["parts[0].s"][-1], result["parts[3].v"][-1]))
        assert {0, 1} <= set(result["parts[1].mode"])
    np.testing.assert_allclose(final[0], final[1], rtol=2e-3)
