"""Willans engine: data sheet, fuel, idle, limiter, starter, stop; against closed forms and an independent equilibrium."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from engine_rigs import Driven, Dyno, Loaded
from scipy.optimize import brentq

import powertrain as pt
from powertrain.components.blocks import TimeTable
from powertrain.components.engines import MappedEngine, WillansEngine, best_fuel_line
from powertrain.components.rotational import ConstantSpeed

ENGINE = WillansEngine()
J, TAU_0, TAU_2, E, LHV = 0.15, 18.0, 4e-5, 0.38, 43e6


def test_an_engine_with_its_largest_torque_at_low_speed_has_torque_at_idle() -> None:
    """The parabola from (100 rad/s, 105 N.m) to (157 rad/s, 250 N.m) would be below zero at idle."""
    turbo = WillansEngine(tau_max=250, w_tau=157, P_max=110e3, w_P=523)
    assert turbo.full_load([50.0, 85.0, 100.0, 157.0, 300.0])[:4] == pytest.approx([52.5, 89.25, 105.0, 250.0])
    w = np.linspace(1, 157, 500)
    assert (np.diff(turbo.full_load(w)) > 0).all()
    parabola = 150 - 45 * ((420 - w) / 320) ** 2
    assert ENGINE.full_load(w) == pytest.approx(parabola), "the default is far above the line"


def motoring(w: float) -> float:
    return TAU_0 + TAU_2 * w * w


def test_full_load_goes_through_the_data_sheet() -> None:
    assert ENGINE.full_load(100.0) == pytest.approx(105)
    assert ENGINE.full_load(420.0) == pytest.approx(150)
    w = np.linspace(300, 680, 38001)
    power, torque = w * ENGINE.full_load(w), ENGINE.full_load(w)
    assert power.max() == pytest.approx(82e3, rel=1e-8)
    assert w[power.argmax()] == pytest.approx(600, abs=0.02)
    assert torque.max() == pytest.approx(150)
    assert w[torque.argmax()] == pytest.approx(420, abs=0.02)


def test_plateau_stays_at_the_largest_torque() -> None:
    """Largest torque from 200 rad/s, largest power with 98 % of it: the cubic alone would pass above."""
    engine = WillansEngine(w_tau=200, P_max=0.98 * 150 * 500, w_P=500)
    w = np.linspace(200, 500, 3001)
    assert engine.full_load(w).max() <= 150 * (1 + 1e-12)
    assert engine.full_load(500.0) == pytest.approx(0.98 * 150)


@pytest.mark.parametrize(
    ("tau_max", "w_tau", "P_max", "w_P"),
    [
        (2300.0, 147.0, 350e3, 168.0),
        (320.0, 300.0, 100e3, 400.0),
        (600.0, 150.0, 100e3, 480.0),
        (150.0, 420.0, 82e3, 600.0),
    ],
)
def test_no_speed_gives_more_than_the_largest_power(tau_max: float, w_tau: float, P_max: float, w_P: float) -> None:
    """A truck's and diesel engines, whose cubic has a minimum of power at w_P and rises to 2.2 P_max below the limiter, and the default.

    Above w_P the power falls as a parabola to zero at twice w_P.
    """
    engine = WillansEngine(tau_max=tau_max, w_tau=w_tau, P_max=P_max, w_P=w_P, tau_low=0.5 * tau_max, w_low=0.5 * w_tau)
    w = np.linspace(1, 2.5 * w_P, 5001)
    torque = engine.full_load(w)
    assert (w * torque).max() <= P_max * (1 + 1e-12)
    assert torque.max() == pytest.approx(tau_max, rel=1e-4)
    assert (np.diff(torque[w > w_tau]) <= 1e-9 * tau_max).all()
    assert w_P * engine.full_load(w_P) == pytest.approx(P_max)
    above = w[w > w_P]
    expected = np.maximum(P_max * (1 - (above / w_P - 1) ** 2), 0)
    assert above * engine.full_load(above) == pytest.approx(expected, rel=1e-9, abs=1e-6)


def test_mean_effective_pressures_lie_on_a_willans_line() -> None:
    """p_me = e p_mf - p_me0 with p = 4 pi tau/V, p_mf = fuel energy per cycle over V."""
    V, w, tau = 1.6e-3, np.array([100.0, 250.0, 500.0])[:, None], np.linspace(0, 100, 5)
    p_me = 4 * math.pi * tau / V
    p_mf = ENGINE.fuel_flow(w, tau) * LHV * (4 * math.pi / w) / V
    p_me0 = 4 * math.pi * (TAU_0 + TAU_2 * w**2) / V
    np.testing.assert_allclose(E * p_mf - p_me0, np.broadcast_to(p_me, p_mf.shape), rtol=1e-12, atol=1e-6)
    assert 1e5 < p_me0.min() < p_me0.max() < 3e5


def test_steady_point_under_a_load() -> None:
    w = brentq(lambda w: 0.4 * (ENGINE.full_load(w) + motoring(w)) - motoring(w) - 40, 420, 670)
    result = pt.simulate(Loaded(engine=ENGINE), 60, inputs={"throttle": 0.4, "load": 40.0}, starts={"engine.w": 300.0})
    assert result["engine.w"][-1] == pytest.approx(w, rel=1e-6)
    assert result["engine.tau"][-1] == pytest.approx(40, abs=1e-4)
    assert result["engine.fuel_rate"][-1] == pytest.approx((40 + motoring(w)) * w / E / LHV, rel=1e-5)
    assert result["engine.fuel_rate"][-1] == pytest.approx(float(ENGINE.fuel_flow(w, 40.0)), rel=1e-5)


def test_fuel_by_hand_at_a_held_speed() -> None:
    """30 s at 250 rad/s and half throttle, the idle controller out of work."""
    engine = pt.replace(ENGINE, k_idle=0)
    result = pt.simulate(Dyno(engine=engine, drive=ConstantSpeed(w_fixed=250)), 30, inputs={"throttle": 0.5})
    firing = 0.5 * (105 + 45 * (1 - (170 / 320) ** 2) + motoring(250))
    assert result["engine.firing"] == pytest.approx(firing, rel=1e-12)
    assert result["engine.fuel"][-1] == pytest.approx(30 * firing * 250 / E / LHV, rel=1e-9)
    assert result["engine.power"][-1] == pytest.approx((firing - motoring(250)) * 250, rel=1e-12)


def test_overrun_burns_nothing_and_slows_down_as_drag_says() -> None:
    """J dw/dt = -(tau_0 + tau_2 w^2): w = a tan(atan(w_0/a) - sqrt(tau_0 tau_2) t/J), a = sqrt(tau_0/tau_2)."""
    a = math.sqrt(TAU_0 / TAU_2)
    times = np.linspace(0, 2, 21)
    result = pt.simulate(Loaded(engine=ENGINE), 2, times=times, starts={"engine.w": 600.0}, rtol=1e-9)
    closed = a * np.tan(math.atan(600 / a) - math.sqrt(TAU_0 * TAU_2) * times / J)
    assert closed.min() > 100  # still above idle
    np.testing.assert_allclose(result["engine.w"], closed, rtol=1e-7)
    assert np.all(result["engine.fuel_rate"] == 0)
    assert np.all(result["engine.fuel"] == 0)


def test_stopped_engine_comes_to_rest_and_holds_itself() -> None:
    a = math.sqrt(TAU_0 / TAU_2)
    rest = J / math.sqrt(TAU_0 * TAU_2) * math.atan(90 / a)
    result = pt.simulate(Loaded(engine=ENGINE), 5, inputs={"on": 0.0, "throttle": 1.0}, starts={"engine.w": 90.0})
    assert [event.time for event in result.events] == pytest.approx([rest], rel=1e-6)
    assert result["engine.w"][-1] == 0
    assert result["engine.mode"][-1] == 0
    assert result["engine.fuel"][-1] == 0
    held = pt.simulate(Loaded(engine=ENGINE), 1, inputs={"on": 0.0, "load": -17.9})
    assert np.all(held["engine.w"] == 0)
    turned = pt.simulate(Loaded(engine=ENGINE), 1, inputs={"on": 0.0, "load": 18.1})
    assert turned["engine.w"][-1] == pytest.approx(-0.1 / J, rel=1e-3)


@pytest.mark.parametrize("load", [0.0, 25.0])
def test_idle_speed_is_held(load: float) -> None:
    result = pt.simulate(Loaded(engine=ENGINE), 20, inputs={"load": load}, starts={"engine.w": 85.0}, atol=1e-10)
    full = 105 - 45 * (335 / 320) ** 2 + 45
    assert result["engine.w"][-1] == pytest.approx(85, abs=1e-5)
    assert result["engine.x"][-1] == pytest.approx((load + motoring(85)) / (full + motoring(85)), abs=1e-6)
    assert result["engine.fuel_rate"][-1] == pytest.approx((load + motoring(85)) * 85 / E / LHV, rel=1e-5)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"w_idle": 800}, r"w_idle < .*\n.* w_idle = 800 rad/s, w_limit = 680 rad/s"),
        ({"w_fire": 100}, r"w_fire <= .*\n.* w_idle = 85 rad/s, w_fire = 100 rad/s"),
    ],
)
def test_an_engine_idles_below_its_limiter_and_without_its_starter(given: dict[str, Any], said: str) -> None:
    """800 rpm without the unit idled at the limiter; a starter that helps up to 100 rad/s saved half of the idle fuel."""
    with pytest.raises(pt.ParameterError, match=said):
        WillansEngine(**given)
    with pytest.raises(pt.ParameterError, match=said):
        pt.replace(MappedEngine.gasoline(), **given)


def test_torque_outside_of_the_throttle_range_is_that_at_its_ends() -> None:
    for engine in (ENGINE, MappedEngine.gasoline()):
        low, high = engine.torque(300.0, [0.0, 1.0])
        assert engine.torque(300.0, [-1.0, 2.0]) == pytest.approx([low, high])
        assert (low, high) == pytest.approx((-engine.motoring(300.0), engine.full_load(300.0)))


def test_idle_controller_does_not_wind_up() -> None:
    """After a minute far above idle it is as fresh as after a second: idle is caught with the same undershoot."""

    def lowest(pull: float) -> float:
        rig = Driven(engine=ENGINE, rows=((0, 0.3), (pull, 0.3), (pull, 0)), load=10)
        result = pt.simulate(rig, pull + 20, starts={"engine.w": 300.0})
        assert np.all(result["engine.x"] >= -1e-9)
        return float(result["engine.w"][result.time > pull].min())

    assert lowest(60) == pytest.approx(lowest(6), abs=0.2)
    assert 65 < lowest(60) < 85


def test_rev_limiter() -> None:
    """Unloaded at full throttle: firing = (680 - w)/10 (full load + motoring) = motoring."""
    result = pt.simulate(Loaded(engine=ENGINE), 20, inputs={"throttle": 1.0}, starts={"engine.w": 85.0})
    w = brentq(lambda w: (680 - w) / 10 * (ENGINE.full_load(w) + motoring(w)) - motoring(w), 670, 680)
    assert result["engine.w"][-1] == pytest.approx(w, rel=1e-6)
    assert result["engine.w"].max() < 680
    assert not list(result.events)


def test_starter_turns_it_from_rest_to_idle() -> None:
    result = pt.simulate(Loaded(engine=ENGINE), 10)
    first = result.at(np.array([0.0, 1e-3]), "engine.w")
    assert first[1] == pytest.approx((60 - 18) / J * 1e-3, rel=0.02)
    assert result["engine.w"][-1] == pytest.approx(85, abs=0.01)
    assert result["engine.w"].max() < 130
    weak = pt.simulate(Loaded(engine=pt.replace(ENGINE, tau_starter=17)), 5)
    assert np.all(weak["engine.w"] == 0)
    assert weak["engine.fuel"][-1] == 0


def test_stop_and_start() -> None:
    """Off for 20 s at a traffic light: no fuel from the first instant, at rest under the accessories' torque, idle again after 5 s."""

    class Light(pt.Component):
        rig: Driven = Driven(engine=ENGINE, rows=((0, 0),), load=10)
        stop: TimeTable = TimeTable(table=((0, 1), (10, 1), (10, 0), (30, 0), (30, 1)))

        def equations(self) -> pt.Equations:
            yield pt.connect(self.stop.y, self.rig.engine.on)

    result = pt.simulate(Light(), 40, starts={"rig.engine.w": 85.0}, points=4001)
    off = (result.time > 10) & (result.time < 30)
    assert np.ptp(result["rig.engine.fuel"][off]) == 0
    assert np.all(result["rig.engine.w"][(result.time > 11) & off] == 0)
    settled = ((result.time > 5) & (result.time < 10)) | (result.time > 35)
    np.testing.assert_allclose(result["rig.engine.w"][settled], 85, atol=0.5)
    assert result["rig.engine.fuel"][-1] > result["rig.engine.fuel"][off][0]


