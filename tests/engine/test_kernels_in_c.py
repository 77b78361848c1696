"""Functions of the loop in C by themselves, between functions of a model that are written in Python."""

from __future__ import annotations

import ctypes
import shutil
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from curves import CURVES, DEEP, Step

from powertrain.dae.hybrid import START, TimeSignal
from powertrain.dae.tolerances import EPS
from powertrain.engine import in_c
from powertrain.engine.location import MOST_IDLE, Locator
from powertrain.engine.schedules import Schedules
from powertrain.integration.step_control import HALVINGS
from powertrain.modes.resolve import PASSES
from powertrain.modes.resting import SINGULAR
from powertrain.numerics.buffers import INFO
from powertrain.numerics.compiled import compiler, library

pytestmark = pytest.mark.skipif(not (shutil.which("cc") or shutil.which("gcc")), reason="no C compiler on this machine")
_Array = np.ndarray[Any, Any]
_FUNCTION = ctypes.CFUNCTYPE(
    ctypes.c_int, *[ctypes.POINTER(ctypes.c_void_p)] * 2, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int
)


@lru_cache
def kernels() -> ctypes.CDLL:
    """The loop with all its functions in reach."""
    return ctypes.CDLL(str(library(in_c.loop_source().replace("\nstatic ", "\n"), compiler())))


class Model:
    """A ``pt_model`` whose arrays, tables and functions are those of Python."""

    def __init__(self, arrays: dict[str, _Array], tables: dict[str, Sequence[int]] | None = None, **sizes: int) -> None:
        self.arrays, self.kept = arrays, list[Any]()
        self.record = in_c._Model(n=self._kept(in_c._Dimensions(**sizes)), max_step=np.inf, longest=np.inf)
        for name in ("arg", "res"):
            setattr(self.record, name, self._address(np.zeros(8, np.intp)))
        for name, values in arrays.items():
            setattr(self.record, name, self._address(values))
        places = {name: self._address(np.array(values, np.intc)) for name, values in (tables or {}).items()}
        self.record.of = self._kept(in_c._Tables(**places))
        self.functions = in_c._Functions()
        self.record.f = self._kept(self.functions)

    def _kept(self, record: ctypes.Structure) -> int:
        self.kept.append(record)
        return ctypes.addressof(record)

    def _address(self, values: _Array) -> int:
        self.kept.append(values)
        return values.ctypes.data

    def function(self, name: str, called: Callable[[], None]) -> None:
        """Let a function of the model change the arrays."""

        def function(*_: Any) -> int:
            called()
            return 0

        pointer = _FUNCTION(function)
        self.kept.append(pointer)
        setattr(self.functions, name, ctypes.cast(pointer, ctypes.c_void_p).value)

    def call(self, name: str, *given: float, result: Any = ctypes.c_int) -> Any:
        """Call a function of the loop."""
        kernel = getattr(kernels(), name)
        kernel.restype = result
        return kernel(ctypes.byref(self.record), *(ctypes.c_double(v) for v in given))


@pytest.mark.parametrize("seed", range(20))
def test_what_others_hold_has_no_mobility_left(seed: int) -> None:
    """G - G_h G_hh^+ G_h^T and the rates to it, each law scaled to a mobility of one, for inertias from 1e-4 to 1e4 kg.m2.

    Laws 0, 1 and 4 depend on one another. Laws 5 and 6 have no mobility: their terms, or nothing, give the scale.
    """
    rng = np.random.default_rng(seed)
    directions = np.vstack([rng.integers(-2, 3, (5, 4)) + np.eye(5, 4), np.zeros((2, 4))])
    directions[4] = directions[0] + directions[1]
    J = 10.0 ** rng.uniform(-4, 4, 4)
    G, rate = directions / J @ directions.T, directions @ (rng.normal(size=4) / J)
    modes = np.append([0, 0, 1, -1, 0] if seed % 2 else rng.permutation([0, 0, 1, -1, 1]), [0, 0])
    given = np.diag(G) + np.array([0, 0, 0, 0, 0, 2.0, 0])
    arrays = {
        "mobility": G.copy(), "rate": rate.copy(), "size": given.copy(), "terms": np.zeros(7), "m": modes.astype(float),
        "holds": np.zeros(7, np.intc),
    }  # fmt: skip
    model = Model(arrays, {"frictions": range(7)}, frictions=7)
    unknown = model.call("eliminate_what_holds", result=ctypes.c_double)
    size = np.sqrt(np.where(given > 0.0, given, 1.0))
    scaled, b = G / np.outer(size, size), rate / size
    h, others = modes == 0, modes != 0
    c = scaled[:, h] @ np.linalg.pinv(scaled[np.ix_(h, h)], rcond=1e-9)
    np.testing.assert_allclose(arrays["size"], size)
    np.testing.assert_allclose(arrays["mobility"][others], (scaled - c @ scaled[h])[others], atol=1e-7)
    np.testing.assert_allclose(arrays["rate"][others], (b - c @ b[h])[others], atol=1e-7 * np.abs(b).max())
    assert unknown == pytest.approx(SINGULAR * np.abs(b[h]).sum())
    if not seed % 2:  # the combination of the holding laws is unique
        least = np.abs(b) + np.abs(c) @ np.abs(b[h])
        assert np.all(arrays["terms"][others] >= 0.999999 * least[others])


