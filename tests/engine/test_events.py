"""Contacts, resets, switches, schedules, guards; what stops a run; what a trajectory gives."""

from __future__ import annotations

import shutil
import sys

import casadi as ca
import numpy as np
import pytest
from models import COUPLED_PARAMETERS, COUPLED_START, coupled_clutches, dae

from powertrain.dae.hybrid import Contact, Guard, HybridDae, Reset, Switch, TimeSignal, When
from powertrain.engine.simulator import Simulator
from powertrain.engine.trajectory import Instant
from powertrain.errors import PowertrainError, SimulationError


def symbols(x: int, m: int, p: int = 0) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    return ca.SX.sym("t"), ca.SX.sym("x", x), ca.SX.sym("m", m), ca.SX.sym("p", p)


def ball(restitution: float, lift: bool = False) -> HybridDae:
    """A unit mass falls on the ground; with ``lift`` it is pulled up again later."""
    t, x, m, p = symbols(2, 1)
    pull = 20.0 * (t - 3.0) if lift else ca.SX(0)
    acceleration = ca.if_else(m[0] > 0.5, 0.0, -10.0 + ca.fmax(pull, 0))
    force = ca.if_else(m[0] > 0.5, 10.0 - ca.fmax(pull, 0), 0.0)
    contact = Contact("ground", "hand", 0, x[0], x[1], acceleration, force, ca.SX(restitution))
    return dae(
        t,
        x,
        m,
        p,
        ca.vertcat(x[1], acceleration),
        ["h", "v"],
        contacts=(contact,),
        impact_x=ca.SX([0.0, 1.0]),
        impact_a=ca.SX(1.0),
    )


def test_inelastic_stop_rests_and_lifts_off() -> None:
    trajectory = Simulator(ball(0.0, lift=True)).run([5.0, 0.0], [], stop=4.0)
    closed = [(e.time, e.new) for e in trajectory.events if e.kind == "contact"]
    assert [new for _, new in closed] == [1.0, 0.0]
    assert closed[0][0] == pytest.approx(1.0, abs=1e-8)
    assert closed[1][0] == pytest.approx(3.5, abs=1e-8)
    h = trajectory.at([2.0, 3.4])[1]
    assert np.abs(h[:, 0]).min() < 1e-9


def test_bouncing_ball_comes_to_rest() -> None:
    trajectory = Simulator(ball(0.5)).run([5.0, 0.0], [], stop=4.0)
    impacts = [e.time for e in trajectory.events if e.kind == "impact"]
    expected = [1.0, 2.0, 2.5, 2.75, 2.875]
    assert np.abs(np.array(impacts[:5]) - expected).max() < 1e-7
    assert trajectory.final_held[0] == 1.0
    assert abs(trajectory.final[1]) < 1e-12


def test_reset_on_a_condition_uses_the_values_before() -> None:
    t, x, m, p = symbols(2, 2)
    resets = (Reset(False, 0, x[1]), Reset(False, 1, x[0]), Reset(True, 1, m[1] + 1))
    when = When("swap", "hand", 0, x[0] - 1.0, resets)
    trajectory = Simulator(dae(t, x, m, p, ca.SX([1.0, 0.0]), ["a", "b"], whens=(when,))).run([0.0, -0.5], [], stop=2.0)
    assert trajectory.final == pytest.approx([0.5, 1.0], abs=1e-8)
    assert trajectory.final_held[1] == 1.0
    instant = trajectory.instants[0]
    assert instant.left == pytest.approx([1.0, -0.5], abs=1e-9)
    assert instant.right == pytest.approx([-0.5, 1.0], abs=1e-9)


