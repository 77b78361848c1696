"""The kernels of operating points alone, on laws written by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.linalg import invhilbert

from powertrain.dae.friction import BACKWARD, FORWARD, FREE, STUCK
from powertrain.dae.hybrid import Friction
from powertrain.equilibrium.beginnings import (
    UNSURE,
    EulerStep,
    _condition_bound,
    _degenerate,
    _distinct,
    _hold_each_other,
    euler_step,
    mobilities,
)
from powertrain.equilibrium.continuation import relaxed
from powertrain.equilibrium.corrector import adrift, corrected, responses, saddles, undetermined
from powertrain.equilibrium.laws import Linearized, NextModes, SteadyLaws
from powertrain.equilibrium.points import AtRest, Iterates, SolvedPoints
from powertrain.equilibrium.solutions import Solutions
from powertrain.equilibrium.system import Balance
from powertrain.numerics.batch import Common

Matrix = np.ndarray[Any, Any]


def by_hand(n: int, count: int, rows: Any, speed: Any, lower: Any, upper: Any, may_free: bool = False) -> SteadyLaws:
    """The laws of ``n`` unknowns whose rates are the rows, and of ``count`` frictions; all are functions of (y, tau)."""
    y, tau, modes, none = ca.SX.sym("y", n), ca.SX.sym("tau", count), ca.SX.sym("m", count), ca.SX(0, 1)
    o = ca.SX(0)
    frictions = [Friction(f"law {k}", "", k, o, o, o, o, o, o, may_free=may_free) for k in range(count)]
    dae = SimpleNamespace(frictions=frictions, switches=[], contacts=[])
    laws = [ca.SX(ca.densify(ca.SX(e(y, tau)))) for e in (rows, speed, lower, upper)]
    names, rate_of = tuple(f"y{i}" for i in range(n)), np.arange(n)
    given: list[Any] = [
        dae,
        none,
        y,
        names,
        np.zeros(n),
        ca.SX.zeros(n),
        modes,
        Common(none),
        tau,
        laws[0],
        rate_of,
        *laws[1:],
        none,
    ]
    given.append(ca.SX.ones(count))
    return SteadyLaws(Balance(*given))


def sliding(coupling: Matrix, damping: float = 1.0, speed: float = 5.0) -> tuple[SteadyLaws, Iterates]:
    """One shaft of a speed y, braked by a damper and by laws that slide; their limits follow the others' torques by ``coupling``."""
    count = len(coupling)
    laws = by_hand(
        1,
        count,
        rows=lambda y, tau: damping * (speed - y) + ca.sum1(1 - tau),
        speed=lambda y, tau: ca.repmat(y, count),
        lower=lambda y, tau: -ca.DM.ones(count),
        upper=lambda y, tau: 1 + ca.DM(coupling) @ (tau - 1),
    )
    return laws, Iterates(np.zeros((1, 0)), np.full((1, 1), speed), np.ones((1, count)), np.ones((1, count)))


def step(along: list[float], unsure: float = 0.0) -> EulerStep:
    return EulerStep(np.zeros((1, 1)), np.array([[along]]), np.full((1, 1, len(along)), unsure), np.zeros(1, bool))


def test_mobilities() -> None:
    """How much a torque moves its own law: its entry of G; what cancels does not move it, and counts as one."""
    G = np.array([[2.0, -0.5, 0.0], [-0.5, 0.25, 0.0], [1.0, 0.0, 0.0]])
    laws, at = sliding(np.zeros((3, 3)))
    value = laws.motion(at)
    value.speed_[0, :, 1:] = -G
    value.speed_[0, 2, 0] = 1.0
    given, reach, slope = mobilities(value, step([0.0, 0.0, 0.0]))
    np.testing.assert_array_equal(given, [[False, False, True]])
    np.testing.assert_allclose(reach, [[2.0, 0.25, 1.0]])
    np.testing.assert_allclose(slope[0], -G)
    given, reach, _ = mobilities(value, step([0.0, 0.0, 3.0]))
    assert not given[0, 2]
    assert reach[0, 2] == pytest.approx(3.0)


def test_a_mobility_that_is_round_off_is_none() -> None:
    """The only term of a mobility tells nothing of its size: the round-off of the step does."""
    laws, at = sliding(np.zeros((1, 1)))
    value = laws.motion(at)
    value.speed_[0] = [1.0, 0.0]
    assert mobilities(value, step([5e-18], unsure=5e-18))[0].all()
    assert not mobilities(value, step([5e-18], unsure=5e-33))[0].any()


