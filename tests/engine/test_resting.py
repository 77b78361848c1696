"""Laws at a limit of their torque that others hold at rest, and those that only seem to be held."""

from __future__ import annotations

import numpy as np
import pytest

from powertrain.modes.resting import _follow


@pytest.mark.parametrize(
    ("free", "held"), [((10.0, 5.0), True), ((0.0, 0.0), True), ((10.0, 0.0), False), ((0.0, 1e-3), False)]
)
def test_a_law_is_held_that_moves_as_those_that_hold(free: tuple[float, float], held: bool) -> None:
    """Two laws of which the first moves twice as fast as the second, which holds; a prescribed motion between them adds to one alone."""
    G = np.array([[4.0, 2.0], [2.0, 1.0]])
    assert _follow(G, np.array(free), [0], np.array([False, True])) == [held]


def test_a_law_with_a_motion_of_its_own_is_not_held() -> None:
    G = np.array([[4.0, 2.0], [2.0, 1.5]])
    assert _follow(G, np.zeros(2), [0], np.array([False, True])) == [False]


def test_the_round_off_of_other_rates_is_no_motion() -> None:
    """A law that moves as the second does, at zero; the third, far from both, has a rate of 1e3 in which it has no share but round-off."""
    G = np.array([[1.0, 1.0, 1e-15], [1.0, 1.0, 0.0], [1e-15, 0.0, 1.0]])
    holds = np.array([False, True, True])
    assert _follow(G, np.array([1e-24, 0.0, 1e3]), [0], holds) == [True]
    assert _follow(G, np.array([1e-5, 0.0, 1e3]), [0], holds) == [False]
