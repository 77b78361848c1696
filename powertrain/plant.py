"""The compiled model a user holds: built once, run many times with other parameters, starts and inputs."""

from __future__ import annotations

import pickle
import threading
from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar, get_args

import numpy as np
from numpy.typing import ArrayLike

from powertrain.compiler.assemble import Compiled, compile_model
from powertrain.dae.hybrid import TimeSignal
from powertrain.engine.failure import OUTSIDE
from powertrain.engine.options import InputValue, compile_option, longest_step, run_span, run_times, scheduled
from powertrain.engine.prepared import Compile, Method
from powertrain.engine.schedules import Schedules
from powertrain.engine.simulator import Simulator
from powertrain.errors import InitializationError, ParameterError, SimulationError, suggestion
from powertrain.initialization.conditions import start_values
from powertrain.initialization.initial import Initializer
from powertrain.initialization.report import InitialReport, with_notes
from powertrain.interruption import interruptible
from powertrain.language import htmltext
from powertrain.language.arguments import (
    by_name,
    number,
    numbers_by_name,
    one_of,
    options_checked,
    tolerances,
)
from powertrain.language.arguments import path as argument_path
from powertrain.language.component import Component
from powertrain.language.packing import packed_model
from powertrain.language.readonly import ReadOnlyValues
from powertrain.language.reals import Array
from powertrain.nonfinite import explain
from powertrain.present import Bar, Watch, told, watcher
from powertrain.result import Result
from powertrain.signals import signals_of

if TYPE_CHECKING:
    from powertrain.native.driver import Begun, CModel
    from powertrain.optimal.dynamics import Dynamics
    from powertrain.running import Running

M = TypeVar("M", bound=Component)
_USUAL = 10.0
"""The span [s] for which the method of an export is chosen."""


