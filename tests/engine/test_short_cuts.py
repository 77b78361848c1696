"""What is done for speed gives what the long way gives: called functions, compiled steps, corners, Newton's steps, location."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from cases import few
from models import COUPLED_PARAMETERS, COUPLED_START, coupled_clutches, dae, implicit, nonlinear

from powertrain.dae.hybrid import Friction, HybridDae, TimeSignal
from powertrain.engine.loop import Run
from powertrain.engine.simulator import Simulator
from powertrain.integration import fused as steps
from powertrain.modes.resolve import ModeResolver

COMPILER = pytest.mark.skipif(not (shutil.which("cc") or shutil.which("gcc")), reason="no C compiler on this machine")


@pytest.mark.parametrize("name", ["dopri5", "rodas5p"])
@pytest.mark.parametrize("model", [nonlinear(), implicit(), coupled_clutches()], ids=["two", "implicit", "clutches"])
def test_a_step_that_calls_functions_is_the_step_that_is_written_out(model: HybridDae, name: str) -> None:
    if name == "dopri5" and model.z.numel():
        return
    rows = [1, 0, 2] if model.z.numel() else None
    y = 0.3 + 0.1 * np.arange(model.x.numel() + model.z.numel())
    m, p = np.zeros(model.m.numel()), 1.0 + 0.1 * np.arange(model.p.numel())
    found = []
    for kind in (ca.SX, ca.MX):
        common = steps.Model(model, rows, kind=kind)
        reached = np.append(0.1 * y, np.linspace(1.0, 2.0, common.indicators))
        found.append(steps.step(common, name)([0.2, 0.01], y, m, p, reached, [1e-6, 1e-8]))
    for written, called in zip(*found, strict=True):
        assert np.allclose(np.array(written), np.array(called), rtol=1e-9, atol=1e-12)


def test_what_is_called_within_steps_computes_nothing_twice() -> None:
    model = steps.Model(coupled_clutches())
    for function in (steps.step(model, "rodas5p"), steps.locate(model), steps.corner(model)):
        assert function.n_instructions() == steps.short(function).n_instructions(), function.name()


@COMPILER
@pytest.mark.parametrize("method", few(["dopri5", "rodas5p"]))
@pytest.mark.parametrize("long", [10**9, 0], ids=["written out", "called"])
def test_compiled_runs_switch_as_interpreted_ones(
    method: Any, long: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("POWERTRAIN_CACHE", str(tmp_path))
    monkeypatch.setattr("powertrain.engine.prepared._LONG", long)
    plain, compiled = (
        Simulator(coupled_clutches(), method, compile=c).run(COUPLED_START, COUPLED_PARAMETERS, stop=1.5)
        for c in (False, True)
    )
    assert [(e.name, e.old, e.new) for e in plain.events] == [(e.name, e.old, e.new) for e in compiled.events]
    assert [e.time for e in plain.events] == pytest.approx([e.time for e in compiled.events], abs=1e-10)
    assert np.abs(plain.final - compiled.final).max() < 1e-8


def on_a_moving_ground() -> HybridDae:
    """A body of 1 kg held by friction of 1 N on a ground whose speed has corners; x is the speed over the ground."""
    t, x, m, p = ca.SX.sym("t"), ca.SX.sym("x", 1), ca.SX.sym("m", 4), ca.SX.sym("p", 0)
    slope = m[3]
    force = ca.if_else(m[0] == 0, -slope, m[0])
    rate = -force - slope
    friction = Friction("shoe", "hand", 0, x, force, ca.SX(-1), ca.SX(1), ca.SX(1), rate, may_free=False)
    speeds = np.array([0.0, 0.25, 0.375, 2.375, 2.375, 3.125])
    ground = TimeSignal("ground", 1, np.array([0.0, 0.5, 1.0, 2.0, 3.5, 5.0]), speeds)
    return dae(t, x, m, p, rate, ["w"], frictions=(friction,), schedules=(ground,))


def test_corners_are_passed_at_once_unless_a_law_has_to_change(monkeypatch: pytest.MonkeyPatch) -> None:
    resolved: list[float] = []
    resolve = ModeResolver.resolve

    def count(resolver: ModeResolver, side: int, jumped: float) -> None:
        resolved.append(float(resolver.memory.time[0]))
        resolve(resolver, side, jumped)

    monkeypatch.setattr(ModeResolver, "resolve", count)
    run = Simulator(on_a_moving_ground()).run([0.0], [], stop=5.0)
    assert [(e.old, e.new) for e in run.events] == [(0, -1), (-1, 0)]
    assert [e.time for e in run.events] == pytest.approx([1.0, 3.0], abs=1e-9)
    assert resolved == pytest.approx([0.0, 1.0, 3.0], abs=1e-9)
    _, x, _, held = run.at([0.25, 1.5, 2.5, 4.0], with_events=False)
    assert x[:, 0] == pytest.approx([0.0, -0.5, -0.5, 0.0], abs=1e-9)
    assert held[-1, 3] == pytest.approx(0.5)


def test_a_step_cut_short_by_a_corner_does_not_shorten_the_next() -> None:
    """Twenty pairs of corners a microsecond apart: growing back from there would take 9 steps each."""
    t, x, m, p = ca.SX.sym("t"), ca.SX.sym("x"), ca.SX.sym("m", 3), ca.SX.sym("p", 0)
    times = np.concatenate([[k, k + 1e-6] for k in range(1, 21)])
    signal = TimeSignal("signal", 0, times, np.ones(40))
    run = Simulator(dae(t, x, m, p, m[1] - x, ["x"], schedules=(signal,))).run([1.0], [], stop=22.0)
    assert run.statistics["steps"] < 60


def test_a_corner_ends_a_row_of_events_that_change_nothing() -> None:
    engine = Simulator(on_a_moving_ground())
    engine.run([0.0], [], stop=0.1)
    run = Run(engine, 0.1, 5.0, np.inf, None, lambda _: None)
    run.idle, run.side = 5, 0
    assert run._turns()
    assert run.idle == 0


def test_the_quick_search_for_algebraic_unknowns_ends_where_the_careful_one_ends() -> None:
    engine = Simulator(implicit())
    engine.run([1.0], [], stop=0.1)
    assert engine.algebra is not None
    quick = engine.algebra._quick
    for x in (0.2, 1.0, 5.0):
        assert quick
        engine.algebra._quick = quick
        fast = engine.resolve(0.5, [x], [0.4, 0.4, 0.4], [], [])[1]
        engine.algebra._quick = []
        careful = engine.resolve(0.5, [x], [0.4, 0.4, 0.4], [], [])[1]
        assert fast == pytest.approx(careful, rel=1e-10)


def test_an_indicator_that_is_flat_below_zero_is_located_in_few_calls() -> None:
    """The first clutch's force ends at 1.25 s; from then on its width is zero."""
    engine = Simulator(coupled_clutches())
    engine.run(COUPLED_START, COUPLED_PARAMETERS, stop=0.1)
    calls, call = [0], engine.locator._call

    def counted() -> None:
        calls[0] += 1
        call()

    engine.locator._call = counted
    run = engine.run(COUPLED_START, COUPLED_PARAMETERS, stop=1.5)
    assert [e.time for e in run.events if e.new == 2] == pytest.approx([1.25], abs=1e-8)
    assert calls[0] < 12 * len(run.instants)