SEARCHES = {name: ([curve, lambda q: 5.0], 0.0) for name, curve in CURVES.items()} | {
    "deep": ([*DEEP, lambda q: 5.0], 0.05)
}
"""Indicators, and how far below zero they count."""


@pytest.mark.parametrize("name", SEARCHES)
def test_both_loops_search_at_the_same_places(name: str) -> None:
    """The search for a crossing in C asks for the indicators where that in Python does, and finds the same fraction.

    Beside an indicator that stays positive: C looks for others that fall midway even if there are none.
    """
    found, (curves, depth) = [], SEARCHES[name]
    for in_python in (True, False):
        step = Step(curves)
        asked: list[float] = []

        def value(step: Step = step, asked: list[float] = asked) -> None:
            asked.append(float(step.memory.fraction[0]))
            step.call()

        if in_python:
            found.append((Locator(value, step.memory).find(depth), asked))
            continue
        arrays = {key: getattr(step.memory, key) for key in ("above", "g", "fraction", "worst", "info")}
        model = Model(arrays | {"lows": np.zeros(len(curves))}, indicators=len(curves))
        model.function("locate", value)
        found.append((model.call("find", depth, result=ctypes.c_double), asked))
    assert found[0] == found[1]
    assert len(found[0][1]) > 1


Verdict = Callable[[float, float], Sequence[float]]
"""Error, 1 if not resolved, growth, least indicator and stiffness of a step, by its time and size."""


def stepping(verdict: Verdict, h: float, target: float) -> tuple[Model, list[tuple[float, float]]]:
    """A run of steps, and the times and sizes of those that it tries."""
    info, tried = np.zeros(INFO + 4), list[tuple[float, float]]()
    arrays = {
        "info": info,
        "time": np.zeros(2),
        "y_0": np.zeros(1),
        "y_1": np.zeros(1),
        "m": np.zeros(1),
        "dense": np.zeros(5),
    }
    model = Model(arrays, y=1)

    def method() -> None:
        tried.append((float(arrays["time"][0]), float(arrays["time"][1])))
        info[:5] = verdict(*tried[-1])

    model.function("method", method)
    model.record.h, model.record.target, model.record.stop = h, target, target
    return model, tried


@pytest.mark.parametrize(("h", "sizes", "left"), [(0.995, [1.0], 1.0), (0.98, [0.98, 0.02], 0.98), (3.0, [1.0], 3.0)])
def test_a_step_reaches_a_little_further_to_the_target(h: float, sizes: list[float], left: float) -> None:
    """By at most 1 %, so that no tiny step is left before the target; a step cut short does not shorten the next one."""
    model, tried = stepping(lambda t, h: (0.1, 0.0, 1.0, 1.0, 0.0), h, 1.0)
    assert model.call("smooth") == 0
    np.testing.assert_allclose([size for _, size in tried], sizes, rtol=1e-14)
    assert model.record.t == 1.0
    assert model.record.h == left


def test_a_step_is_halved_so_often() -> None:
    """Where indicators are not resolved, each step is tried at 2^0 .. 2^-HALVINGS of its size, then accepted; the next does not grow."""
    model, tried = stepping(lambda t, h: (0.1, float(t < 0.00391), 5.0, 1.0, 0.0), 1.0, 1.0)
    assert model.call("smooth") == 0
    expected = [0.5**k for k in [*range(HALVINGS + 1), *range(HALVINGS, 2 * HALVINGS + 1)]]
    assert [size for _, size in tried][: len(expected)] == expected
    assert model.record.rejected == 2 * HALVINGS


