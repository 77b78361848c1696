"""Steady operating points of a model on grids of inputs, parameters and prescribed variables.

They are solved from the same compiled equations that are simulated, with the modes of all friction laws, switches and contacts
found together at every point.
"""

from __future__ import annotations

import threading
import weakref
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from powertrain.equilibrium.placed import Request, state_of
from powertrain.equilibrium.system import formulate
from powertrain.errors import ParameterError, suggestion
from powertrain.interruption import interruptible
from powertrain.language.arguments import by_name, flag, listed, names, number, numbers_by_name, text
from powertrain.language.component import Component
from powertrain.language.labelled import check_stated, check_unit
from powertrain.language.reals import Array
from powertrain.language.units import rate_unit
from powertrain.plant import Plant, plant_of
from powertrain.signals import Picked, Selector, Signals, signals_of
from powertrain.steadystate.axes import Grid, make_grid
from powertrain.steadystate.dataset import dataset, described
from powertrain.steadystate.results import DataVariable, Look
from powertrain.steadystate.steady_map import SteadyMap

if TYPE_CHECKING:
    import xarray as xr

T = TypeVar("T")
_KEPT = 16


@interruptible()
def steady(
    plant: Plant[Any] | Component,
    grid: Mapping[str, ArrayLike],
    *,
    outputs: str | Iterable[Selector] | Mapping[str, Selector] | None = None,
    parameters: Mapping[str, float] | None = None,
    inputs: Mapping[str, float] | None = None,
    free: Sequence[str] | None = None,
    held: Sequence[str] | None = None,
    guesses: Mapping[str, float] | None = None,
    time: float = 0.0,
    first: bool = False,
    side: Literal[-1, 1] | None = None,
    compile: bool = False,
    progress: bool | None = None,
) -> xr.Dataset:
    """Operating points of a model, at which nothing accelerates.

    If only modes are unknown, all combinations consistent with the known signs are tried. If speeds, inputs or parameters
    are implicit, modes and unknowns are solved together, starting from the values of the model and with the laws sliding forward and
    backward; a solution that none of these starts reaches is missed. The size of the grid changes nothing but the time a point takes.
    An operating point may be unstable: a motion that begins near it need not end there.

    The result has ``units`` and ``long_name`` on all variables, and a ``status`` at every point. If the status is ``stuck``, friction
    is at rest under a prescribed motion, and equilibrium does not determine its torque: ``<name>_low`` and ``<name>_high`` are then the
    least and the greatest value for all torques between the law's bounds, infinite where the signal has a pole between them. Values at
    all other points that are not ``ok`` are nan; ``undefined_value`` refers to signals that are nan only there, such as an efficiency
    at zero power. ``status_laws`` are the laws that the status refers to; the attribute ``problems`` explains it in words, and
    ``notes`` says where tables of the model have other values than the points.

    Parameters
    ----------
    plant : Plant or Component
        The model.
    grid : mapping of str to array_like
        Values of inputs, parameters or variables by name. A sequence spans a dimension, named by the last part of the name, or by the
        whole name if the last part is that of another result; a number holds at all points; a ``DataArray`` names its own dimensions, and
        its ``units``, if it has any, must be the model's. Discrete variables that are not given keep their start values.
    outputs : str, iterable or mapping, optional
        Names, patterns or selectors of signals, or a mapping of new names to them; by default all signals with a steady value, and
        what is ``free``.
    parameters, inputs : mapping of str to float, optional
        Other values for all points.
    free : sequence of str, optional
        Inputs or parameters to be solved for, one for each prescribed variable; by default the inputs without a value if their number
        matches. A prescribed state without a free quantity is *held*: its own balance is not required, and ``der(name)`` is its rate of
        change.
    held : sequence of str, optional
        The held states, if not all prescribed states are held.
    guesses : mapping of str to float, optional
        Values of variables near the solution that is looked for. The search starts there, and also where a run would start.
    time : float
        Time [s] at which time-dependent sources are evaluated.
    first : bool
        If there are several solutions, return one; laws at rest are preferred to sliding laws, then what the guesses lead to.
    side : {-1, 1}, optional
        At ``stuck`` points: return the values at one end of the interval, with the torque of forward (1) or backward (-1) motion.
    compile : bool
        Use the C compiler of the machine; worthwhile for many points. The results are the same.
    progress : bool, optional
        Show a progress bar; by default for computations of more than two seconds.

    Returns
    -------
    xarray.Dataset
        The outputs over the dimensions of the grid, and their ``status``.

    Raises
    ------
    ParameterError
        If names or values are wrong, or if the conditions do not determine the state.
    PowertrainError
        If ``compile`` finds no C compiler, or if it fails.

    Examples
    --------
    >>> pt.steady(axle, {"left.w": 10.0, "torque": [50.0, 100.0]}, outputs="*.tau")  # doctest: +SKIP
    """
    if side is not None and number("side", side) not in (1, -1):
        raise ParameterError(f"side = {side!r} must be 1 or -1, or None for intervals")
    look = Look(side, flag("first", first))
    plant, t = plant_of(plant), number("time", time, "s")
    q = question(plant, grid, outputs, parameters, inputs, free, guesses, held, t)
    map_ = steady_map(plant, q, flag("compile", compile))
    ordered, results = map_.run(q.grid, look, None if progress is None else flag("progress", progress))
    return dataset(plant, q.grid, q.common, map_, ordered, results)


