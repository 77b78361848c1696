"""The kernels of operating points alone, on laws written by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from powertrain.equilibrium.beginnings import _degenerate, mobilities
from powertrain.equilibrium.corrector import Near, bordered, undetermined
from powertrain.equilibrium.laws import BACKWARD, FORWARD, FREE, STUCK, Iterates, LawValues, SteadyLaws
from powertrain.equilibrium.relaxation import relaxed
from powertrain.equilibrium.solutions import Solutions, SolvedPoints

Matrix = np.ndarray[Any, Any]


def sliding(coupling: Matrix, damping: float = 1.0, speed: float = 5.0) -> tuple[Any, Iterates]:
    """One shaft of a speed y, braked by a damper and by laws that slide; their limits follow the others' torques by ``coupling``."""
    count = len(coupling)
    values = LawValues(
        rows=np.zeros((1, 1)),
        speed=np.full((1, count), speed),
        lower=np.full((1, count), -1.0),
        upper=np.full((1, count), 1.0),
        g=np.zeros((1, 0)),
        rows_=np.concatenate([[[-damping]], -np.ones((1, count))], axis=1)[None],
        speed_=np.concatenate([np.ones((count, 1)), np.zeros((count, count))], axis=1)[None],
        lower_=np.zeros((1, count, 1 + count)),
        upper_=np.concatenate([np.zeros((count, 1)), coupling], axis=1)[None],
        g_=np.zeros((1, 0, 1 + count)),
    )
    laws = SimpleNamespace(
        unknowns=1, count=count, frictions=count, contact=np.zeros(count, bool), law_modes=np.arange(count),
        rates=np.array([0]), rate_of=np.array([0]), values=lambda at: values, zone=lambda value, at: 1e-9,
    )  # fmt: skip
    return laws, Iterates(np.zeros((1, 0)), np.full((1, 1), speed), np.ones((1, count)), np.ones((1, count)))


def test_mobilities() -> None:
    """How much a torque moves its own law: its entry of G; what cancels does not move it, and counts as one."""
    G = np.array([[2.0, -0.5, 0.0], [-0.5, 0.25, 0.0], [1.0, 0.0, 0.0]])
    laws, _ = sliding(np.zeros((3, 3)))
    value = laws.values(None)
    value.speed_[0, :, 1:] = -G
    value.speed_[0, 2, 0] = 1.0
    given, reach, slope = mobilities(value, np.array([[[0.0, 0.0, 0.0]]]))
    np.testing.assert_array_equal(given, [[False, False, True]])
    np.testing.assert_allclose(reach, [[2.0, 0.25, 1.0]])
    np.testing.assert_allclose(slope[0], -G)
    moved = np.array([[[0.0, 0.0, 3.0]]])
    given, reach, _ = mobilities(value, moved)
    assert not given[0, 2]
    assert reach[0, 2] == pytest.approx(3.0)


@pytest.mark.parametrize(("gain", "locked"), [(0.5, False), (0.99, False), (1.0 - 1e-11, True), (-1.0 + 1e-11, True)])
def test_torques_that_follow_each_other_without_limit(gain: float, locked: bool) -> None:
    """tau_1 = 1 + gain tau_2 and tau_2 = 1 + gain tau_1 grow as 1/(1 - gain^2)."""
    laws, at = sliding(np.array([[0.0, gain], [gain, 0.0]]))
    near = Near(np.zeros((1, 2), bool), np.full((1, 2), 1e-8))
    assert undetermined(laws, at, laws.values(at), near, np.ones((1, 2))).tolist() == [locked]


@pytest.mark.parametrize(("damping", "open_"), [(1.0, False), (1e-5, False), (1e-9, True)])
def test_a_motion_that_nothing_holds(damping: float, open_: bool) -> None:
    laws, at = sliding(np.zeros((1, 1)), damping)
    near = Near(np.zeros((1, 1), bool), np.full((1, 1), 1e-8))
    assert undetermined(laws, at, laws.values(at), near, np.ones((1, 1))).tolist() == [open_]


@pytest.mark.parametrize("damping", [(1e-9, 1.0), (1.0, 1e-9), (1.0, 1.0)])
def test_any_motion_that_nothing_holds_counts(damping: tuple[float, float]) -> None:
    """Of two shafts without laws, the first or the last."""
    none = np.zeros((1, 0))
    slopes = [np.zeros((1, 0, 2))] * 4
    values = LawValues(np.zeros((1, 2)), none, none, none, none, -np.diag(damping)[None], *slopes)
    index = np.arange(2)
    laws = SimpleNamespace(
        unknowns=2, count=0, frictions=0, contact=np.zeros(0, bool), law_modes=index[:0], rates=index, rate_of=index,
        values=lambda at: values,
    )  # fmt: skip
    at, near = Iterates(none, np.ones((1, 2)), none, none), Near(none.astype(bool), none)
    assert undetermined(laws, at, laws.values(at), near, none).tolist() == [min(damping) < 1e-6]  # type: ignore[arg-type]


