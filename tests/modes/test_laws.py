"""The rules of one law agree with each other: what is watched in a run, what follows at an event, and what holds at a steady state."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import casadi as ca
import numpy as np
import pytest

from powertrain.dae import contact, friction, switch, when
from powertrain.dae.contact import CLOSED, OPEN
from powertrain.dae.friction import BACKWARD, FORWARD, FREE, STUCK
from powertrain.dae.hybrid import Contact, Friction, HybridDae, Switch, When
from powertrain.dae.tolerances import EPS, INTEGRATED, NO_WIDTH, ZONE

NEVER, ALWAYS = ca.SX(0), ca.SX(1)
KNOWN, REACH = 0.25, 2.0
"""Uncertainty of the torque, and effect of the torque on the rate."""
SPEEDS = (-1.0, 0.0, 1.0)
TORQUES = (-1.3, -1.2, 0.0, 1.9, 3.2, 3.3)
"""Around the limits of -1 and 3, with their hysteresis and twice of that."""
RATES = (-0.6, -0.4, 0.0, 0.4, 0.6)
"""Around the rate that the uncertainty of the torque may cause."""


def model(*modes: float) -> HybridDae:
    """A model of nothing but held values and a state, on which conditions may depend."""
    none, held = ca.SX(0, 1), ca.SX(ca.DM(list(modes)))
    return HybridDae(ca.SX.sym("t"), ca.SX.sym("x"), none, held, none, none, none, (), np.zeros(len(modes)))


def law(w: float = 0.0, torque: float = 0.0, rate: float = 0.0, upper: float = 3.0, **more: object) -> Friction:
    values = [ca.SX(v) for v in (w, torque, -1.0, upper, 1.0, rate)]
    given: dict[str, object] = {"known": ca.SX(KNOWN), "reach": ca.SX(REACH), "may_free": False}
    return Friction("law", "", 0, *values, **(given | more))  # type: ignore[arg-type]


def kept(one: Friction, mode: float, jumped: ca.SX, slack: ca.SX) -> bool:
    return float(friction.next_mode(model(mode), one, jumped, slack)) == mode


@pytest.mark.parametrize("algebraic", [False, True])
def test_modes_of_a_steady_state_are_those_that_a_run_keeps(algebraic: bool) -> None:
    """At a given speed, torque and rate. A law that acts on no inertia has its speed in place of the rate, and no slack."""
    for w, torque, rate in product(SPEEDS, TORQUES, [None] if algebraic else RATES):
        one = law(w, torque, w if rate is None else rate, algebraic=algebraic)
        for mode, margin in friction.steady_margins(one).items():
            holds = kept(one, mode, ALWAYS, NEVER if algebraic else ALWAYS)
            assert (float(margin) >= 0.0) == holds, (w, torque, rate, mode)


@pytest.mark.parametrize("mode", [FORWARD, STUCK, BACKWARD])
def test_a_friction_law_changes_its_mode_where_its_indicator_is_below_zero(mode: float) -> None:
    for w, torque in product((0.0,) if mode == STUCK else (-1.0, 1.0), TORQUES):
        one = law(w, torque)
        ((value, _),) = friction.watched(model(mode), one)
        assert (float(value) > 0.0) == kept(one, mode, NEVER, NEVER), (w, torque)


@pytest.mark.parametrize("mode", [FORWARD, BACKWARD])
@pytest.mark.parametrize(("slack", "least"), [(0.0, 0.0), (1.0, -KNOWN * REACH)])
def test_a_law_at_rest_slides_on_while_its_rate_agrees(mode: float, slack: float, least: float) -> None:
    """With slack, a rate against the mode counts as zero as far as the torque is uncertain."""
    for rate in (least - 0.01, least + 0.01):
        one = law(0.9 * ZONE, rate=mode * rate)
        assert kept(one, mode, NEVER, ca.SX(slack)) == (rate > least)


@pytest.mark.parametrize("mode", [FORWARD, BACKWARD])
@pytest.mark.parametrize(
    ("width", "rate", "way"), [(0.0, -0.1, -1.0), (0.2, -0.5, -1.0), (0.2, -0.3, 0.0), (0.3, -0.7, 0.0)]
)
def test_a_law_between_equal_limits_reverses(mode: float, width: float, rate: float, way: float) -> None:
    """Not if the other limit turns its rate round, or the limits differ by more than is known; without slack it sticks."""
    one = law(rate=mode * rate, upper=width, torque=width if mode == FORWARD else 0.0, rests=1, share=ca.SX(0))
    one = replace(one, lower=ca.SX(0))
    found = [friction.next_modes(model(mode, 0.0), one, NEVER, slack)[0] for slack in (ALWAYS, NEVER)]
    assert list(map(float, found)) == [way * mode, STUCK]


@pytest.mark.parametrize(("w", "jumped", "mode"), [(0.9, 0.0, FORWARD), (0.9, 1.0, STUCK), (1.1, 0.0, BACKWARD)])
def test_the_error_of_the_integration_turns_no_law_round(w: float, jumped: float, mode: float) -> None:
    """Against its mode by less than that, it goes on if its rate agrees; after a jump the speed tells its mode."""
    one = law(-w * INTEGRATED, rate=1.0)
    found = float(friction.next_mode(model(FORWARD), one, ca.SX(jumped), NEVER))
    assert found == (BACKWARD if jumped else mode)


@pytest.mark.parametrize(("mode", "width", "expected"), [
    (STUCK, 0.5, FREE), (STUCK, 1.5, STUCK), (FREE, 0.5, FREE), (FREE, 1.5, FREE), (FREE, 2.5, STUCK),
])  # fmt: skip
def test_a_free_law_engages_above_twice_the_width(mode: float, width: float, expected: float) -> None:
    """Widths in units of that below which limits are the same; exact, as one limit is zero."""
    zero = ca.SX(0)
    one = Friction("law", "", 0, zero, zero, zero, ca.SX(width * NO_WIDTH), ca.SX(1), zero, known=ca.SX(KNOWN))
    assert float(friction.next_mode(model(mode), one, NEVER, NEVER)) == expected
    assert (float(friction.steady_margins(one)[FREE]) >= 0.0) == (width <= 1.0)


@pytest.mark.parametrize(("share", "expected"), [(9.0, FORWARD), (1.3, FORWARD), (1.2, STUCK), (-9.0, STUCK)])
@pytest.mark.parametrize("rate", [-1e-6, 1e-6])
def test_a_law_that_others_hold_at_its_limit_stays_there_for_its_share(
    share: float, expected: float, rate: float
) -> None:
    """At the limit of 1.5, known to 0.25; its rate is the creep of others."""
    one = law(torque=1.5, rate=rate, rests=1, share=ca.SX(share))
    assert float(friction.next_modes(model(FORWARD, 1.0), one, NEVER, NEVER)[0]) == expected


@pytest.mark.parametrize(("rate", "expected"), [(1e-12, FORWARD), (-1e-12, STUCK)])
@pytest.mark.parametrize("share", [-9.0, 1.2, 9.0])
def test_a_law_that_nothing_holds_at_its_limit_goes_by_its_rate(share: float, rate: float, expected: float) -> None:
    """However small; its share is that of its compliance."""
    one = law(torque=1.5, rate=rate, rests=1, share=ca.SX(share))
    assert float(friction.next_modes(model(FORWARD, 0.0), one, NEVER, NEVER)[0]) == expected


@pytest.mark.parametrize("rests", [0.0, 1.0])
@pytest.mark.parametrize(("peak", "rate", "stays"), [(1.0, 0.1, True), (1.2, 0.9, False), (1.2, 1.1, True)])
def test_a_law_with_a_peak_that_comes_to_rest_is_stuck_first(
    peak: float, rate: float, stays: bool, rests: float
) -> None:
    """Unless it is about to move: its rate, in units of its uncertainty; at its peak it stays at its limit."""
    one = replace(law(rate=rate * KNOWN * REACH), rests=1, share=ca.SX(9.0), peak=ca.SX(peak))
    assert float(friction.next_modes(model(FORWARD, rests), one, NEVER, NEVER)[0]) == (
        FORWARD if stays or rests else STUCK
    )


@pytest.mark.parametrize(("peak", "torque", "rests"), [(2.0, 6.3, 1.0), (2.0, 6.2, 0.0), (1.0, 3.3, 0.0)])
def test_a_law_that_breaks_away_keeps_its_peak_first(peak: float, torque: float, rests: float) -> None:
    zero, one = ca.SX(0), ca.SX(1)
    broken = Friction("law", "", 0, zero, ca.SX(torque), -one, 3 * one, ca.SX(peak), zero, known=ca.SX(KNOWN), rests=1)
    assert float(friction.next_modes(model(STUCK, 0.0), broken, NEVER, NEVER)[1]) == rests


@pytest.mark.parametrize(("mode", "torque"), [(FORWARD, 4.0), (BACKWARD, -2.0), (0.0, 1.0), (0.5, 2.5)])
def test_torque_of_a_prescribed_law_between_its_limits(mode: float, torque: float) -> None:
    found = friction.sliding_torque(ca.SX(mode), ca.SX(-2.0), ca.SX(4.0), prescribed=True)
    assert float(found) == torque


def touching(gap: float, speed: float, acceleration: float, force: float) -> Contact:
    values = [ca.SX(v) for v in (gap, speed, acceleration, force, 0.0, 0.1, KNOWN)]
    return Contact("stop", "", 0, *values)


@pytest.mark.parametrize(("mode", "gap", "speed", "acceleration", "force", "jumped", "expected", "strikes"), [
    (CLOSED, 0.0, 0.0, 0.0, 1.0, 0.0, CLOSED, False),  # pressed
    (CLOSED, 0.0, 0.0, 0.0, -0.2, 0.0, CLOSED, False),  # round-off pulls
    (CLOSED, 0.0, 0.0, 0.0, -0.3, 0.0, OPEN, False),  # pulled
    (CLOSED, 1e-6, 0.0, 0.0, 1.0, 0.0, CLOSED, False),  # error of the integration
    (CLOSED, 1e-6, -1.0, 0.0, 1.0, 2.0, OPEN, False),  # a reset has taken one side away
    (CLOSED, 0.0, -1e-6, 0.0, 1.0, 2.0, CLOSED, True),  # a reset throws its sides at each other
    (CLOSED, 0.0, -1e-7, 0.0, 1.0, 2.0, CLOSED, False),
    (OPEN, 0.0, 0.0, -0.2, 0.0, 0.0, CLOSED, False),  # closes without an impact
    (OPEN, 0.0, 0.0, -0.05, 0.0, 0.0, OPEN, False),  # rests beside
    (OPEN, -2e-10, -1.0, 0.0, 0.0, 0.0, OPEN, True),
    (OPEN, -2e-10, 1.0, 0.0, 0.0, 0.0, OPEN, False),  # leaves
    (OPEN, -3e-10, -0.5e-10, -0.2, 0.0, 0.0, OPEN, True),
    (OPEN, -3e-10, -0.5e-10, -0.05, 0.0, 0.0, OPEN, False),  # held by friction
    (CLOSED, 1e-7, 0.0, 0.0, 1.0, 2.0, CLOSED, False),
    (OPEN, -0.5e-10, -1.0, 0.0, 0.0, 0.0, OPEN, False),  # within the hysteresis
])  # fmt: skip
def test_next_mode_of_a_contact(
    mode: float,
    gap: float,
    speed: float,
    acceleration: float,
    force: float,
    jumped: float,
    expected: float,
    strikes: bool,
) -> None:
    stop, held = touching(gap, speed, acceleration, force), model(mode)
    assert float(contact.next_mode(held, stop, ca.SX(jumped))) == expected
    assert bool(float(contact.struck(held, stop, ca.SX(jumped)))) == strikes
    if mode == CLOSED and not jumped:
        ((value, _),) = contact.watched(held, stop)
        assert (
            (float(value) > 0.0)
            == (float(contact.steady_margins(stop, moved=True)[CLOSED]) >= 0.0)
            == (expected == CLOSED)
        )


def test_a_steady_contact_that_nothing_closes_is_closed_where_the_gap_is_zero() -> None:
    margins = [
        float(contact.steady_margins(touching(gap, 0.0, 0.0, 1.0), moved=False)[CLOSED]) for gap in (-1e-9, 0.0, 1e-9)
    ]
    assert [margin >= 0.0 for margin in margins] == [False, True, False]


@pytest.mark.parametrize("mode", [0.0, 1.0])
@pytest.mark.parametrize("g", [-1.1, -0.9, 0.9, 1.1])
def test_a_switch_changes_where_its_indicator_is_below_zero(mode: float, g: float) -> None:
    """Conditions in units of their hysteresis; those that do not change, or at a known instant, are not located."""
    held, known = model(mode), ca.SX(1.0)
    value, _ = switch.watched(held, Switch("law", "", 0, g * held.x, known=known))
    stays = float(switch.next_mode(held, Switch("law", "", 0, ca.SX(g), known=known), None)) == mode
    assert (float(ca.substitute(value, held.x, 1.0)) > 0.0) == stays
    assert (float(switch.steady_margins(Switch("law", "", 0, ca.SX(g * EPS)))[mode]) >= 0.0) == stays
    laws = Switch("law", "", 0, ca.SX(g)), Switch("law", "", 0, g * held.x), Switch("law", "", 0, held.t - g, ca.SX(g))
    assert switch.located(replace(held, switches=laws, relations=laws)) == [laws[1], laws[1]]


@pytest.mark.parametrize(("mode", "g", "fires", "edge", "expected"), [
    (0.0, 2.0, None, True, 0.0), (0.0, 0.5, None, False, 0.0), (1.0, 2.0, None, False, 1.0), (1.0, -0.5, None, False, 1.0),
    (1.0, -2.0, None, False, 0.0), (0.0, -2.0, 1.0, True, 0.0), (0.0, -2.0, 0.0, False, 0.0),
])  # fmt: skip
def test_a_when_rises_once(mode: float, g: float, fires: float | None, edge: bool, expected: float) -> None:
    """Conditions in units of their hysteresis; the mode is set with the resets."""
    one, held = When("law", "", 0, ca.SX(g * EPS), ()), model(mode)
    assert bool(float(when.rises(held, one, None if fires is None else ca.SX(fires)))) == edge
    assert float(when.next_mode(held, one)) == expected