@pytest.mark.parametrize(("given", "held"), [(1.7, 1.0), (-0.4, 0.0)])
def test_throttle_is_held_within_its_range(given: float, held: float) -> None:
    runs = [
        pt.simulate(Loaded(engine=ENGINE), 2, inputs={"throttle": u}, starts={"engine.w": 200.0}) for u in (given, held)
    ]
    np.testing.assert_array_equal(runs[0]["engine.w"], runs[1]["engine.w"])


def test_it_supplies_the_energy_of_its_fuel() -> None:
    """What the audit finds missing at crank, kinetic energy and losses is what the fuel and the starter brought."""
    result = pt.simulate(Loaded(engine=ENGINE), 10, inputs={"throttle": 0.6, "load": 20.0}, rtol=1e-9, atol=1e-12)
    assert result["engine.w"][0] == 0
    assert result["engine.w"][-1] > 600
    audit = pt.energy_audit(result)
    assert audit.closure < 1e-8
    started = np.clip(result["engine.w"] / 40, 0, 1)
    power = result["engine.fuel_rate"] * LHV + 60 * (1 - started) * result["engine.w"]
    supply = np.interp(result.time, audit.time, audit.supply["engine"])
    np.testing.assert_allclose(supply, power, rtol=1e-6, atol=1e-6 * power.max())
    sources = audit.components.loc["engine", "sources"]
    assert sources == pytest.approx(LHV * result["engine.fuel"][-1], rel=5e-3)  # the starter's 0.3 %
    assert np.asarray(audit.loss["engine"]).min() >= 0


