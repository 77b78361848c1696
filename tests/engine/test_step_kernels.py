"""Parts of the step that no run shows when they are wrong: the first step size, the error of algebraic unknowns, kinks inside a step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from models import dae, exact, nonlinear

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.dae.friction import next_mode
from powertrain.dae.hybrid import Friction, HybridDae
from powertrain.dae.tolerances import EPS
from powertrain.engine.chatter import Chatter
from powertrain.engine.simulator import Simulator
from powertrain.integration import fused as steps
from powertrain.modes.selflocking import refused

Matrix = np.ndarray[Any, Any]


@pytest.mark.parametrize("t", [0.0, 0.3, 2.0])
@pytest.mark.parametrize("still", [False, True])
@pytest.mark.parametrize("far", [True, False])
def test_the_first_step_is_hairers(t: float, still: bool, far: bool) -> None:
    """E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, section II.4, for order 5; also from a point where
    nothing moves, and from zero."""
    model, rtol, atol = nonlinear(), 1e-6, 1e-8
    if still:
        model = replace(model, xdot=ca.SX.zeros(2))
    y = exact(t) + 0.1 if far else np.zeros(2)
    rates = ca.Function("f", [model.t, model.x], [model.xdot])

    def f(at: float, x: Matrix) -> Matrix:
        return np.array(rates(at, x)).ravel()

    def norm(v: Matrix) -> float:
        return float(np.linalg.norm(v / (atol + rtol * np.abs(y)), 4))

    first = 1e-6 if min(norm(y), norm(f(t, y))) < 1e-5 else 0.01 * norm(y) / norm(f(t, y))
    most = max(norm(f(t, y)), norm(f(t + first, y + first * f(t, y)) - f(t, y)) / first)
    expected = min(100 * first, (0.01 / most) ** 0.2 if most > 1e-15 else max(1e-6, 1e-3 * first))
    _, slope, start = steps.fresh(steps.Model(model, None))([t, 0.0], y, [], [], [rtol, atol])
    np.testing.assert_allclose(np.array(slope).ravel(), f(t, y), rtol=1e-10, atol=1e-11)  # of the right limit
    assert float(start[0]) == pytest.approx(expected, rel=1e-9)


class Followed(pt.Component):
    """What has to be solved for follows a sine; the only state hardly moves."""

    x: pt.Variable = pt.variable("1", "State", start=1.0)
    z: pt.Variable = pt.variable("1", "Implicit unknown")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == -0.1 * self.x
        yield self.z + 0.5 * ca.sin(self.z) == 3 * ca.sin(20 * pt.time)


@pytest.mark.parametrize("rtol", [1e-4, 1e-6])
def test_algebraic_unknowns_bound_the_steps_where_states_do_not(rtol: float) -> None:
    """To ten times the tolerance at the ends of steps; between them the polynomial is of lower order."""
    run = pt.simulate(Followed(), 3.0, rtol=rtol)
    left = run["z"] + 0.5 * np.sin(run["z"]) - 3 * np.sin(20 * run.time)
    assert np.abs(left).max() < 100 * rtol


def test_chattering_is_told_by_times_that_lie_close_together() -> None:
    """1,000 switches within 1e-5 of the span, no less and not more slowly."""

    def chatters(apart: float, count: int) -> bool:
        chatter = Chatter(10.0)
        return any(chatter.note(3, 1.0 + k * apart) for k in range(count))

    close = 1e-4 / 999
    assert chatters(0.99 * close, 1000)
    assert not chatters(0.99 * close, 999)
    assert not chatters(1.01 * close, 1500)


@pytest.mark.parametrize("w", [3.0, -3.0, 1.5, -1.5])
@pytest.mark.parametrize("rate", [1.0, -1.0, 0.0])
def test_a_prescribed_speed_beyond_its_zone_tells_its_direction(w: float, rate: float) -> None:
    """Speeds in units of their hysteresis: up to twice that the rate tells where it goes."""
    t, x, m, p = ca.SX.sym("t"), ca.SX.sym("x", 0), ca.SX.sym("m", 1), ca.SX.sym("p", 0)
    law = Friction("law", "", 0, ca.SX(w * EPS), ca.SX(0), ca.SX(-1), ca.SX(1), ca.SX(1), ca.SX(rate), prescribed=True)
    model = dae(t, x, m, p, ca.SX(0, 1), [], frictions=(law,))
    for mode in (-1.0, 0.0, 1.0):
        found = ca.Function("f", [m], [next_mode(model, law, ca.SX(0), ca.SX(0))])(mode)
        assert float(found) == (np.sign(w) if abs(w) > 2 else np.sign(rate))


@pytest.mark.parametrize(("crossed", "locked"), [(1e-5, True), (1e-7, False)])
def test_limits_that_cross_by_more_than_a_hysteresis_lock(crossed: float, locked: bool) -> None:
    """As shares of the largest torque, 1 kN.m of another law; the limits follow a mode, as those of a lossy mesh do."""
    t, x, m, p = ca.SX.sym("t"), ca.SX.sym("x", 0), ca.SX.sym("m", 2), ca.SX.sym("p", 0)
    one, large = ca.SX(1), ca.SX(1e3)
    crossing = Friction("mesh", "", 0, one, one, 1 + 1e3 * m[1], one, one, one, may_free=False)
    other = Friction("other", "", 0, one, large, -large, large, one, one)
    found = refused(dae(t, x, m, p, ca.SX(0, 1), [], frictions=(crossing, other)))
    assert (float(ca.Function("f", [m], [found])([1.0, crossed])) > 0) == locked
    assert float(ca.Function("f", [m], [found])([0.0, 1.0])) < 0  # stuck, it does not slide


class Kinked(pt.Component):
    """x' = 10 |v - c| with v = exp(-t/20): a kink that is no event, between two stages of a long step."""

    c: pt.Parameter = pt.parameter("1", "Where the kink is", default=0.5)
    x: pt.Variable = pt.variable("1", "Distance", start=0.0)
    v: pt.Variable = pt.variable("1", "Slows down", start=1.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.v) == -0.05 * self.v
        yield pt.der(self.x) == 10 * ca.fabs(self.v - self.c)


