"""The loop in C over the machine code of one model: steps and routine events; every other event is handed back to the loop in Python.

The source is that of exported models, ``powertrain/native/powertrain_loop.c``. Here it works on the arrays of ``Memory``, and the records
below repeat those of ``powertrain_loop.h``.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from powertrain.dae.hybrid import Guard
from powertrain.engine.limits import limits
from powertrain.engine.prepared import Prepared
from powertrain.engine.schedules import Schedules
from powertrain.engine.trajectory import Instant
from powertrain.language.reals import Array
from powertrain.modes.resolve import PASSES
from powertrain.numerics.buffers import zeros
from powertrain.numerics.compiled import Library, compiler, library

SOURCES = Path(__file__).parents[1] / "native"
SIGNALS = ("times", "owners", "jumps", "first", "starts", "rows")
FULL, TOO_STIFF, UNDERFLOW, RATES, GUARD, EVENTS, ASK = 1, 2, -1, -4, -5, -7, -11
"""What C returns besides 0, as in ``powertrain_run.h`` and ``powertrain_loop.h``."""
_ROWS, _HELD, _INSTANTS = 1000, 500, 200
"""How much of a run is kept in C before Python takes it over."""
_DIMENSIONS = "x z y m indicators whens timed rests laws frictions counted constants"
TABLES = "places when_place when_first when_initially reset_place reset_discrete rests rest_laws laws frictions quiet bends guards"
_FUNCTIONS = "method constants advance samples survey verdict fresh rest locate corner update newton instants longest resets mobility"
_ARRAYS = (
    "y_0 y_1 reached_0 reached_1 m p time tolerance info dense outside fraction above at g worst held flags edges closing fire jumped "
    "first corners instants nearer resets open points found least stiffness constants mobility rate terms size calm seen held_left "
    "before left lows prepared counts which holds overridden row held_row instant_row out sample_times"
)
_REALS = "t start stop h longest crossed max_step instant corner target stiff"
_INTEGERS = (
    "side begun changed fixed idle reset located prepared_once hosted every_event every_mode every_idle explicit_method"
)
_COUNTS = "steps rejected events rows helds kept sampled most_rows most_held most_instants samples"


def _fields(kind: type, names: str | Iterable[str]) -> list[tuple[str, type]]:
    return [(name, kind) for name in (names.split() if isinstance(names, str) else names)]


class Signals(ctypes.Structure):
    """``pt_signals``."""

    _fields_ = [("points", ctypes.c_int), *_fields(ctypes.c_void_p, SIGNALS)]


class _Dimensions(ctypes.Structure):
    _fields_ = _fields(ctypes.c_int, _DIMENSIONS)


class _Tables(ctypes.Structure):
    _fields_ = _fields(ctypes.c_void_p, TABLES)


class _Functions(ctypes.Structure):
    _fields_ = _fields(ctypes.c_void_p, _FUNCTIONS)


class _Model(ctypes.Structure):
    _fields_ = [
        *_fields(ctypes.c_void_p, f"n of f signals arg res iw w {_ARRAYS}"),
        *_fields(ctypes.c_double, _REALS),
        *_fields(ctypes.c_int, _INTEGERS),
        *_fields(ctypes.c_long, _COUNTS),
    ]


def loop_source() -> str:
    """The loop with its headers and limits, in one piece."""
    code = (SOURCES / "powertrain_loop.c").read_text(encoding="utf-8")
    headers = {name: (SOURCES / name).read_text(encoding="utf-8") for name in ("powertrain_loop.h", "powertrain_run.h")}
    for name, text in (headers | {"powertrain_limits.h": limits()}).items():
        code = code.replace(f'#include "{name}"\n', text)
    return code


@lru_cache
def _loop() -> ctypes.CDLL:
    """The loop, compiled at its first use on a machine."""
    return ctypes.CDLL(str(library(loop_source(), compiler())))


def signal_tables(schedules: Schedules) -> dict[str, np.ndarray]:
    """Breakpoints and segments of all signals of time, in the order that ``pt_signals`` has."""
    starts = [found for found, _ in schedules.segments]
    return {
        "times": np.array(schedules.times, float),
        "owners": np.array(schedules.owners, np.intc),
        "jumps": np.array(schedules.jumps, np.intc),
        "first": np.cumsum([0, *map(len, starts)]).astype(np.intc),
        "starts": np.array([t for s in starts for t in s], float),
        "rows": np.concatenate([np.zeros(0), *(rows.ravel() for _, rows in schedules.segments)]),
    }


def signals(tables: dict[str, np.ndarray]) -> tuple[Signals, list[np.ndarray]]:
    """The tables for C, and the arrays that must be kept with them."""
    kept = [np.append(tables[name], np.zeros(1, tables[name].dtype)) for name in SIGNALS]
    return Signals(len(tables["times"]), *(array.ctypes.data for array in kept)), kept


def places(engine: Prepared) -> dict[str, list[int]]:
    """The tables of laws and held values that every loop needs, by their names in C."""
    held = engine.sizes[2]
    return {
        "rests": list(engine.catalogue.rests.values()),
        "rest_laws": list(engine.catalogue.rests),
        "frictions": [law.index for law in engine.dae.frictions],
        "quiet": [int(i in engine.catalogue.quiet or i >= held) for i in range(engine.memory.m.size)],
        "bends": [engine.bends.get(k, -1) for k in range(len(engine.indicators))],
        "guards": [int(isinstance(indicator.law, Guard)) for indicator in engine.indicators],
    }


class Position(NamedTuple):
    """Where a run is: time, next step and longest step (s), side of the unknowns, last instant passed (s), idle events, stiff steps."""

    t: float
    h: float
    longest: float
    side: int
    crossed: float
    idle: int
    stiff: float


class Stretch(NamedTuple):
    """What C has done: its status, where it is, what comes next, and records of the run.

    ``located``: the event that is left to Python lies inside a step. ``instant``, ``corner``: the next instant of a timed law and the next
    breakpoint of a signal (s). ``rows``: as ``Memory.record``, with the place of the held values among ``held``.
    """

    status: int
    located: bool
    at: Position
    instant: float
    corner: float
    rejected: int
    outside: Array
    rows: Array
    held: Array
    instants: list[Instant]


class LoopInC:
    """The loop of one engine and one method in C, whose ``step`` and ``others`` are machine code.

    ``explicit``: the method is to be given up where stability limits its steps.
    """

    def __init__(self, engine: Prepared, step: Library, others: Library, explicit: bool) -> None:
        self._engine, self._kept = engine, list[Any]()
        self._schedules: Schedules | None = None
        self._model = _Model(hosted=1, explicit_method=explicit)
        gaps_jump = engine.overlaps is not None and engine.overlaps.may_jump
        self._model.every_event = engine.continuity is not None or gaps_jump
        self._model.every_mode = engine.admissible.checks
        self._model.every_idle = bool(engine.admissible.yielding)
        self._model.most_rows, self._model.most_held, self._model.most_instants = _ROWS, _HELD, _INSTANTS
        self._continue, self._at = _loop().pt_continue, ctypes.byref(self._model)
        addresses = step.addresses() | others.addresses()
        functions = {key if key in _FUNCTIONS.split() else "method": at for key, at in addresses.items()}
        constants = step.get("constants")
        sizes = [] if constants is None else [constants.nnz_out(i) for i in range(constants.n_out())]
        self._set("f", _Functions(**functions))
        self._set("n", self._dimensions(len(sizes)))
        tables = {name: np.array([*values, 0], np.intc) for name, values in places(engine).items()}
        self._tables = _Tables(**{name: self._address(values) for name, values in tables.items()})
        self._set("of", self._tables)
        self._connect([*step.values(), *others.values()], [zeros(n) for n in sizes])
        self._share(step)

    def _set(self, name: str, record: ctypes.Structure) -> None:
        self._kept.append(record)
        setattr(self._model, name, ctypes.addressof(record))

    def _address(self, array: np.ndarray) -> int:
        self._kept.append(array)
        return array.ctypes.data

    def _dimensions(self, constants: int) -> _Dimensions:
        """Python applies resets and changes one law at a time, so that C needs no numbers of whens and laws."""
        engine, memory = self._engine, self._engine.memory
        x, z, _, _ = engine.sizes
        return _Dimensions(
            x=x, z=z, y=memory.y[0].size, m=memory.m.size, indicators=len(engine.indicators), timed=len(engine.timed),
            rests=len(engine.catalogue.rests), frictions=len(engine.dae.frictions), counted=len(engine.catalogue.counted),
            constants=constants,
        )  # fmt: skip

    def _connect(self, functions: Sequence[ca.Function], constants: Sequence[Array]) -> None:
        """The work vectors of the functions, and the arrays that only this loop uses."""
        model, memory, indicators = self._model, self._engine.memory, len(self._engine.indicators)
        model.arg = self._address(np.zeros(max(f.sz_arg() for f in functions), np.intp))
        model.res = self._address(np.zeros(max(f.sz_res() for f in functions), np.intp))
        model.iw = self._address(np.zeros(max(f.sz_iw() for f in functions) + 1, np.int64))
        model.w = self._address(zeros(max(f.sz_w() for f in functions)))
        model.constants = self._address(np.array([*map(self._address, constants), 0], np.intp))
        self._rows, self._counts = np.empty((_ROWS, memory.record.size)), np.zeros_like(memory.outside)
        m, y = memory.m.size, memory.y[0].size
        self._held, self._instants = np.empty((_HELD, m)), np.empty((_INSTANTS, 1 + 2 * y + 2 * m))
        self._held_left = zeros(m)
        laws = len(self._engine.dae.frictions)
        own: dict[str, np.ndarray] = {
            "mobility": zeros(laws**2), "rate": zeros(laws), "terms": zeros(laws), "size": zeros(laws), "calm": zeros(laws),
            "holds": np.zeros(laws + 1, np.intc), "nearer": zeros(y), "open": zeros(1), "seen": zeros(PASSES * m), "before": zeros(m),
            "left": zeros(y), "lows": zeros(indicators), "prepared": zeros(m), "counts": self._counts, "row": self._rows,
            "held_left": self._held_left, "held_row": self._held, "instant_row": self._instants,
        }  # fmt: skip
        for name, array in own.items():
            setattr(model, name, self._address(array))

    def _share(self, step: Library) -> None:
        """The arrays of the engine, and those between the parts of a step."""
        memory = self._engine.memory
        names = "m p time tolerance info dense outside fraction above at g worst held flags edges closing fire jumped instants"
        shared = {name: getattr(memory, name) for name in names.split()}
        shared |= {f"y_{k}": memory.y[k] for k in (0, 1)} | {f"reached_{k}": memory.reached[k] for k in (0, 1)}
        shared |= {"first": memory.start, "corners": memory.corner}
        if samples := step.get("samples"):
            shared |= {"points": zeros(samples.nnz_in(0)), "found": zeros(samples.nnz_out(0)), "stiffness": zeros(1)}
            shared["least"] = zeros(step["survey"].nnz_out(0))
        for name, array in shared.items():
            setattr(self._model, name, self._address(array))

    def _use(self, schedules: Schedules) -> None:
        """The signals of time of this run."""
        if schedules is self._schedules:
            return
        self._schedules = schedules
        self._signals, self._signal_arrays = signals(signal_tables(schedules))
        self._signal_places = np.array([*schedules.places, 0], np.intc)
        self._model.signals, self._tables.places = ctypes.addressof(self._signals), self._signal_places.ctypes.data

    def proceed(self, at: Position, start: float, stop: float, max_step: float, held: Array) -> Stretch:
        """Continue a run between two times, with the ``held`` values of its last record."""
        model = self._model
        self._use(self._engine.schedules)
        model.start, model.stop, model.max_step = start, stop, max_step
        model.t, model.h, model.longest, model.side, model.crossed, model.idle, model.stiff = at
        model.rows = model.helds = model.kept = model.rejected = 0
        self._held_left[:] = held
        self._counts.fill(0.0)
        status = int(self._continue(self._at))
        return Stretch(
            status=status,
            located=model.located == 1,
            at=Position(model.t, model.h, model.longest, model.side, model.crossed, model.idle, model.stiff),
            instant=model.instant,
            corner=model.corner,
            rejected=model.rejected,
            outside=self._counts[: len(self._engine.catalogue.counted)],
            rows=self._rows[: model.rows],
            held=self._held[: model.helds].copy(),
            instants=[self._instant(row) for row in self._instants[: model.kept].copy()],
        )

    def _instant(self, row: Array) -> Instant:
        y, m = self._engine.memory.y[0].size, self._engine.memory.m.size
        a, b, c = 1 + y, 1 + 2 * y, 1 + 2 * y + m
        return Instant(float(row[0]), row[1:a], row[a:b], row[b:c], row[c:])
