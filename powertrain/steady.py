"""Steady operating points of a model on grids of inputs, parameters and prescribed variables.

They are solved from the same compiled equations that are simulated, with the modes of all friction laws, switches and contacts
found together at every point.
"""

from __future__ import annotations

import math
import threading
import time as clock
import weakref
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain.assemble import Compiled
from powertrain.axes import PAD, Grid, make_grid
from powertrain.buffers import Array
from powertrain.component import Component
from powertrain.equilibrium import Asked, formulate, state_of
from powertrain.errors import ParameterError, suggestion
from powertrain.lanes import Rows
from powertrain.operating import DIVERGED, IMMOVABLE, NONE, OK, OUTSIDE, SEVERAL, STUCK_POINT, UNDEFINED, Points, Solver
from powertrain.plant import Plant, compile
from powertrain.rows import RowMap, find_cuts
from powertrain.signals import Picked, Signals, signals_of
from powertrain.walk import Walker

if TYPE_CHECKING:
    import xarray as xr

What: TypeAlias = "str | Callable[[Any], Any]"
STATUS = {
    OK: "ok",
    STUCK_POINT: "stuck",
    SEVERAL: "several_solutions",
    NONE: "no_solution",
    IMMOVABLE: "cannot_move",
    OUTSIDE: "outside_range",
    DIVERGED: "no_convergence",
    UNDEFINED: "undefined_value",
}
_FAST = 2048
_SLOW_BLOCK = 8192
_MOST_LAWS = 62
_KEPT = 16
_SHORT_ROW = 64
_PATIENCE = 2.0


def steady(
    plant: Plant[Any] | Component,
    grid: Mapping[str, ArrayLike],
    *,
    outputs: str | Iterable[What] | Mapping[str, What] | None = None,
    parameters: Mapping[str, float] | None = None,
    inputs: Mapping[str, float] | None = None,
    free: Sequence[str] | None = None,
    guesses: Mapping[str, float] | None = None,
    time: float = 0.0,
    exhaustive: bool = False,
    progress: bool | None = None,
) -> xr.Dataset:
    """Operating points of a model at which nothing accelerates.

    ``grid``: values by name, for inputs, parameters, or variables of the model. A sequence spans a dimension, named by the last part of
    the name; a number holds everywhere; a ``DataArray`` names its own dimensions. ``outputs``: names, patterns or selectors of the
    signals wanted, or a mapping of new names to them; by default all that have a steady value. ``parameters``, ``inputs``: other values
    that hold everywhere. ``free``: inputs or parameters to be found, one for each prescribed variable; by default the inputs without a
    value where there are as many. A prescribed state for which nothing is found is *held*: its own balance is left open, and
    ``der(name)`` says how it would change. ``guesses``: where the search for unknowns begins. ``exhaustive``: try all combinations of
    modes also where unknowns are implicit. ``progress``: a bar; by default for work that takes more than two seconds.

    The result has ``units`` and ``long_name`` on all variables, and a ``status`` at every point. Where the status is ``stuck``, friction
    rests under a prescribed motion, whose torque equilibrium does not determine: ``<name>_low`` and ``<name>_high`` are then the values
    at both ends of the law's bounds. Values at points that are not ``ok`` are nan; ``undefined_value`` concerns the signals that are
    nan there only, such as an efficiency at zero power. ``status_laws`` are the laws that the status is about.

    Raises ParameterError where names or values are wrong, or the conditions do not determine the state.
    """
    plant = plant if isinstance(plant, Plant) else compile(plant)
    spanned = make_grid(grid)
    wanted = _wanted(signals_of(plant.compiled), outputs)
    asked = _asked(plant, spanned, wanted, inputs or {}, free)
    _check_values(plant, spanned, guesses or {})
    map_ = _map(plant, asked, wanted, float(time), dict(guesses or {}))
    common = _common(plant, parameters, inputs or {})
    return map_.run(spanned, common, exhaustive, progress)


@dataclass(frozen=True)
class _Wanted:
    """A signal wanted under a name; ``asked`` by that name, so that it must have a value."""

    name: str
    picked: Picked
    asked: bool