def test_curve_takes_the_place_of_the_data_sheet() -> None:
    curve = pt.Map.curve([0, 300, 700], [100, 160, 90], x="speed", x_unit="rad/s", unit="N.m", outside="clip")
    engine = pt.replace(ENGINE, curve=curve)
    assert engine.full_load([150, 500, 800]) == pytest.approx([130, 125, 90])
    wrong = pt.Map.curve([0, 6000], [100, 160], x="speed", x_unit="rpm", unit="N.m")
    with pytest.raises(pt.ParameterError, match=r"curve gives .* over speed \[rpm\]; .* over one speed \[rad/s\]"):
        pt.compile(pt.replace(ENGINE, curve=wrong))
    power = pt.Map.curve([0, 700], [40, 60], x="w", x_unit="rad/s", unit="kW", name="P")
    with pytest.raises(
        pt.ParameterError, match=r"curve gives P \[kW\] over w \[rad/s\]; it must give a torque \[N.m\]"
    ):
        pt.compile(pt.replace(ENGINE, curve=power))
    brake = pt.Map.curve([0, 700], [-100, -160], x="w", x_unit="rad/s", unit="N.m")
    with pytest.raises(pt.ParameterError, match=r"curve falls to -160 N.m; .* must not be negative"):
        pt.compile(pt.replace(ENGINE, curve=brake))