def test_rejected_steps_use_the_order_that_they_show() -> None:
    """An error in proportion to the step: first as h^5, then as h; after a step that is accepted as h^5 again."""

    def verdict(t: float, h: float) -> Sequence[float]:
        return 4.0 * h if t == 0.0 else 3.0 if h > 0.2 else 0.5, 0.0, 1.0, 1.0, 0.0

    model, tried = stepping(verdict, 1.0, 1.0)
    assert model.call("smooth") == 0
    sizes = [1.0, 0.9 * 4.0**-0.2, 0.225, 0.225, 0.225 * 0.9 * 3.0**-0.2]
    np.testing.assert_allclose([size for _, size in tried[:5]], sizes, rtol=1e-12)


def located(idle: int, curve: Callable[[float], float], t: float, h: float, target: float) -> float:
    """The instant of the event that is located in a step."""
    step = Step([curve, lambda q: 5.0])
    arrays = {key: getattr(step.memory, key) for key in ("above", "g", "fraction", "worst", "info")}
    arrays |= {"lows": np.zeros(2), "y_0": np.zeros(1), "y_1": np.zeros(1), "at": np.zeros(1)}
    model = Model(arrays, {"guards": [0, 0]}, indicators=2, y=1)
    model.function("locate", step.call)
    model.record.idle, model.record.target = idle, target
    assert model.call("located", t, h) == 1
    return float(model.record.t)


@pytest.mark.parametrize("idle", [0, 1, 10, 20, 25])
def test_events_without_a_change_deepen_the_search(idle: int) -> None:
    """An indicator counts from -EPS 2^n on after n events that changed nothing, at most from -EPS 2^20 on."""
    depth = EPS * 2.0 ** min(idle, 20) if idle else 0.0
    t = located(idle, lambda q: 1e-3 * (0.4 - q), 2.0, 1.0, 9.0)
    assert t == pytest.approx(2.4 + depth / 1e-3, abs=1e-7)


def test_an_event_at_the_end_of_the_last_step_is_at_the_target() -> None:
    """Exactly, even where t + (target - t) is a little less."""
    t, target = next((t, b) for t in np.linspace(0.1, 0.9, 99) for b in (1.1, 1.3, 1.7) if t + (b - t) < b)
    assert located(0, lambda q: 1.0 - q - 1.5e-11, t, target - t, target) == target


def test_events_without_a_change_are_counted_until_they_are_too_many() -> None:
    """A quiet event that changes nothing is counted, a change ends the count, and so does what is no quiet event."""
    arrays = {
        "m": np.zeros(1),
        "before": np.zeros(1),
        "first": np.zeros(2),
        "time": np.zeros(2),
        "y_0": np.zeros(1),
        "y_1": np.zeros(1),
    }
    model = Model(arrays, {"quiet": [1]}, m=1, y=1)
    model.function("fresh", lambda: None)

    def resume(found: int, jumps: int, changed: int) -> int:
        return int(kernels().resume_after_event(ctypes.byref(model.record), found, jumps, changed))

    assert [resume(1, 0, 0) for _ in range(MOST_IDLE)] == [0] * MOST_IDLE
    assert model.record.idle == MOST_IDLE
    assert resume(1, 0, 0) == in_c.EVENTS
    for event in ((1, 0, 1), (0, 0, 0), (1, 1, 0)):
        model.record.idle = 5
        assert resume(*event) == 0
        assert model.record.idle == 0


def test_a_start_sees_no_instant() -> None:
    """What an event that failed has left behind does not fire when a run begins again."""
    arrays = {name: np.zeros(7) for name in "flags jumped m held held_left time first y_0 y_1 seen".split()}
    arrays["fire"] = np.ones(1)
    model = Model(arrays, m=1, timed=1, y=1)
    model.function("update", lambda: seen.append(float(arrays["fire"][0])))
    model.function("fresh", lambda: None)
    model.record.changed, seen = 1, list[float]()
    assert model.call("pt_begin") == 0
    assert seen == [0.0]


def test_an_input_that_was_set_passes_the_corners_of_its_signal() -> None:
    """Also those that the signal of another input has at the same instant."""
    times, values = np.array([0.0, 1.0, 1.0, 2.0]), np.array([0.0, 2.0, 5.0, 6.0])
    schedules = Schedules([TimeSignal("a", 0, times, values), TimeSignal("b", 3, times[1:], -values[1:])])
    m = np.zeros(6)
    arrays: dict[str, _Array] = {"m": m, "overridden": np.array([1, 0], np.intc)}
    model = Model(arrays, {"places": schedules.places})
    record, kept = in_c.signals(in_c.signal_tables(schedules))
    model.kept.append(kept)
    model.record.signals = model._kept(record)
    m[:3] = 0.5, 7.0, 0.0
    assert model.call("following", 0.2, result=ctypes.c_double) == 1.0
    assert model.call("cross", 0.2, 1.5) == 1
    assert m.tolist() == [0.5, 7.0, 0.0, 1.0, -5.0, -1.0]
    arrays["overridden"][:] = 1
    assert model.call("following", 0.2, result=ctypes.c_double) == np.inf
    assert model.call("cross", 1.5, 2.5) == 0
    assert m[3:].tolist() == [1.0, -5.0, -1.0]