def test_the_defect_midway_sees_kinks_that_the_embedded_error_does_not() -> None:
    """Without it some are passed with 750 times the tolerance."""

    def integral(t: Matrix, c: float) -> Matrix:
        return 20 * (1 - np.exp(-t / 20)) - c * t

    plant = pt.compile(Kinked())
    for c in np.linspace(0.55, 0.95, 41):
        run = plant.simulate(14.0, parameters={"c": c}, rtol=1e-6)
        turn = np.minimum(-20 * np.log(c), run.time)
        exact = 10 * (2 * integral(turn, c) - integral(run.time, c))
        assert np.abs(run["x"] - exact).max() < 50e-6 * (1 + exact[-1])


class Turned(pt.Component):
    """An inertia whose speed is given exactly."""

    w: pt.Input = pt.signal_input("rad/s", "Speed", default=1.0)
    motor: rot.Speed = rot.Speed(exact=True)
    shaft: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.w, self.motor.w_ref)
        yield pt.connect(self.motor.flange, self.shaft.flange_a)


@pytest.mark.parametrize(("jump", "refused"), [(1e-5, True), (-1e-5, True), (1e-8, False)])
def test_jumps_beyond_round_off_are_refused_where_inertia_follows(jump: float, refused: bool) -> None:
    given = {"w": ([0.0, 1.0, 1.0, 2.0], [1.0, 1.0, 1.0 + jump, 1.0 + jump])}
    plant = pt.compile(Turned())
    if not refused:
        assert plant.simulate(2.0, inputs=given)["shaft.w"][-1] == 1.0 + jump
        return
    with pytest.raises(pt.SimulationError, match=r"at t = 1 s .* jump by -?1e-05 rad/s"):
        plant.simulate(2.0, inputs=given)


