"""What a simulation gives: signals by name or selector, events, reports; on to pandas, xarray, files and plots."""

from __future__ import annotations

import html
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from os import PathLike
from pathlib import Path
from reprlib import repr as short
from typing import TYPE_CHECKING, Any, Generic, TypeAlias, TypeVar, cast, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain import export
from powertrain.compiler.assemble import Compiled, compile_model
from powertrain.engine.trajectory import COUNTED, Samples, Trajectory
from powertrain.errors import ModelError, ParameterError
from powertrain.events import EventTable
from powertrain.language import htmltext
from powertrain.language.arguments import array, text, writing
from powertrain.language.component import Component
from powertrain.language.connectors import Signal
from powertrain.language.quantities import converted
from powertrain.language.readonly import ReadOnlyValues
from powertrain.language.reals import Array, sealed
from powertrain.language.symbols import Symbol
from powertrain.language.units import with_unit
from powertrain.signals import Picked, signals_of

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes

M = TypeVar("M", bound=Component)
Selector: TypeAlias = Callable[[M], Symbol | Signal]
What: TypeAlias = str | Callable[[M], Symbol | Signal]
Several: TypeAlias = list[str] | list[Callable[[M], Symbol | Signal]] | tuple[What[M], ...]

LISTED = 60
"""Signals in the HTML of a result."""