def test_a_motion_that_others_move_and_that_moves_others_is_not_given() -> None:
    """A free unknown takes what the first torque does to its own law: with the second one both are determined, and it yields to that."""
    laws, at = sliding(np.zeros((2, 2)))
    value = laws.motion(at)
    value.speed_[0] = 0.0
    value.speed_[0, :, 1:] = -np.array([[0.0, 3.0], [0.5, 2.0]])
    given, reach, _ = mobilities(value, step([0.0, 0.0]))
    assert not given.any()
    np.testing.assert_allclose(reach, [[3.0, 2.0]])


def test_laws_in_a_combination_of_torques_that_moves_nothing() -> None:
    """Of three laws on two motions, the third has a share of 3e-5 in it. A fourth has its own motion, and that of a fifth is given."""
    on = np.array([[1.0, 0.3, -0.2], [0.4, 1.7, 0.1], [0.0, 0.1, 2.9]])
    shares = np.array([[1.0, 0.0, 0.0], [-2.0, 1e-4, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 1.0]]) @ on
    slope = -(shares @ shares.T)
    size = np.sqrt(np.append(-np.diag(slope), np.inf))
    slope = np.pad(slope, (0, 1), constant_values=0.5)
    assert _hold_each_other(size[None], slope[None]).tolist() == [[True, True, True, False, True]]


def test_points_with_equal_slopes_are_found() -> None:
    """Also if a slope has no value: then every point is on its own."""
    rows = np.array([[1.0, 2.0], [3.0, 4.0], [1.0, 2.0], [1.0, 2.0 + 1e-15]])
    first, place = _distinct(rows)
    assert first.size == 3
    np.testing.assert_array_equal(rows[first][place], rows)
    rows[1, 0] = np.nan
    assert _distinct(rows)[1].tolist() == [0, 1, 2, 3]


@pytest.mark.parametrize(("gain", "locked"), [(0.5, False), (0.99, False), (1.0 - 1e-11, True), (-1.0 + 1e-11, True)])
def test_torques_that_follow_each_other_without_limit(gain: float, locked: bool) -> None:
    """tau_1 = 1 + gain tau_2 and tau_2 = 1 + gain tau_1 grow as 1/(1 - gain^2)."""
    laws, at = sliding(np.array([[0.0, gain], [gain, 0.0]]))
    rest = AtRest(np.zeros((1, 2), bool), np.full((1, 2), 1e-8), np.ones((1, 2)))
    assert undetermined(laws, at, responses(laws, at, rest)).tolist() == [locked]


def nothing_holds(laws: SteadyLaws, at: Iterates, rest: AtRest) -> list[bool]:
    """Whether there is a motion that nothing holds, at every point."""
    found = np.zeros(len(at.y), bool)
    for _, _, free in adrift(laws, at, rest, responses(laws, at, rest)):
        found |= free
    return list(found.tolist())


@pytest.mark.parametrize(("damping", "open_"), [(1.0, False), (1e-5, False), (1e-9, True)])
def test_a_motion_that_nothing_holds(damping: float, open_: bool) -> None:
    laws, at = sliding(np.zeros((1, 1)), damping)
    rest = AtRest(np.zeros((1, 1), bool), np.full((1, 1), 1e-8), np.ones((1, 1)))
    assert nothing_holds(laws, at, rest) == [open_]


@pytest.mark.parametrize("damping", [(1e-9, 1.0), (1.0, 1e-9), (1.0, 1.0)])
def test_any_motion_that_nothing_holds_counts(damping: tuple[float, float]) -> None:
    """Of two shafts without laws, the first or the last."""
    none = np.zeros((1, 0))

    def nothing(y: Any, tau: Any) -> Any:
        return ca.SX(0, 1)

    laws = by_hand(2, 0, lambda y, tau: ca.DM(damping) * (1 - y), nothing, nothing, nothing)
    at, rest = Iterates(none, np.ones((1, 2)), none, none), AtRest(none.astype(bool), none, none)
    assert nothing_holds(laws, at, rest) == [min(damping) < 1e-6]


