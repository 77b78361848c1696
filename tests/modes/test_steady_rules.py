"""The modes that follow at iterates of operating points, law by law."""

from __future__ import annotations

import math

import casadi as ca
import pytest

from powertrain.dae import contact, friction, switch
from powertrain.dae.contact import CLOSED, OPEN
from powertrain.dae.friction import BACKWARD, FORWARD, FREE, STUCK
from powertrain.dae.hybrid import Contact, Friction

ZONE = 1e-9


def brake(
    w: float, torque: float, lower: float = -5.0, upper: float = 5.0, peak: float = 1.0, share: float | None = None
) -> Friction:
    w_, torque_, low, high, top = (ca.SX(x) for x in (w, torque, lower, upper, peak))
    part = torque_ if share is None else ca.SX(share)
    return Friction("brake", "", 0, w_, torque_, low, high, top, ca.SX(0), known=ca.SX(1e-7), share=part)


def after(law: Friction, mode: float, side: float = 1.0, given: bool = False) -> float:
    numbers = (ca.SX(x) for x in (mode, ZONE, side, float(given)))
    return float(friction.next_steady_mode(law, *numbers))


@pytest.mark.parametrize(
    ("mode", "w", "torque", "follows"),
    [
        (STUCK, 0.0, 4.0, STUCK),
        (STUCK, 0.0, 6.0, FORWARD),
        (STUCK, 0.0, -6.0, BACKWARD),
        (STUCK, 0.0, 5.0 + 5e-8, STUCK),
        (STUCK, 3.0, -6.0, FORWARD),
        (STUCK, -3.0, 0.0, BACKWARD),
        (FORWARD, 3.0, 5.0, FORWARD),
        (FORWARD, -3.0, 5.0, STUCK),
        (FORWARD, -5e-10, 5.0, FORWARD),
        (BACKWARD, 3.0, -5.0, STUCK),
        (FREE, 0.0, 6.0, FORWARD),
        (FREE, -3.0, 0.0, BACKWARD),
    ],
)
def test_friction(mode: float, w: float, torque: float, follows: float) -> None:
    assert after(brake(w, torque), mode) == follows


def test_a_stuck_law_breaks_loose_at_its_peak() -> None:
    assert after(brake(0.0, 6.0, peak=1.5), STUCK) == STUCK
    assert after(brake(0.0, 7.6, peak=1.5), STUCK) == FORWARD


def test_a_law_without_width_is_free() -> None:
    assert after(brake(3.0, 0.0, 0.0, 0.0), FORWARD) == FREE


@pytest.mark.parametrize(
    ("w", "share", "follows"),
    [
        (0.0, 4.0, STUCK),
        (0.0, 6.0, FORWARD),
        (0.0, 5.0 - 5e-8, FORWARD),
        (0.0, 5.0 - 2e-7, STUCK),
        (0.0, -math.inf, STUCK),
        (0.0, math.inf, FORWARD),
        (1.0, 4.0, FORWARD),
    ],
)
def test_a_law_that_is_held_at_its_limit_sticks_if_its_share_is_within(w: float, share: float, follows: float) -> None:
    """As in a run, within the uncertainty of its torque; without compliance it goes by its speed, and the share is infinite."""
    assert after(brake(w, 5.0, share=share), FORWARD) == follows


@pytest.mark.parametrize(("w", "side", "follows"), [(0.0, 1.0, 1.0), (0.0, -1.0, -1.0), (2.0, -1.0, 1.0)])
def test_a_given_motion_rests_at_its_side(w: float, side: float, follows: float) -> None:
    assert after(brake(w, 0.0), STUCK, side, given=True) == follows


@pytest.mark.parametrize(
    ("mode", "gap", "force", "follows"),
    [
        (CLOSED, 0.0, 3.0, CLOSED),
        (CLOSED, 0.0, -3.0, OPEN),
        (CLOSED, 1e-3, 3.0, OPEN),
        (OPEN, 1e-3, 0.0, OPEN),
        (OPEN, -1e-10, 0.0, OPEN),
        (OPEN, -1e-3, 0.0, CLOSED),
    ],
)
def test_contact(mode: float, gap: float, force: float, follows: float) -> None:
    zero = ca.SX(0)
    law = Contact("stop", "", 0, ca.SX(gap), zero, zero, ca.SX(force), zero)
    assert float(contact.next_steady_mode(law, ca.SX(mode), ca.SX(ZONE))) == follows


@pytest.mark.parametrize(
    ("mode", "g", "follows"),
    [(1.0, -1.0, 0.0), (0.0, 1.0, 1.0), (0.0, ZONE / 2, 0.0), (1.0, -ZONE / 2, 1.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)],
)
def test_a_condition_at_zero_keeps_its_side(mode: float, g: float, follows: float) -> None:
    """Zero itself is not positive."""
    assert float(switch.next_steady_mode(ca.SX(mode), ca.SX(g), ca.SX(ZONE))) == follows
