"""Friction under a forced motion that begins, pauses or ends at rest."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest
from joined import joined

import powertrain as pt
from powertrain.components import blocks
from powertrain.components import rotational as rot
from powertrain.components.transmissions import RangeTransmission


class Forced(pt.Component):
    """A bearing on a shaft with inertia whose speed is forced."""

    signal: Any
    motor: rot.Speed = rot.Speed(exact=True)
    bearing: rot.BearingFriction = rot.BearingFriction(tau_pos=((0.0, 1.0), (10.0, 2.0)))
    J: rot.Inertia = rot.Inertia(J=0.1)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.signal.y, self.motor.w_ref)
        yield pt.connect(self.motor.flange, self.bearing.flange_a)
        yield pt.connect(self.bearing.flange_b, self.J.flange_a)


CYCLE = ((0.0, 0.0), (0.1, 0.0), (0.3, 5.0), (0.4, 5.0), (0.6, 0.0), (0.8, 0.0), (1.0, -4.0))
SIGNALS = {
    "cycle with pauses": blocks.TimeTable(table=CYCLE),
    "ramp later": blocks.Ramp(height=-5.0, duration=0.5, startTime=0.3),
    "ramp at once": blocks.Ramp(height=5.0, duration=0.5),
    "without acceleration at first": blocks.Sine(f=1.0, amplitude=2.0, phase=-math.pi / 2, offset=2.0),
    "behind a filter, never": blocks.Constant(k=0.0),
}


@pytest.mark.parametrize(
    ("name", "exact"), [(n, e) for n in SIGNALS for e in (True, False) if not (e and "filter" in n)]
)
def test_torque_follows_the_speed(name: str, exact: bool) -> None:
    """sign(w)(1 + |w|/10) while it moves, within +-1 at rest; the energy closes."""
    result = pt.simulate(Forced(signal=SIGNALS[name], motor=rot.Speed(exact=exact)), 1.0, rtol=1e-8)
    w, tau = result["J.w"], result["bearing.tau"]
    moves = np.abs(w) > 1e-6
    np.testing.assert_allclose(tau[moves], (np.sign(w) * (1 + np.abs(w) / 10))[moves], rtol=1e-6)
    assert (np.abs(tau[~moves]) <= 1 + 1e-6).all()
    assert pt.energy_audit(result).closure < 1e-7
    rests = bool((result["bearing.mode"] == 0).any())
    assert rests == bool(result.notes)
    if exact:
        assert rests == (name != "ramp at once")


def test_pause_is_met_exactly() -> None:
    result = pt.simulate(Forced(signal=SIGNALS["cycle with pauses"]), 1.0)
    changes = [(round(e.time, 9), e.new) for e in result.trajectory.events if e.name == "bearing.mode"]
    assert changes == [(0.1, 1.0), (0.6, 0.0), (0.8, -1.0)]


class Closing(pt.Component):
    """A clutch that begins to close at the start, at once or later."""

    pedal: blocks.Ramp = blocks.Ramp(height=1.0, duration=1.0)
    J1: rot.Inertia = rot.Inertia(J=1.0)
    clutch: rot.Clutch = rot.Clutch(fn_max=10.0)
    J2: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.J1.flange_b, self.clutch.flange_a)
        yield pt.connect(self.clutch.flange_b, self.J2.flange_a)
        yield pt.connect(self.pedal.y, self.clutch.f_normalized)


@pytest.mark.parametrize(("begin", "first"), [(0.0, "backward -> stuck"), (0.1, "free -> backward")])
def test_what_happens_with_the_start_is_no_event(begin: float, first: str) -> None:
    model = pt.replace(Closing(), {"pedal.startTime": begin})
    result = pt.simulate(model, 1.0, starts={"J1.w": 1.0})
    assert first in str(result.events).splitlines()[1]
    assert result.events[-1].new == 0


@pytest.mark.parametrize("amplitude", [3.0, -3.0])
@pytest.mark.parametrize("w", [2.0, -2.0])
def test_the_driving_side_changes_with_a_signal_that_begins_at_zero(amplitude: float, w: float) -> None:
    """A gear at a given speed under a torque that rises from zero at the start, and in each period anew: it always loses."""
    gear = rot.Gear(ratio=0.4, efficiency=0.6)
    wave = blocks.Trapezoid(period=0.5, amplitude=amplitude, rising=0.1, width=0.1, falling=0.05)
    joints = "0.flange=1.flange_a 1.flange_b=2.flange=4.flange_a 2.tau=3.y"
    model = joined(rot.ConstantSpeed(w_fixed=w), gear, rot.Torque(), wave, rot.Inertia(J=0.5), joints=joints)
    result = pt.simulate(model, 1.2, rtol=1e-8)
    load = result["parts[2].tau"]
    drives = load * w < 0  # the shaft with the given speed, against the load
    loss = np.where(drives, 1 / 0.6 - 1, 1 - 0.6) * np.abs(load * w / 0.4)
    np.testing.assert_allclose(result["parts[1].lossPower"], loss, rtol=1e-6, atol=1e-6)
    assert pt.energy_audit(result).violations.empty


def looped(ratio: float, exact: bool, amplitude: float) -> pt.Component:
    """A shaft with a prescribed speed, and a freewheel across two of its gears, which blocks it forward.

    The frame of the second gear may turn, but at the ratio 1 no torque turns it.
    """
    gears = rot.IdealGear(ratio=0.4), rot.IdealGear(ratio=ratio)
    inertias = [rot.Inertia(J=J) for J in (1.0, 1.0, 0.5, 0.5)]
    source = blocks.Sine(amplitude=amplitude, f=2.0), rot.Speed(exact=exact)
    joints = (
        "0.y=1.w_ref 1.flange=5.flange_a=2.flange_a=3.flange_a 3.flange_b=4.flange_b=7.flange_a 3.support=8.flange_a"
    )
    return joined(*source, *gears, rot.Freewheel(), *inertias, joints=f"{joints} 2.flange_b=6.flange_a=4.flange_a")


@pytest.mark.parametrize("ratio", [1.0, 1 - 1e-9, 1 - 1e-6])
@pytest.mark.parametrize("exact", [True, False])
@pytest.mark.parametrize(("amplitude", "least", "most"), [(3.0, 0.0, 1e-5), (-3.0, 0.25, 0.26)])
def test_a_prescribed_motion_against_a_freewheel(
    ratio: float, exact: bool, amplitude: float, least: float, most: float
) -> None:
    """The shaft went on turning, with a torque of 1e9 N.m that came from nothing but the compliance of the freewheel."""
    with pytest.raises(
        pt.PowertrainError, match=r"parts\[4\]\.mode .* moves backward .* cannot slide that way"
    ) as caught:
        pt.simulate(looped(ratio, exact, amplitude), 1.0)
    found = re.search(r"backward at t = (\S+) s", str(caught.value))
    assert found is not None
    assert least <= float(found[1]) <= most


@pytest.mark.parametrize("limit", [0.6, 60.0, 60e3])
def test_a_prescribed_motion_against_a_freewheel_and_a_brake(limit: float) -> None:
    """The freewheel turns the brake, which slips from the start on."""
    source = blocks.Sine(amplitude=3.0, f=2.0), rot.Speed(exact=True)
    parts = rot.Inertia(J=1.0), rot.Freewheel(), rot.Inertia(J=1.0), rot.Brake(fn_max=limit, mue_pos=((0.0, 1.0),))
    joints = "0.y=1.w_ref 1.flange=2.flange_a 2.flange_b=3.flange_a 3.flange_b=4.flange_a 4.flange_b=5.flange_a 6.y=5.f_normalized"
    result = pt.simulate(joined(*source, *parts, blocks.Constant(k=1.0), joints=joints), 0.12, rtol=1e-9)
    assert (result["parts[3].mode"] == 0).all()
    np.testing.assert_allclose(result["parts[4].w"], 3 * np.sin(4 * np.pi * result.time), atol=1e-6)
    np.testing.assert_allclose(result["parts[5].tau"][1:], limit, rtol=1e-9)


@pytest.mark.parametrize("ratio", [0.9, 0.999, 0.99999])
def test_a_frame_that_gives_way(ratio: float) -> None:
    """Locked, the freewheel turns the frame: for the speed w of the shaft by w + (2.5 - 1) w ratio/(ratio - 1)."""
    result = pt.simulate(looped(ratio, False, 3.0), 0.1, rtol=1e-9)
    w = result["parts[5].w"]
    assert w[-1] > 2
    turned = w + 1.5 * w * ratio / (ratio - 1)
    np.testing.assert_allclose(result["parts[8].w"], turned, rtol=1e-6, atol=1e-6)
    assert pt.energy_audit(result).closure < 1e-6


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize("pressed", [0.15, 0.165, 0.17])
def test_a_brake_pressed_while_a_motion_dies_away_opposes_it(pressed: float, direction: float) -> None:
    """A speed of 3 rad/s exp(-314/s (t - 0.1 s)), within the error of the integration when the brake is pressed."""

    class Dying(pt.Component):
        wanted: blocks.Step = blocks.Step(height=-3.0 * direction, offset=3.0 * direction, startTime=0.1)
        press: blocks.Step = blocks.Step(startTime=pressed)
        motor: rot.Speed = rot.Speed()
        wheel: rot.Inertia = rot.Inertia(J=0.5)
        brake: rot.Brake = rot.Brake(fn_max=60.0)

        def equations(self) -> pt.Equations:
            yield pt.connect(self.wanted.y, self.motor.w_ref)
            yield pt.connect(self.press.y, self.brake.f_normalized)
            yield pt.connect(self.motor.flange, self.wheel.flange_a)
            yield pt.connect(self.wheel.flange_b, self.brake.flange_a)

    result = pt.simulate(Dying(), 1.0)
    assert set(result["brake.tau"][result.time > pressed]) == {30.0 * direction}


@pytest.mark.parametrize("rtol", [1e-5, 1e-7])
def test_a_given_motion_stays_as_it_is_where_gears_come_to_rest(rtol: float) -> None:
    """A filtered speed of zero at the input: gears that stop must not move it, or the idle range would seem to turn with the input."""
    load = rot.Torque(), blocks.Sine(amplitude=4.0, f=1.0)
    zero, ratio = blocks.Constant(k=0.0), blocks.Constant(k=0.3)
    joints = (
        "0.flange=1.flange_a 1.flange_b=2.flange_a 2.flange_b=3.flange_a=4.flange 5.y=4.tau 6.y=0.w_ref 7.y=2.ratio"
    )
    shafts = rot.Inertia(J=1.0), rot.Inertia(J=0.1)
    model = joined(rot.Speed(), shafts[0], RangeTransmission(), shafts[1], *load, zero, ratio, joints=joints)
    result = pt.simulate(model, 1.0, rtol=rtol)
    assert (result["parts[0].w"] == 0.0).all()
    used, idle = (
        [(e.time, e.new) for e in result.events if e.name == f"parts[2].gears[{k}].planetaries[0].mode"] for k in (0, 1)
    )
    assert used == idle
    assert [new for _, new in used] == [-1.0, 0.0, 1.0, 0.0, -1.0]