def one_law(speed: float, width: float = 2.0, residual: float = 0.0) -> tuple[SteadyLaws, LawValues, Iterates]:
    """A law whose speed is the difference of two of one rad/s, with limits on both sides of its torque of zero."""
    none = np.zeros((1, 0))
    values = LawValues(
        np.full((1, 1), residual), np.array([[speed]]), np.full((1, 1), -width / 2), np.full((1, 1), width / 2), none,
        np.array([[[3.0, -2.0, 0.0]]]), np.array([[[1.0, -1.0, 0.0]]]), np.zeros((1, 1, 3)), np.zeros((1, 1, 3)),
        np.zeros((1, 0, 3)),
    )  # fmt: skip
    laws = SteadyLaws.__new__(SteadyLaws)
    laws.unknowns, laws.law_modes, laws.switch_modes = 2, np.array([0]), np.zeros(0, np.intp)
    laws.may_free, laws.contact = np.ones(1, bool), np.zeros(1, bool)
    return laws, values, Iterates(none, np.array([[1.0 + speed, 1.0]]), np.zeros((1, 1)), np.zeros((1, 1)))


@pytest.mark.parametrize(("width", "mode"), [(5e-11, FREE), (5e-9, STUCK)])
def test_a_law_is_free_where_its_limits_are_one(width: float, mode: float) -> None:
    laws, values, at = one_law(0.0, width)
    assert laws.next_modes(at, values, np.zeros((1, 1), bool), np.ones((1, 1)), None)[0, 0] == mode


@pytest.mark.parametrize(("residual", "balanced"), [(5e-7, True), (-5e-7, True), (1e-6, False), (-1e-6, False)])
def test_equations_are_balanced_by_their_terms(residual: float, balanced: bool) -> None:
    """Of 3 + 2 + 1."""
    laws, values, at = one_law(0.0, residual=residual)
    assert laws.balanced(at, values).tolist() == [balanced]


@pytest.mark.parametrize(("small", "degenerate"), [(1e-12, False), (4e-15, True), (0.0, True)])
def test_equations_that_determine_unknowns_by_round_off_alone(small: float, degenerate: bool) -> None:
    """Whatever the unit of an equation."""
    matrix = np.array([[[1e6, 1e6], [1.0, 1.0 + small]], np.eye(2)])
    assert _degenerate(matrix).tolist() == [degenerate, False]


@pytest.mark.parametrize(("speed", "mode"), [(0.0, STUCK), (2e-10, STUCK), (1e-7, FORWARD), (-1e-7, BACKWARD)])
def test_rest_is_a_share_of_the_terms(speed: float, mode: float) -> None:
    laws, values, at = one_law(speed)
    assert laws.zone(values, at)[0, 0] == pytest.approx(3e-9, rel=1e-6)
    assert laws.next_modes(at, values, np.zeros((1, 1), bool), np.ones((1, 1)), None)[0, 0] == mode


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
    laws, at = sliding(np.zeros((2, 2)), speed=0.0)
    at.modes[0] = STUCK, FORWARD
    near = Near(np.zeros((1, 2), bool), np.array([[3e-8, 5e-8]]))
    matrix, right = bordered(laws, at, laws.values(at), near, np.ones((1, 2)), proximal=False)
    np.testing.assert_array_equal(matrix[0, 1:], [[1.0, -3e-8, 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(right[0, 1:], [-3e-8, 0.0])
    assert bordered(laws, at, laws.values(at), near, np.ones((1, 2)), proximal=True)[1][0, 1] == 0.0


def test_a_motion_is_followed_in_steps_that_grow() -> None:
    """y' = 1 - y: every implicit Euler step is exact, so that each is taken and the lengths grow threefold from 1e-4 to 1e7 s."""
    calls, none = 0, np.zeros((1, 0))

    def values(at: Iterates) -> LawValues:
        nonlocal calls
        calls += 1
        slopes = [np.zeros((1, 0, 1))] * 4
        return LawValues(1.0 - at.y, none, none, none, none, np.full((1, 1, 1), -1.0), *slopes)

    laws = SimpleNamespace(
        unknowns=1, rates=np.array([0]), rate_of=np.array([0]), values=values,
        next_modes=lambda at, value, given, side, drive: at.modes,
    )  # fmt: skip
    end = relaxed(laws, Iterates(none, np.full((1, 1), -300.0), none, none), none.astype(bool), none)  # type: ignore[arg-type]
    assert end.y[0, 0] == pytest.approx(1.0, abs=1e-9)
    assert calls == 2 * (1 + int(np.log(1e11) / np.log(3.0)))