def one_law(speed: float, width: float = 2.0, residual: float = 0.0) -> tuple[SteadyLaws, Iterates]:
    """A law whose speed is the difference of two of one rad/s, with limits on both sides of its torque of zero."""
    laws = by_hand(
        2,
        1,
        rows=lambda y, tau: ca.vertcat(3.0 * y[0] - 2.0 * y[1] - 1.0 - 3.0 * speed + residual, 0.0),
        speed=lambda y, tau: y[0] - y[1],
        lower=lambda y, tau: -width / 2,
        upper=lambda y, tau: width / 2,
        may_free=True,
    )
    none = np.zeros((1, 0))
    return laws, Iterates(none, np.array([[1.0 + speed, 1.0]]), np.zeros((1, 1)), np.zeros((1, 1)))


def next_modes(laws: SteadyLaws, at: Iterates) -> NextModes:
    return laws.next_modes(at, AtRest(np.zeros((1, 1), bool), np.zeros((1, 1)), np.ones((1, 1))))


@pytest.mark.parametrize(("width", "mode"), [(5e-11, FREE), (5e-9, STUCK)])
def test_a_law_is_free_where_its_limits_are_one(width: float, mode: float) -> None:
    assert next_modes(*one_law(0.0, width)).modes[0, 0] == mode


@pytest.mark.parametrize(("residual", "balanced"), [(5e-7, True), (-5e-7, True), (1e-6, False), (-1e-6, False)])
def test_equations_are_balanced_by_their_terms(residual: float, balanced: bool) -> None:
    """Of 3 + 2 + 1."""
    assert next_modes(*one_law(0.0, residual=residual)).balanced.tolist() == [balanced]


@pytest.mark.parametrize(("small", "degenerate"), [(1e-12, False), (4e-15, True), (0.0, True)])
def test_equations_that_determine_unknowns_by_round_off_alone(small: float, degenerate: bool) -> None:
    """Whatever the unit of an equation."""
    matrix = np.array([[[1e6, 1e6], [1.0, 1.0 + small]], np.eye(2)])
    assert _degenerate(matrix).tolist() == [degenerate, False]


@pytest.mark.parametrize(("speed", "mode"), [(0.0, STUCK), (2e-10, STUCK), (1e-7, FORWARD), (-1e-7, BACKWARD)])
def test_rest_is_a_share_of_the_terms(speed: float, mode: float) -> None:
    laws, at = one_law(speed)
    assert Linearized(laws)(at, lossless=False).zone[0, 0] == pytest.approx(3e-9, rel=1e-6)
    assert next_modes(laws, at).modes[0, 0] == mode


@pytest.mark.parametrize(("speed", "differ"), [(5.0, True), (0.0, False)])
def test_solutions_that_differ_in_a_torque_alone(speed: float, differ: bool) -> None:
    """Where the law slides there are two; how laws at rest share a torque makes no other solution."""
    laws, at = sliding(np.zeros((1, 1)), speed=speed)
    solutions = Solutions.__new__(Solutions)
    solutions.laws = laws

    def point(tau: float) -> SolvedPoints:
        one = np.ones((1, 1))
        return SolvedPoints(np.ones(1, bool), at.y, at.modes, tau * one, np.zeros((1, 1), bool), one)

    assert solutions._differ(at.grid, point(1.0), point(1.0 + 1e-4)).tolist() == [differ]
    assert solutions._differ(at.grid, point(1.0), point(1.0 + 1e-9)).tolist() == [False]


def test_modes_at_rest_come_first() -> None:
    laws, at = sliding(np.zeros((2, 2)))
    solutions = Solutions.__new__(Solutions)
    solutions.laws = laws

    def rank(*modes: float) -> int:
        return int(solutions._rank(SolvedPoints(at.y, at.y, np.array([modes]), at.tau, at.tau, at.tau))[0])  # type: ignore[arg-type]

    assert rank(STUCK, STUCK) < rank(FORWARD, STUCK) < rank(BACKWARD, STUCK) < rank(FORWARD, FORWARD)


def test_stuck_laws_yield_in_newtons_matrix() -> None:
    """Row of a stuck law: its speed, less what it yields; of a sliding one: its torque, less its limit."""
    laws, at = sliding(np.zeros((2, 2)), speed=2.0)
    at.modes[0], at.tau[0] = (STUCK, FORWARD), (7.0, 3.0)
    rest = AtRest(np.zeros((1, 2), bool), np.array([[3e-8, 5e-8]]), np.ones((1, 2)))
    entries, value = laws.equations(laws.fixed(at, rest, step=4.0), at.z)
    matrix = laws.pattern.dense(entries)
    np.testing.assert_array_equal(matrix, [[[-1.25, -1.0, -1.0], [1.0, -3e-8, 0.0], [0.0, 0.0, 1.0]]])
    np.testing.assert_array_equal(value, [[-8.0, 2.0, 2.0]])


