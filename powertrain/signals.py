"""Signals of a compiled model: found by name, pattern or selector, computed on demand for any number of samples."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any, TypeAlias
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.assemble import Compiled, SignalEntry
from powertrain.compiler.binding import bind_parameters
from powertrain.compiler.flat import Flat
from powertrain.compiler.flatten import flatten
from powertrain.engine.trajectory import Samples
from powertrain.errors import ParameterError, PowertrainError, suggestion
from powertrain.language.arguments import names as argument_names
from powertrain.language.component import Component
from powertrain.language.connectors import Signal, of_a_signal
from powertrain.language.reals import Array
from powertrain.language.replacing import replace as changed
from powertrain.language.symbols import Symbol, column, free_symbols, key, scalars
from powertrain.numerics.batch import Lanes, building
from powertrain.numerics.many import Many
from powertrain.numerics.newton import newton

Selector: TypeAlias = "str | Callable[[Any], Any]"
"""The name of a signal, or a function of the model such as ``lambda m: m.J1.w``."""
BLOCK = 64
"""Signals computed together where neighbours share most of their arithmetic."""
_SHARED = 4
"""A block is computed where that takes at most so many times the operations of the signal asked for."""
_LARGEST_BLOCK = 4_000_000
_LARGEST_CORRECTION = 40
_CORRECTIONS = 4
_CLOSE = 1e-7
_ANYWHERE = (0.7, 1.3)
"""Values at which an identity of expressions is tested; with equal ones, terms might cancel by chance."""
_UNCHANGED = 1e-9
"""Change per kelvin that is round-off."""


@dataclass(frozen=True)
class Picked:
    """What a name or a selector asks for; ``name`` is empty for an expression of several signals."""

    name: str
    label: str
    unit: str
    doc: str
    expression: Symbol


class Signals:
    """All signals and parameters of one compiled model. Picklable; every thread builds functions of its own."""

    def __init__(self, compiled: Compiled) -> None:
        dae = compiled.dae
        self.inputs = dae.arguments
        self.residual = dae.residual
        self.entries: dict[str, SignalEntry] = compiled.signals
        self.parameters = {name: (c.unit, c.doc) for name, c in compiled.parameters.items()}
        self._resolve: Callable[[list[Symbol]], list[Symbol]] = compiled.resolve
        self._source: Flat | None = compiled.source
        self._model: Component | None = None
        self._prepare()

    def _prepare(self) -> None:
        self.names = list(self.entries)
        self._place = {name: i for i, name in enumerate(self.names)}
        states, held = scalars(self.inputs[1]), scalars(self.inputs[3])
        self._stored = {key(s): (which, i) for which, each in (("x", states), ("m", held)) for i, s in enumerate(each)}
        self._explicit: dict[str, bool] = {}
        self._local = threading.local()

    @property
    def layout(self) -> tuple[object, ...]:
        """What all compilations of one model share: names of signals and parameters, and the sizes of the arrays of a run."""
        return self.names, list(self.parameters), [s.numel() for s in self.inputs]

    @property
    def source(self) -> Flat:
        """The flat model, whose components are what selectors see."""
        if self._source is None:
            assert self._model is not None
            with building:
                self._source = bind_parameters(flatten(self._model))
        return self._source

    @property
    def model(self) -> Component:
        """The model as the user wrote it."""
        if self._model is None:
            self._model = changed(self.source.model)
        return self._model

    def __getstate__(self) -> dict[str, Any]:
        expressions = [e.expression for e in self.entries.values()]
        with building:
            function = ca.Function("powertrain_packed", list(self.inputs), [column(expressions), self.residual])
        texts = {name: (e.unit, e.doc) for name, e in self.entries.items()}
        return {"function": function, "texts": texts, "parameters": self.parameters, "model": self.model}

    def __setstate__(self, state: dict[str, Any]) -> None:
        function: ca.Function = state["function"]
        self.inputs = tuple(Symbol.sym(name, function.size1_in(i)) for i, name in enumerate("txzmp"))  # type: ignore[assignment]
        expressions, self.residual = function.call(list(self.inputs))
        texts = state["texts"].items()
        pairs = zip(texts, scalars(expressions), strict=True)
        self.entries = {name: SignalEntry(unit, doc, e) for (name, (unit, doc)), e in pairs}
        self.parameters = state["parameters"]
        self._resolve, self._source, self._model = self._by_name, None, state["model"]
        self._prepare()

    def _by_name(self, expressions: list[Symbol]) -> list[Symbol]:
        """``Compiled.resolve`` for what was unpickled without equations: a symbol stands for the signal of its name."""
        known = dict(zip(self.parameters, scalars(self.inputs[4]), strict=True)) | {"time": self.inputs[0]}
        known |= {name: e.expression for name, e in self.entries.items()}
        whole = column(expressions)
        old = [s for s in free_symbols(whole) if s.name() in known]
        (new,) = ca.substitute([whole], [column(old)], [column([known[s.name()] for s in old])])
        return scalars(new)

    def matching(self, patterns: str | Iterable[str], among: Sequence[str] | None = None) -> list[str]:
        """Names that fit one of the patterns (``*``, ``?``), in the model's order; ParameterError for one without."""
        patterns = argument_names("signals", patterns)
        names = self.names if among is None else among
        found: set[str] = set()
        for pattern in patterns:
            fits = {pattern} if pattern in self._place else {n for n in names if fits_pattern(n, pattern)}
            if not fits:
                raise self._unknown(pattern, self.names)
            found |= fits
        return [name for name in names if name in found]

    def _unknown(self, name: str, known: Sequence[str]) -> ParameterError:
        derivative = name.startswith("der(") and name[4:-1] in self.entries
        hint = "; a selector gives derivatives: lambda m: powertrain.der(m.J1.w)" if derivative else ""
        return ParameterError(f"the model has no signal {name}{hint or suggestion(name, known)}")

    def pick(self, what: Selector) -> Picked:
        """The signal or parameter of a name, or what a selector gives. ParameterError where there is none."""
        if not isinstance(what, str):
            return self._selected(what)
        if what in self.entries:
            entry = self.entries[what]
            return Picked(what, what, entry.unit, entry.doc, entry.expression)
        if what in self.parameters:
            unit, doc = self.parameters[what]
            return Picked(what, what, unit, doc, self.inputs[4][list(self.parameters).index(what)])
        raise self._unknown(what, [*self.names, *self.parameters])

    def identity(self, picked: Picked) -> str:
        """A key that tells expressions apart: the name of a signal, else the whole expression, whose label rounds its numbers."""
        return picked.name or str(ca.Function("powertrain_identity", self.inputs, [picked.expression]).serialize())

    def _selected(self, selector: Callable[[Any], Any]) -> Picked:
        if not callable(selector):
            raise ParameterError(f"name a signal by its path or a selector (lambda m: m.J1.w), not by {selector!r}")
        with building, self.source.reading("selector"):
            try:
                picked = selector(self.source.model)
            except AttributeError as error:
                fields = list(getattr(error.obj, "_fields", {}))
                said = f"selector: {type(error.obj).__name__} has no field {error.name}"
                raise ParameterError(
                    f"{said}{suggestion(str(error.name), fields)} (its fields: {', '.join(fields)})"
                ) from None
            except PowertrainError:
                raise
            except Exception as error:
                said = of_a_signal(error) or f"it raises {type(error).__name__}: {error}"
                raise ParameterError(f"selector: {said}") from error
            if isinstance(picked, Signal):
                picked = picked.value
            if isinstance(picked, int | float):
                picked = Symbol(picked)
            if not isinstance(picked, Symbol) or not picked.is_scalar():
                said = f"a selector gives a variable or an expression of variables, not a {type(picked).__name__}"
                raise ParameterError(f"{said}; write lambda m: m.J1.w or lambda m: m.J1.w - m.J2.w")
            if picked.is_symbolic() and (picked.name() in self.entries or picked.name() in self.parameters):
                return self.pick(picked.name())
            text = str(picked)
            if text.startswith("(") and text.endswith(")") and text.count("(") == 1:
                text = text[1:-1]
            return Picked("", text, self._unit(picked), "", self.resolve([picked])[0])

    def _unit(self, expression: Symbol) -> str:
        """The unit of sums and differences of like quantities; else ''."""
        symbols = free_symbols(expression)
        units = {self.entries[s.name()].unit for s in symbols if s.name() in self.entries}
        if len(units) != 1 or any(s.name() not in self.entries for s in symbols):
            return ""
        slopes = ca.jacobian(expression, column(symbols))
        plain = slopes.is_constant() and set(np.abs(np.array(ca.DM(slopes))).ravel()) == {1.0}
        return units.pop() if plain else ""

    def is_temperature_difference(self, expression: Symbol) -> bool:
        """Whether an expression of (t, x, z, m, p) depends on temperatures, but not on whether all of them rise by 1 K."""
        units = {key(e.expression): e.unit for e in self.entries.values() if e.expression.is_symbolic()}
        units |= {key(s): unit for s, (unit, _) in zip(scalars(self.inputs[4]), self.parameters.values(), strict=True)}
        found = [s for s in free_symbols(expression) if units.get(key(s)) == "K"]
        if not found:
            return False
        change = ca.Function("change", self.inputs, [ca.jtimes(expression, column(found), ca.DM.ones(len(found)))])
        anywhere = [np.linspace(*_ANYWHERE, group.numel()) for group in self.inputs]
        return abs(float(change(*anywhere))) < _UNCHANGED

    def resolve(self, expressions: Sequence[Symbol]) -> list[Symbol]:
        """Expressions of the model's variables as expressions of (t, x, z, m, p). ParameterError where that fails."""
        with building:
            found = self._resolve(scalars(self.bound(expressions)))
            inside = {key(s) for group in self.inputs for s in scalars(group)}
            for s in free_symbols(column(found)):
                if key(s) not in inside:
                    said = f"{s.name()} is not a signal of the compiled model"
                    raise ParameterError(f"{said}; declare it as a variable of a component")
            return found

    def bound(self, expressions: Sequence[Symbol]) -> Symbol:
        """Expressions of the model's variables with the values of the parameters that enclosing components set."""
        whole = column(list(expressions))
        if not self.source.bindings:
            return whole
        bindings = self.source.bindings.values()
        return ca.substitute(whole, column([b.constant.symbol for b in bindings]), column([b.value for b in bindings]))

    def compute(self, names: Sequence[str], samples: Samples, p: Array) -> dict[str, Array]:
        """The named signals, and perhaps others that cost nothing more."""
        found: dict[str, Array] = {}
        for name in names:
            if name in found:
                continue
            column_of = self._column(name, samples)
            if column_of is not None:
                found[name] = column_of
                continue
            first = self._place[name] // BLOCK * BLOCK
            block = tuple(self.names[first : first + BLOCK])
            if len(block) * len(samples.t) > _LARGEST_BLOCK or self._nodes(block) > _SHARED * self._nodes((name,)):
                block = (name,)
            values = np.ascontiguousarray(self._evaluator(block)(samples, p).T)
            found.update(zip(block, values, strict=True))
        return found

    def values(self, picked: Picked, samples: Samples, p: Array) -> Array:
        """What was picked, one value per sample."""
        if picked.name in self.entries:
            return self.compute([picked.name], samples, p)[picked.name]
        return self.evaluate([picked.expression], samples, p)[:, 0]

    def explicit(self, name: str) -> bool:
        """Whether a signal follows from states and held values alone, in a model with algebraic unknowns."""
        if name not in self._explicit:
            z = self.inputs[2]
            self._explicit[name] = bool(z.numel()) and not ca.depends_on(self.entries[name].expression, z)
        return self._explicit[name]

    def evaluate(self, expressions: Sequence[Symbol], samples: Samples, p: Array) -> NDArray[np.float64]:
        """Expressions of (t, x, z, m, p), one row per sample."""
        return Lanes(self.inputs, column(list(expressions)))(samples, p)

    def _column(self, name: str, samples: Samples) -> Array | None:
        """A state or held value, which needs no arithmetic."""
        expression = self.entries[name].expression
        if not expression.is_symbolic() or key(expression) not in self._stored:
            return None
        which, i = self._stored[key(expression)]
        return np.ascontiguousarray(getattr(samples, which)[:, i])

    def _nodes(self, block: tuple[str, ...]) -> int:
        return ca.n_nodes(column([self.entries[name].expression for name in block]))

    def _evaluator(self, block: tuple[str, ...]) -> Many:
        known: dict[tuple[str, ...], Many] = self._local.__dict__.setdefault("known", {})
        if block not in known:
            known[block] = Many(self.inputs, column([self.entries[name].expression for name in block]))
        return known[block]

    def corrected(self, samples: Samples, p: Array) -> Samples:
        """Samples whose algebraic unknowns are a few steps of Newton's method better than the dense output's."""
        nz = samples.z.shape[1]
        if not 0 < nz <= _LARGEST_CORRECTION or not len(samples.t):
            return samples
        if "correction" not in self._local.__dict__:
            jacobian = ca.vec(ca.densify(ca.jacobian(self.residual, self.inputs[2]).T))
            self._local.correction = Lanes(self.inputs, ca.cse(ca.vertcat(self.residual, jacobian)))
        correction: Lanes = self._local.correction

        def equations(which: NDArray[np.intp], z: Array) -> tuple[Array, Array]:
            rows = correction(Samples(samples.t[which], samples.x[which], z, samples.m[which]), p)
            return rows[:, nz:].reshape(-1, nz, nz), rows[:, :nz]

        z, _ = newton(equations, samples.z, still=_CLOSE, most=_CORRECTIONS, halvings=1)
        return samples._replace(z=z)


def fits_pattern(name: str, pattern: str) -> bool:
    """Whether ``name`` fits a pattern of ``*`` and ``?``; brackets stand for themselves ('wheels[0].*')."""
    return fnmatchcase(name, pattern.replace("[", "[[]"))


_known: WeakKeyDictionary[Compiled, Signals] = WeakKeyDictionary()


def signals_of(compiled: Compiled) -> Signals:
    """The signals of a compiled model, the same object for every run."""
    if compiled not in _known:
        _known[compiled] = Signals(compiled)
    return _known[compiled]