def _wanted(signals: Signals, outputs: Any) -> list[_Wanted]:
    """Every wanted signal."""
    if outputs is None:
        return [_Wanted(n, signals.pick(n), False) for n in signals.names]
    if isinstance(outputs, Mapping):
        return [_Wanted(str(n), signals.pick(what), True) for n, what in outputs.items()]
    listed = [outputs] if isinstance(outputs, str) or callable(outputs) else list(outputs)
    found: dict[str, _Wanted] = {}
    for what in listed:
        if isinstance(what, str) and what not in signals.parameters:
            found |= {n: _Wanted(n, signals.pick(n), n == what) for n in signals.matching(what)}
        else:
            picked = signals.pick(what)
            name = picked.name or picked.label
            found[name] = _Wanted(name, picked, True)
    return list(found.values())


def _asked(
    plant: Plant[Any], grid: Grid, wanted: list[_Wanted], inputs: Mapping[str, float], free: Sequence[str] | None
) -> Asked:
    """Sorts the names of the grid, and decides what is to be found."""
    compiled = plant.compiled
    names = [a.name for a in grid.axes]
    for n in names:
        if n not in compiled.inputs and n not in compiled.parameters and n not in compiled.signals:
            known = [*compiled.inputs, *compiled.parameters, *compiled.signals]
            raise ParameterError(f"grid: the model has no input, parameter or variable {n}{suggestion(n, known)}")
    prescribed = [n for n in names if n not in compiled.inputs and n not in compiled.parameters]
    loose = [n for n in compiled.inputs if n not in names and n not in inputs]
    for n in inputs:
        if n not in compiled.inputs:
            raise ParameterError(f"the model has no input {n}{suggestion(n, compiled.inputs)}")
    states = [n for n in prescribed if state_of(compiled, n) >= 0]
    if free is None:
        free = loose if len(loose) == len(prescribed) else []
    for n in free:
        if n not in compiled.inputs and n not in compiled.parameters:
            raise ParameterError(f"free: the model has no input or parameter {n}{suggestion(n, [*compiled.inputs, *compiled.parameters])}")
        if n in names or n in inputs:
            raise ParameterError(f"free: {n} has a value already, so that it cannot be found")
    missing = len(prescribed) - len(free)
    held = states if len(states) == missing else []
    if missing != len(held):
        raise ParameterError(_miscounted(prescribed, list(free), loose, states))
    return Asked(
        tuple(names),
        tuple(prescribed),
        tuple(held),
        tuple(free),
        tuple(w.picked.expression for w in wanted),
    )


def _miscounted(prescribed: list[str], free: list[str], loose: list[str], states: list[str]) -> str:
    said = f"steady: the grid prescribes {len(prescribed)} variable{'s' * (len(prescribed) != 1)} ({', '.join(prescribed) or 'none'})"
    found = f"{len(free)} input{'s' * (len(free) != 1)} or parameter{'s' * (len(free) != 1)} {'are' if len(free) != 1 else 'is'} to be found"
    hint = f"inputs without a value: {', '.join(loose)}" if loose else "all inputs have a value; a parameter can be found too"
    more = f"; {', '.join(states)} could be held" if states else ""
    return f"{said}, and {found} ({', '.join(free) or 'none'}). Name as many as are prescribed with free=[...] ({hint}{more})"


def _check_values(plant: Plant[Any], grid: Grid, guesses: Mapping[str, float]) -> None:
    for axis in grid.axes:
        constant = plant.compiled.parameters.get(axis.name)
        if constant is not None and axis.name not in plant.compiled.inputs:
            for value in np.unique(axis.values):
                constant.check(float(value), axis.name)
    for name in guesses:
        if name not in plant.compiled.signals and name not in plant.compiled.parameters:
            raise ParameterError(f"guesses: the model has no variable {name}{suggestion(name, plant.compiled.signals)}")


def _common(plant: Plant[Any], parameters: Mapping[str, float] | None, inputs: Mapping[str, float]) -> Array:
    values = {n: u.guess for n, u in plant.compiled.inputs.items()} | {n: float(v) for n, v in inputs.items()}
    return np.concatenate([plant.parameter_vector(parameters), np.array(list(values.values()), float)])


_local = threading.local()


