"""The gear schedule and the switch of the engine, without a car."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

import powertrain as pt
from powertrain.components.blocks import TimeTable
from powertrain.components.control import FixedGear, GearSchedule, OperatingLineControl, PowerShiftSchedule, StartStop
from powertrain.components.control.shift_rule import Driving
from powertrain.presets.files import applied
from powertrain.vehicles.manual_car import ManualCar

SPEEDS = ((4.0, 2.0), (8.0, 6.0))


class Scheduled(pt.Component):
    """A schedule for three gears that is shown a speed, an accelerator and an engine that turns fast enough."""

    v: TimeTable
    u: TimeTable = TimeTable(table=((0.0, 0.5),))
    w: TimeTable = TimeTable(table=((0.0, 300.0),))
    schedule: GearSchedule | PowerShiftSchedule = GearSchedule(speeds=SPEEDS, eager=0)
    pulls: tuple[tuple[float, ...], ...] = ()

    def equations(self) -> pt.Equations:
        if self.pulls:
            yield from self.schedule.pulled(*self.pulls)
        yield pt.connect(self.v.y, self.schedule.v)
        yield pt.connect(self.u.y, self.schedule.accelerator)
        yield pt.connect(self.w.y, self.schedule.w)


PULLS = (400.0, 300.0), (200.0, 250.0)
"""Engine speeds before and after both upshifts at which two gears pull equally hard."""
UP_AND_DOWN = TimeTable(table=((0.0, 0.0), (10.0, 10.0), (20.0, 0.0)))


def test_shifts_where_the_speeds_say() -> None:
    """Speed = time to 10 s: up at 4 s and 8 s; and back: down at 14 s (6 m/s) and 18 s (2 m/s)."""
    result = pt.simulate(Scheduled(v=UP_AND_DOWN), stop=20, max_step=0.5)
    t, gear = result.time, result["schedule.gear"]
    changes = np.flatnonzero(np.diff(gear))
    np.testing.assert_allclose(t[changes], [4, 8, 14, 18], atol=1e-6)
    assert gear[changes + 1].tolist() == [2, 3, 2, 1]


@pytest.mark.parametrize("start", [-200.0, 0.0, 30.0])
def test_gears_follow_in_a_run_that_starts_at_any_time(start: float) -> None:
    """A car that already drives 20 m/s shifts at once, directly to third gear; no shift goes on before that."""
    car = pt.compile(Scheduled(v=TimeTable(table=((0.0, 20.0),))))
    result = car.simulate(start + 5, start=start, max_step=0.5)
    np.testing.assert_allclose(_shifts(result), [start + 1e-3], atol=1e-6)
    assert result["schedule.gear"][-1] == 3
    assert result["schedule.hold"].max() == result["schedule.hold"][0] == 1


@pytest.mark.parametrize(
    ("gear", "said"),
    [(-1.0, "-1; allowed is 1 to 3"), (0.0, "0; allowed is 1 to 3"), (4.0, "4; allowed"), (1.5, "0.5; allowed is 0$")],
)
def test_a_run_does_not_start_in_a_gear_that_the_schedule_does_not_have(gear: float, said: str) -> None:
    plant = pt.compile(Scheduled(v=UP_AND_DOWN))
    assert plant.simulate(1.0, starts={"schedule.gear": 3.0})["schedule.gear"][0] == 3
    with pytest.raises(
        pt.InitializationError, match=rf"gear(, a whole number from 1 to 3)? \(schedule: .* at t = 0 s: {said}"
    ):
        plant.simulate(1.0, starts={"schedule.gear": gear})


def test_course_of_a_shift() -> None:
    """The clutch opens in 0.15 s, the lever moves in 0.25 s through neutral, the clutch closes in 0.3 s; the throttle is cut meanwhile."""
    result = pt.simulate(Scheduled(v=UP_AND_DOWN), stop=6, max_step=0.5)
    times = 4 + np.array([-0.01, 0.075, 0.15, 0.275, 0.4, 0.55, 0.7, 1.0])
    np.testing.assert_allclose(result.at(times, "schedule.hold"), [1, 0.5, 0, 0, 0, 0.5, 1, 1], atol=1e-6)
    np.testing.assert_allclose(result.at(times, "schedule.throttle"), [0.5, 0.25, 0, 0, 0, 0.25, 0.5, 0.5], atol=1e-6)
    np.testing.assert_allclose(result.at(times, "schedule.lever"), [1, 1, 1, 1.5, 2, 2, 2, 2], atol=1e-6)


@pytest.mark.parametrize("kind", [GearSchedule, PowerShiftSchedule])
@pytest.mark.parametrize(
    ("pedal", "v", "pressed"), [(1.0, 1.0, 0.25), (0.9, 1.0, 0.5), (0.5, 1.0, 0.75), (1.0, 5.0, 0.75)]
)
def test_a_full_pedal_launches_with_a_slipping_clutch_in_first_gear(
    kind: type[GearSchedule | PowerShiftSchedule], pedal: float, v: float, pressed: float
) -> None:
    """At 350 rad/s a clutch that closes from 200 to 400 rad/s holds three quarters, and 100 rad/s later one quarter."""
    schedule = kind(speeds=SPEEDS, eager=0, kick=0.8, w_open=200, w_closed=400, launch=100)
    speed, u, w = (TimeTable(table=((0.0, value),)) for value in (v, pedal, 350.0))
    result = pt.simulate(Scheduled(v=speed, u=u, w=w, schedule=schedule), stop=3)
    assert result["schedule.gear"][-1] == (2 if v > 4 else 1)
    assert result["schedule.clutch"][-1] == pytest.approx(pressed)


def test_the_torque_is_reduced_in_upshifts_only() -> None:
    """Up at 4 s, down at 18 s, in 0.4 s each: in the middle of an upshift 60 % of half a throttle is left, a quarter before it 70 %."""
    schedule = PowerShiftSchedule(speeds=SPEEDS, eager=0, cut=0.4)
    result = pt.simulate(Scheduled(v=UP_AND_DOWN, schedule=schedule), stop=20, max_step=0.5)
    times = np.array([3.9, 4.1, 4.2, 4.3, 4.5, 18.2])
    np.testing.assert_allclose(result.at(times, "schedule.throttle"), [0.5, 0.35, 0.3, 0.35, 0.5, 0.5], atol=1e-6)


def test_accelerator_shifts_later_and_dwell_is_kept() -> None:
    """eager = 1 and half an accelerator: up at 6 m/s. With the speed of third gear from the start, the shifts are a dwell apart."""
    car = pt.replace(Scheduled(v=UP_AND_DOWN), {"schedule.eager": 1.0})
    assert next(iter(_shifts(pt.simulate(car, stop=8, max_step=0.5)))) == pytest.approx(6, abs=1e-6)
    fast = Scheduled(v=TimeTable(table=((0.0, 0.0), (1.0, 20.0))))
    first, second = _shifts(pt.simulate(fast, stop=8, max_step=0.5))
    assert second - first == pytest.approx(2.0, abs=1e-6)


def moving(v: float, low: float, high: float, period: float = 5.0) -> Scheduled:
    """A constant speed with a pedal that goes to and fro."""
    corners = [(k * period / 2, high if k % 2 else low) for k in range(int(120 / period))]
    schedule = GearSchedule(speeds=SPEEDS)
    return Scheduled(v=TimeTable(table=((0.0, v),)), u=TimeTable(table=tuple(corners)), schedule=schedule)


@pytest.mark.parametrize("v", [5.0, 7.5, 9.0, 11.0])
def test_a_moving_pedal_does_not_hunt(v: float) -> None:
    """At a constant speed it shifts up as far as that takes, once, and never down."""
    result = pt.simulate(moving(v, 0.0, 0.79), stop=60, max_step=0.2)
    gears = result["schedule.gear"]
    assert np.all(np.diff(gears) >= 0)
    assert gears[-1] == (2 if v < 8 else 3)


def test_a_kick_down_is_kept_for_a_while() -> None:
    """At 9 m/s third gear goes down to second with a full pedal (6 m/s times 2), and up again 10 s later, not at once."""
    u = TimeTable(table=((0.0, 0.0), (10.0, 0.0), (10.0, 1.0), (11.0, 1.0), (11.0, 0.0)))
    car = Scheduled(v=TimeTable(table=((0.0, 9.0),)), u=u, schedule=GearSchedule(speeds=SPEEDS))
    result = pt.simulate(car, stop=25, max_step=0.2)
    np.testing.assert_allclose(result.at([9.0, 10.5, 19.9, 20.1], "schedule.gear"), [3, 2, 2, 3])
    hunting = _shifts(pt.simulate(moving(9.0, 0.0, 1.0), stop=100, max_step=0.2))
    assert len(hunting) <= 2 + 2 * 100 / 10


def test_a_kick_down_ends_where_the_full_pedal_shifts_up() -> None:
    """2 m/s2 from 9 m/s: second gear is kept to 16 m/s, then third follows although 10 s are not over."""
    v = TimeTable(table=((0.0, 9.0), (10.0, 9.0), (15.0, 19.0)))
    u = TimeTable(table=((0.0, 0.0), (10.0, 0.0), (10.0, 1.0)))
    result = pt.simulate(Scheduled(v=v, u=u, schedule=GearSchedule(speeds=SPEEDS)), stop=15, max_step=0.2)
    assert _shifts(result)[-1] == pytest.approx(13.5, abs=1e-6)


def test_a_full_pedal_waits_for_the_speed_at_which_the_next_gear_pulls_harder() -> None:
    """Pull speeds of 400 and 300 rad/s with w = 40 v: up at 10 m/s, where 4 m/s would do, and half way from kick at 200 rad/s, 5 m/s."""
    v, w = TimeTable(table=((0.0, 0.0), (20.0, 20.0))), TimeTable(table=((0.0, 0.0), (20.0, 800.0)))
    for pedal, first in ((0.5, 4.0), (0.9, 5.0), (1.0, 10.0)):
        u = TimeTable(table=((0.0, pedal),))
        car = Scheduled(v=v, u=u, w=w, pulls=PULLS, schedule=GearSchedule(speeds=SPEEDS, eager=0))
        assert _shifts(pt.simulate(car, stop=12, max_step=0.2))[0] == pytest.approx(first, abs=1e-6)


def test_the_upshift_never_waits_for_a_speed_beyond_that_of_the_pull() -> None:
    """eager = 4 asks for 20 m/s, where the engine would turn at 800 rad/s; the next gear pulls harder from 400 rad/s, 10 m/s."""
    v, w = TimeTable(table=((0.0, 0.0), (20.0, 20.0))), TimeTable(table=((0.0, 0.0), (20.0, 800.0)))
    u, schedule = TimeTable(table=((0.0, 1.0),)), GearSchedule(speeds=SPEEDS, eager=4)
    assert _shifts(pt.simulate(Scheduled(v=v, u=u, w=w, pulls=PULLS, schedule=schedule), stop=12, max_step=0.2))[
        0
    ] == pytest.approx(10, abs=1e-6)


def test_a_full_pedal_goes_down_to_the_gear_that_pulls_harder() -> None:
    """Third gear at 30 m/s, far above all shift speeds: down below 6/8 of 250 rad/s, the pull speed after the shift.

    A shift that interrupts the torque waits for the shift speeds.
    """
    u = TimeTable(table=((0.0, 0.0), (10.0, 0.0), (10.0, 1.0)))
    smooth, abrupt = (kind(speeds=SPEEDS, eager=0) for kind in (PowerShiftSchedule, GearSchedule))
    for schedule, speed, gear in ((smooth, 180.0, 2), (smooth, 195.0, 3), (abrupt, 180.0, 3)):
        w = TimeTable(table=((0.0, speed),))
        car = Scheduled(v=TimeTable(table=((0.0, 30.0),)), u=u, w=w, pulls=PULLS, schedule=schedule)
        assert pt.simulate(car, stop=11, max_step=0.2)["schedule.gear"][-1] == gear


@pytest.mark.parametrize("kind", [GearSchedule, PowerShiftSchedule])
def test_no_kick_down_where_the_next_gear_pulls_harder(kind: type[GearSchedule] | type[PowerShiftSchedule]) -> None:
    """Second gear at 9 m/s and 500 rad/s, below 2 m/s times 5, where third pulls harder from 300 rad/s: a full pedal shifts up."""
    v, u = (
        TimeTable(table=((0.0, 7.0), (10.0, 7.0), (10.0, 9.0))),
        TimeTable(table=((0.0, 0.0), (10.0, 0.0), (10.0, 1.0))),
    )
    w, schedule = TimeTable(table=((0.0, 500.0),)), kind(speeds=SPEEDS, eager=4)
    result = pt.simulate(Scheduled(v=v, u=u, w=w, pulls=PULLS, schedule=schedule), stop=11.5, max_step=0.2)
    assert result.at([9.9, 10.1, 11.5], "schedule.gear").tolist() == [2, 3, 3]


@pytest.mark.parametrize("kind", [GearSchedule, PowerShiftSchedule])
def test_no_kick_down_to_a_gear_that_pulls_less(kind: type[GearSchedule] | type[PowerShiftSchedule]) -> None:
    """Second gear at 7 m/s, below 2 m/s times 5: above 200 rad/s it pulls harder than first; kick-down below 2/4 of that, 100 rad/s."""
    u = TimeTable(table=((0.0, 0.0), (10.0, 0.0), (10.0, 1.0)))
    for speed, gear in ((250.0, 2), (150.0, 2), (90.0, 1)):
        car = Scheduled(
            v=TimeTable(table=((0.0, 7.0),)),
            u=u,
            w=TimeTable(table=((0.0, speed),)),
            pulls=PULLS,
            schedule=kind(speeds=SPEEDS, eager=4),
        )
        assert pt.simulate(car, stop=14, max_step=0.2)["schedule.gear"][-1] == gear


class Drawn(pt.Component):
    """A schedule with a full pedal whose engine turns with the gear that it chooses."""

    v: TimeTable
    schedule: GearSchedule | PowerShiftSchedule
    ratios: tuple[float, ...]
    pulls: tuple[tuple[float, ...], ...]
    radius: pt.Parameter = pt.parameter("m", "Radius of the wheels over the final drive", default=0.3 / 4)
    u: TimeTable = TimeTable(table=((0.0, 1.0),))

    def equations(self) -> pt.Equations:
        yield from self.schedule.pulled(*self.pulls)
        yield pt.connect(self.v.y, self.schedule.v)
        yield pt.connect(self.u.y, self.schedule.accelerator)
        ratio = sum(x * (ca.fabs(self.schedule.gear - k) < 0.5) for k, x in enumerate(self.ratios, 1))
        yield self.schedule.w.value == ratio * self.v.y.value / self.radius


@pytest.mark.parametrize("kind", [GearSchedule, PowerShiftSchedule])
def test_a_full_pedal_does_not_hunt_where_the_shift_speeds_are_beyond_those_of_the_pull(
    kind: type[GearSchedule] | type[PowerShiftSchedule],
) -> None:
    """A diesel whose second gear pulls harder from 426 rad/s, with shift speeds for 560 rad/s: one upshift at 8.9 m/s, and it stays."""
    ratios = 3.6, 2.1, 1.4, 1.0
    before = 426.0, 411.0, 402.0
    after = tuple(w * other / one for w, one, other in zip(before, ratios[:-1], ratios[1:], strict=True))
    schedule = kind.for_gears(ratios, 4.0, w_full=560.0, down=0.85)
    v = TimeTable(table=((0.0, 0.0), (10.0, 8.95), (60.0, 9.1)))
    result = pt.simulate(Drawn(v=v, schedule=schedule, ratios=ratios, pulls=(before, after)), stop=60, max_step=0.2)
    changes = np.flatnonzero(np.diff(result["schedule.gear"]))
    assert result["v.y"][changes].tolist() == pytest.approx([426 / 3.6 * 0.075], rel=1e-6)


def test_the_rule_in_numbers_is_that_of_the_run() -> None:
    """``trials.backward`` decides by the same rule: a drive through all shifts, decided every 10 ms, shifts at the times of the run."""
    schedule = PowerShiftSchedule(speeds=SPEEDS, kick=0.6)
    v = TimeTable(table=((0.0, 0.0), (10.0, 14.0), (20.0, 5.0), (30.0, 9.0), (40.0, 1.0)))
    u = TimeTable(table=((0.0, 0.3), (12.0, 0.3), (16.0, 1.0), (22.0, 1.0), (26.0, 0.0)))
    w = TimeTable(table=((0.0, 300.0), (15.0, 450.0), (25.0, 150.0), (40.0, 350.0)))
    result = pt.simulate(Scheduled(v=v, u=u, w=w, pulls=PULLS, schedule=schedule), stop=40, max_step=0.2)
    now = Driving(*(pt.Symbol.sym(name) for name in Driving._fields))
    rule = ca.Function("rule", [*now], [*schedule.shifts(now, schedule.kick_limits(now.gear, *PULLS))])
    gear, began, kicked, changes = 1, -100.0, -100.0, []
    for t in np.arange(0.0, 40.0, 0.01):
        shown = (np.interp(t, *np.transpose(table.table)) for table in (v, w, u))
        due = [bool(one) for one in rule(*shown, gear, t - kicked, 0.0, 0.0)[:3]]
        if any(due) and t - began > 2.0:
            gear, began, kicked = gear + (1 if due[0] else -1), t, t if due[2] else kicked
            changes.append(t)
    assert len(changes) > 4
    np.testing.assert_allclose(
        _shifts(result), changes, atol=0.031
    )  # three shifts wait for each other, each up to a step late


FOUR = ((4.0, 3.0), (8.0, 6.0), (12.0, 10.0))


def test_a_shift_leads_across_gears_to_the_one_that_is_due() -> None:
    """From 0 to 10 m/s in 1 s: up at 4 m/s, and after the dwell of 2 s to third; braked within 1 s: to third, and to first."""
    v = TimeTable(table=((0.0, 0.0), (1.0, 15.0), (10.0, 15.0), (11.0, 0.0)))
    result = pt.simulate(Scheduled(v=v, schedule=GearSchedule(speeds=FOUR, eager=0)), stop=14, max_step=0.1)
    changes = np.flatnonzero(np.diff(result["schedule.gear"]))
    assert result["schedule.gear"][changes + 1].tolist() == [2, 4, 3, 1]
    np.testing.assert_allclose(result.time[changes], [4 / 15, 2 + 4 / 15, 10 + 1 / 3, 12 + 1 / 3], atol=1e-6)
    t = 12 + 1 / 3 + 0.15 + 0.25 * np.array([0, 0.4, 0.49, 0.51, 0.6, 1])
    np.testing.assert_allclose(result.at(t, "schedule.lever"), [3, 2.6, 2.51, 1.49, 1.4, 1], atol=1e-6)


class Climbing(pt.Component):
    """A schedule that is shown a speed and a slope."""

    v: TimeTable
    slope: pt.Parameter = pt.parameter("1", "Slope", default=0.0)
    schedule: GearSchedule | PowerShiftSchedule = GearSchedule(speeds=SPEEDS, eager=0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.v.y, self.schedule.v)
        yield self.schedule.grade.value == self.slope
        yield self.schedule.accelerator.value == 0.5
        yield self.schedule.w.value == 300


@pytest.mark.parametrize("slope", [-0.2, 0.0, 0.2, 0.4, 0.5])
def test_on_a_grade_it_does_not_shift_up_to_a_gear_that_it_would_leave(slope: float) -> None:
    """In 0.7 s the weight takes 0.7 g sin(alpha) from the speed, which shall stay above 2 m/s, and 6 m/s in third gear."""
    lost = 0.7 * 9.80665 * np.sin(np.arctan(slope))
    result = pt.simulate(Climbing(v=UP_AND_DOWN, slope=slope), stop=10, max_step=0.2)
    changes = np.flatnonzero(np.diff(result["schedule.gear"]))
    np.testing.assert_allclose(result["v.y"][changes], [max(4, 2 + lost), max(8, 6 + lost)], atol=1e-6)
    powered = Climbing(v=UP_AND_DOWN, slope=slope, schedule=PowerShiftSchedule(speeds=SPEEDS, eager=0))
    result = pt.simulate(powered, stop=10, max_step=0.2)
    changes = np.flatnonzero(np.diff(result["schedule.gear"]))
    np.testing.assert_allclose(result["v.y"][changes], [4, 8], atol=1e-6)


def test_a_power_shift_leads_to_the_next_gear() -> None:
    v = TimeTable(table=((0.0, 15.0),))
    result = pt.simulate(Scheduled(v=v, schedule=PowerShiftSchedule(speeds=FOUR, eager=0)), stop=5, max_step=0.1)
    changes = np.flatnonzero(np.diff(result["schedule.gear"]))
    assert result["schedule.gear"][changes + 1].tolist() == [2, 3, 4]


class Descending(pt.Component):
    """A schedule that is shown a speed and both pedals."""

    v: TimeTable
    u: TimeTable
    b: TimeTable
    schedule: GearSchedule = GearSchedule(speeds=FOUR, eager=0, braking=0.5)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.v.y, self.schedule.v)
        yield pt.connect(self.u.y, self.schedule.accelerator)
        yield pt.connect(self.b.y, self.schedule.brake)
        yield self.schedule.w.value == 300


def test_while_the_driver_slows_down_the_engine_brakes_in_a_lower_gear() -> None:
    """Down at 1.5 times the speeds of ``FOUR``, until the accelerator passes 0.2, by which the driver held the speed before."""
    u = TimeTable(table=((0.0, 0.0), (20.0, 0.0), (20.0, 0.15), (30.0, 0.15), (40.0, 0.25)))
    b = TimeTable(table=((0.0, 0.0), (5.0, 0.0), (5.0, 0.3), (10.0, 0.3), (10.0, 0.0)))
    for v, braked in ((14.9, 3), (15.1, 4), (8.9, 2), (9.1, 3), (4.4, 1)):
        car = Descending(v=TimeTable(table=((0.0, v),)), u=u, b=b)
        result = pt.simulate(car, stop=45, max_step=0.1)
        gear = result.at([4.9, 8.0, 15.0, 34.0, 44.0], "schedule.gear").tolist()
        before = 1 + sum(v > up for up, _ in FOUR)
        assert gear == [before, braked, braked, braked, before]
        assert result.at([4.9, 5.1, 34.9, 35.1], "schedule.slowing").tolist() == [0, 1, 1, 0]
        plain = pt.simulate(pt.replace(car, {"schedule.braking": 0.0}), stop=45, max_step=0.1)
        assert plain["schedule.gear"][-1] == before
        assert plain["schedule.slowing"].max() == 0


def test_a_faster_descent_shifts_up_before_the_engine_races() -> None:
    """From third gear, with which the run begins, to second, which is kept to 12 m/s, 1.5 times its upshift."""
    v = TimeTable(table=((0.0, 8.5), (5.0, 8.5), (15.0, 13.5)))
    u, b = TimeTable(table=((0.0, 0.0),)), TimeTable(table=((0.0, 0.3),))
    result = pt.simulate(Descending(v=v, u=u, b=b), stop=15, max_step=0.1)
    changes = np.flatnonzero(np.diff(result["schedule.gear"]))
    assert result["schedule.gear"][changes + 1].tolist() == [3, 2, 3]
    assert result["v.y"][changes[-1]] == pytest.approx(12, abs=1e-6)


def test_a_misspelt_option_of_a_schedule_is_named() -> None:
    with pytest.raises(pt.ParameterError, match=r"GearSchedule has no field w_fulll; did you mean w_full"):
        GearSchedule.for_gears((3.6, 2.1), 4.0, w_fulll=500.0)


def _shifts(result: pt.Result[Scheduled]) -> list[float]:
    return [float(t) for t in result.time[np.flatnonzero(np.diff(result["schedule.gear"]))]]


def test_clutch_follows_the_engine() -> None:
    car = Scheduled(v=TimeTable(table=((0.0, 0.0),)), w=TimeTable(table=((0.0, 80.0), (1.0, 180.0))))
    result = pt.simulate(car, stop=1, max_step=0.1)
    clutch = result.at([0.15, 0.475, 0.8, 1.0], "schedule.clutch")
    np.testing.assert_allclose(clutch, [0, 0.5, 1, 1], atol=1e-9)


@pytest.mark.parametrize(
    ("speeds", "said"),
    [
        (((4.0, 4.5),), r"up from gear 1 at 4 m/s, down to it at 4.5 m/s"),
        (((4.0, 2.0), (3.0, 2.5)), "gears 1 and 2 are not in order"),
    ],
)
def test_schedule_that_cannot_be(speeds: tuple[tuple[float, float], ...], said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        pt.compile(GearSchedule(speeds=speeds))


def test_shift_speeds_with_units() -> None:
    given: Any = [["36 km/h", 9], ["20m/s", "54 km/h"]]
    np.testing.assert_allclose(GearSchedule(speeds=given).speeds, [(10, 9), (20, 15)], rtol=1e-15)
    for schedule in {"speeds": given}, {"class": "PowerShiftSchedule", "speeds": given}:
        car = applied(ManualCar(), {"schedule": schedule})[0]
        assert car.schedule.speeds == GearSchedule(speeds=given).speeds  # type: ignore[attr-defined]


@pytest.mark.parametrize("kind", [{}, {"class": "PowerShiftSchedule"}])
@pytest.mark.parametrize(
    ("speeds", "said"),
    [
        ([["15 km", "9 km"]], "schedule.speeds = '15 km': km cannot be converted to m/s"),
        ([["15", "9"]], r"schedule.speeds is not a table of rows of numbers \[m/s\]: the row \('15', '9'\) is not 2"),
        ("15 km/h", r"schedule.speeds is not a table of rows of numbers \[m/s\]: the row '1'"),
    ],
)
def test_shift_speeds_that_are_none(kind: dict[str, str], speeds: Any, said: str) -> None:
    with pytest.raises(pt.ParameterError, match=f"^{said}"):
        applied(ManualCar(), {"schedule": {**kind, "speeds": speeds}})


class Stopping(pt.Component):
    """A switch that is shown a speed and an accelerator."""

    v: TimeTable = TimeTable(table=((0.0, 0.0),))
    u: TimeTable = TimeTable(table=((0.0, 0.0),))
    switch: StartStop = StartStop()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.v.y, self.switch.v)
        yield pt.connect(self.u.y, self.switch.accelerator)


def test_start_stop() -> None:
    """Rests from the start: stops after the least time of 2 s; the accelerator starts it at 5 s; it rests again, and runs to 7 s."""
    u = TimeTable(table=((0.0, 0.0), (5.0, 0.0), (5.0, 0.1), (5.5, 0.1), (5.5, 0.0)))
    result = pt.simulate(Stopping(u=u), stop=9, max_step=0.5)
    np.testing.assert_allclose(result.at([1.9, 2.1, 4.9, 5.1, 6.9, 7.1], "switch.on"), [1, 0, 0, 1, 1, 0])


@pytest.mark.parametrize(("delay", "stops"), [(0.0, 2.0), (3.0, 3.0)])
def test_rest_counts_from_the_start_of_the_run(delay: float, stops: float) -> None:
    result = pt.compile(Stopping(switch=StartStop(delay=delay))).simulate(40, start=30, max_step=0.5)
    np.testing.assert_allclose(result.at([30 + stops - 0.1, 30 + stops + 0.1], "switch.on"), [1, 0])


RESTS = (0, 0), (5, 0), (5, 1), (10, 1), (10, 0), (16, 0), (16, 1), (17, 1), (17, 0), (21, 0), (21, 1)


@pytest.mark.parametrize("start", [0, 30])
def test_every_rest_counts_anew(start: float) -> None:
    """At rest from 5 s to 10 s and from 21 s on: stops 2 s later each time; a rest of 1 s in between stops nothing."""
    v = TimeTable(table=tuple((t + start, 0.0 if rests else 5.0) for t, rests in RESTS))
    result = pt.compile(Stopping(v=v, u=v, switch=StartStop(delay=2.0))).simulate(start + 30, start=start, max_step=0.5)
    times = np.array([4.9, 6.9, 7.1, 9.9, 10.1, 16.9, 18.0, 22.9, 23.1])
    np.testing.assert_allclose(result.at(start + times, "switch.on"), [1, 1, 0, 0, 1, 1, 1, 1, 0])


def test_runs_while_the_vehicle_does() -> None:
    result = pt.simulate(Stopping(v=TimeTable(table=((0.0, 5.0), (4.0, 0.0)))), stop=6, max_step=0.5)
    np.testing.assert_allclose(result.at([3.9, 3.95], "switch.on"), [1, 0])


@pytest.mark.parametrize("control", [GearSchedule, FixedGear, OperatingLineControl])
def test_a_clutch_that_closes_below_the_speed_at_which_it_opens_is_refused(control: type[Any]) -> None:
    with pytest.raises(pt.ParameterError, match="w_open = 200 rad/s, w_closed = 160 rad/s"):
        control(w_open=200)


def test_an_engine_that_stops_where_it_starts_is_refused() -> None:
    with pytest.raises(pt.ParameterError, match=r"u_stop = 0.5, u_start = 0.02"):
        StartStop(u_stop=0.5)


def test_a_shift_ends_before_the_next_one_begins() -> None:
    """Otherwise the lever would start again at the gear that it has not reached."""
    GearSchedule(dwell=0.7, t_open=0.15, t_lever=0.25, t_close=0.3)
    with pytest.raises(pt.ParameterError, match=r"dwell = 0.69 s, .*t_lever = 0.25 s"):
        GearSchedule(dwell=0.69, t_open=0.15, t_lever=0.25, t_close=0.3)
    PowerShiftSchedule(dwell=0.4)
    with pytest.raises(pt.ParameterError, match=r"dwell = 0.39 s, t_shift = 0.4 s"):
        PowerShiftSchedule(dwell=0.39)