class Plant(Generic[M]):
    """A model compiled to a hybrid DAE. It can be pickled (and is compiled again when it is unpickled) and used from several threads."""

    def __init__(self, model: M) -> None:
        self.model: M = model
        self.compiled: Compiled = compile_model(model)
        self._defaults = np.array([c.value for c in self.compiled.parameters.values()])
        self._position = {name: i for i, name in enumerate(self.compiled.parameters)}
        self.compiled.limits.check(self._defaults)
        self._local = threading.local()

    def __reduce__(self) -> tuple[Any, ...]:
        return _unpacked, (packed_model(self.model),)

    def __repr__(self) -> str:
        c = self.compiled
        return f"Plant({type(self.model).__name__}: {len(c.states)} states, {len(c.parameters)} parameters, {len(c.inputs)} inputs)"

    def _repr_html_(self) -> str:
        c, units = self.compiled, self.compiled.signals
        states = [(name, units[name].unit, units[name].doc) for name in c.states if name in units]
        inputs = [(name, given.unit, given.doc) for name, given in c.inputs.items()]
        values = [(name, f"{p.value:g}", p.unit, p.doc) for name, p in c.parameters.items()]
        counts = f"{type(self.model).__name__}: {len(c.states)} states, {len(values)} parameters, {len(inputs)} inputs"
        return (
            htmltext.heading("Plant", counts)
            + htmltext.folded("states", htmltext.table(("state", "unit", "meaning"), states))
            + htmltext.folded("inputs", htmltext.table(("input", "unit", "meaning"), inputs))
            + htmltext.folded("parameters", htmltext.table(("parameter", "value", "unit", "meaning"), values))
        )

    @property
    def parameters(self) -> dict[str, float]:
        """Names and values of all parameters that can be changed between runs, by ``simulate(parameters=...)``."""
        values = {name: c.value for name, c in self.compiled.parameters.items()}
        return ReadOnlyValues(values, "pass other values to the run: simulate(..., parameters={...})")

    def parameter_vector(self, parameters: Mapping[str, float] | None = None, *, together: bool = True) -> Array:
        """All parameter values with the given ones replaced; ParameterError for unknown names and values outside their range.

        ``together``: also check the conditions between parameters.
        """
        p = self._defaults.copy()
        for name, value in by_name("parameters", parameters).items():
            if name not in self._position:
                raise ParameterError(f"the model has no parameter {name}{suggestion(name, self._position)}")
            p[self._position[name]] = self.compiled.parameters[name].check(value, name)
        if together:
            self.compiled.limits.check(p)
        return p

    @property
    def limited(self) -> set[str]:
        """The parameters on which bound parameters and conditions of ``check()`` depend."""
        return self.compiled.limits.names

    def check_together(self, names: Sequence[str], sets: Array, parameters: Mapping[str, float] | None = None) -> None:
        """ParameterError for values of the named parameters, one set per column, that contradict each other or the rest."""
        p = np.repeat(self.parameter_vector(parameters, together=False)[:, None], sets.shape[1], axis=1)
        p[[self._position[name] for name in names]] = sets
        self.compiled.limits.check(p)

    @interruptible()
    def simulate(
        self,
        stop: float | str,
        *,
        start: float | str = 0.0,
        parameters: Mapping[str, float] | None = None,
        starts: Mapping[str, float] | None = None,
        guesses: Mapping[str, float] | None = None,
        inputs: Mapping[str, InputValue] | None = None,
        times: ArrayLike | None = None,
        points: int = 500,
        rtol: float = 1e-6,
        atol: float | None = None,
        max_step: float = np.inf,
        method: Method = "auto",
        compile: Compile = False,
        record: Sequence[str] | None = None,
        progress: bool | Watch = False,
    ) -> Result[M]:
        """Simulate from ``start`` to ``stop``.

        Parameters
        ----------
        stop : float or str
            End of the simulated time [s], also as text such as "10 min".
        start : float or str, optional
            Its start.
        parameters : mapping of str to float, optional
            Values that replace those of the model, by name, in SI units.
        starts : mapping of str to float, optional
            Initial values of variables, by name, in SI units or as texts with a unit. Variables without a start begin at zero; if they
            cannot all do so, ``result.notes`` says which value would settle the start.
        guesses : mapping of str to float, optional
            Values from which the initial conditions are solved.
        inputs : mapping, optional
            Inputs of the model by name: a number, or (times [s], values), linear between them; a repeated time is a jump. An input that
            is not given has its default; without one it is zero, which ``result.notes`` says.
        times : array_like, optional
            Output times [s] besides those of the events.
        points : int
            Number of output intervals where no ``times`` are given.
        rtol, atol : float
            Tolerances of the states; ``atol`` counts in their nominal sizes and is by default equal to ``rtol``.
        max_step : float
            Largest step [s].
        method : {"auto", "dopri5", "rodas5p"}
            Explicit Runge-Kutta or Rosenbrock method; by default the stiffness of the model decides.
        compile : bool or "background"
            Use the C compiler of the machine; "background": while this run goes on, for the runs that begin when it is done.
        record : sequence of str, optional
            Names or patterns of the signals to keep; by default all.
        progress : bool or callable
            A progress bar, or a function that is given the run at the time reached (``pt.Present``): at the start, ten times a second,
            and at the end.

        Returns
        -------
        Result
            Signals, events and statistics of the run.

        Raises
        ------
        ParameterError
            For unknown names and values out of range.
        InitializationError
            If the initial conditions have no solution.
        SimulationError
            If the run ends early; the run so far is its ``result``.

        Examples
        --------
        >>> plant.simulate(10.0, parameters={"body.m": 1500}, inputs={"pedal": ([0, 1], [0, 0.5])})  # doctest: +SKIP
        """
        start, stop = run_span(start, stop)
        grid = run_times(start, stop, times, points)
        max_step, (rtol, atol) = longest_step(max_step, stop), tolerances(rtol, atol)
        p = self.parameter_vector(parameters)
        if record is not None:
            signals_of(self.compiled).matching(record)
        engine = self._engine(method, compile)
        given = by_name("inputs", inputs)
        x, z, m, report = self._begun(engine, start, p, given, starts, guesses)
        knots = {s.name: (s.times, s.values) for s in self._schedules(given) if s.name in given}
        shown = watcher(progress, start, stop)
        watch = told(self.compiled, p, shown)
        try:
            trajectory = engine.run(
                x, p, m, z, start=start, stop=stop, rtol=rtol, atol=atol, max_step=max_step, progress=watch
            )
        except InitializationError as error:
            raise with_notes(error, report.notes) from None
        except SimulationError as error:
            if error.result is not None:
                reached = error.result
                if OUTSIDE in str(error):
                    why = explain(self.compiled, reached.end, reached.final, reached.final_held, p)
                    error.args = (f"{error}{why and chr(10) + '  '}{why}",)
                error.result = Result(self.compiled, reached, grid, p, report, record, str(error), knots)
            raise
        finally:
            if isinstance(shown, Bar):
                shown.close()
        return Result(self.compiled, trajectory, grid, p, report, record, inputs=knots)

    def initialize(
        self,
        t: float = 0.0,
        parameters: Mapping[str, float] | None = None,
        starts: Mapping[str, float] | None = None,
        guesses: Mapping[str, float] | None = None,
        inputs: Mapping[str, InputValue] | None = None,
    ) -> tuple[Array, Array, Array, InitialReport]:
        """Determine the state at the start of a run, with all modes.

        Parameters
        ----------
        t : float
            Time [s].
        parameters, starts, guesses, inputs
            As for ``simulate``.

        Returns
        -------
        tuple
            States, algebraic unknowns and held values, and the ``InitialReport``.

        Raises
        ------
        ParameterError
            For unknown names and values out of range.
        InitializationError
            If the initial conditions have no solution.
        """
        t = number("t", t, "s")
        engine, p = self._engine("auto", False), self.parameter_vector(parameters)
        x, z, m, report = self._begun(engine, t, p, by_name("inputs", inputs), starts, guesses)
        try:
            return (*engine.resolve(t, x, z, m, p), report)
        except InitializationError as error:
            raise with_notes(error, report.notes) from None

    def function(
        self,
        outputs: str | Callable[[Any], Any] | Sequence[str | Callable[[Any], Any]] = (),
        inputs: str | Sequence[str] | None = None,
        modes: Mapping[str, float] | tuple[Result[Any], float] | None = None,
    ) -> Dynamics:
        """The equations in given modes as a ``casadi.Function`` of (t, x, z, u, p), with names, units and the limits of the modes.

        ``outputs``: names or selectors of signals; ``inputs``: inputs of the model or parameters that become u, by default all inputs;
        ``modes``: modes of the laws by name (friction: 1 forward, 0 stuck, -1 backward, 2 free; contacts and switches: 1 or 0;
        switches that are not named keep their initial mode), or (result, t) for the modes and the state of a run at t.
        Discrete variables keep the values they have there; signals of time remain signals of time.

        Raises ParameterError for unknown names and missing modes.
        """
        from powertrain.optimal.dynamics import dynamics

        return dynamics(self, outputs, inputs, modes)

    def start(
        self,
        t: float = 0.0,
        *,
        parameters: Mapping[str, float] | None = None,
        starts: Mapping[str, float] | None = None,
        guesses: Mapping[str, float] | None = None,
        inputs: Mapping[str, InputValue] | None = None,
        rtol: float = 1e-6,
        atol: float | None = None,
        max_step: float = np.inf,
        method: Method = "auto",
        compile: Compile = False,
        record: bool = True,
    ) -> Running[M]:
        """Start a run that is advanced step by step.

        Use ``run.step(0.01, throttle=0.3)``, ``run["engine.w"]``, ``run.state`` and ``run.result()``.

        Parameters
        ----------
        t : float
            Time of the start [s].
        parameters, starts, guesses, rtol, atol, max_step, method, compile
            As for ``simulate``.
        inputs : mapping, optional
            Inputs by name; they keep their values until ``step`` gives others.
        record : bool
            False keeps only the present state.

        Returns
        -------
        Running

        Raises
        ------
        ParameterError, InitializationError
            As ``simulate``.
        """
        from powertrain.running import Running, State

        t, given = number("t", t, "s"), by_name("inputs", inputs)
        max_step, (rtol, atol) = longest_step(max_step, t), tolerances(rtol, atol)
        x, z, m, report = self.initialize(t, parameters, starts, guesses, given)
        signals = tuple(s for s in self._schedules(given) if s.name in given or s.name not in self.compiled.inputs)
        options = {"rtol": rtol, "atol": atol, "max_step": max_step, "record": record}
        unset = frozenset(n for n, u in self.compiled.inputs.items() if n not in given and not u.declared)
        state, p = State(t, x, z, m, signals, unset), self.parameter_vector(parameters)
        return Running(self.compiled, lambda: self._engine(method, compile), state, p, report, options)

    def export_c(
        self,
        folder: str | PathLike[str],
        *,
        method: Method = "auto",
        start: float = 0.0,
        parameters: Mapping[str, float] | None = None,
        starts: Mapping[str, float] | None = None,
        guesses: Mapping[str, float] | None = None,
        inputs: Mapping[str, InputValue] | None = None,
    ) -> CModel[M]:
        """Write the model as C99 source that runs without Python and without allocation: steps, events, modes and loop.

        Parameters
        ----------
        folder
            Where the files go; those of an earlier export are replaced.
        method
            "dopri5" (not stiff, no algebraic unknowns) or "rodas5p"; "auto" takes what a run of ten seconds would begin with.
        start, parameters, starts, guesses, inputs
            As for ``simulate``: the start [s] that ``pt_start`` loads.

        Returns
        -------
        CModel
            Compiles the files and runs them from Python; its results are those of ``simulate`` to rounding.

        Raises
        ------
        ParameterError
            For models with contacts or with more than 100 unknowns.
        """
        from powertrain.native.code import refuse, write
        from powertrain.native.driver import CModel

        target, engine = Path(argument_path("folder", folder)), self._engine(method, False)
        refuse(engine)
        begun = self._begin(start, parameters, starts, guesses, inputs)
        engine.resolve(start, *begun[:4])
        chosen = engine.first_method(_USUAL)
        write(target, self.compiled, engine, chosen, float(start), begun)
        return CModel(self.compiled, target, chosen, self._begin)

    def _begin(self, start: float, parameters: Any, starts: Any, guesses: Any, inputs: Any) -> Begun:
        """A consistent start of a run, for drivers in other languages."""
        from powertrain.native.driver import Begun

        given = by_name("inputs", inputs)
        x, z, m, report = self.initialize(start, parameters, starts, guesses, given)
        return Begun(x, z, m, self.parameter_vector(parameters), report, self._schedules(given))

    def _engine(self, method: Method, compiled: Compile) -> Simulator:
        one_of("method", method, get_args(Method))
        key = method, compile_option(compiled)
        engines: dict[tuple[str, Compile], Simulator] = self._local.__dict__.setdefault("engines", {})
        if key not in engines:
            with interruptible():
                engines[key] = Simulator(self.compiled.dae, *key)
        return engines[key]

    def _begun(
        self, engine: Simulator, t: float, p: Array, inputs: Mapping[str, InputValue], starts: Any, guesses: Any
    ) -> tuple[Array, Array, Array, InitialReport]:
        """States, algebraic unknowns and held values at the start, and the report. The engine gets the time signals of this run."""
        if "initializer" not in self._local.__dict__:
            self._local.initializer = Initializer(self.compiled)
        initializer: Initializer = self._local.initializer
        held, schedules = self.compiled.dae.held_start.copy(), self._schedules(inputs)
        if self.compiled.inputs:
            engine.schedules = Schedules(schedules)
        if engine.schedules:
            engine.schedules.enter(held, t)
        given = start_values(self.compiled, starts), numbers_by_name("guesses", guesses)
        return initializer.solve(engine, t, p, held, *given)

    def _schedules(self, inputs: Mapping[str, InputValue]) -> list[TimeSignal]:
        """The signals of time of a run with these inputs."""
        for name in inputs:
            if name not in self.compiled.inputs:
                hint = suggestion(name, self.compiled.inputs)
                if name in self.compiled.parameters:
                    hint = f'; it is a parameter, with one value for a run: parameters={{"{name}": ...}}'
                raise ParameterError(f"the model has no input {name}{hint}")
        units = {name: given.unit for name, given in self.compiled.inputs.items()}
        return [scheduled(s, inputs, units.get(s.name, "1")) for s in self.compiled.dae.schedules]


def compile(model: M) -> Plant[M]:  # noqa: A001
    """Compile a model once; the plant runs it with other parameters, initial values and inputs without compiling again."""
    return Plant(model)


def plant_of(model: M | Plant[M]) -> Plant[M]:
    """A plant, or the plant of a model that is not compiled yet."""
    return model if isinstance(model, Plant) else Plant(model)


def _unpacked(packed: bytes) -> Plant[Any]:
    return compile(pickle.loads(packed))


def simulate(model: M | Plant[M], stop: float | str, **options: Any) -> Result[M]:
    """Compile ``model``, unless it is a plant, and simulate it to ``stop`` (s); options as for ``Plant.simulate``."""
    return plant_of(model).simulate(stop, **options)


if not TYPE_CHECKING:
    Plant.simulate = options_checked(Plant.simulate)
    Plant.start = options_checked(Plant.start)
