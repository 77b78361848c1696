"""Resets that accumulate: the run ends where it cannot follow them, says when, and what to write instead."""

from __future__ import annotations

import math
import re
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest

import powertrain as pt
from powertrain.engine.chatter import Chatter
from powertrain.engine.zeno import _motion

G = 9.81


class Ball(pt.Component):
    """A ball that is thrown back by a reset."""

    e: pt.Parameter = pt.parameter("1", "Speed after a bounce over that before it", default=0.7)
    drag: pt.Parameter = pt.parameter("1/s", "Drag", default=0.0)
    placed: bool = False
    falling: bool = False
    h: pt.Variable = pt.variable("m", "Height", start=1.0)
    v: pt.Variable = pt.variable("m/s", "Speed", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.h) == self.v
        yield pt.der(self.v) == -G - self.drag * self.v
        height = (pt.reinit(self.h, 0.0),) if self.placed else ()
        below = ca.logic_not(ca.logic_or(self.h >= 0, self.v >= 0)) if self.falling else self.h < 0
        yield pt.when(below, pt.reinit(self.v, -self.e * self.v), *height, name="bounce")


class Buried(pt.Component):
    """The same ball, whose height is found by iteration."""

    depth: pt.Variable = pt.variable("m", "Where the sensor stands, an implicit unknown", guess=1.0)
    h: pt.Variable = pt.variable("m", "Height", start=1.0)
    v: pt.Variable = pt.variable("m/s", "Speed", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.h) == self.v
        yield pt.der(self.v) == -G
        yield self.depth + 0.1 * ca.sin(self.depth) == self.h
        yield pt.when(self.depth < 0, pt.reinit(self.v, -0.7 * self.v), name="bounce")


class Stopped(pt.Component):
    """The same ball on a contact."""

    e: pt.Parameter = pt.parameter("1", "Speed after a bounce over that before it", default=0.7)
    h: pt.Variable = pt.variable("m", "Height", start=1.0)
    v: pt.Variable = pt.variable("m/s", "Speed", start=0.0)
    f: pt.Variable = pt.variable("N", "Force of the floor on 1 kg")

    def equations(self) -> pt.Equations:
        yield pt.der(self.h) == self.v
        yield pt.der(self.v) == -G + self.f
        yield pt.unilateral(self.h, self.f, restitution=self.e)


@pytest.mark.parametrize("placed", [False, True])
@pytest.mark.parametrize("e", [0.001, 0.01, 0.1, 0.5, 0.7, 0.9])
@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-9])
def test_accumulating_bounces_end_the_run_at_their_limit(e: float, placed: bool, rtol: float) -> None:
    with pytest.raises(pt.SimulationError, match=r"bounce .*test_zeno.py:\d+.* come too close") as caught:
        pt.simulate(Ball(e=e, placed=placed), 10.0, rtol=rtol)
    assert "unilateral(gap, force, restitution=...)" in str(caught.value)
    limit = math.sqrt(2 / G) * (1 + 2 * e / (1 - e))
    said = float(re.findall(r"at t = (\S+) s there have been", str(caught.value))[0])
    assert said == pytest.approx(limit, abs=1e-3)
    assert caught.value.result["h"].min() > -1e-8


@pytest.mark.parametrize("e", [0.97, 0.99])
def test_slowly_accumulating_bounces_are_named_too(e: float) -> None:
    with pytest.raises(pt.SimulationError, match=r"bounce .*(come too close|without end).*unilateral"):
        pt.simulate(Ball(e=e), 100.0)


@pytest.mark.parametrize("falling", [False, True])
def test_with_drag(falling: bool) -> None:
    with pytest.raises(pt.SimulationError, match=r"each interval is 0\.6 times the one before"):
        pt.simulate(Ball(e=0.6, drag=0.3, falling=falling), 10.0)


def test_where_the_condition_hangs_on_an_implicit_unknown() -> None:
    plant = pt.compile(Buried())
    assert plant.compiled.dae.z.numel() == 1
    with pytest.raises(pt.SimulationError, match=r"each interval is 0\.7 times the one before"):
        plant.simulate(10.0)


def test_before_their_limit_bounces_are_followed() -> None:
    result = pt.simulate(Ball(), 2.55)
    assert result["h"].min() > -1e-8
    assert len(result.events["bounce"]) > 15


@pytest.mark.parametrize("e", [1.0, 1.05])
def test_bounces_that_do_not_shrink_are_followed(e: float) -> None:
    result = pt.simulate(Ball(e=e, placed=True), 10.0)
    assert result["h"].min() > -1e-6


def test_the_remedy_passes_the_limit() -> None:
    result = pt.simulate(Stopped(), 10.0)
    assert result["h"].min() > -1e-6
    assert result["h"][-1] == pytest.approx(0, abs=1e-9)
    np.testing.assert_allclose(result["f"][-1], G)


