"""Runs that are advanced step by step, with inputs from outside: controllers in Python, hardware in the loop, learning."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from reprlib import repr as short
from typing import Any, Generic, NoReturn, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from powertrain.compiler.assemble import Compiled
from powertrain.dae.hybrid import TimeSignal
from powertrain.engine.options import run_times
from powertrain.engine.schedules import Schedules
from powertrain.engine.simulator import Simulator
from powertrain.engine.trajectory import Instant, Trajectory
from powertrain.errors import ParameterError, SimulationError, suggestion
from powertrain.language import htmltext
from powertrain.language.arguments import number
from powertrain.language.component import Component
from powertrain.language.labelled import check_unit
from powertrain.language.reals import Array, sealed
from powertrain.present import Present
from powertrain.result import Result
from powertrain.signals import signals_of

M = TypeVar("M", bound=Component)


@dataclass(frozen=True)
class State:
    """What decides how a run goes on: time in s, states, algebraic unknowns, held values (modes, discrete variables, inputs).

    ``signals`` are the signals of time that still run: those of the model, and inputs that were given over time and not set since.
    ``unset`` are the inputs that have not been given a value.
    """

    t: float
    x: Array
    z: Array
    m: Array
    signals: tuple[TimeSignal, ...]
    unset: frozenset[str]

    def __post_init__(self) -> None:
        for values in (self.x, self.z, self.m):
            sealed(values)


class Running(Generic[M]):
    """A run that is advanced step by step; created by ``plant.start``.

    ``run.step(dt, throttle=0.3)`` advances by ``dt`` seconds, ``run["engine.w"]`` is the present value of a signal (selectors work, too),
    ``run.state`` is everything that determines how the run continues. A state can be stored and restored: with the same inputs, the run
    then repeats to the last bit. ``run.result()`` is the run so far as a ``Result``.
    """

    def __init__(
        self,
        compiled: Compiled,
        engine: Callable[[], Simulator],
        state: State,
        p: Array,
        report: Any,
        options: Mapping[str, Any],
    ) -> None:
        self._compiled, self._engine, self._p, self._report, self._options = compiled, engine, p, report, options
        self._signals = signals_of(compiled)
        self._places = {s.name: s.index for s in compiled.dae.schedules if s.name in compiled.inputs}
        self._begin(state)

    def _begin(self, state: State) -> None:
        self._state, self._first, self._schedules = state, state, Schedules(state.signals)
        self._pieces: list[Trajectory] = []
        followed = {s.name for s in state.signals}
        self._set = {n: {state.t: float(state.m[k + 1])} for n, k in self._places.items() if n not in followed}
        """The values of the inputs that follow no signal, by the times from which they hold."""

    @property
    def time(self) -> float:
        """The present time in s."""
        return self._state.t

    @property
    def state(self) -> State:
        """The present state. Setting a state returns to it and discards the run so far."""
        return self._state

    @state.setter
    def state(self, state: State) -> None:
        sizes = [tuple(len(v) for v in (s.x, s.z, s.m)) for s in (state, self._state) if isinstance(s, State)]
        if len(set(sizes)) != 1 or len(sizes) != 2:
            raise ParameterError(f"state = {short(state)}: pass a state from a run of the same model")
        self._begin(state)

    def step(self, dt: float, /, **inputs: float) -> Running[M]:
        """Advance by ``dt`` s. Inputs keep their values until new ones are given. Returns the run itself.

        Inputs of components, whose names contain dots, are passed as ``run.step(dt, **{"driver.v_ref": 10})``. Raises SimulationError like
        ``simulate``; the run then remains where it was.
        """
        dt = number("dt", dt, "s")
        if dt <= 0.0:
            raise ParameterError(f"dt = {dt:g} s is not positive")
        state = self._state
        m = state.m.copy()
        given = {name: number(f"input {name}", value) for name, value in inputs.items()}
        for name, value in given.items():
            if name not in self._places:
                raise ParameterError(f"the model has no input {name}{suggestion(name, self._places)}")
            check_unit(f"input {name}", inputs[name], self._compiled.inputs[name].unit)
            m[self._places[name] : self._places[name] + 3] = state.t, value, 0.0
        signals = tuple(s for s in state.signals if s.name not in inputs)
        schedules = self._schedules if len(signals) == len(state.signals) else Schedules(signals)
        engine = self._engine()
        kept, engine.schedules = engine.schedules, schedules
        try:
            options = {name: self._options[name] for name in ("rtol", "atol", "max_step")}
            found = engine.resume(
                state.x,
                self._p,
                state.m,
                state.z,
                start=state.t,
                stop=state.t + dt,
                held=m if inputs else None,
                **options,
            )
        except SimulationError as error:
            error.result = None
            raise
        finally:
            engine.schedules = kept
        n = found.states
        held = found.final_held[: state.m.size]
        x, z = found.final[:n].copy(), found.final[n:].copy()
        self._state = State(state.t + dt, x, z, held.copy(), signals, state.unset - given.keys())
        self._schedules = schedules
        for name, value in given.items():
            self._set.setdefault(name, {})[state.t] = value
        if self._options["record"]:
            self._pieces.append(found)
        return self

    def __getitem__(self, what: str | Callable[[M], Any]) -> float:
        """The present value of a signal or of an expression of signals."""
        state = self._state
        return Present[M](self._signals, state.t, state.x, state.z, state.m, self._p)[what]

    def result(self, times: ArrayLike | None = None) -> Result[M]:
        """The run since its start, or since its state was set; ``times`` (s): of the output, by default those of the steps."""
        if not self._options["record"]:
            raise ParameterError("the run was started with record=False, which keeps only the present state")
        if not self._pieces:
            raise ParameterError("the run has not advanced yet: call step(dt) first")
        steps = [p.start for p in self._pieces] + [self._state.t]
        grid = run_times(steps[0], steps[-1], steps if times is None else times, 1)
        inputs = {name: self._knots(name) for name in self._places if name not in self._state.unset}
        return Result(self._compiled, joined(self._first, self._pieces), grid, self._p, self._report, inputs=inputs)

    def _knots(self, name: str) -> tuple[Array, Array]:
        """Times and values of an input: its signal until it is set, then jumps."""
        followed = [s for s in self._first.signals if s.name == name]
        if name not in self._set:
            return followed[0].times, followed[0].values
        times, values = (np.array(list(each)).repeat(2) for each in zip(*self._set[name].items(), strict=True))
        if not followed or times[0] == self._first.t:
            return times[1:], values[:-1]
        signal = followed[0]
        before = int(signal.times.searchsorted(times[0]))
        left = np.interp(times[0], signal.times[: before + 1], signal.values[: before + 1])
        return np.append(signal.times[:before], times), np.concatenate([signal.values[:before], [left], values[:-1]])

    def __copy__(self) -> Running[M]:
        """A run of its own, which goes on from here."""
        other: Running[M] = Running.__new__(Running)
        other.__dict__.update(self.__dict__)
        other._pieces, other._set = self._pieces.copy(), {name: values.copy() for name, values in self._set.items()}
        return other

    def __deepcopy__(self, memo: Any) -> Running[M]:
        return self.__copy__()

    def __reduce__(self) -> NoReturn:
        raise ParameterError(
            "a run that is advanced step by step cannot be sent to another process; send the plant and run.state, which can be pickled, "
            "and there set the state of a run that plant.start() begins with the same parameters"
        )

    def __repr__(self) -> str:
        return f"Running({type(self._signals.model).__name__} at t = {self.time:g} s)"

    def _repr_html_(self) -> str:
        entries, names = self._signals.entries, self._compiled.states
        rows = [(n, f"{self[n]:.6g}", entries[n].unit, entries[n].doc) for n in names if n in entries]
        about = f"{type(self._signals.model).__name__} at t = {self.time:g} s"
        return htmltext.heading("Running", about) + htmltext.table(("state", "value", "unit", "meaning"), rows)


def joined(first: State, pieces: list[Trajectory]) -> Trajectory:
    """One trajectory of runs that follow each other; what changes between them is an instant of its own."""
    held, mode, instants, offset = [], [], [], 0
    left = np.concatenate([first.x, first.z]), first.m
    modes = [index for index, _, _ in pieces[0].laws]
    for piece in pieces:
        right = piece.dense[0, 0] if len(piece.times) else piece.final, piece.held[0]
        if (left[1][modes] != right[1][modes]).any():
            instants.append(Instant(piece.start, left[0], right[0], left[1], right[1]))
        held.append(piece.held)
        mode.append(piece.mode_of_step + offset)
        instants += piece.instants
        offset += len(piece.held)
        left = piece.final, piece.final_held
    statistics = {k: sum(p.statistics.get(k, 0.0) for p in pieces) for k in pieces[-1].statistics}
    last = pieces[-1]
    return Trajectory(
        np.concatenate([p.times for p in pieces]), np.concatenate([p.sizes for p in pieces]),
        np.concatenate([p.dense for p in pieces]), np.concatenate(held), np.concatenate(mode), last.end, last.final,
        last.final_held, last.states, tuple(instants), last.laws, last.rests, statistics,
        tuple(dict.fromkeys(note for p in pieces for note in p.notes)),
    )  # fmt: skip