def _map(
    plant: Plant[Any], asked: Asked, wanted: list[_Wanted], time: float, guesses: dict[str, float]
) -> _Map:
    """The prepared map, kept for the next call with the same names."""
    kept: weakref.WeakKeyDictionary[Plant[Any], dict[Any, _Map]] = _local.__dict__.setdefault("maps", weakref.WeakKeyDictionary())
    maps = kept.setdefault(plant, {})
    texts = tuple((w.name, w.asked, w.picked.name or str(w.picked.expression)) for w in wanted)
    names = (asked.axes, asked.held, asked.free)
    identity = (*names, texts, time, tuple(guesses.items()))
    if identity not in maps:
        if len(maps) >= _KEPT:
            maps.clear()
        maps[identity] = _Map(plant, asked, wanted, time, guesses)
    return maps[identity]


@dataclass(frozen=True)
class _Quantity:
    """A variable of the result."""

    name: str
    unit: str
    doc: str


class _Map:
    """One question about a plant: what is given, found and wanted. Solves any grid of it."""

    def __init__(
        self,
        plant: Plant[Any],
        asked: Asked,
        wanted: list[_Wanted],
        time: float,
        guesses: dict[str, float],
    ) -> None:
        compiled = self.compiled = plant.compiled
        self.model = type(plant.model).__name__
        problem = self.problem = formulate(compiled, asked, time, guesses)
        lost = problem.turning
        for w, gone in zip(wanted, lost, strict=True):
            if gone and w.asked:
                raise ParameterError(f"outputs: {w.name} depends on an angle that merely turns, so it has no steady value")
        problem.outputs = [e for e, gone in zip(problem.outputs, lost, strict=True) if not gone]
        self.solver = Solver(problem)
        self.walker = None if problem.u else Walker(problem, self.solver)
        self._rows_map = RowMap(self.walker) if self.walker is not None else None
        self._orders: dict[Any, list[str]] = {}
        self._cuts: dict[Any, list[int] | None] = {}
        self.quantities = [
            _Quantity(w.name, w.picked.unit, w.picked.doc or w.picked.label)
            for w, gone in zip(wanted, lost, strict=True)
            if not gone
        ]
        held = [(n, compiled.signals[n]) for n in asked.held]
        self.quantities += [_Quantity(f"der({n})", rate_unit(e.unit), f"Rate of {n}, which is held") for n, e in held]
        self.laws = [law.name for law in problem.laws] + [g.name for g in problem.guards]
        self.where = [law.where for law in problem.laws] + [g.where for g in problem.guards]

    def run(self, grid: Grid, common: Array, exhaustive: bool, progress: bool | None) -> xr.Dataset:
        """Solves all points of a grid."""
        self.solver.set_common(common)
        fast = self.walker is not None and grid.size >= _FAST
        ordered = self._slowest_first(grid) if fast else grid
        sheet = _Sheet(self, ordered.size)
        bar = _Bar(progress, grid.size)
        if fast and self.walker is not None:
            self.walker.set_common(common)
            finite = self._by_rows(self.walker, sheet, ordered, common, bar)
            if finite is None:
                for first, count, values in ordered.pieces():
                    self._walk(self.walker, sheet, first, count, values, bar)
            if not finite:
                self._look_again(sheet, ordered)
        else:
            for first, count, values in ordered.pieces():
                for low in range(0, count, _SLOW_BLOCK):
                    high = min(low + _SLOW_BLOCK, count)
                    sheet.solve(_block(values, low, high), first + low, exhaustive)
                    bar.reach(first + high)
        bar.close()
        return self._dataset(grid, ordered, sheet)

    def _slowest_first(self, grid: Grid) -> Grid:
        """The grid with those dimensions first along which modes change most."""
        identity = grid.identity()
        if identity not in self._orders:
            shape, rows = grid.sample(512)
            modes = self.solver.solve(rows).modes.reshape(-1, *shape)
            changes = [float((np.diff(modes, axis=i + 1) != 0).any(axis=0).mean() if n > 1 else 0.0) * n for i, n in enumerate(shape)]
            best = sorted(range(len(shape)), key=lambda i: (-changes[i], grid.shape[i] >= _SHORT_ROW, i))
            self._orders = {identity: [grid.dims[i] for i in best]}
            self._cuts.clear()
        return grid.ordered(self._orders[identity])

    def _by_rows(self, walker: Walker, sheet: _Sheet, grid: Grid, common: Array, bar: _Bar) -> bool | None:
        """Fills the map by rows along the last dimension, if only one axis changes along it; whether all is known to be finite."""
        last = [i for i, a in enumerate(grid.axes) if grid.dims[-1] in a.dims]
        if len(last) != 1 or grid.axes[last[0]].dims != (grid.dims[-1],) or grid.shape[-1] < _SHORT_ROW:
            return None
        fast, x = last[0], np.ascontiguousarray(grid.axes[last[0]].values)
        slow = grid.rows(fast)

        def points(rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Rows:
            values = np.insert(slow[:, rows], fast, x[columns], axis=0)
            found = self.solver.solve(values)
            for k in np.flatnonzero(found.status == OK)[:: max(1, rows.size // 64)]:
                walker.enter(found.modes[:, k])
            return found.modes

        identity = grid.identity()
        if identity not in self._cuts:
            self._cuts[identity] = find_cuts(slow.shape[1], x.size, points)
        cuts = self._cuts[identity]
        if cuts is None:
            return None

        def rest(row: int, first: int, end: int) -> None:
            count = end - first
            values = [np.full(count + PAD, v) for v in np.insert(slow[:, row], fast, 0.0)]
            values[fast][:count], values[fast][count:] = x[first:end], x[end - 1]
            start = row * x.size + first
            part = sheet.apart(count)
            self._walk(walker, part, 0, count, values, None)
            sheet.put(start, part)

        assert self._rows_map is not None
        return self._rows_map.fill(fast, x, slow, cuts, common, sheet.rows, rest, bar.reach)

    def _walk(self, walker: Walker, sheet: _Sheet, first: int, count: int, values: list[Array], bar: _Bar | None) -> None:
        results = [row[first:] for row in sheet.rows]

        def careful(low: int, high: int) -> Array | None:
            return sheet.solve(_block(values, low, high), first + low)

        walker.walk(count, values, results, careful, (lambda i: None) if bar is None else (lambda i: bar.reach(first + i)))

    def _look_again(self, sheet: _Sheet, grid: Grid) -> None:
        """Points with values that are not finite are solved one by one, which says why."""
        suspects: NDArray[np.bool_] | None = None
        for row in sheet.rows:
            part = row[: grid.size]
            if not math.isfinite(float(np.add.reduce(part))):
                suspects = ~np.isfinite(part) if suspects is None else suspects | ~np.isfinite(part)
        if suspects is None:
            return
        where = np.flatnonzero(suspects & (sheet.status == OK))
        for low in range(0, where.size, _SLOW_BLOCK):
            some = where[low : low + _SLOW_BLOCK]
            sheet.solve_at(grid.at(some), some)

    def _dataset(self, grid: Grid, ordered: Grid, sheet: _Sheet) -> xr.Dataset:
        import xarray as xr

        from powertrain import __version__

        turn = [ordered.dims.index(d) for d in grid.dims]

        def shaped(flat: NDArray[Any]) -> NDArray[Any]:
            return flat[: grid.size].reshape(ordered.shape).transpose(turn)

        data: dict[str, Any] = {}
        coords: dict[str, Any] = {}
        for axis in grid.axes:
            unit, doc = _described(self.compiled, axis.name)
            name = axis.dims[0] if len(axis.dims) == 1 and axis.dims[0] == axis.name.rpartition(".")[2] else axis.name
            coords[name] = (axis.dims, axis.values, {"units": unit, "long_name": doc or axis.name, "signal": axis.name})
        low_high = sheet.intervals
        for k, q in enumerate(self.quantities):
            if q.name in coords:
                continue
            attributes = {"units": q.unit, "long_name": q.doc or q.name}
            data[q.name] = (grid.dims, shaped(sheet.rows[k]), attributes)
            if low_high is not None:
                for end, rows, text in (("low", low_high[0], "least"), ("high", low_high[1], "greatest")):
                    said = {**attributes, "long_name": f"{attributes['long_name']}, {text} possible value"}
                    data[f"{q.name}_{end}"] = (grid.dims, shaped(rows[k]), said)
        data["status"] = (grid.dims, shaped(sheet.status), _flags())
        if sheet.blame is not None:
            data["status_laws"] = (grid.dims, shaped(sheet.blame), self._law_flags())
        attributes = {"model": self.model, "powertrain_version": __version__, "problems": self._problems(sheet, grid.size)}
        return xr.Dataset(data, coords=coords, attrs=attributes)

    def _law_flags(self) -> dict[str, Any]:
        masks = np.array([1 << k for k in range(min(len(self.laws), _MOST_LAWS))], np.int64)
        named = " ".join(n.replace(" ", "_") for n in self.laws[:_MOST_LAWS])
        return {"units": "1", "long_name": "Laws that the status is about", "flag_masks": masks, "flag_meanings": named}

    def _problems(self, sheet: _Sheet, size: int) -> str:
        """What is wrong at how many points, in words."""
        status, lines = sheet.status[:size], []
        for code, text in _PROBLEMS.items() if status.any() else ():
            hit = status == code
            if not hit.any():
                continue
            said = f"{int(hit.sum())} of {size} points: {text}"
            if sheet.blame is not None:
                bits = int(np.bitwise_or.reduce(sheet.blame[:size][hit]))
                laws = [f"{n} ({w})" for k, (n, w) in enumerate(zip(self.laws, self.where, strict=True)) if k < _MOST_LAWS and bits >> k & 1]
                said += f": {', '.join(laws[:6])}" if laws else ""
            lines.append(said)
        if self.walker is not None and self.walker.unchecked:
            lines.append("too many laws depend on each other to check that solutions are unique")
        return "\n".join(lines)


_PROBLEMS = {
    STUCK_POINT: "friction rests under a prescribed motion, its torque is not determined, the interval is given",
    SEVERAL: "several solutions (the laws hold each other in more than one way, or nothing determines an unknown)",
    NONE: "no combination of modes is consistent; the laws lock themselves, what is prescribed cannot be in equilibrium",
    IMMOVABLE: "cannot move: a speed or ratio is infinite",
    OUTSIDE: "a quantity is outside its range",
    DIVERGED: "the search for the unknowns did not converge; give guesses, or look whether an equilibrium exists",
    UNDEFINED: "a signal has no value there, such as an efficiency at zero power",
}


def _flags() -> dict[str, Any]:
    named = " ".join(STATUS.values())
    return {"units": "1", "long_name": "Status of the operating point", "flag_values": np.array(list(STATUS), np.int8), "flag_meanings": named}


class _Sheet:
    """The results of all points, flat, in the order of the walk; with room for what is written beyond the end."""

    def __init__(self, owner: _Map, size: int) -> None:
        self.solver, self.count = owner.solver, len(owner.quantities)
        self.size, self._owner = size, owner
        self.rows = [np.empty(size + PAD) for _ in range(self.count)]
        self.status = np.zeros(size, np.int8)
        self.blame: NDArray[np.int64] | None = None
        self._ends: list[tuple[NDArray[np.intp], Rows, Rows]] = []

    def solve(self, grid: Rows, first: int, exhaustive: bool = False) -> Array | None:
        """Solves consecutive points; returns the modes of the last good one."""
        return self.solve_at(grid, first + np.arange(grid.shape[1]), exhaustive)

    def solve_at(self, grid: Rows, places: NDArray[np.intp], exhaustive: bool = False) -> Array | None:
        """Solves some points and writes them."""
        points = self.solver.solve(grid, exhaustive=exhaustive)
        values, left = self.solver.values(grid, points)
        status = points.status
        resting = (status == OK) & points.rest.any(axis=0)
        if resting.any():
            where = np.flatnonzero(resting)
            low, high, solved = self._both_ends(grid[:, where], points, where, exhaustive)
            status[where] = np.where(solved, STUCK_POINT, NONE)
            points.blame[:, where] = points.rest[:, where]
            self._ends.append((places[where[solved]], low[:, solved], high[:, solved]))
        outside = (status == OK) & left.any(axis=0)
        status[outside] = OUTSIDE
        undefined = (status == OK) & ~np.isfinite(values).all(axis=0)
        status[undefined] = UNDEFINED
        values[:, (status != OK) & ~undefined] = np.nan
        values[:, undefined] = np.where(np.isfinite(values[:, undefined]), values[:, undefined], np.nan)
        for row, found in zip(self.rows, values, strict=True):
            row[places] = found
        self.status[places] = status
        self._note(places, np.vstack([points.blame, left & outside]), status)
        good = np.flatnonzero(status == OK)
        return points.modes[:, good[-1]].copy() if good.size else None

    def _both_ends(self, grid: Rows, points: Points, where: NDArray[np.intp], exhaustive: bool) -> tuple[Rows, Rows, NDArray[np.bool_]]:
        """Least and greatest values over the ends of the bounds of the laws at rest, and whether all ends can be."""
        laws = np.flatnonzero(points.rest[:, where].any(axis=1))
        low = np.full((self.count, where.size), np.inf)
        high, solved = -low, np.ones(where.size, bool)
        for ends in product((1.0, -1.0), repeat=min(len(laws), 8)):
            side = np.ones((points.modes.shape[0], where.size))
            side[laws[:8]] = np.array(ends)[:, None]
            end = self.solver.solve(grid, side, exhaustive)
            values, _ = self.solver.values(grid, end)
            solved &= end.status == OK
            low, high = np.minimum(low, values), np.maximum(high, values)
        return low, high, solved

    def _note(self, places: NDArray[np.intp], blame: NDArray[np.bool_], status: NDArray[np.int8]) -> None:
        hit = (status != OK) & (status != UNDEFINED) & blame.any(axis=0)
        if not hit.any():
            return
        if self.blame is None:
            self.blame = np.zeros(self.size, np.int64)
        weights = np.array([1 << k if k < _MOST_LAWS else 0 for k in range(len(blame))], np.int64)
        self.blame[places[hit]] = weights @ blame[:, hit]

    def apart(self, size: int) -> _Sheet:
        """An empty sheet of the same signals."""
        return _Sheet(self._owner, size)

    def put(self, first: int, part: _Sheet) -> None:
        """Takes over a part of the points."""
        last = first + part.size
        for row, values in zip(self.rows, part.rows, strict=True):
            row[first:last] = values[: part.size]
        self.status[first:last] = part.status
        if part.blame is not None:
            if self.blame is None:
                self.blame = np.zeros(self.size, np.int64)
            self.blame[first:last] = part.blame
        self._ends += [(places + first, low, high) for places, low, high in part._ends]

    @property
    def intervals(self) -> tuple[list[Array], list[Array]] | None:
        """Least and greatest values at all points, where some point is stuck."""
        if not self._ends:
            return None
        both = ([r[: self.size].copy() for r in self.rows], [r[: self.size].copy() for r in self.rows])
        for places, low, high in self._ends:
            for rows, values in zip(both, (low, high), strict=True):
                for row, value in zip(rows, values, strict=True):
                    row[places] = value
        return both


def _described(compiled: Compiled, name: str) -> tuple[str, str]:
    """Unit and meaning of an input, a parameter or a variable."""
    if name in compiled.inputs:
        return compiled.inputs[name].unit, compiled.inputs[name].doc
    if name in compiled.parameters:
        return compiled.parameters[name].unit, compiled.parameters[name].doc
    return compiled.signals[name].unit, compiled.signals[name].doc


def rate_unit(unit: str) -> str:
    """The unit of a rate: 'rad/s' -> 'rad/s2', 'rad' -> 'rad/s'."""
    return f"{unit[:-2]}/s2" if unit.endswith("/s") else f"{unit}/s"


def _block(values: Sequence[Array], low: int, high: int) -> Rows:
    return np.array([v[low:high] for v in values]).reshape(len(values), high - low)


class _Bar:
    """A progress bar over points: always, never, or (None) for what takes more than two seconds."""

    def __init__(self, wanted: bool | None, total: int) -> None:
        self._wanted, self._total, self._bar = wanted, total, None
        self._start = clock.perf_counter()

    def reach(self, count: int) -> None:
        """The number of points that are done."""
        if self._wanted is False:
            return
        if self._bar is None and (self._wanted or clock.perf_counter() - self._start > _PATIENCE):
            from tqdm.auto import tqdm

            self._bar = tqdm(total=self._total, unit=" points", desc="steady")
        if self._bar is not None:
            self._bar.update(count - self._bar.n)

    def close(self) -> None:
        """The end."""
        if self._bar is not None:
            self._bar.close()