@pytest.mark.parametrize(
    ("mode", "side", "given", "lossless", "value", "slopes"),
    [
        (STUCK, 1.0, False, False, 5.0, [1.0, -1e-8]),
        (FORWARD, 1.0, False, False, 4.0 - 30.0, [-6.0, 1.0]),
        (BACKWARD, 1.0, False, False, 4.0 - 10.0, [-2.0, 1.0]),
        (STUCK, 1.0, True, False, 4.0 - 30.0, [-6.0, 1.0]),
        (STUCK, -1.0, True, False, 4.0 - 10.0, [-2.0, 1.0]),
        (STUCK, 0.0, True, False, 4.0 - 10.0, [0.0, 1.0]),
        (FORWARD, 1.0, False, True, 4.0, [0.0, 1.0]),
    ],
)
def test_what_is_zero_of_a_law(
    mode: float, side: float, given: bool, lossless: bool, value: float, slopes: list[float]
) -> None:
    """A torque of 4 N.m at 5 rad/s, whose limits are 2 y and 6 y: the smallest between them is the lower."""
    laws = by_hand(1, 1, lambda y, tau: -y, lambda y, tau: y, lambda y, tau: 2 * y, lambda y, tau: 6 * y)
    at = Iterates(np.zeros((1, 0)), np.array([[5.0]]), np.array([[mode]]), np.array([[4.0]]))
    rest = AtRest(np.array([[given]]), np.array([[1e-8]]), np.array([[side]]))
    entries, found = laws.equations(laws.fixed(at, rest, lossless), at.z)
    assert found[0].tolist() == [-5.0, value]
    assert laws.pattern.dense(entries)[0, 1].tolist() == slopes


def test_a_limit_that_is_infinite_is_not_seen_from_the_other() -> None:
    laws = by_hand(1, 1, lambda y, tau: -y, lambda y, tau: y, lambda y, tau: -1 / y, lambda y, tau: tau + 1)
    at = Iterates(np.zeros((1, 0)), np.zeros((1, 1)), np.array([[FORWARD]]), np.array([[4.0]]))
    rest = AtRest(np.zeros((1, 1), bool), np.array([[1e-8]]), np.ones((1, 1)))
    entries, found = laws.equations(laws.fixed(at, rest), at.z)
    assert found[0, 1] == -1.0
    assert np.isfinite(entries).all()


def without_laws(rows: Any, y: float) -> tuple[SteadyLaws, Iterates, AtRest]:
    """One unknown with this rate, at the value ``y``."""
    none = np.zeros((1, 0))

    def nothing(y: Any, tau: Any) -> Any:
        return ca.SX(0, 1)

    laws = by_hand(1, 0, lambda y, tau: rows(y), nothing, nothing, nothing)
    return laws, Iterates(none, np.full((1, 1), y), none, none), AtRest(none.astype(bool), none, none)


def test_a_motion_is_followed_in_steps_that_grow(monkeypatch: pytest.MonkeyPatch) -> None:
    """y' = 1 - y: every implicit Euler step is exact, so that each is taken and the lengths grow threefold from 1e-4 to 1e7 s."""
    laws, at, rest = without_laws(lambda y: 1.0 - y, -300.0)
    rounds, followed = 0, SteadyLaws.next_modes

    def counted(self: SteadyLaws, here: Iterates, rest: AtRest) -> NextModes:
        nonlocal rounds
        rounds += 1
        return followed(self, here, rest)

    monkeypatch.setattr(SteadyLaws, "next_modes", counted)
    assert relaxed(laws, at, rest).y[0, 0] == pytest.approx(1.0, abs=1e-9)
    assert rounds == 1 + int(np.log(1e11) / np.log(3.0))


@pytest.mark.parametrize(("start", "end"), [(1e-3, 1.0), (-1e-3, -1.0), (3.0, 1.0)])
def test_a_motion_that_grows_is_followed_to_its_end(start: float, end: float) -> None:
    """y' = y - y^3 leaves zero, where long steps would lead back to; only zero is a saddle, with one direction."""
    laws, at, rest = without_laws(lambda y: y - y**3, start)
    there = relaxed(laws, at, rest)
    assert there.y[0, 0] == pytest.approx(end, abs=1e-9)
    assert not saddles(laws, responses(laws, there, rest))[0].any()
    grows, direction = saddles(laws, responses(laws, without_laws(lambda y: y - y**3, 0.0)[1], rest))
    assert grows.all()
    assert abs(direction[0, 0]) == 1.0


