"""Friction under a forced motion that begins, pauses or ends at rest."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from joined import joined

import powertrain as pt
from powertrain.components import blocks
from powertrain.components import rotational as rot


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