@dataclass(frozen=True)
class Wanted:
    """A signal requested under a name; if ``asked`` by that name, it must have a value."""

    name: str
    picked: Picked
    asked: bool


@dataclass(frozen=True)
class Question:
    """A request to a model. ``common`` are the values of all parameters, then of all inputs; values on the grid replace them."""

    grid: Grid
    wanted: list[Wanted]
    asked: Request
    common: Array


def question(
    plant: Plant[Any],
    grid: Any,
    outputs: Any,
    parameters: Any,
    inputs: Any,
    free: Any,
    guesses: Any,
    held: Any = None,
    time: float = 0.0,
) -> Question:
    """The request in the arguments; ParameterError for wrong names and values."""
    given, guessed = numbers_by_name("inputs", inputs), numbers_by_name("guesses", guesses)
    found, kept = (None if n is None else names(w, n) for w, n in (("free", free), ("held", held)))
    wanted = wanted_signals(signals_of(plant.compiled), outputs, found or ())
    spanned = make_grid(grid, {w.name for w in wanted})
    asked = replace(asked_for(plant, spanned, wanted, given, found, kept), guesses=guessed, time=time)
    _check_names(spanned, wanted)
    for name in given:
        check_unit(f"inputs: {name}", inputs[name], plant.compiled.inputs[name].unit)
    _check_values(plant, spanned, guessed, by_name("parameters", parameters))
    values = {n: u.value for n, u in plant.compiled.inputs.items()} | given
    common = np.concatenate(
        [plant.parameter_vector(parameters, together=False), np.array(list(values.values()), float)]
    )
    return Question(spanned, wanted, asked, common)


def wanted_signals(signals: Signals, outputs: Any, free: Sequence[str]) -> list[Wanted]:
    """Every wanted signal; by default all of them, and the parameters that are found."""
    if outputs is None:
        solved = [n for n in free if n in signals.parameters]
        return [Wanted(n, signals.pick(n), False) for n in [*signals.names, *solved]]
    if isinstance(outputs, Mapping):
        return [Wanted(text("outputs", n), signals.pick(what), True) for n, what in outputs.items()]
    found: dict[str, Wanted] = {}
    for what in [outputs] if callable(outputs) else listed("outputs", outputs):
        if isinstance(what, str) and what not in signals.parameters:
            found |= {n: Wanted(n, signals.pick(n), n == what) for n in signals.matching(what)}
        else:
            picked = signals.pick(what)
            name = picked.name or picked.label
            found[name] = Wanted(name, picked, True)
    return list(found.values())


def asked_for(
    plant: Plant[Any],
    grid: Grid,
    wanted: list[Wanted],
    inputs: Mapping[str, float],
    free: Sequence[str] | None,
    held: Sequence[str] | None,
) -> Request:
    """Classify the names on the grid, and decide what is to be found."""
    compiled = plant.compiled
    names = [a.name for a in grid.axes]
    _known(
        "grid: the model has no input, parameter or variable",
        names,
        compiled.inputs,
        compiled.parameters,
        compiled.signals,
    )
    _known("the model has no input", inputs, compiled.inputs)
    values = compiled.inputs.keys() | compiled.parameters.keys() | compiled.discretes.keys()
    prescribed = [n for n in names if n not in values]
    loose = [n for n in compiled.inputs if n not in names and n not in inputs]
    states = [n for n in prescribed if state_of(compiled, n) >= 0]
    if free is None:
        free = loose if len(loose) == len(prescribed) else []
    _known("free: the model has no input or parameter", free, compiled.inputs, compiled.parameters)
    for n in free:
        if n in names or n in inputs:
            raise ParameterError(f"free: {n} already has a value, so it cannot be solved for")
    _once("free", free)
    missing = len(prescribed) - len(free)
    if held is None:
        held = states if len(states) == missing else []
    _known("held: the grid prescribes no state", held, states)
    _once("held", held)
    if missing != len(held):
        raise ParameterError(_miscounted(prescribed, list(free), loose, states))
    return Request(
        tuple(names),
        tuple(prescribed),
        tuple(held),
        tuple(free),
        tuple(w.picked.expression for w in wanted),
    )


def _known(problem: str, names: Iterable[str], *known: Iterable[str]) -> None:
    """ParameterError if a name is none of those that are ``known``."""
    choices = [name for some in known for name in some]
    for n in names:
        if n not in choices:
            raise ParameterError(f"{problem} {n}{suggestion(n, choices)}")