@pytest.mark.parametrize(
    ("edges", "discretes"), [([[1, 1]], [5.0, 0.0]), ([[1, 0], [0, 1]], [5.0, 6.0]), ([[0, 1], [1, 1]], [0.0, 0.0])]
)
def test_conditions_that_are_true_at_a_start(edges: list[list[int]], discretes: list[float]) -> None:
    """Of two resets the first one counts what is true from the beginning on. The second one has to become true, as by the first."""
    sizes = {"m": 4, "held": 4, "flags": 7, "edges": 2, "closing": 1, "jumped": 2, "resets": 2, "seen": 4 * PASSES}
    arrays: dict[str, _Array] = {name: np.zeros(size) for name, size in sizes.items()}
    arrays |= {name: np.zeros(2) for name in ("time", "y_0", "y_1", "fire", "p")} | {"which": np.zeros(2, np.intc)}
    tables: dict[str, Sequence[int]] = {
        "when_place": [0, 1],
        "when_first": [0, 1, 2],
        "when_initially": [1, 0],
        "reset_place": [2, 3],
        "reset_discrete": [1, 1],
    }
    model, rounds = Model(arrays, tables, whens=2, m=4, y=1), iter([*edges, [0, 0]])

    def update() -> None:
        arrays["edges"][:] = next(rounds)
        arrays["flags"][1] = arrays["edges"].any()
        arrays["held"][:] = arrays["m"]

    def resets() -> None:
        arrays["resets"][:] = 5.0, 6.0

    model.function("update", update)
    model.function("resets", resets)
    arrays["jumped"][0] = START
    assert model.call("resolve") == 0
    assert arrays["m"][2:].tolist() == discretes


def test_an_event_left_to_python_is_as_it_was_found() -> None:
    """With the segments of signals before it, which Python enters when it passes the corner."""
    schedules = Schedules([TimeSignal("a", 0, np.array([0.0, 1.0, 2.0]), np.array([0.0, 2.0, 5.0]))])
    arrays = {name: np.zeros(3) for name in ("m", "before", "held_left")} | {"left": np.zeros(1), "time": np.zeros(2)}
    arrays |= {"y_0": np.ones(1), "y_1": np.zeros(1), "fire": np.zeros(1)}
    model = Model(arrays, {"places": schedules.places}, m=3, y=1)
    record, kept = in_c.signals(in_c.signal_tables(schedules))
    model.kept.append(kept)
    model.record.signals = model._kept(record)
    schedules.enter(arrays["m"], 0.5)
    arrays["held_left"][:] = arrays["m"]
    run = model.record
    run.t, run.corner, run.instant, run.crossed, run.every_mode = 1.0, 1.0, np.inf, 0.2, 1
    assert kernels().event(ctypes.byref(run), 1) == in_c.ASK
    assert run.crossed == 0.2
    np.testing.assert_array_equal(arrays["m"], arrays["held_left"])


@pytest.mark.parametrize("begun", [0, 1])
def test_what_has_stuck_is_at_rest_where_a_run_goes_on_with_other_inputs(begun: int) -> None:
    sizes = {
        "m": 1,
        "held": 1,
        "held_left": 1,
        "before": 1,
        "flags": 7,
        "edges": 1,
        "closing": 1,
        "jumped": 2,
        "seen": PASSES,
    }
    arrays = {name: np.zeros(size) for name, size in sizes.items()}
    arrays |= {name: np.zeros(1) for name in ("fire", "p", "reached_0", "reached_1", "tolerance")}
    arrays |= {"time": np.zeros(2), "first": np.array([1e-3, 0.0]), "y_0": np.array([1e-9]), "y_1": np.zeros(1)}
    model = Model(arrays, m=1, y=1)

    def fresh() -> None:
        side = model.record.side
        arrays[f"y_{1 - side}"][:] = arrays[f"y_{side}"]

    model.function("rest", lambda: arrays["y_1"].fill(0.0))
    model.function("update", lambda: None)
    model.function("fresh", fresh)
    model.record.begun, model.record.changed, model.record.side = begun, 1, 0
    assert model.call("pt_begin") == 0
    assert arrays[f"y_{model.record.side}"][0] == (0.0 if begun else 1e-9)
    assert arrays["jumped"][0] == 0.0