class Result(Generic[M]):
    """A simulated run of a model ``M``.

    ``result["J1.w"]`` is a signal as an array over ``result.time``: the requested times, and every event twice, with its left and
    right limits. ``result[lambda m: m.J1.w]`` is the same with the fields of the model, which editors check and complete;
    expressions such as ``lambda m: m.J1.w - m.J2.w`` work too. Signals that are not states are computed when they are
    requested. Arrays are read-only.

    ``ok`` is False if the run ended early; ``message`` gives the reason, and the result holds the run so far. Results can be pickled.
    """

    report: Any
    """How the start was found: the conditions that were used and the states they gave."""
    inputs: dict[str, tuple[Array, Array]]
    """The inputs that were given: times (s) and values of their knots."""

    def __init__(
        self,
        compiled: Compiled,
        trajectory: Trajectory,
        times: ArrayLike,
        p: Array,
        report: Any,
        record: str | Sequence[str] | None = None,
        message: str = "",
        inputs: Mapping[str, tuple[Array, Array]] | None = None,
    ) -> None:
        self._signals = signals_of(compiled)
        self._compiled: Compiled | None = compiled
        self._trajectory: Trajectory | None = trajectory
        self._times, self._p = np.array(times, float).ravel(), p
        self.report, self.message, self.inputs = report, message, dict(inputs or {})
        self._values: dict[str, Array] = {}
        self._record: tuple[str, ...] | None = None
        if record is not None:
            self._keep(record)

    def _keep(self, record: str | Sequence[str]) -> None:
        """Computes what is to be kept and lets go of the rest."""
        names = self._signals.matching(record)
        values = self._signals.compute(names, self._samples, self._p)
        self._values = {name: sealed(values[name].copy()) for name in names}
        self._record = tuple(names)
        self.__dict__ |= {name: getattr(self, name) for name in ("time", "events", "statistics", "notes", "modes")}
        del self.__dict__["_samples"], self.__dict__["_dense"]
        self._trajectory = None

    def recorded(self, record: str | Sequence[str]) -> Result[M]:
        """The same run with only samples of the signals of the given names and patterns, as from ``simulate(record=...)``."""
        return Result(
            self.compiled, self.trajectory, self._times, self._p, self.report, record, self.message, self.inputs
        )

    def detached(self) -> dict[str, Any]:
        """The numbers of the run without its model, small and fast to pickle; ``attached`` turns them into a result again."""
        return {name: value for name, value in self.__getstate__().items() if name != "_signals"}

    @classmethod
    def attached(cls, numbers: dict[str, Any], compiled: Compiled) -> Result[M]:
        """A result from the output of ``detached`` in another process, for the same model compiled in this one."""
        result = cls.__new__(cls)
        result.__setstate__({**numbers, "_signals": signals_of(compiled), "_compiled": compiled})
        return result

    def __getstate__(self) -> dict[str, Any]:
        left_out = {"_dense", "_samples", "_compiled"} | (set() if self._record is not None else {"_values", "time"})
        state = {name: value for name, value in self.__dict__.items() if name not in left_out}
        return state | {"_compiled": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update({"_values": {}, **state})

    @property
    def ok(self) -> bool:
        """Whether the run reached its end."""
        return not self.message

    @cached_property
    def time(self) -> Array:
        """The instants of all samples in seconds; an instant with an event appears twice."""
        return sealed(self._dense.t.copy())

    @cached_property
    def _dense(self) -> Samples:
        """The samples as the dense output gives them."""
        asked = self._times
        if not self.ok:
            asked = np.append(asked[asked < self.trajectory.end], self.trajectory.end)
        return self.trajectory.at(asked, with_events=True)

    @cached_property
    def _samples(self) -> Samples:
        return self._signals.corrected(self._dense, self._p)

    @property
    def p(self) -> Array:
        """The values of the parameters, in the order of ``parameters``."""
        return self._p

    def samples_at(self, times: ArrayLike) -> Samples:
        """Times of the run with states, algebraic unknowns and held values; at the instant of an event the right limit."""
        return self._signals.corrected(self.trajectory.at(times, with_events=False), self._p)

    @property
    def samples(self) -> Samples:
        """Times, states, algebraic unknowns and held values at ``time``, for analyses of this run."""
        self.trajectory  # noqa: B018  (says what is missing where only samples were kept)
        return self._samples

    @cached_property
    def events(self) -> EventTable:
        """The events: which law changed, when and how; prints as a table."""
        return EventTable(self.trajectory.events)

    @cached_property
    def statistics(self) -> dict[str, float]:
        """Numbers of steps, rejected steps and instants with events, and the model's own counts."""
        return dict(self.trajectory.statistics)

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """What to know about this result.

        What is not unique: its start, or the torque of friction at rest; inputs without a value, which are zero; tables that keep the
        parameters of the model; quantities that left the range of the model, with the number of steps outside.
        """
        missing = {n: u.unit for n, u in self.compiled.inputs.items() if n not in self.inputs and not u.declared}
        zero = (
            f"the input {n} is {with_unit('0', unit)}, because it was given no value" for n, unit in missing.items()
        )
        return (*self.report.notes, *self.trajectory.notes, *zero, *_outside(self.statistics))

    @cached_property
    def modes(self) -> dict[str, str]:
        """The kind of law for every signal that is a mode."""
        return {name: kind for _, name, kind in self.trajectory.laws if name in self._signals.entries}

    @property
    def model(self) -> M:
        """The simulated model."""
        return cast("M", self._signals.model)

    @property
    def compiled(self) -> Compiled:
        """The compiled model, for analyses of this run. A pickled result compiles its model again."""
        if self._compiled is None:
            compiled, here = compile_model(self.model), self._signals
            if signals_of(compiled).layout != here.layout:
                raise ParameterError(
                    "the result was pickled with another version of powertrain or of the model; simulate again"
                )
            self._compiled = compiled
        return self._compiled

    @property
    def trajectory(self) -> Trajectory:
        """The accepted steps with their dense output."""
        if self._trajectory is None:
            raise ParameterError("record=... keeps only samples of the named signals; simulate without it to keep all")
        return self._trajectory

    @cached_property
    def parameters(self) -> dict[str, float]:
        """The parameters of this run by name."""
        values = dict(zip(self._signals.parameters, self._p.tolist(), strict=True))
        return ReadOnlyValues(values, "simulate again with other parameters")

    @property
    def units(self) -> dict[str, str]:
        """The unit of every signal."""
        return {name: self._signals.entries[name].unit for name in self._kept}

    @property
    def _kept(self) -> Sequence[str]:
        return self._signals.names if self._record is None else self._record

    def names(self, pattern: str = "*") -> list[str]:
        """Signals whose names match: ``result.names("clutch1.*")``."""
        return self._signals.matching(pattern, self._kept)

    def description(self, what: What[M]) -> str:
        """The description of a signal or parameter."""
        return self._pick(what).doc

    def label(self, what: What[M]) -> str:
        """The name of a signal, or the text of a selector's expression."""
        return self._pick(what).label

    def unit(self, what: What[M]) -> str:
        """The unit of a signal, of a parameter, or of sums and differences of like signals; '' if it is unknown."""
        return self._pick(what).unit

    def converted(self, what: What[M], unit: str) -> Array:
        """The values of a signal in another unit: ``result.converted("body.v", "km/h")``.

        A signal in K that would not change if all temperatures of the model rose by 1 K is a difference of temperatures: 20 K are 20 degC
        or 36 degF. Other signals in K are temperatures; leave a difference to one without a unit, such as the output of a block, in K.
        Errors: ModelError for an unknown unit, for a unit of another quantity, and for an expression whose unit is unknown.
        """
        unit, values, own = text("unit", unit), np.asarray(self[what]), self.unit(what)
        if not own:
            raise ModelError(f"the unit of {self._pick(what).label} is unknown; convert the signals in it")
        if own == "K" and self._signals.is_temperature_difference(self._pick(what).expression):
            return converted(values, own, unit) - converted(0.0, own, unit)
        return converted(values, own, unit)

    def __contains__(self, name: object) -> bool:
        return name in self._signals.entries and (self._record is None or name in self._record)

    def __iter__(self) -> Iterator[str]:
        return iter(self._kept)

    def __getitem__(self, what: What[M]) -> Array:
        if isinstance(what, str):
            if what in self._values:
                return self._values[what]
            if self._record is None and what in self._signals.entries:
                return self._columns([what])[what]
            if what == "time" and what not in self._signals.entries:
                return self.time
        picked = self._pick(what)
        if picked.name in self._signals.entries:
            return self._columns([picked.name])[picked.name]
        if picked.expression.is_constant() or picked.name:
            value = self.parameters[picked.name] if picked.name else float(picked.expression)
            return sealed(np.full(len(self.time), value))
        return sealed(self._expressions([picked.expression])[:, 0])

    def signal(self, what: What[M]) -> Array:
        """``result[what]`` as a call: pyright and editors follow selectors into calls, but not into brackets."""
        return self[what]

    def _columns(self, names: Sequence[str]) -> dict[str, Array]:
        missing = [name for name in names if name not in self._values]
        explicit = [name for name in missing if self._signals.explicit(name)] if "_samples" not in self.__dict__ else []
        if explicit:
            found = self._signals.compute(explicit, self._dense, self._p)
            self._values |= {name: sealed(found[name]) for name in explicit}
            missing = [name for name in missing if name not in self._values]
        if missing:
            found = self._signals.compute(missing, self._samples, self._p)
            self._values |= {name: sealed(values) for name, values in found.items()}
        return {name: self._values[name] for name in names}

    def _pick(self, what: What[M]) -> Picked:
        picked = self._signals.pick(what)
        if self._record is not None and picked.name not in self._record and picked.name not in self._signals.parameters:
            kept = ", ".join(self._record[:8]) + (", ..." if len(self._record) > 8 else "")
            raise ParameterError(f"{picked.label} was not recorded: record=... kept {kept}")
        return picked

    def evaluate(self, expressions: Sequence[Symbol]) -> NDArray[np.float64]:
        """Expressions of the model's variables (symbols of ``compiled.source``) over the samples, one column each."""
        if not isinstance(expressions, Sequence) or not all(isinstance(e, Symbol) for e in expressions):
            raise ParameterError(
                f"expressions = {short(expressions)}: pass a list of expressions; signals and selectors are read by result[...]"
            )
        return self._expressions(self._signals.resolve(expressions))

    def _expressions(self, expressions: Sequence[Symbol]) -> NDArray[np.float64]:
        self.trajectory  # noqa: B018  (says what is missing where only samples were kept)
        return self._signals.evaluate(expressions, self._samples, self._p)

    @overload
    def at(self, t: float, what: What[M]) -> float: ...
    @overload
    def at(self, t: Sequence[float] | NDArray[np.floating], what: What[M]) -> Array: ...
    @overload
    def at(self, t: float, what: Several[M]) -> dict[str, float]: ...
    @overload
    def at(self, t: Sequence[float] | NDArray[np.floating], what: Several[M]) -> dict[str, Array]: ...
    def at(self, t: Any, what: Any) -> Any:
        """Values at any time of the run from the dense output; at the instant of an event its right limit.

        ``t``: one time or several, in seconds; ``what``: one name or selector, or several (then a dictionary is returned).
        Raises ParameterError for a time outside the run.
        """
        times = self.trajectory.within("t = ", array("t", t))
        several = isinstance(what, list | tuple)
        picked = [self._pick(w) for w in (what if several else [what])]
        samples = self.samples_at(times.ravel())
        values = self._at_samples(picked, samples)
        shaped = {name: v.reshape(times.shape) if times.ndim else float(v[0]) for name, v in values.items()}
        return shaped if several else next(iter(shaped.values()))

    def _at_samples(self, picked: Sequence[Picked], samples: Samples) -> dict[str, Array]:
        found = self._signals.compute([p.name for p in picked if p.name in self._signals.entries], samples, self._p)
        others = [p for p in picked if p.name not in found]
        if others:
            rows = self._signals.evaluate([p.expression for p in others], samples, self._p)
            found |= {p.label: rows[:, k] for k, p in enumerate(others)}
        return {p.label: found[p.name or p.label] for p in picked}

    def _table(self, patterns: tuple[str, ...]) -> dict[str, tuple[Array, str, str]]:
        names = self._signals.matching(patterns, self._kept) if patterns else self._kept
        for name in patterns:
            if name in self._signals.entries:
                self._pick(name)
        entries = self._signals.entries
        return {name: (values, entries[name].unit, entries[name].doc) for name, values in self._columns(names).items()}

    def to_xarray(self, *names: str) -> xr.Dataset:
        """All signals, or those of the given names and patterns, over ``time``, each with ``units`` and ``long_name``.

        Instants with events appear twice in ``time``. Attributes: model, powertrain_version, parameters, events (JSON).
        """
        known = export.attributes(type(self.model).__name__, self.parameters, self.events, self.message)
        return export.dataset(self.time, self._table(names), self.modes, known)

    def to_dataframe(self, *names: str) -> pd.DataFrame:
        """All signals, or those of the given names and patterns, over time; ``attrs["units"]`` are their units."""
        return export.frame(self.time, self._table(names))

    def save(self, path: str | PathLike[str], *names: str) -> None:
        """Write ``to_xarray(*names)`` to a netCDF file (.nc), which ``load`` reads, or ``to_dataframe(*names)`` to a .csv file.

        netCDF requires ``powertrain[netcdf]``. ParameterError for other file name extensions, and for a file that cannot be written.
        """
        is_csv = export.suffix(path) == ".csv"
        with writing(path):
            if is_csv:
                self.to_dataframe(*names).to_csv(path)
            else:
                export.save(self.to_xarray(*names), path)

    def netcdf(self, *names: str, **attributes: str) -> bytes:
        """The content of a classic netCDF file of ``to_xarray(*names)``, with additional attributes."""
        known = export.attributes(type(self.model).__name__, self.parameters, self.events, self.message)
        return export.classic(self.time, self._table(names), self.modes, {**known, **attributes})

    def plot(self, *what: What[M], ax: Axes | None = None, events: bool | str = False) -> Axes:
        """Signals over time in one Axes; see ``powertrain.figures.plot.plot_signals``."""
        from powertrain.figures.plot import plot_signals

        return plot_signals(self, *what, ax=ax, events=events)

    def explore(self, file: str | PathLike[str] | None = None, *signals: str) -> Path:
        """The interactive page of the run as an HTML file, opened in the browser unless ``file`` is given; see ``pt.explore``."""
        from powertrain import explore

        return explore(self, file, *signals)

    def __repr__(self) -> str:
        said = "" if self.ok else f", ended early: {self.message.splitlines()[0]}"
        return f"Result({self._summary()}{said})"

    def _summary(self) -> str:
        time, n, events = self.time, len(self._kept), len(self.events)
        span = f"{time[0]:g} .. {time[-1]:g} s, {len(time)} samples" if len(time) else "no samples"
        counts = f"{n} signal{'s' * (n != 1)}, {events} event{'s' * (events != 1)}"
        return f"{type(self.model).__name__}: {span}, {counts}"

    def _repr_html_(self) -> str:
        entries = self._signals.entries
        rows = [(name, entries[name].unit, entries[name].doc) for name in self._kept[:LISTED]]
        more = f"<p>… {len(self._kept) - LISTED} more: <code>result.names()</code></p>" * (len(self._kept) > LISTED)
        said = "" if self.ok else f"<p><b>Ended early:</b></p><pre>{html.escape(self.message)}</pre>"
        notes = "".join(f"<p>{html.escape(note)}</p>" for note in self.notes)
        return (
            htmltext.heading("Result", self._summary())
            + f"{said}{notes}"
            + htmltext.folded("events", self.events._repr_html_())
            + htmltext.folded("signals", htmltext.table(("signal", "unit", "meaning"), rows) + more)
        )

    def _ipython_key_completions_(self) -> list[str]:
        return list(self._kept)


def _outside(statistics: Mapping[str, float]) -> list[str]:
    """A sentence for each quantity that left its range."""
    counts = {name.removeprefix(COUNTED): n for name, n in statistics.items() if name.startswith(COUNTED) and n}
    return [
        f"{n:.0f} of {statistics['steps']:.0f} steps were outside the range of the model: {name}"
        for name, n in counts.items()
    ]