def test_a_sampled_signal_counts_exact_instants() -> None:
    t, x, m, p = symbols(1, 3, 1)
    following = (m[1] + 1) * p[0]
    when = When("sample", "hand", 0, t - following, (Reset(True, 1, m[1] + 1), Reset(True, 2, x[0])), time=following)
    trajectory = Simulator(dae(t, x, m, p, ca.SX(1.0), ["a"], whens=(when,))).run([0.0], [0.1], stop=1.05)
    assert trajectory.final_held[1] == 10.0
    assert trajectory.final_held[2] == pytest.approx(1.0, abs=1e-12)
    assert [i.time for i in trajectory.instants] == [pytest.approx(0.1 * k, abs=0) for k in range(1, 11)]


def test_a_step_at_the_start_holds_from_the_start() -> None:
    t, x, m, p = symbols(1, 1)
    switch = Switch("step", "hand", 0, t - 0.0, time=ca.SX(0.0))
    trajectory = Simulator(dae(t, x, m, p, m[0], ["a"], switches=(switch,))).run([0.0], [], stop=1.0)
    assert trajectory.final[0] == pytest.approx(1.0, abs=1e-12)


def test_continuous_switch_leaves_no_event() -> None:
    t, x, m, p = symbols(1, 1)
    switch = Switch("abs", "hand", 0, ca.sin(t), continuous=True)
    xdot = ca.if_else(m[0] > 0.5, ca.sin(t), -ca.sin(t))
    trajectory = Simulator(dae(t, x, m, p, xdot, ["a"], switches=(switch,))).run(
        [0.0], [], stop=10.0, rtol=1e-9, atol=1e-11
    )
    assert trajectory.events == []
    assert trajectory.final[0] == pytest.approx(6.0 + 1.0 - np.cos(10.0 - 3 * np.pi), abs=1e-8)


def test_schedule_with_kinks_and_jumps() -> None:
    t, x, m, p = symbols(1, 3)
    schedule = TimeSignal("torque", 0, np.array([0.5, 1.0, 1.0, 2.0]), np.array([0.0, 1.0, 3.0, 3.5]))
    model = dae(t, x, m, p, m[1] + m[2] * (t - m[0]), ["a"], schedules=(schedule,))
    trajectory = Simulator(model).run([0.0], [], stop=3.0)
    assert trajectory.final[0] == pytest.approx(0.25 + 3.25 + 3.5, abs=1e-12)
    assert [i.time for i in trajectory.instants] == [1.0]
    later = Simulator(model).run([0.0], [], start=1.5, stop=2.0)
    assert later.final[0] == pytest.approx((3.25 + 3.5) / 4, abs=1e-12)


def test_guards_stop_or_count() -> None:
    t, x, m, p = symbols(1, 0)
    stops = Guard("map", "car.py:3", x[0], ca.SX(-1.0), ca.SX(0.7), "rad/s", "error")
    counts = Guard("table", "car.py:4", x[0], ca.SX(-np.inf), ca.SX(0.5), "rad/s", "count")
    counted = Simulator(dae(t, x, m, p, ca.cos(t), ["a"], guards=(counts,))).run([0.0], [], stop=1.0)
    assert counted.statistics["outside table"] > 0
    with pytest.raises(SimulationError, match=r"map \(car.py:3\) leaves its range .* rad/s") as caught:
        Simulator(dae(t, x, m, p, ca.cos(t), ["a"], guards=(stops, counts))).run([0.0], [], stop=3.0)
    assert caught.value.result.end == pytest.approx(np.arcsin(0.7), abs=1e-6)
    with pytest.raises(SimulationError, match="at t = 0 s: 2 rad/s"):
        Simulator(dae(t, x, m, p, ca.cos(t), ["a"], guards=(stops,))).run([2.0], [], stop=3.0)


def test_counts_of_one_name_are_told_apart() -> None:
    t, x, m, p = symbols(1, 0)
    low, high = (
        Guard("current", f"{path}: within(i, ...) (car.py:4)", x[0], ca.SX(-np.inf), ca.SX(limit), "A", "count")
        for path, limit in (("front.battery", 0.5), ("rear.battery", 2.0))
    )
    found = Simulator(dae(t, x, m, p, ca.cos(t), ["a"], guards=(low, high))).run([0.0], [], stop=1.0).statistics
    assert found["outside current (front.battery)"] > 0
    assert found["outside current (rear.battery)"] == 0


