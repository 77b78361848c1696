"""A run in C, driven from Python through ctypes: the same results as ``simulate``."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from powertrain.compiler.assemble import Compiled
from powertrain.dae.hybrid import HybridDae, TimeSignal
from powertrain.engine.catalogue import catalogue
from powertrain.engine.in_c import FULL, signal_tables, signals
from powertrain.engine.options import longest_step, run_span, run_times
from powertrain.engine.schedules import Schedules
from powertrain.engine.trajectory import Instant, Trajectory, TrajectoryRecorder
from powertrain.errors import PowertrainError, SimulationError
from powertrain.language.arguments import positive, tolerances
from powertrain.language.component import Component
from powertrain.language.reals import Array
from powertrain.numerics.compiled import FLAGS as OPTIMISED
from powertrain.numerics.compiled import compile_c, compiler
from powertrain.result import Result

M = TypeVar("M", bound=Component)
FLAGS = ("-std=c99", *OPTIMISED)
SOURCES = ("functions.c", "model.c", "powertrain_run.c", "powertrain_loop.c")
_ROWS, _HELD, _INSTANTS = 4000, 1000, 500
"""How much of a run is kept in C before Python takes it over."""


class Begun(NamedTuple):
    """A consistent start of a run: states, algebraic unknowns, held values, parameters; how it was found; the signals of time."""

    x: Array
    z: Array
    m: Array
    p: Array
    report: Any
    schedules: Sequence[TimeSignal]


class CModel(Generic[M]):
    """A model exported as C, in its folder; created by ``plant.export_c``.

    ``simulate`` runs it and gives a ``Result``; ``library`` builds and loads it. The functions of C are those of ``powertrain_run.h``.
    """

    def __init__(self, compiled: Compiled, folder: Path, method: str, begin: Callable[..., Begun]) -> None:
        self._compiled, self._begin, self.folder, self.method = compiled, begin, folder, method
        self._sources = self._read()
        self._library: ctypes.CDLL | None = None

    def __repr__(self) -> str:
        return f"CModel(in {self.folder}, {self.method})"

    @property
    def library(self) -> ctypes.CDLL:
        """The model as a shared library, compiled at the first use.

        PowertrainError where there is no compiler, where it fails, and where another model has been exported to the folder since.
        """
        if self._library is None:
            if self._read() != self._sources:
                raise PowertrainError(f"{self.folder} has other sources than this export wrote; export the model again")
            self._library = self._compile()
            self._library.pt_size.restype = ctypes.c_size_t
            self._library.pt_message.restype = ctypes.c_char_p
            self._library.pt_unknowns.restype = ctypes.POINTER(ctypes.c_double)
            self._library.pt_held.restype = ctypes.POINTER(ctypes.c_double)
            self._library.pt_time.restype = ctypes.c_double
        return self._library

    def _read(self) -> list[bytes]:
        return [(self.folder / name).read_bytes() for name in SOURCES]

    def _compile(self) -> ctypes.CDLL:
        """The sources, compiled and loaded under a name of their own: a name that has been loaded is not read again."""
        with TemporaryDirectory(ignore_cleanup_errors=True) as place:
            target = Path(place) / "model.so"
            compile_c(compiler("export_c"), FLAGS, SOURCES, target, self.folder)
            return ctypes.CDLL(str(target))

    def simulate(
        self,
        stop: float | str,
        *,
        start: float | str = 0.0,
        step: float | None = None,
        parameters: Mapping[str, float] | None = None,
        starts: Mapping[str, float] | None = None,
        guesses: Mapping[str, float] | None = None,
        inputs: Mapping[str, Any] | None = None,
        times: ArrayLike | None = None,
        points: int = 500,
        rtol: float = 1e-6,
        atol: float | None = None,
        max_step: float = np.inf,
    ) -> Result[M]:
        """Run the model in C from ``start`` to ``stop`` (s); the start is made consistent in Python.

        Parameters
        ----------
        stop, start, parameters, starts, guesses, inputs, times, points, rtol, atol, max_step
            As for ``plant.simulate``.
        step
            Fixed step in s, as on a real-time target: without error control, but with located events; by default the step is controlled.

        Returns
        -------
        Result
            As that of ``plant.simulate`` with the method of the export.

        Raises
        ------
        ParameterError, InitializationError
            As ``plant.simulate``.
        SimulationError
            Where the loop in C gives up, with the run so far as ``result``; what it cannot do ``plant.simulate`` may.
        """
        first, last = run_span(start, stop)
        longest, step = longest_step(max_step, last), None if step is None else positive("step", step)
        grid = run_times(first, last, times, points)
        begun = self._begin(first, parameters, starts, guesses, inputs)
        run = _Run(self.library, self._compiled.dae, first, begun)
        self.library.pt_tolerance(run.model, *map(ctypes.c_double, (*tolerances(rtol, atol), longest)))
        status = run.to(last, step)
        trajectory = run.trajectory()
        knots = {s.name: (s.times, s.values) for s in begun.schedules if s.name in (inputs or {})}
        message = "" if not status else f"at t = {trajectory.end:.9g} s {self.library.pt_message(status).decode()}"
        result: Result[M] = Result(self._compiled, trajectory, grid, begun.p, begun.report, None, message, knots)
        if status:
            raise SimulationError(f"in C: {message}", result)
        return result


class _Run:
    """One run in memory of Python's, and what C has kept of it so far."""

    def __init__(self, library: ctypes.CDLL, dae: HybridDae, start: float, at: Begun) -> None:
        self.library, self.start, self._dae, self._catalogue = library, start, dae, catalogue(dae)
        sizes = (ctypes.c_int * 6)()
        library.pt_sizes(sizes)
        self.x, self.z, self.m, _, self.whens, _ = sizes
        self.y = max(self.x + self.z, 1)
        self._memory = np.zeros(library.pt_size() // 8 + 1)
        self.model = _pointer(self._memory)
        padded = [np.append(v, 0.0) for v in (at.x, at.z, at.m, at.p)]
        library.pt_load(self.model, ctypes.c_double(start), *map(_pointer, padded))
        self._table, self._kept = signals(signal_tables(Schedules(at.schedules)))
        library.pt_use_signals(self.model, ctypes.byref(self._table))
        self._rows = np.empty((_ROWS, 3 + 5 * self.y))
        self._held = np.empty((_HELD, self.m))
        self._instants = np.empty((_INSTANTS, 1 + 2 * self.y + 2 * self.m + self.whens))
        self.recorder = TrajectoryRecorder(np.empty(self._rows.shape[1]), self.x, self.z, self._catalogue)

    def to(self, stop: float, step: float | None) -> int:
        """Run to ``stop``; the status of C."""
        self._record()
        while True:
            status = self._advance(stop, step)
            counts = self._take()
            if status != FULL:
                self.counts = counts
                return status
            self._record()

    def _advance(self, stop: float, step: float | None) -> int:
        library, model = self.library, self.model
        if step is None:
            return int(library.pt_run(model, ctypes.c_double(stop)))
        while (left := stop - library.pt_time(model)) > 1e-9 * step:
            status = int(library.pt_step(model, ctypes.c_double(min(step, left) if left > 1.5 * step else left)))
            if status:
                return status
        return 0

    def _record(self) -> None:
        arrays = ((self._rows, _ROWS), (self._held, _HELD), (self._instants, _INSTANTS))
        self.library.pt_record(self.model, *(v for a, n in arrays for v in (_pointer(a), ctypes.c_long(n))))

    def _take(self) -> Array:
        counts = (ctypes.c_long * 6)()
        self.library.pt_counts(self.model, counts)
        self.recorder.extend(self._rows[: counts[3]], self._held[: counts[4], : self._dae.m.numel()].copy())
        instants = [self._instant(values) for values in self._instants[: counts[5]].copy()]
        self.recorder.instants += [i for i in instants if not i.begins(self.start, self._catalogue.rests.values())]
        return np.array(counts, float)

    def trajectory(self) -> Trajectory:
        """The run as the simulator in Python records it."""
        final, held = self.library.pt_unknowns(self.model)[: self.y], self.library.pt_held(self.model)[: self.m]
        statistics: dict[str, float] = dict(zip(("steps", "rejected", "events"), self.counts.tolist(), strict=False))
        end, held = float(self.library.pt_time(self.model)), held[: self._dae.m.numel()]
        return self.recorder.trajectory(end, np.array(final), np.array(held), statistics, ())

    def _instant(self, values: Array) -> Instant:
        cuts = np.cumsum([1, self.y, self.y, self.m, self.m])
        t, left, right, before, after, reset = np.split(values, cuts)
        n, m = self.x + self.z, self._dae.m.numel()
        extra = tuple((w.name, "reset") for w, done in zip(self._dae.whens, reset, strict=False) if done)
        return Instant(float(t[0]), left[:n], right[:n], before[:m], after[:m], extra)


def _pointer(array: Array) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)