def test_the_limiter_is_within_the_speeds_of_a_curve() -> None:
    """A diesel's curve up to 480 rad/s, with the limiter of the default engine: with its edge held, 87 kW would become 119 kW."""
    speeds, torques = [80.0, 200.0, 480.0], [150.0, 320.0, 177.0]
    ends, goes_on = (
        pt.Map.curve(speeds, torques, x="w", x_unit="rad/s", unit="N.m", name="full load", outside=outside)
        for outside in ("clip", "linear")
    )
    with pytest.raises(pt.ParameterError, match=r"highest speed of the full load(.|\n)*w_limit = 680 rad/s"):
        WillansEngine(curve=ends)
    engine = WillansEngine(curve=ends, w_limit=480)
    assert best_fuel_line(engine).power[-1] < 88e3
    assert WillansEngine(curve=goes_on).full_load(600.0) == pytest.approx(177 - 120 * 143 / 280)


def test_curve_that_begins_above_idle_speed() -> None:
    """It ends with an advice, or its first value holds at 85 rad/s."""
    late = pt.Map.curve([100, 700], [110, 160], x="w", x_unit="rad/s", unit="N.m")
    with pytest.raises(
        pt.ParameterError, match=r'curve begins at 100 rad/s, .* w_idle = 85 rad/s; .* outside = "clip"'
    ):
        pt.compile(pt.replace(ENGINE, curve=late))
    pt.compile(pt.replace(ENGINE, {"curve": late, "w_idle": 100.0}))
    held = pt.Map.curve([100, 700], [110, 160], x="w", x_unit="rad/s", unit="N.m", outside="clip")
    assert pt.replace(ENGINE, curve=held).full_load(85.0) == pytest.approx(110)