@pytest.mark.parametrize(
    ("slopes", "span", "method"),
    [
        ([[-100.0, 0.0], [-7.0, 0.5]], 124.0, "dopri5"),
        ([[-100.0, 0.0], [-7.0, 0.5]], 126.0, "rodas5p"),  # 12,500 times the time constant of the fast state
        ([[-100.0, 1e4], [0.0, 0.5]], 124.0, "dopri5"),  # large slopes without large eigenvalues
        ([[0.0, 100.0], [-100.0, 0.0]], 126.0, "rodas5p"),
        ([[np.nan, 0.0], [0.0, -100.0]], 126.0, "dopri5"),
        ([[-np.inf, 0.0], [0.0, -100.0]], 126.0, "dopri5"),
    ],
)
def test_eigenvalues_at_the_start_choose_the_method(slopes: list[list[float]], span: float, method: str) -> None:
    t, x, m, p = ca.SX.sym("t"), ca.SX.sym("x", 2), ca.SX.sym("m", 0), ca.SX.sym("p", 4)
    simulator = Simulator(dae(t, x, m, p, ca.reshape(p, 2, 2).T @ x, ["a", "b"]))
    simulator.resolve(0.0, [0.0, 0.0], [], [], np.ravel(slopes))
    assert simulator.first_method(span) == method


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_slope_that_jumps_at_a_state_is_the_one_ahead(direction: float) -> None:
    """As that of a cam whose angle starts on a corner of its table."""
    t, x, m, p = ca.SX.sym("t"), ca.SX.sym("x", 2), ca.SX.sym("m", 0), ca.SX.sym("p", 0)
    model = dae(t, x, m, p, ca.vertcat(direction, ca.if_else(x[0] < 0.5, 2.0, 3.0)), ["angle", "lift"])
    slope = steps.fresh(steps.Model(model))([0.0, 0.0], [0.5, 0.0], [], [], [1e-6, 1e-6])[1]
    assert float(slope[1]) == (3.0 if direction > 0 else 2.0)


def one_unknown(residual: Callable[[ca.SX, ca.SX], ca.SX]) -> HybridDae:
    """x' = -x beside residual(z, x) = 0."""
    t, x, z, m, p = ca.SX.sym("t"), ca.SX.sym("x"), ca.SX.sym("z"), ca.SX.sym("m", 0), ca.SX.sym("p", 0)
    return dae(t, x, m, p, -x, ["x"], z=z, residual=residual(z, x))


@pytest.mark.parametrize("start", [-0.8, 0.3, 0.9, 1.4, 1.5, -1.5])
def test_full_steps_are_trusted_only_while_they_approach_the_root(start: float) -> None:
    """sin z = 0.1: from where the slope is small they arrive at another root, 16 rad away."""
    find = steps.newton(steps.Model(one_unknown(lambda z, x: ca.sin(z) - x), [0]))
    z, left = (float(v) for v in find([0.0, 0.0], [0.1, start], [], []))
    assert (left == 0) == (abs(start) < 1.0)
    if abs(start) < 1.0:
        assert z == pytest.approx(np.arcsin(0.1), abs=1e-12)


def test_a_small_residual_is_no_solution_while_steps_go_on() -> None:
    """z^3 = 0 from 1e-7: every step takes a third of what is left."""
    find = steps.newton(steps.Model(one_unknown(lambda z, x: z**3), [0]))
    assert float(find([0.0, 0.0], [0.1, 1e-7], [], [])[1]) > 0


@pytest.mark.parametrize("start", [0.2, -0.1, 0.0])
def test_a_root_at_zero_is_found(start: float) -> None:
    """z + z^2 = 0: what is left of z is not compared with z itself."""
    find = steps.newton(steps.Model(one_unknown(lambda z, x: z + z**2), [0]))
    z, left = (float(v) for v in find([0.0, 0.0], [0.1, start], [], []))
    assert left == 0
    assert abs(z) < 1e-15


