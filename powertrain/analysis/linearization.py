"""Linear models at an operating point: der(x) = A x + B u, y = C x + D u, for the modes that the laws have there."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from reprlib import repr as short
from typing import TYPE_CHECKING, Any, TypeAlias
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.analysis.perturbation import ORDER, Perturbed, compile_perturbed, spots
from powertrain.analysis.reduction import Matrices, free_motion, substitute_inputs
from powertrain.compiler.assemble import Compiled
from powertrain.errors import ModelError, ParameterError, suggestion
from powertrain.language.arguments import by_name, listed, number
from powertrain.language.component import Component
from powertrain.language.connectors import Output
from powertrain.language.recorder import reading
from powertrain.language.symbols import Symbol, column, free_symbols
from powertrain.plant import Plant
from powertrain.result import Result
from powertrain.signals import Picked, Samples, signals_of

if TYPE_CHECKING:
    from powertrain.analysis.linear_model import LinearModel

Array = NDArray[np.float64]
Selector: TypeAlias = "str | Callable[[Any], Any]"
Point: TypeAlias = "Mapping[str, float] | tuple[Result[Any], float]"


def linearize(
    plant: Plant[Any] | Component,
    inputs: Sequence[Selector] | None = None,
    outputs: Sequence[Selector] | None = None,
    *,
    at: Point | None = None,
    parameters: Mapping[str, float] | None = None,
) -> LinearModel:
    """The linear model at an operating point: a ``control.StateSpace`` with named states, inputs and outputs, and ``linearization``.

    ``inputs``: by default the inputs of the model. Possible are an input of the model; any signal port, to which the linear input is added
    ("torque.tau"); a flow of a port, as an external torque or force on the component ("J1.flange_a.tau"); a parameter, whose
    column is the effect of another constant value.
    ``outputs``: any signals; by default the outputs of the model or, if it has none, its states. Both accept names and selectors
    (``lambda m: m.J1.w``).
    ``at``: values as for ``simulate(starts=...)``, which may include inputs of the model and "time" (s); or ``(result, t)``, with
    the right limit at an event. ``parameters``: other values, as for ``simulate``.

    Modes are those of the operating point: stuck friction and closed contacts remove states. The change of sources over time is not part of
    the linear model. If derivatives of an input occur, the states are shifted by a multiple of the input (see ``Linearization``).

    Raises ParameterError for unknown names; ModelError if an output depends on the derivative of an input, if derivatives are not
    finite, or if the algebraic equations are singular.
    """
    plant = plant if isinstance(plant, Plant) else Plant(plant)
    signals = signals_of(plant.compiled)
    point = _operating_point(plant, at, parameters)
    driven = (
        list(plant.compiled.inputs)
        if inputs is None
        else [s if isinstance(s, str) else signals.pick(s).label for s in listed("inputs", inputs)]
    )
    shown = _default_outputs(plant.compiled) if outputs is None else listed("outputs", outputs)
    if not driven:
        raise ParameterError(
            'the model has no inputs; name what drives the linear model, e.g. inputs=["source.y"] (a signal port) '
            'or inputs=["shaft.flange_a.tau"] (an external torque)'
        )
    return _linearizer(plant, tuple(driven), shown).at(point)


def free_response(
    plant: Plant[Any], outputs: Sequence[Selector], at: Point | None, parameters: Mapping[str, float] | None
) -> tuple[NDArray[np.float64], NDArray[np.float64], tuple[str, ...]]:
    """A and C of der(x) = A x, y = C x at an operating point, and the names of y; arguments and errors as for ``linearize``."""
    point, linearizer = _operating_point(plant, at, parameters), _linearizer(plant, (), outputs)
    reduced = linearizer.reduced(point)[0]
    return reduced.a, reduced.c, linearizer.outputs


def _linearizer(plant: Plant[Any], inputs: tuple[str, ...], outputs: Sequence[Selector]) -> _Linearizer:
    """The derivatives for this choice, built once for a plant."""
    signals = signals_of(plant.compiled)
    kept = _kept.setdefault(plant, {})
    key = (inputs, tuple(signals.pick(s).label for s in outputs))
    if key not in kept:
        kept[key] = _Linearizer(plant, inputs, outputs)
    return kept[key]


@dataclass(frozen=True)
class _Point:
    t: float
    x: Array
    z: Array
    m: Array
    p: Array


def _operating_point(plant: Plant[Any], at: Point | None, parameters: Mapping[str, float] | None) -> _Point:
    if not isinstance(at, tuple):
        values = dict(by_name("at", at))
        t = number("at: time", values.pop("time", 0.0), "s")
        given = {n: values.pop(n) for n in list(values) if n in plant.compiled.inputs}
        x, z, m, _ = plant.initialize(t, parameters, values, inputs=given)
        return _Point(t, x, z, m, plant.parameter_vector(parameters))
    if len(at) != 2 or not isinstance(at[0], Result):
        raise ParameterError(f"at = {short(at)}: pass values by name, or (result, t) with a result of this model")
    result, t = at[0], number("at: t", at[1], "s")
    if parameters is not None:
        raise ParameterError("at=(result, t) takes the parameters of the result; leave parameters out")
    trajectory, p = result.trajectory, result.parameters
    same = type(result.model) is type(plant.model) and list(p) == list(plant.compiled.parameters)
    if not same or trajectory.states != len(plant.compiled.states):
        raise ParameterError(f"at=(result, t): the result belongs to another model ({type(result.model).__name__})")
    if not trajectory.start <= t <= trajectory.end:
        raise ParameterError(
            f"at: t = {t:g} s lies outside the simulated span [{trajectory.start:g}, {trajectory.end:g}] s"
        )
    vector = np.array(list(p.values()), float)
    samples = signals_of(plant.compiled).corrected(Samples(*trajectory.at([t], with_events=False)), vector)
    return _Point(float(t), samples.x[0], samples.z[0], samples.m[0], vector)


def _default_outputs(compiled: Compiled) -> list[str]:
    root = compiled.flat.components[0]
    ports = [port._path for port in root.__dict__.values() if isinstance(port, Output)]
    return ports or [name for name in compiled.states if name in compiled.signals]


_kept: WeakKeyDictionary[Plant[Any], dict[tuple[tuple[str, ...], tuple[str, ...]], _Linearizer]] = WeakKeyDictionary()


class _Linearizer:
    """The derivatives of one model for one choice of inputs and outputs, built once."""

    def __init__(self, plant: Plant[Any], inputs: tuple[str, ...], outputs: Sequence[Selector]) -> None:
        original = plant.compiled
        self.model, self.original, self.inputs = plant.model, original, inputs
        self.parameters = [n for n in inputs if n in original.parameters]
        self.driven = [n for n in inputs if n not in original.parameters]
        self._refuse_unknown()
        perturbed = (
            compile_perturbed(plant.model, self.driven)
            if self.driven
            else Perturbed(original, Symbol.sym("reference"), (), {})
        )
        self.compiled = perturbed.compiled
        self.picked: list[Picked] = [signals_of(self.compiled).pick(s) for s in outputs]
        self.outputs = tuple(p.label for p in self.picked)
        self._refuse_twice("inputs", inputs)
        self._refuse_twice("outputs", self.outputs)
        self.transfer = _transfer(original, self.compiled)
        self.values = self._derivatives(perturbed)

    def _refuse_unknown(self) -> None:
        known = spots(self.original.flat)
        for name in self.driven:
            if name not in known:
                near = suggestion(name, [*known, *self.original.parameters])
                raise ParameterError(
                    f"inputs: the model has no input, signal port, flow of a port or parameter {name}{near}"
                )

    def _refuse_twice(self, kind: str, names: Sequence[str]) -> None:
        if len(set(names)) < len(names):
            raise ParameterError(f"{kind}: {next(n for n in names if names.count(n) > 1)} appears twice")

    def _derivatives(self, perturbed: Perturbed) -> ca.Function:
        """Values and Jacobian of (xdot, residual, outputs, motions that laws may hold) by (x, z, parameters, u_0, u_1, ...)."""
        dae, compiled = self.compiled.dae, self.compiled
        outputs = [p.expression + perturbed.added.get(p.name, 0) for p in self.picked]
        self.holding = [f for f in dae.frictions if not f.algebraic and not f.prescribed]
        motions = [f.w for f in self.holding] + [e for c in dae.contacts for e in (c.speed, c.gap)]
        p = {name: dae.p[i] for i, name in enumerate(compiled.parameters)}
        coefficients = [c for k in range(ORDER + 1) for c in (row[k] for row in perturbed.coefficients)]
        rows = column([*_scalars(dae.xdot), *_scalars(dae.residual), *outputs, *motions])
        columns = column([*_scalars(dae.x), *_scalars(dae.z), *(p[n] for n in self.parameters), *coefficients])
        jacobian = ca.jacobian(rows, columns)
        kinematic = ca.jacobian(dae.xdot, dae.x)
        at = ca.vertcat(dae.t, dae.x, dae.z, dae.m, column(coefficients))
        self.kinematic = np.array([_constant(kinematic[i, :], at) for i in range(dae.x.numel())], bool)
        known = [dae.t, dae.x, dae.z, dae.m, dae.p, perturbed.reference, column(coefficients)]
        self.extra = len(coefficients)
        return ca.Function("powertrain_linear", known, [ca.densify(rows), ca.densify(jacobian)])

    def at(self, point: _Point) -> LinearModel:
        """The linear model at an operating point."""
        return self._state_space(*self.reduced(point), point)

    def reduced(self, point: _Point) -> tuple[Matrices, NDArray[np.int64], NDArray[np.float64], Array]:
        """Its matrices, which of the states they have, what of the inputs is taken out of these, and the values of all states."""
        x, z = self.transfer(point)
        values, jacobian = self.values(point.t, x, z, point.m, point.p, point.t, np.zeros(self.extra))
        full = self._matrices(np.array(values, float).ravel(), np.array(jacobian, float), z.size)
        proper, gains = substitute_inputs(full, self._improper)
        held = self._held(point.m)
        self._refuse_moved(proper.v[0][held])
        reduced, kept = free_motion(proper, np.array(held, int), self.kinematic)
        return reduced, kept, gains, x

    def _refuse_moved(self, effects: NDArray[np.float64]) -> None:
        for name in self.parameters:
            if np.abs(effects[:, self.inputs.index(name)]).max(initial=0.0) > 0.0:
                raise ModelError(
                    f"the parameter {name} changes relative speeds or gaps that stuck friction or closed contacts hold at zero, "
                    "so another value of it means another operating point; it cannot be an input here"
                )

    def _matrices(self, values: Array, jacobian: NDArray[np.float64], nz: int) -> Matrices:
        """The algebraic unknowns eliminated; one matrix of inputs for each derivative."""
        n, ny, npar, nu = self.compiled.dae.x.numel(), len(self.outputs), len(self.parameters), len(self.driven)
        self._refuse_infinite(jacobian, nz)
        rows = np.r_[0:n, n + nz : jacobian.shape[0]]
        columns = np.r_[0:n, n + nz : jacobian.shape[1]]
        inner = jacobian[n : n + nz, n : n + nz]
        reduced = jacobian[np.ix_(rows, columns)]
        if nz:
            if np.linalg.cond(inner) > 1e14:
                raise ModelError(
                    "the algebraic equations of the model are singular at the operating point, so there is no linear model"
                )
            reduced = reduced - jacobian[rows, n : n + nz] @ np.linalg.solve(inner, jacobian[n : n + nz, columns])
        order = np.argsort([self.inputs.index(name) for name in (*self.parameters, *self.driven)])
        blocks = []
        for k in range(ORDER + 1):
            first = n + npar + k * nu
            constants = reduced[:, n : n + npar] if k == 0 else np.zeros((len(rows), npar))
            blocks.append(np.hstack([constants, reduced[:, first : first + nu]])[:, order])
        split = (slice(0, n), slice(n, n + ny), slice(n + ny, None))
        a, c, w = (reduced[part, :n] for part in split)
        b, d, v = ([block[part] for block in blocks] for part in split)
        return Matrices(a, b, c, d, w, v)

    def _refuse_infinite(self, jacobian: NDArray[np.float64], nz: int) -> None:
        bad = np.flatnonzero(~np.isfinite(jacobian).all(axis=1))
        if bad.size:
            names = [*(f"der({s})" for s in self.compiled.states), *["an algebraic equation"] * nz, *self.outputs]
            said = ", ".join(dict.fromkeys(names[i] for i in bad if i < len(names))) or "a relative motion"
            raise ModelError(
                f"the derivatives of {said} are not finite at the operating point; choose another one nearby"
            )

    def _improper(self, output: int, given: int, order: int) -> ModelError:
        derivative = {1: "derivative", 2: "second derivative"}.get(order, f"{order}th derivative")
        return ModelError(
            f"{self.outputs[output]} depends on the {derivative} of the input {self.inputs[given]}: no state-space model has such a "
            "response. Leave this output out, take the derivative as the input (an acceleration source instead of a speed source), or "
            "filter the input"
        )

    def _held(self, m: Array) -> list[int]:
        """The rows of the relative motions that the modes hold at zero."""
        contacts = self.compiled.dae.contacts
        rows = [i for i, law in enumerate(self.holding) if m[law.index] == 0]
        first = len(self.holding)
        return rows + [
            first + 2 * i + k for i, contact in enumerate(contacts) if m[contact.index] > 0.5 for k in (0, 1)
        ]

    def _state_space(
        self, matrices: Matrices, kept: NDArray[np.int64], gains: NDArray[np.float64], x: Array, point: _Point
    ) -> LinearModel:
        from powertrain.analysis.linear_model import Linearization, LinearModel

        states = [self.compiled.states[i] for i in kept]
        compiled = self.compiled
        units = {n: compiled.signals[n].unit for n in states if n in compiled.signals} | {
            p.label: p.unit for p in self.picked
        }
        known = spots(self.original.flat)
        units |= {n: known[n].unit if n in known else self.original.parameters[n].unit for n in self.inputs}
        dae = compiled.dae
        laws = [(law.name, law.index) for group in (dae.frictions, dae.contacts, dae.switches) for law in group]
        note = Linearization(
            time=point.t,
            states=tuple(states),
            inputs=self.inputs,
            outputs=self.outputs,
            units=units,
            values={compiled.states[i]: float(x[i]) for i in range(len(x))},
            modes={name: float(point.m[index]) for name, index in laws},
            removed=tuple(name for i, name in enumerate(compiled.states) if i not in kept),
            shifted={
                compiled.states[i]: {self.inputs[j]: float(gains[i, j]) for j in np.flatnonzero(gains[i])}
                for i in kept
                if gains[i].any()
            },
        )
        return LinearModel(
            matrices.a, matrices.b[0], matrices.c, matrices.d[0], note,
            states=_dotless(states), inputs=_dotless(self.inputs), outputs=_dotless(self.outputs), name=type(self.model).__name__,
        )  # fmt: skip


def _scalars(expression: Symbol) -> list[Symbol]:
    return list(ca.vertsplit(expression)) if expression.numel() else []


def _constant(row: Symbol, at: Symbol) -> bool:
    return not row.nnz() or not any(ca.which_depends(row.nz[:], at, 1, True))


def _dotless(names: Sequence[str]) -> list[str]:
    """Names without dots, which python-control does not allow, still all different."""
    found: list[str] = []
    for name in names:
        plain = short = name.replace(".", "_")
        count = 1
        while short in found:
            count += 1
            short = f"{plain}_{count}"
        found.append(short)
    return found


def _transfer(original: Compiled, perturbed: Compiled) -> Callable[[_Point], tuple[Array, Array]]:
    """States and algebraic unknowns of the perturbed model from a point of the original one, by their names."""
    if perturbed is original:
        return lambda point: (point.x, point.z)
    if [s.name() for s in _scalars(perturbed.dae.m)] != [s.name() for s in _scalars(original.dae.m)]:
        raise ModelError("a perturbation of this input changes modes of the model; choose another input")
    dae = original.dae
    symbols = {s.name(): s for s in (*_scalars(dae.x), *_scalars(dae.z))}
    symbols |= dict(zip(original.states, _scalars(dae.x), strict=True))

    def found(name: str) -> Symbol:
        if name in symbols:
            return symbols[name]
        if name in original.signals:
            expression: Symbol = original.signals[name].expression
            return expression
        base, order = name, 0
        while base.startswith("der(") and base.endswith(")"):
            base, order = base[4:-1], order + 1
        if base in original.variables:
            expression = original.variables[base].symbol
            with reading(original.flat.recorder) as recorder:
                for _ in range(order):
                    expression = recorder.derivative(expression)
            (expression,) = original.resolve([expression])
            inside = {s.name() for group in (dae.t, dae.x, dae.z, dae.m, dae.p) for s in _scalars(group)}
            if all(s.name() in inside for s in free_symbols(expression)):
                return expression
        raise ModelError(
            f"with a perturbation of this input the model has the state {name}, which the operating point lacks; choose another input"
        )

    x = column([found(n) for n in perturbed.states])
    z = column([found(s.name()) for s in _scalars(perturbed.dae.z)])
    function = ca.Function("powertrain_transfer", [dae.t, dae.x, dae.z, dae.m, dae.p], [ca.densify(x), ca.densify(z)])

    def transfer(point: _Point) -> tuple[Array, Array]:
        x, z = function(point.t, point.x, point.z, point.m, point.p)
        return np.array(x, float).ravel(), np.array(z, float).ravel()

    return transfer
