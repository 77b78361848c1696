"""Bearings, brakes, clutches, freewheels: closed forms, sticking and breaking loose."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from joined import joined
from rotational_line import Line, run

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Constant, Ramp, Step
from powertrain.components.thermal import FixedTemperature, HeatCapacitor


def bearing(tau_pos: tuple[tuple[float, float], ...], peak: float = 1.0, J: float = 2.0) -> Line:
    return Line(
        parts=(rot.Torque(), rot.Inertia(J=J), rot.BearingFriction(tau_pos=tau_pos, peak=peak)),
        signals=(Ramp(height=10, duration=1, startTime=2),),
        wires=((0, 0, "tau"),),
    )


@pytest.mark.parametrize("sign", [1, -1])
def test_bearing_stops_the_shaft_and_holds_it(sign: int) -> None:
    result = run(bearing(((0.0, 4.0),)), 2.0, {"1.w": sign * 3.0})
    stop = 3.0 * 2.0 / 4.0
    expected = sign * np.maximum(3.0 - 2.0 * result.time, 0.0)
    np.testing.assert_allclose(result["parts[1].w"], expected, atol=1e-8)
    assert set(result["parts[2].mode"][result.time < stop - 1e-6]) == {sign}
    assert set(result["parts[2].mode"][result.time > stop + 1e-6]) == {0}
    assert result["parts[1].phi"][-1] == pytest.approx(sign * 3.0**2 * 2.0 / 4.0 / 2, rel=1e-8)


@pytest.mark.parametrize("peak", [1.0, 1.5])
def test_bearing_breaks_loose_at_the_peak(peak: float) -> None:
    result = run(bearing(((0.0, 4.0),), peak), 3.0, points=3000)
    loose = 2 + peak * 4 / 10
    assert np.abs(result["parts[1].w"][result.time < loose - 1e-6]).max() == 0.0
    late = result.time > loose + 1e-6
    t, t0 = result.time[late], loose
    expected = (10 * ((t - 2) ** 2 - (t0 - 2) ** 2) / 2 - 4 * (t - t0)) / 2
    np.testing.assert_allclose(result["parts[1].w"][late], expected, atol=1e-7)
    assert result["parts[1].a"][np.argmax(late)] == pytest.approx((peak - 1) * 4 / 2, abs=0.01)


def test_friction_table_is_continued_by_its_last_slope() -> None:
    """tau = 1 + 0.5 w beyond the table that ends at w = 2, on the way down from w = 10."""
    result = run(bearing(((0.0, 1.0), (1.0, 1.5), (2.0, 2.0))), 1.0, {"1.w": 10.0})
    expected = (10.0 + 2.0) * np.exp(-0.25 * result.time) - 2.0
    np.testing.assert_allclose(result["parts[1].w"], expected, rtol=1e-8)


def test_friction_table_bends_at_its_rows() -> None:
    """tau = 4 below w = 1 and 4 + 2(w - 1) above it."""
    result = run(bearing(((0.0, 4.0), (1.0, 4.0), (2.0, 6.0)), J=1.0), 2.0, {"1.w": 5.0})
    bend = math.log((5 + 1) / (1 + 1)) / 2
    expected = np.where(
        result.time < bend, 6 * np.exp(-2 * result.time) - 1, np.maximum(1 - 4 * (result.time - bend), 0)
    )
    np.testing.assert_allclose(result["parts[1].w"], expected, atol=2e-7)


def brake(signal: pt.Component) -> Line:
    part = rot.Brake(fn_max=20, cgeo=0.5, mue_pos=((0.0, 0.4),))
    return Line(parts=(rot.Inertia(J=2), part), signals=(signal,), wires=((0, 1, "f_normalized"),))


def test_brake_acts_from_its_signal_on() -> None:
    result = run(brake(Step(height=0.5, startTime=1)), 3.0, {"0.w": 1.5})
    torque = 0.5 * 0.4 * 20 * 0.5
    expected = np.clip(1.5 - torque / 2 * (result.time - 1), 0, 1.5)
    np.testing.assert_allclose(result["parts[0].w"], expected, atol=1e-8)
    modes = result["parts[1].mode"]
    assert modes[0] == 2
    assert modes[-1] == 0


@pytest.mark.parametrize("force", [0.0, -0.3])
def test_open_brake_is_free(force: float) -> None:
    result = run(brake(Constant(k=force)), 1.0, {"0.w": 1.5})
    np.testing.assert_allclose(result["parts[0].w"], 1.5, rtol=1e-12)
    assert set(result["parts[1].mode"]) == {2}


@pytest.mark.parametrize("reverse", [False, True])
def test_clutch_synchronises_two_shafts(reverse: bool) -> None:
    clutch = rot.Clutch(fn_max=30, cgeo=0.5, mue_pos=((0.0, 0.2),))
    line = Line(
        parts=(rot.Inertia(J=1), clutch, rot.Inertia(J=3)), signals=(Constant(k=1),), wires=((0, 1, "f_normalized"),)
    )
    w = (2.0, 12.0) if reverse else (12.0, 2.0)
    result = run(line, 4.0, {"0.w": w[0], "2.w": w[1]})
    torque, reduced = 0.5 * 0.2 * 30, 3 / 4
    lock = 10 * reduced / torque
    common = (w[0] + 3 * w[1]) / 4
    after = result.time > lock + 1e-6
    np.testing.assert_allclose(result["parts[0].w"][after], common, rtol=1e-8)
    assert np.abs(result["parts[1].w_rel"][after]).max() < 1e-12
    assert set(result["parts[1].mode"][after]) == {0}
    assert set(result["parts[1].mode"][result.time < lock - 1e-6]) == {1 if reverse else -1}
    heat = np.trapezoid(result["parts[1].lossPower"], result.time)
    assert heat == pytest.approx(reduced * 100 / 2, rel=1e-4)


def test_clutch_slips_above_its_peak_and_locks_no_more() -> None:
    line = Line(
        parts=(rot.Torque(), rot.Inertia(J=1), rot.Clutch(fn_max=20, peak=1.5), rot.Inertia(J=1)),
        signals=(Ramp(height=100, duration=1), Constant(k=1)),
        wires=((0, 0, "tau"), (1, 2, "f_normalized")),
    )
    result = run(line, 1.0)
    slip = 2 * 1.5 * 10 / 100
    assert set(result["parts[2].mode"][result.time < slip - 1e-6]) == {0}
    assert set(result["parts[2].mode"][result.time > slip + 1e-6]) == {-1}
    late = result.time > slip + 1e-6
    np.testing.assert_allclose(result["parts[3].a"][late], 10.0, rtol=1e-10)


class Warm(pt.Component):
    """A shaft that is braked by every lossy bearing and warms one body."""

    shaft: rot.Inertia = rot.Inertia(J=2)
    bearing: rot.BearingFriction = rot.BearingFriction(tau_pos=((0, 1), (10, 2)))
    damper: rot.Damper = rot.Damper(d=0.3)
    ground: rot.Fixed = rot.Fixed()
    eddy: rot.EddyCurrentTorque = rot.EddyCurrentTorque(tau_nominal=5, w_nominal=4, alpha20=4e-3)
    body: HeatCapacitor = HeatCapacitor(C=7)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.shaft.flange_a, self.bearing.flange_a, self.damper.flange_a, self.eddy.flange)
        yield pt.connect(self.damper.flange_b, self.ground.flange)
        yield pt.connect(self.body.port, self.bearing.heat_port, self.damper.heat_port, self.eddy.heat_port)


def test_losses_arrive_as_heat() -> None:
    result = run(Warm(), 20.0, {"shaft.w": 20.0})
    kinetic = 2 * result["shaft.w"] ** 2 / 2
    np.testing.assert_allclose(7 * (result["body.T"] - 293.15), kinetic[0] - kinetic, atol=1e-5)
    assert result["bearing.mode"][-1] == 0
    for part in ("bearing", "damper", "eddy"):
        assert result[f"{part}.lossPower"].min() > -1e-9


def test_eddy_current_brake_is_strongest_at_its_nominal_speed() -> None:
    line = Line(parts=(rot.EddyCurrentTorque(tau_nominal=5, w_nominal=4), rot.Inertia(J=1)))
    result = run(line, 25.0, {"1.w": 30.0}, points=2000)
    tau, w = result["parts[0].tau"], result["parts[1].w"]
    assert tau.max() == pytest.approx(5, rel=1e-3)
    assert w[np.argmax(tau)] == pytest.approx(4, rel=0.1)
    # Separation of variables: w_n^2 ln(w/w0) + (w^2 - w0^2)/2 = -2 tau w_n t/J
    moving = w > 1e-3
    left = 16 * np.log(w[moving] / 30) + (w[moving] ** 2 - 900) / 2
    np.testing.assert_allclose(left, -2 * 5 * 4 * result.time[moving], rtol=1e-6, atol=1e-4)


class Retarded(pt.Component):
    """A shaft of 2 kg.m2 with a retarder that warms a body: 5 N.m from 10 rad/s on, 100 W from 20 rad/s on."""

    command: pt.Parameter = pt.parameter("1", "Command", default=1.0)
    shaft: rot.Inertia = rot.Inertia(J=2)
    retarder: rot.Retarder = rot.Retarder(tau_max=5, w_full=10, P_max=100)
    body: HeatCapacitor = HeatCapacitor(C=7)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.shaft.flange_a, self.retarder.flange)
        yield pt.connect(self.body.port, self.retarder.heat_port)
        yield self.retarder.command.value == self.command


@pytest.mark.parametrize("direction", [1, -1])
def test_a_retarder_brakes_with_constant_power_then_constant_torque_then_the_square_of_the_speed(
    direction: int,
) -> None:
    """From 30 rad/s: w^2 = 900 - 100 t until 20 rad/s at 5 s; then -2.5 rad/s2 until 10 rad/s at 9 s; then 1/w = 0.1 + (t - 9)/40."""
    result = run(Retarded(), 29.0, {"shaft.w": 30.0 * direction})
    w = direction * np.array([result.at([t], "shaft.w")[0] for t in (3.0, 7.0, 29.0)])
    np.testing.assert_allclose(w, [np.sqrt(600), 15, 1 / 0.6], rtol=1e-6)
    np.testing.assert_allclose(7 * (result["body.T"] - 293.15), 900 - result["shaft.w"] ** 2, atol=1e-4)


def test_a_retarder_takes_a_share_of_its_torque() -> None:
    """At 16 rad/s: 5 N.m times the command, which is within 0 to 1."""
    for command, share in (-1, 0), (0.3, 0.3), (2, 1):
        result = run(Retarded(command=command), 0.1, {"shaft.w": 16.0})
        assert result["retarder.tau"][0] == pytest.approx(5 * share)


def test_an_eddy_current_brake_has_a_resistance() -> None:
    """1 + alpha20 (T - 293.15 K) of copper is zero at 36.7 K: a brake so cold would drive."""
    with pytest.raises(pt.ParameterError, match=r"(?s)EddyCurrentTorque: .*TRef = 30 K"):
        rot.EddyCurrentTorque(tau_nominal=5, w_nominal=4, TRef=30, alpha20=3.9e-3)
    brake = rot.EddyCurrentTorque(tau_nominal=5, w_nominal=4, alpha20=3.9e-3)
    for T, works in ((40.0, True), (30.0, False)):
        model = joined(
            brake, rot.ConstantSpeed(w_fixed=3), FixedTemperature(T=T), joints="0.flange=1.flange 0.heat_port=2.port"
        )
        if works:
            assert pt.simulate(model, 0.1)["parts[0].lossPower"].min() > 0
        else:
            with pytest.raises(pt.PowertrainError, match=r"resistance R\(T\)/R\(TRef\)"):
                pt.simulate(model, 0.1)


def overrun(part: pt.Component, wires: bool) -> Line:
    """A shaft whose torque reverses after 1 s pulls another one through a freewheel."""
    return Line(
        parts=(rot.Torque(), rot.Inertia(J=1), part, rot.Inertia(J=3)),
        signals=(Step(height=-16, offset=8, startTime=1), Constant(k=0)),
        wires=((0, 0, "tau"), (1, 2, "f_normalized")) if wires else ((0, 0, "tau"),),
    )


@pytest.mark.parametrize("kind", ["Freewheel", "OneWayClutch"])
def test_freewheel_takes_along_and_lets_run_ahead(kind: str) -> None:
    part = rot.Freewheel() if kind == "Freewheel" else rot.OneWayClutch(fn_max=1)
    result = run(overrun(part, kind == "OneWayClutch"), 2.0)
    together = result.time < 1 - 1e-9
    np.testing.assert_allclose(result["parts[3].w"][together], 2 * result.time[together], rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(result["parts[2].tau"][together], -6.0, rtol=1e-9)
    np.testing.assert_allclose(result["parts[3].w"][~together], 2.0, rtol=1e-8)
    alone = result.time > 1 + 1e-9
    np.testing.assert_allclose(result["parts[1].w"][alone], 2 - 8 * (result.time[alone] - 1), rtol=1e-7, atol=1e-7)
    assert result["parts[2].w_rel"].min() >= -1e-12


def test_one_way_clutch_pulls_back_with_friction() -> None:
    part = rot.OneWayClutch(fn_max=4, mue_pos=((0.0, 0.5),))
    line = overrun(part, wires=True)
    result = run(pt.replace(line, {"signals[1].k": 1.0}), 2.0)
    alone = result.time > 1 + 1e-9
    np.testing.assert_allclose(result["parts[2].tau"][alone], 2.0, rtol=1e-9)
    np.testing.assert_allclose(result["parts[3].w"][alone], 2 - 2 / 3 * (result.time[alone] - 1), rtol=1e-8)


@pytest.mark.parametrize("kind", ["Freewheel", "OneWayClutch"])
def test_freewheel_cannot_start_the_wrong_way(kind: str) -> None:
    part = rot.Freewheel() if kind == "Freewheel" else rot.OneWayClutch(fn_max=1)
    with pytest.raises(pt.PowertrainError, match=r"parts\[2\].mode"):
        run(overrun(part, kind == "OneWayClutch"), 1.0, {"1.w": 3.0})


@pytest.mark.parametrize(
    ("table", "said"),
    [
        (((0.0, -1.0),), "-1 N.m at 0 rad/s"),
        (((-1.0, 2.0), (0.0, 1.0)), "begins at -1 rad/s"),
        (((0.0, 1.0), (5.0, 2.0), (5.0, 3.0)), "5 follows 5"),
        (((0.0, 1.0), (5.0,)), "not a table of rows"),
        (((0.0, 1.0, 2.0),), "not a table of rows of numbers: .* is not 2 finite numbers"),
        ((), r"tau_pos: \(\) is not"),
        (((5.0, 2.0), (10.0, 1.0)), "begins at 5 rad/s; the first row must be at 0 rad/s"),
    ],
)
def test_friction_that_is_no_table_or_would_drive(table: Any, said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said) as caught:
        run(bearing(table), 1.0)
    assert ("BearingFriction.tau_pos" if "table" in said else "parts[2].tau_pos") in str(caught.value)


def test_friction_table_that_falls_below_zero_ends_the_run() -> None:
    """tau = 1 - w/10 beyond its last row at w = 5."""
    falling = bearing(((0.0, 1.0), (5.0, 0.5)))
    assert run(falling, 1.0, {"1.w": 9.0}).ok
    with pytest.raises(pt.SimulationError, match=r"tau_pos continued beyond 5 rad/s .*parts.2.*allowed is at least 0"):
        run(falling, 3.0, {"1.w": 9.0})