@pytest.mark.parametrize("fraction", [0.2, 0.5, 0.9])
def test_unknowns_inside_a_step_solve_their_equations(fraction: float) -> None:
    """z^3 + z = 4 x. The polynomial is off by 1e-3, one correction by Newton's method leaves its square, two leave nothing."""
    x = 1.0 - 0.5 * fraction
    (z,) = (float(root.real) for root in np.roots([1.0, 0.0, 1.0, -4 * x]) if abs(root.imag) < 1e-9)
    dense = np.zeros((5, 2))
    dense[:2] = [1.0, 2.0], [-0.5, (z + 1e-3 - 2.0) / fraction]
    locate = steps.locate(steps.Model(one_unknown(lambda z, x: z**3 + z - 4 * x), [0]))
    found = np.array(locate([0.0, 1.0], fraction, [], dense.ravel(), [], [])[0]).ravel()
    np.testing.assert_allclose(found, [x, z], atol=1e-11)


@pytest.mark.parametrize("off", [1e-3, 0.5])
def test_unknowns_at_a_corner(off: float) -> None:
    """z^3 + z = 2: two corrections suffice from 1e-3 away; from 0.5 away modes are resolved, which solves for z as well."""
    corner = steps.corner(steps.Model(one_unknown(lambda z, x: z**3 + z - 2 * x), [0]))
    y, _, found = corner([0.0, 0.0], [1.0, 1.0 + off], [], [])
    assert (float(found[0]) == 0.0) == (off < 0.1)
    if off < 0.1:
        assert float(y[1]) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("flag", [0, 1, 2, 3, 4])
def test_what_makes_a_corner_an_event(flag: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A change of modes, a reset, an impact, a law at its limit, or torques that are not finite."""
    flags = np.zeros(7)
    flags[flag] = np.inf if flag == 3 else 1.0
    for expected, given in ((False, np.zeros(7)), (True, flags)):
        monkeypatch.setattr(steps, "_rules", lambda *_, given=given: [None, ca.SX(given)])
        found = steps.corner(steps.Model(nonlinear()))([0.0, 0.0], [1.0, 1.0], [], [])[2]
        assert (float(found[0]) != 0.0) == expected


def braked() -> HybridDae:
    """A mass that a brake holds, whose limits depend on the speed and on a second state."""
    t, x, m, p = ca.SX.sym("t"), ca.SX.sym("x", 2), ca.SX.sym("m", 1), ca.SX.sym("p", 0)
    upper = 1 + x[1] + x[0]
    law = Friction("brake", "hand", 0, x[0], ca.SX(0), -upper, upper, ca.SX(1), ca.SX(0), may_free=False)
    return dae(t, x, m, p, ca.vertcat(0.0, ca.sign(t - 1)), ["w", "other"], frictions=(law,))


def test_a_corner_continues_at_rest_with_the_slope_ahead() -> None:
    """A stuck speed is zero again, and a slope that jumps at the corner is that of the right limit."""
    y, reached, _ = steps.corner(steps.Model(braked()))([1.0, 0.0], [1e-9, 0.3], [0.0], [])
    np.testing.assert_array_equal(np.array(y).ravel(), [0.0, 0.3])
    np.testing.assert_array_equal(np.array(reached).ravel()[:2], [0.0, 1.0])


def test_indicators_at_the_start_of_the_step_after_an_event_or_a_corner() -> None:
    """The brake may take 1.3 N more, with its speed set to zero."""
    fresh, corner = steps.fresh(steps.Model(braked())), steps.corner(steps.Model(braked()))
    for found in (fresh([1.0, 0.0], [1e-3, 0.3], [0.0], [], [1e-6, 1e-6]), corner([1.0, 0.0], [1e-3, 0.3], [0.0], [])):
        assert float(found[1][2]) == pytest.approx(1.3, abs=1e-6)


@pytest.mark.parametrize(("speed", "jumped", "judged"), [(1e-8, 0.0, 0.0), (1e-8, 1.0, 1e-8), (1e-3, 0.0, 1e-3)])
def test_stuck_laws_are_judged_at_rest(
    speed: float, jumped: float, judged: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A speed within the error of the integration is zero for the rules, unless something has jumped; a larger one stays."""
    monkeypatch.setattr(steps, "_rules", lambda model, y, fire, jumped: [y])
    seen = steps.update(steps.Model(braked()))([0.0, 0.0], [speed, 0.3], [0.0], [], [], [jumped, 0.0])
    np.testing.assert_array_equal(np.array(seen).ravel(), [judged, 0.3])