def test_numbers_and_arrays() -> None:
    assert isinstance(ENGINE.full_load(300.0), float)
    assert ENGINE.fuel_flow([100, 200], [[50], [60], [70]]).shape == (3, 2)
    assert ENGINE.fuel_flow(200.0, -50.0) == 0
    assert ENGINE.bsfc(200.0, 0.0) == math.inf
    assert ENGINE.bsfc(200.0, 100.0) == pytest.approx((100 + motoring(200)) / (100 * E * LHV))


def test_a_long_drive_takes_no_events() -> None:
    rows = tuple((20.0 * k, -0.05 if k % 2 else 0.55) for k in range(91))
    result = pt.simulate(Driven(engine=ENGINE, rows=rows, d=0.1), 1800, starts={"engine.w": 85.0})
    assert not list(result.events)
    assert result.statistics["steps"] < 15_000


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"w_tau": 90}, "w_tau = 90 rad/s, w_low = 100 rad/s"),
        ({"w_P": 400}, "w_tau = 420 rad/s, w_P = 400 rad/s"),
        ({"tau_low": 200}, "tau_max = 150 N.m, tau_low = 200 N.m"),
    ],
)
def test_points_of_the_full_load_out_of_order_are_rejected(given: dict[str, float], said: str) -> None:
    with pytest.raises(pt.ParameterError, match=f"does not hold with {said}"):
        pt.replace(WillansEngine(), given)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"P_max": 82}, r"self.tau_max \* self.w_tau <= .*P_max = 82 W"),  # kW
        ({"w_P": 5700, "w_tau": 4000}, r"w_tau = 4000 rad/s, P_max = 82000 W"),  # rpm
        ({"P_max": 110e3}, r"self.P_max <= .*tau_max = 150 N.m, P_max = 110000 W, w_P = 600 rad/s"),
    ],
)
def test_a_data_sheet_that_contradicts_itself_is_refused(changes: dict[str, Any], said: str) -> None:
    """More power at the largest torque than the largest power, or a largest power that takes more than the largest torque."""
    with pytest.raises(pt.ParameterError, match=rf"(?s){said}"):
        WillansEngine(**changes)


def test_the_default_engine_has_1600_cm3() -> None:
    assert WillansEngine.of_displacement("1.6 l") == ENGINE
    assert WillansEngine.of_displacement(1.6e-3, P_max=82e3, e=0.4, J=0.2) == WillansEngine(e=0.4, J=0.2)
    default = WillansEngine.of_displacement(1.6e-3, p_0="1.41 bar", p_2="0.50 bar")
    assert default.motoring([0.0, 400.0, 600.0]) == pytest.approx(ENGINE.motoring([0.0, 400.0, 600.0]), rel=4e-3)