def test_a_step_outside_several_limits_of_one_name_counts_once() -> None:
    t, x, m, p = symbols(1, 0)
    place = "gearbox: yield pressure.value == curve(lever.value) (car.py:4)"
    guards = tuple(
        Guard("lever", place, x[0], ca.SX(-np.inf), ca.SX(limit), "1", "count") for limit in (-1.0, -0.5, 0.5)
    )
    found = Simulator(dae(t, x, m, p, ca.cos(t), ["a"], guards=guards)).run([0.0], [], stop=1.0).statistics
    assert found["outside lever (gearbox)"] == found["steps"]


def test_chattering_is_named() -> None:
    t, x, m, p = symbols(1, 1)
    switch = Switch("thermostat", "hand", 0, x[0])
    model = dae(t, x, m, p, ca.if_else(m[0] > 0.5, -1.0, 1.0), ["a"], switches=(switch,))
    with pytest.raises(SimulationError, match=r"thermostat \(hand\) switches without end") as caught:
        Simulator(model).run([0.5], [], stop=1.0)
    assert caught.value.result.end == pytest.approx(0.5, abs=1e-3)
    assert len(caught.value.result.events) < 2000


def test_a_derivative_that_is_not_finite_is_named() -> None:
    t, x, m, p = symbols(2, 0)
    model = dae(t, x, m, p, ca.vertcat(-1.0, ca.sqrt(x[0])), ["fuel", "power"])
    with pytest.raises(SimulationError, match=r"t = 1\.?\d* s the derivative of power is -?nan") as caught:
        Simulator(model).run([1.0, 0.0], [], stop=2.0)
    assert caught.value.result.end == pytest.approx(1.0, abs=1e-6)
    assert caught.value.result.at([0.5])[1][0, 0] == pytest.approx(0.5)


def test_a_singularity_names_the_state() -> None:
    t, x, m, p = symbols(1, 0)
    with pytest.raises(SimulationError, match="step size becomes too small at t = 1"):
        Simulator(dae(t, x, m, p, x**2, ["a"])).run([1.0], [], stop=2.0)


def test_a_coordinate_that_its_states_no_longer_determine_is_named() -> None:
    """A point on the unit circle with y as its state, at the lowest point: x has no slope in y there."""
    t, x, m, p = symbols(1, 0)
    horizontal = ca.SX.sym("horizontal")
    circle = horizontal**2 + x**2 - 1
    model = dae(t, x, m, p, -horizontal, ["y"], z=horizontal, residual=circle, residual_places=("the circle",))
    with pytest.raises(SimulationError, match=r"(?s)no longer determine horizontal from the states \(y\).*the circle"):
        Simulator(model).run([-0.8], [], z0=[0.6], stop=2.0)


def test_times_with_both_limits_and_without() -> None:
    trajectory = Simulator(coupled_clutches()).run(COUPLED_START, COUPLED_PARAMETERS, stop=1.5)
    grid = np.linspace(0, 1.5, 16)
    t, _, z, m = trajectory.at(grid)
    assert len(t) == 16 + 2 * len(trajectory.instants) - 2  # 0.4 and 0.9 are on the grid
    assert np.all(np.diff(t) >= 0)
    assert z.shape == (len(t), 0)
    at = np.flatnonzero(t == 0.4)
    assert m[at, 1].tolist() == [2.0, -1.0]
    assert trajectory.at(grid, with_events=False)[0] == pytest.approx(grid)
    assert trajectory.at([0.4], with_events=False)[3][0, 1] == -1.0