def _once(argument: str, names: Sequence[str]) -> None:
    for n in names:
        if names.count(n) > 1:
            raise ParameterError(f"{argument}: {n} appears twice")


def _miscounted(prescribed: list[str], free: list[str], loose: list[str], states: list[str]) -> str:
    said = f"steady: the grid prescribes {_count(prescribed, 'variable')}, and {_count(free, 'input or parameter')} to be found"
    hint = (
        f"inputs without a value: {', '.join(loose)}"
        if loose
        else "all inputs have a value; a parameter can be found too"
    )
    more = f"; {', '.join(states)} could be held" if states else ""
    return f"{said}. Name as many as are prescribed with free=[...] ({hint}{more})"


def _count(names: list[str], what: str) -> str:
    """'2 variables (a, b)', '1 variable (a)', 'no variable'."""
    if not names:
        return f"no {what}"
    return f"{len(names)} {what}{'s' * (len(names) != 1)} ({', '.join(names)})"


def _check_names(grid: Grid, wanted: list[Wanted]) -> None:
    """A coordinate must not take the place of a result, nor a result that of another."""
    own, status = {a.coordinate: a.name for a in grid.axes}, {"status", "status_laws"}
    for w in wanted:
        if w.name in status or own.get(w.name, w.picked.name) != w.picked.name:
            other = "a variable that every map has" if w.name in status else f"the coordinate for {own[w.name]}"
            raise ParameterError(
                f'outputs: {w.name} is also the name of {other}; choose another one: outputs={{"another_name": ...}}'
            )
    results = {w.name for w in wanted} - own.keys()
    for axis in grid.axes:
        for n in axis.coords.keys() & results | {*axis.coords, *axis.dims} & status:
            raise ParameterError(
                f"grid: {axis.name} has a coordinate {n}, which is also the name of a result; rename or drop it"
            )


def _check_values(plant: Plant[Any], grid: Grid, guesses: Mapping[str, float], parameters: Mapping[str, float]) -> None:
    for axis in grid.axes:
        check_stated(f"grid: {axis.name}", axis.unit, described(plant.compiled, axis.name)[0])
        constant = plant.compiled.parameters.get(axis.name)
        if constant is not None and axis.name not in plant.compiled.inputs:
            for value in np.unique(axis.values):
                constant.check(float(value), axis.name)
    plant.check_together(*grid.of([a for a in grid.axes if a.name in plant.limited]), parameters)
    for name in guesses:
        if name not in plant.compiled.signals and name not in plant.compiled.parameters:
            raise ParameterError(f"guesses: the model has no variable {name}{suggestion(name, plant.compiled.signals)}")


_local = threading.local()


def kept(
    plant: Plant[Any], kind: str, q: Question, more: Hashable, valid: Callable[[T], bool], make: Callable[[], T]
) -> T:
    """The prepared form of a question, kept for the next call with the same names; functions serve one thread."""
    plants: weakref.WeakKeyDictionary[Plant[Any], dict[Any, Any]] = _local.__dict__.setdefault(
        kind, weakref.WeakKeyDictionary()
    )
    asked, others = q.asked, plants.setdefault(plant, {})
    texts = tuple((w.name, w.asked, w.picked.name or str(w.picked.expression)) for w in q.wanted)
    identity = (asked.axes, asked.held, asked.free, tuple(asked.guesses.items()), asked.time, texts, more)
    found: T | None = others.get(identity)
    if found is None or not valid(found):
        found = make()
        if len(others) >= _KEPT:
            others.clear()
        others[identity] = found
    return found


def steady_map(plant: Plant[Any], q: Question, compile: bool = False) -> SteadyMap:
    """The prepared map with the values of the question, kept for the next call with the same names."""
    values = q.common[: len(plant.compiled.parameters)]
    map_ = kept(plant, "maps", q, compile, lambda m: m.valid(values), lambda: _prepared(plant, q, values, compile))
    map_.problem.common.set(q.common)
    return map_


def _prepared(plant: Plant[Any], q: Question, parameters: Array, compile: bool) -> SteadyMap:
    signals, asked, wanted = plant.compiled.signals, q.asked, q.wanted
    problem = formulate(plant.compiled, asked, parameters)
    for w, lost in zip(wanted, problem.turning, strict=True):
        if lost and w.asked:
            raise ParameterError(f"outputs: {w.name} depends on an angle that only rotates, so it has no steady value")
    steady_ones = [k for k, lost in enumerate(problem.turning) if not lost]
    problem = replace(problem, outputs=[problem.outputs[k] for k in steady_ones])
    quantities = [
        DataVariable(w.name, w.picked.unit, w.picked.doc or w.picked.label) for w in (wanted[k] for k in steady_ones)
    ]
    quantities += [
        DataVariable(f"der({n})", rate_unit(signals[n].unit), f"Rate of {n}, which is held") for n in asked.held
    ]
    return SteadyMap(problem, quantities, parameters, frozenset(plant.compiled.parameters), compile)