def test_conditions_are_not_beyond_their_bound() -> None:
    """Random matrices in random units, one that is singular, and a number."""
    rng = np.random.default_rng(0)
    matrices = rng.normal(size=(400, 4, 4)) * 10.0 ** rng.uniform(-6, 0, (400, 1, 4))
    assert (_condition_bound(matrices) >= np.linalg.cond(matrices)).all()
    assert _condition_bound(np.ones((1, 2, 2)))[0] == np.inf
    assert _condition_bound(np.full((1, 1, 1), -3.0))[0] == pytest.approx(2.0)


@pytest.mark.parametrize("softer", [1.0, 3.0])
def test_shared_torques_hold_the_load_though_each_law_yields(softer: float) -> None:
    """Two laws on one damped motion share 1 kN.m as their compliances do; what these let it creep is no damper's torque any more."""
    laws = by_hand(
        1,
        2,
        rows=lambda y, tau: 1000.0 - 10.0 * y - tau[0] - tau[1],
        speed=lambda y, tau: ca.repmat(y, 2),
        lower=lambda y, tau: -3e3 * ca.DM.ones(2),
        upper=lambda y, tau: 3e3 * ca.DM.ones(2),
    )
    at = Iterates(np.zeros((1, 0)), np.zeros((1, 1)), np.full((1, 2), STUCK), np.zeros((1, 2)))
    rest = AtRest(np.zeros((1, 2), bool), np.array([[1e-6, softer * 1e-6]]), np.ones((1, 2)))
    end, done = corrected(laws, at, rest)
    assert done.all()
    share = np.array([softer, 1.0]) / (softer + 1.0)
    np.testing.assert_allclose(end.tau[0], 1000.0 * share, rtol=1e-5)
    assert end.tau.sum() == pytest.approx(1000.0, rel=1e-13)
    np.testing.assert_allclose(end.y, 0.0, atol=1e-14)


@pytest.mark.parametrize(
    ("limit", "modes", "torques"), [(5.0, [STUCK, STUCK], [3.0, 3.0]), (2.0, [FORWARD, STUCK], [2.0, 4.0])]
)
def test_a_law_at_its_limit_sticks_if_its_share_is_less(limit: float, modes: list[float], torques: list[float]) -> None:
    """Two brakes hold a shaft against 6 N.m; the first is at its limit, and would take 3 N.m by the compliance of both."""
    laws = by_hand(
        1,
        2,
        rows=lambda y, tau: -y - ca.sum1(tau) + 6.0,
        speed=lambda y, tau: ca.repmat(y, 2),
        lower=lambda y, tau: ca.DM([-limit, -8.0]),
        upper=lambda y, tau: ca.DM([limit, 8.0]),
        may_free=True,
    )
    at = Iterates(np.zeros((1, 0)), np.zeros((1, 1)), np.array([[FORWARD, STUCK]]), np.array([[limit, 6.0 - limit]]))
    rest = AtRest(np.zeros((1, 2), bool), np.full((1, 2), 1e-8), np.ones((1, 2)))
    end, done = corrected(laws, at, rest)
    assert done.all()
    assert end.modes[0].tolist() == modes
    np.testing.assert_allclose(end.tau, [torques], atol=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_the_round_off_of_a_step_is_known(seed: int) -> None:
    """On integer matrices of condition 5e8, with whole numbers as the solution; elimination alone is as wrong as ``unsure`` says."""
    matrix, solution = invhilbert(7), np.random.default_rng(seed).integers(-9, 9, 7).astype(float)
    solution[0] = 0.0
    right = matrix @ solution
    laws = by_hand(
        7,
        1,
        rows=lambda y, tau: ca.DM(matrix) @ y - ca.DM(right) * tau,
        speed=lambda y, tau: y[0],
        lower=lambda y, tau: -ca.DM.ones(1),
        upper=lambda y, tau: ca.DM.ones(1),
    )
    at = Iterates(np.zeros((1, 0)), np.zeros((1, 7)), np.ones((1, 1)), np.ones((1, 1)))
    value = laws.motion(at)
    found = euler_step(laws, value, 1e300)
    error = np.abs(found.along[0, :, 0] - solution)
    assert error.max() > 0.0
    assert (error <= UNSURE * found.unsure[0, :, 0]).all()
    assert mobilities(value, found)[0].all()  # the torque does not move its own law