@pytest.mark.parametrize(("displacement", "V"), [("1.0 l", 1.0e-3), ("2500 cm3", 2.5e-3)])
def test_engines_of_all_displacements_have_the_same_mean_effective_pressures(displacement: str, V: float) -> None:
    """Friction and full load over displacement depend on speed alone, fuel flow over displacement also on the mean effective pressure."""
    engine, w = WillansEngine.of_displacement(displacement), np.linspace(50, 650, 25)[:, None]
    for law in ("motoring", "full_load"):
        np.testing.assert_allclose(getattr(engine, law)(w) / V, getattr(ENGINE, law)(w) / 1.6e-3, rtol=1e-12)
    p = np.linspace(-1e5, 12e5, 14) / (4 * math.pi)
    np.testing.assert_allclose(engine.fuel_flow(w, p * V) / V, ENGINE.fuel_flow(w, p * 1.6e-3) / 1.6e-3, rtol=1e-12)


def test_an_engine_of_another_displacement_moves_in_the_same_time() -> None:
    """Torques and moment of inertia are in proportion: two litres start, run up and run down as the default engine does."""
    throttle = TimeTable(table=((0.0, 0.3), (2.0, 0.3), (2.0, 0.0), (4.0, 0.0)))

    class Alone(pt.Component):
        engine: WillansEngine
        pedal: TimeTable = throttle

        def equations(self) -> pt.Equations:
            yield pt.connect(self.pedal.y, self.engine.throttle)

    times = np.linspace(0, 4, 41)
    one, other = (
        pt.simulate(Alone(engine=engine), 4, times=times, rtol=1e-9)
        for engine in (ENGINE, WillansEngine.of_displacement(2e-3))
    )
    assert one["engine.w"].max() > 300
    np.testing.assert_allclose(other["engine.w"], one["engine.w"], atol=1e-5)
    assert other["engine.fuel"][-1] == pytest.approx(2 / 1.6 * one["engine.fuel"][-1], rel=1e-7)


def test_an_engine_by_displacement_power_and_friction() -> None:
    """2 l with 150 kW and friction of 0.8 bar + 0.6 bar (w/400)^2: the torques of full load are in proportion to the power."""
    engine = WillansEngine.of_displacement("2 l", P_max="150 kW", p_0="0.8 bar", p_2=60e3, w_tau=250)
    w = np.linspace(200, 680, 24001)
    assert (w * engine.full_load(w)).max() == pytest.approx(150e3, rel=1e-8)
    assert engine.full_load(250.0) == pytest.approx(150 * 150 / 82)
    assert engine.full_load(100.0) == pytest.approx(105 * 150 / 82)
    assert engine.motoring([0.0, 400.0]) == pytest.approx([2e-3 / (4 * math.pi) * p for p in (0.8e5, 1.4e5)])
    assert float(engine.J) == pytest.approx(0.15 * 2 / 1.6)
    assert float(engine.tau_starter) == pytest.approx(60 * 2 / 1.6)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"displacement": 2.0}, "WillansEngine.of_displacement: displacement = 2"),
        ({"displacement": 0}, "WillansEngine.of_displacement: displacement = 0"),
        ({"displacement": "2 kg"}, "WillansEngine.of_displacement: displacement = '2 kg'"),
        ({"displacement": 2e-3, "P_max": -1}, "WillansEngine.of_displacement: P_max = -1"),
        ({"displacement": 2e-3, "p_0": "0.8 kW"}, "WillansEngine.of_displacement: p_0 = '0.8 kW'"),
    ],
)
def test_sizes_that_no_engine_has(given: dict[str, Any], said: str) -> None:
    with pytest.raises(pt.ParameterError) as caught:
        WillansEngine.of_displacement(**given)
    assert said in str(caught.value)


@pytest.mark.parametrize(("w", "counted"), [(-100.0, True), (-20.0, False), (600.0, False), (1000.0, True)])
def test_an_engine_driven_too_fast_or_backward_is_counted(w: float, counted: bool) -> None:
    """The rev limiter is at 680 rad/s; it cannot stop the wheels from driving the engine after a missed shift."""
    result = pt.simulate(Dyno(engine=ENGINE, drive=ConstantSpeed(w_fixed=w)), 0.1)
    assert (result.statistics["outside speed of the engine"] > 0) == counted
