"""Which laws cause an event, and how its instant moves: the choice among the laws at one instant, written by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from powertrain.dae.hybrid import Friction, Guard, Switch, When
from powertrain.dae.tolerances import EPS
from powertrain.modes.indicators import Indicator
from powertrain.variational.instants import EventLaws, NotDifferentiable, Shift, duration
from powertrain.variational.partials import Slopes

NONE = ca.SX(0)
STICKING = Friction("stick", "here", 0, NONE, NONE, NONE, NONE, NONE, NONE)
JUMP = Switch("jump", "here", 1, NONE)
KINK = Switch("kink", "here", 2, NONE, continuous=True)
FLAT = Switch("flat", "here", 13, NONE, continuous=True)
RELATION = Switch("relation", "here", 3, NONE, continuous=True)
TIMED = (
    When("timed", "here", 4, NONE, (), time=NONE),
    Switch("clock", "here", 14, NONE, time=NONE),
    Switch("part", "here", 15, NONE, time=NONE),
)
"""The last one is a comparison of a combined condition."""
GUARD = Guard("guard", "here", NONE, NONE, NONE, "1", "")
LAWS = (STICKING, STICKING, JUMP, KINK, RELATION, GUARD)
"""Friction has an indicator for each limit."""
AT = {"stick": 0, "other": 1, "jump": 2, "kink": 3, "relation": 4, "guard": 5}
TIME, STEP = 2.0, 0.5


def shifts(
    at_zero: dict[str, float],
    changed: str = "",
    *,
    hit: str = "",
    fall: float = -1.0,
    falls: dict[str, float] | None = None,
    fallen: float = 0.5,
    timed: dict[str, float] | None = None,
    schedule: int | None = None,
) -> list[Shift]:
    """The causes where some indicators have small values; all others are 1 and constant. ``timed``: the instants of timed laws."""
    value, rates = np.ones(9), np.zeros(6)
    for name, small in at_zero.items():
        value[AT[name]], rates[AT[name]] = small, (falls or {}).get(name, fall)
    value[6:] = [(timed or {}).get(law.name, 0.0) for law in TIMED]
    left = np.append(1.0, np.zeros(15))
    right = left.copy()
    for name in changed.split():
        index = {"stick": 0, "jump": 1, "kink": 2, "relation": 3, "timed": 4, "clock": 14, "part": 15}[name]
        right[index] = 0.0 if name == "stick" else 1.0
    right[[] if schedule is None else schedule] = 1.0
    schedules = [SimpleNamespace(name=f"signal{i}", index=i) for i in (5, 8, 11)]
    system: Any = SimpleNamespace(
        dae=SimpleNamespace(
            whens=TIMED[:1],
            relations=[RELATION, TIMED[2]],
            switches=[JUMP, KINK, FLAT, TIMED[1]],
            frictions=[STICKING],
            contacts=[],
            laws=(STICKING, JUMP, KINK, FLAT, TIMED[1]),
            schedules=schedules,
        ),
        size=2,
        parameters=(0,),
        segments=(8, 9, 10, 5, 6, 7),
    )
    laws = EventLaws(system, [Indicator(law, NONE, EPS) for law in LAWS], TIMED, [STICKING])
    s, q = np.arange(18.0).reshape(9, 2), np.arange(18.0, 99.0).reshape(9, 9)
    run: Any = SimpleNamespace(
        instants=SimpleNamespace(
            times=np.array([TIME]),
            left=SimpleNamespace(m=left[None]),
            right=SimpleNamespace(m=right[None]),
            before=SimpleNamespace(t=np.array([TIME - STEP])),
            extra=(tuple((name, "impact") for name in hit.split()),),
        )
    )
    return laws.shifts(run, 0, Slopes(value, np.zeros(9), s, q, np.zeros((9, 0))), rates, value[:6] + fallen)


@pytest.mark.parametrize(
    ("at_zero", "changed", "expected"),
    [
        ("jump", "jump", "jump"),
        ("stick jump", "stick jump", "stick jump"),
        ("stick jump", "jump", "jump"),  # a law that keeps its mode is no cause of what another one does,
        ("jump", "stick", "jump"),  # unless it is the only one that has fallen
        ("kink jump", "kink jump", "jump"),  # where branches meet, nothing jumps
        ("kink", "kink jump", "kink"),
        ("relation jump", "relation jump", "relation jump"),  # a comparison of a when is a switch without branches
        ("guard jump", "jump", "jump"),
        ("other stick", "stick", "stick"),  # two indicators of one law
    ],
)
def test_laws_that_have_fallen_through_zero(at_zero: str, changed: str, expected: str) -> None:
    found = shifts(dict.fromkeys(at_zero.split(), -EPS / 3), changed)
    assert sorted(shift.name for shift in found) == sorted(expected.split())
    assert all(shift.flat is None for shift in found)


def test_how_the_instant_moves() -> None:
    """d(tau) = -(h_s, h_q) / (dh/dt), with the row of the indicator; the other limit of the same law is the second one."""
    for name, row in ("jump", 2), ("other", 1):
        (found,) = shifts({name: -EPS / 3}, "jump" if name == "jump" else "stick", fall=-4.0)
        assert found.row == row
        np.testing.assert_allclose(found.s, [(2 * row) / 4, (2 * row + 1) / 4])
        np.testing.assert_allclose(found.q, [(18 + 9 * row + i) / 4 for i in range(9)])


def test_an_impact_without_a_change_of_mode() -> None:
    """A barrier that is struck and let go at the same instant has the mode that it had before."""
    assert [shift.name for shift in shifts({"stick": -EPS / 3, "jump": -EPS / 3}, hit="stick")] == ["stick"]


def test_how_far_an_indicator_may_be_above_zero() -> None:
    """Fallen indicators are located to a few 1e-11. If none has fallen, the lowest of those that changed is the cause, up to 1e-6."""
    assert [shift.name for shift in shifts({"stick": 3e-11, "jump": 1e-8}, "stick jump")] == ["stick"]
    assert [shift.name for shift in shifts({"stick": 2e-8, "jump": 1e-8}, "stick jump")] == ["jump"]
    assert [shift.name for shift in shifts({"stick": 2e-8, "jump": 1e-8}, "stick")] == ["stick"]
    assert [shift.name for shift in shifts({"stick": 2e-8, "jump": 1e-8})] == ["jump"]
    with pytest.raises(NotDifferentiable, match="cannot be determined: stick, jump"):
        shifts({"stick": 3e-6, "jump": 2e-6}, "stick jump")
    with pytest.raises(NotDifferentiable, match="cannot be determined: without a law"):
        shifts({})


def test_the_first_of_those_below_zero() -> None:
    """What is deeper below zero, at its rate, fell first; within the hysteresis of both nobody knows."""
    for deep, rate, names in (-5.0, -1.0, ["jump"]), (-5.0, -4.0, ["stick", "jump"]), (-3.5, -1.0, ["stick", "jump"]):
        found = shifts({"stick": 0.0, "jump": deep * EPS}, "stick jump", falls={"stick": -1.0, "jump": rate})
        assert [shift.name for shift in found] == names


@pytest.mark.parametrize(("changed", "rate"), [("stick jump", 1.0), ("stick jump", 0.0), ("stick", 1.0)])
def test_an_indicator_that_rises_has_not_fallen(changed: str, rate: float) -> None:
    found = shifts({"stick": -EPS, "jump": -EPS}, changed, falls={"stick": rate})
    assert [shift.name for shift in found] == ["jump"]


def test_a_known_instant() -> None:
    """Its own derivatives, within 1e-9 of the time. A when and its comparisons may be as before: a reset may have restarted the time."""
    here = TIME + 0.9e-9 * TIME
    for name, row, changed in (
        ("timed", 6, "timed"),
        ("timed", 6, ""),
        ("clock", 7, "clock"),
        ("part", 8, "part"),
        ("part", 8, ""),
    ):
        (found,) = shifts({}, changed, timed={name: here})
        assert (found.name, found.row) == (name, row)
        assert found.s.tolist() == [2 * row, 2 * row + 1]
        assert found.q.tolist() == [18 + 9 * row + i for i in range(9)]
    assert [shift.name for shift in shifts({"jump": -EPS}, "jump", timed={"clock": TIME})] == ["jump"]
    assert [shift.name for shift in shifts({"jump": 0.1}, "jump clock", timed={"clock": TIME})] == ["clock"]
    for off in -1.1e-9, 1.1e-9:
        with pytest.raises(NotDifferentiable, match="cannot be determined: timed"):
            shifts({}, "timed", timed={"timed": TIME + off * TIME})


@pytest.mark.parametrize(("schedule", "knot"), [(5, 8), (6, 8), (7, 8), (8, 7), (13, None)])
def test_a_knot_of_an_input(schedule: int, knot: int | None) -> None:
    """The instant is the end of the segment, after the parameter and the segments of two inputs in q; a third one has no unknowns."""
    (found,) = shifts({}, schedule=schedule)
    assert (found.name, found.row, found.s.tolist()) == (f"signal{schedule - (schedule - 5) % 3}", -1, [0.0, 0.0])
    assert found.q.tolist() == [float(i == knot) for i in range(9)]


def test_grazing() -> None:
    """An indicator that arrives with a small slope moves its instant too far; one that comes to rest may, as nothing jumps then."""
    (found,) = shifts({"jump": -EPS / 3}, "jump", fall=-1e-4)
    assert found.flat is not None
    assert "after a fall of 0.5 in 0.5 s" in str(found.flat)
    (found,) = shifts({"stick": -EPS / 3}, "stick", fall=-1e-4)
    assert found.flat is None
    (found,) = shifts({"stick": 1e-8}, "stick", fall=1e-4)
    assert found.flat is not None
    (found,) = shifts({"stick": 1e-8}, "stick", fall=0.0)
    assert found.flat is not None
    assert np.isfinite(found.s).all()


def test_how_long_a_change_lasts() -> None:
    """Until the mode changes again, else until the end."""
    m = np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]])
    run: Any = SimpleNamespace(
        instants=SimpleNamespace(times=np.arange(4.0) ** 2, right=SimpleNamespace(m=m)), end=20.0
    )
    assert [duration(run, k, 0) for k in range(4)] == [1.0, 8.0, 5.0, 11.0]
    assert [duration(run, k, 1) for k in range(4)] == [4.0, 3.0, 16.0, 11.0]