def test_a_part_of_a_run_has_its_steps_and_events() -> None:
    """Whole steps that begin and end at events, in between, or at the ends of the run; all bounces are steps."""
    run = Simulator(ball(0.5)).run([5.0, 0.0], [], stop=4.0)
    first, second = (float(e.time) for e in run.events[:2])
    for start, end in ((first, second), (0.5, second), (first, 2.2), (0.0, 4.0), (3.1, 3.2)):
        part = run.part(start, end)
        assert part.start == run.times[run.times <= start].max()
        assert part.end == min(run.times[run.times >= end], default=4.0)
        assert [e.time for e in part.events] == [e.time for e in run.events if part.start <= e.time <= part.end]
        inside = np.linspace(part.start, part.end, 20)
        for found, expected in zip(part.at(inside[:-1], False), run.at(inside[:-1], False), strict=True):
            np.testing.assert_array_equal(found, expected)
        np.testing.assert_array_equal(part.final[0], run.at([part.end], False).x[0, 0])


@pytest.mark.parametrize(
    ("time", "before", "after", "extra", "begins"),
    [
        (0.0, [2.0, 0.0, 1.0], [0.0, 1.0, 1.0], (), True),
        (0.1, [2.0, 0.0, 1.0], [0.0, 1.0, 1.0], (), False),
        (0.0, [2.0, 0.0, 1.0], [0.0, 1.0, 0.0], (), False),
        (0.0, [2.0, 0.0, 1.0], [0.0, 1.0, 1.0], (("hit", "impact"),), False),
    ],
)
def test_free_laws_that_engage_at_the_start_are_no_event(
    time: float, before: list[float], after: list[float], extra: tuple[tuple[str, str], ...], begins: bool
) -> None:
    """The second value marks whether the first law rests at its limit; the third is the mode of a law that is not free."""
    y = np.zeros(1)
    assert Instant(time, y, y, np.array(before), np.array(after), extra).begins(0.0, [1]) == begins


def test_a_second_run_does_not_depend_on_the_first() -> None:
    engine = Simulator(coupled_clutches())
    first = engine.run(COUPLED_START, COUPLED_PARAMETERS, stop=1.5).final
    engine.run(COUPLED_START, 1.3 * COUPLED_PARAMETERS, stop=0.77)
    assert np.array_equal(engine.run(COUPLED_START, COUPLED_PARAMETERS, stop=1.5).final, first)


def test_progress_ends_at_the_stop_time() -> None:
    seen: list[float] = []
    run = Simulator(coupled_clutches()).run
    run(COUPLED_START, COUPLED_PARAMETERS, stop=1.5, progress=lambda t, y, m: seen.append(t))
    assert (seen[0], seen[-1]) == (0.0, 1.5)


def test_bad_calls() -> None:
    engine = Simulator(coupled_clutches())
    with pytest.raises(ValueError, match="before start"):
        engine.run(COUPLED_START, COUPLED_PARAMETERS, start=2.0, stop=1.0)
    with pytest.raises(ValueError, match="x has 1 entries instead of 8"):
        engine.run([1.0], COUPLED_PARAMETERS, stop=1.0)


@pytest.mark.slow
@pytest.mark.skipif(not (shutil.which("cc") or shutil.which("gcc")), reason="no C compiler on this machine")
def test_compiled_steps_give_the_same_run(tmp_path: object, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("POWERTRAIN_CACHE", str(tmp_path))
    plain, compiled = (
        Simulator(coupled_clutches(), compile=c).run(COUPLED_START, COUPLED_PARAMETERS, stop=1.5) for c in (False, True)
    )
    assert np.abs(plain.final - compiled.final).max() < 1e-10


def test_compiling_without_a_compiler_says_so(tmp_path: object, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("POWERTRAIN_CACHE", str(tmp_path))
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setitem(sys.modules, "ziglang", None)
    with pytest.raises(PowertrainError, match="needs a C compiler"):
        Simulator(coupled_clutches(), compile=True).run(COUPLED_START, COUPLED_PARAMETERS, stop=1.5)