class Refilled(pt.Component):
    """A level that falls until it is filled up by a reset: its condition is turned back far."""

    x: pt.Variable = pt.variable("m", "Level", start=1.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == -1 - self.x
        yield pt.when(self.x < 0.1, pt.reinit(self.x, self.x + 1e-3))


def test_frequent_resets_are_followed() -> None:
    assert len(pt.simulate(Refilled(), 0.7).events) > 50


@pytest.mark.parametrize("e", [0.3, 0.7])
def test_the_next_bounce_is_due_when_the_ball_is_back(e: float) -> None:
    """After 2 v/g."""
    with pytest.raises(pt.SimulationError) as caught:
        pt.simulate(Ball(e=e), 10.0)
    due = float(re.findall(r"the next is due in (\S+) s", str(caught.value))[0])
    assert due == pytest.approx(2 * caught.value.result["v"][-1] / G, rel=0.05)  # it is said with two digits


def test_the_acceleration_of_a_condition_of_an_implicit_unknown() -> None:
    """Against differences of z(t) along x(t) = x + v t - 2 t^2, where z + z^3 = x + sin(t)."""
    t, x, z = ca.SX.sym("t"), ca.SX.sym("x", 2), ca.SX.sym("z")
    residual = z + z**3 - x[0] - ca.sin(t)
    dae: Any = SimpleNamespace(t=t, x=x, z=z, xdot=ca.vertcat(x[1], -4.0), residual=residual)
    motion = ca.Function("motion", [t, x, z], [_motion(dae, z**2 + x[1])])

    def unknown(now: float) -> float:
        place = 0.7 + 1.3 * now - 2 * now**2
        roots = np.roots([1.0, 0.0, 1.0, -place - np.sin(now)])
        return float(roots[np.abs(roots.imag).argmin()].real)

    h = 1e-3
    before, here, after = (unknown(now) ** 2 + 1.3 - 4 * now for now in (-h, 0.0, h))
    expected = [here, (after - before) / (2 * h), (after - 2 * here + before) / h**2]
    np.testing.assert_allclose(np.array(motion(0.0, [0.7, 1.3], unknown(0.0))).ravel(), expected, rtol=1e-4)


@pytest.mark.parametrize("e", [0.45, 0.5, 0.52])
def test_a_ball_is_followed_while_it_falls_farther_than_a_nanometre(e: float) -> None:
    """Dropped from 1 m it rises to e^(2n) m after n bounces; ten times the hysteresis of events is 1e-9 m."""
    with pytest.raises(pt.SimulationError, match="come too close") as raised:
        pt.simulate(Ball(e=e), 10.0, rtol=1e-10, atol=1e-14)
    assert raised.value.result is not None
    resets = [event for event in raised.value.result.events if event.kind == "reset"]
    assert len(resets) == math.ceil(math.log(1e-9) / (2 * math.log(e)))


@pytest.mark.parametrize(("span", "chatters"), [(0.99e-4, True), (1.01e-4, False)])
def test_chattering_is_a_thousand_switches_in_a_hundred_thousandth_of_the_run(span: float, chatters: bool) -> None:
    chatter = Chatter(10.0)
    found = [chatter.note(3, 1.0 + span * k / 999) for k in range(1000)]
    assert found == [False] * 999 + [chatters]
    assert not chatter.note(4, 1.0 + span)


class Limited(pt.Component):
    """x grows by one per second, and is put back from 0.5 by a reset; ``pushed``: a mass of 1 kg under 1 N, which is stopped there."""

    back: pt.Parameter = pt.parameter("m", "How far it is put back", default=0.0)
    pushed: bool = False
    x: pt.Variable = pt.variable("m", "Position", start=0.0)
    v: pt.Variable = pt.variable("m/s", "Speed", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == (self.v if self.pushed else 1)
        yield pt.der(self.v) == 1
        stop = (pt.reinit(self.v, 0),) if self.pushed else ()
        yield pt.when(self.x > 0.5, pt.reinit(self.x, 0.5 - self.back), *stop, name="limit")


@pytest.mark.parametrize("pushed", [False, True])
def test_reset_to_the_limit_of_its_condition_is_noted(pushed: bool) -> None:
    """x reaches 0.5 once, and goes on from there."""
    result = pt.simulate(Limited(pushed=pushed), 1.5)
    assert result["x"][-1] == pytest.approx(0.625 if pushed else 1.5, abs=1e-6)
    (note,) = result.notes
    assert re.search(r"limit \(the model: .*test_zeno\.py:\d+.* goes on beyond it", note)


@pytest.mark.parametrize("back", [3e-10, 1e-9])
def test_resets_by_a_tiny_step_are_without_end(back: float) -> None:
    with pytest.raises(pt.SimulationError, match=r"limit \(the model: .* resets without end") as caught:
        pt.simulate(Limited(back=back), 1.0)
    assert caught.value.result["x"].max() < 0.5 + 1e-9


def test_resets_by_a_step_are_followed() -> None:
    """It is put back by 0.2 m at 0.5, 0.7, 0.9, 1.1 and 1.3 s."""
    result = pt.simulate(Limited(back=0.2), 1.4)
    assert not result.notes
    assert result["x"][-1] == pytest.approx(1.4 - 5 * 0.2, abs=1e-8)
