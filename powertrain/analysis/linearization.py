"""Linear models at an operating point: der(x) = A x + B u, y = C x + D u, in the modes of the laws there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.analysis.operating_point import Point, operating_point
from powertrain.analysis.perturbation import ORDER, Perturbed, compile_perturbed, spots, transfer
from powertrain.analysis.reduction import Matrices, Quotient, free_motion, substitute_inputs, without_unseen
from powertrain.compiler.assemble import Compiled
from powertrain.dae.contact import CLOSED, pressure_margin
from powertrain.dae.friction import FORWARD, STUCK, stuck_margin
from powertrain.dae.hybrid import Contact, Friction, HybridDae, Law, OperatingPoint
from powertrain.dae.tolerances import SAME, ZONE
from powertrain.errors import ModelError, ParameterError, suggestion
from powertrain.interruption import interruptible
from powertrain.language.arguments import flag, listed
from powertrain.language.component import Component
from powertrain.language.connectors import Output
from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol, column, scalars
from powertrain.plant import Plant, plant_of
from powertrain.signals import Picked, Selector, signals_of

if TYPE_CHECKING:
    from powertrain.analysis.linear_model import LinearModel


@interruptible()
def linearize(
    plant: Plant[Any] | Component,
    inputs: Sequence[Selector] | None = None,
    outputs: Sequence[Selector] | None = None,
    *,
    at: Point | None = None,
    parameters: Mapping[str, float] | None = None,
    reduced: bool = False,
) -> LinearModel:
    """The linear model at an operating point.

    The modes are those of the operating point: stuck friction and closed contacts remove states. Friction without a limit there holds
    nothing, such as that of an unloaded gear at rest, in proportion to its torque: it slides forward. Where a law is about to change its
    mode there is no derivative: an unloaded lossy gear, which either side may drive, a brake at the torque at which it slips, bodies that
    touch without force. The model has that of one side, and ``linearization.one_sided`` names the law. Sources that change with time are
    not part of the linear model; discrete variables, such as the output of a sampled controller, keep their values in it. If derivatives
    of an input occur, the states are shifted by a multiple of the input (see ``Linearization``).

    Parameters
    ----------
    plant : Plant or Component
        The model.
    inputs : sequence of str or selectors, optional
        By default the inputs of the model. Allowed are an input of the model; any signal port, to which the linear input is added
        ("torque.tau"); a flow of a port, as an external torque or force on the component ("J1.flange_a.tau"); or a parameter, whose
        column is the effect of another constant value.
    outputs : sequence of str or selectors, optional
        Any signals; by default the outputs of the model or, if it has none, its states. A selector is a function such as
        ``lambda m: m.J1.w``.
    at : mapping or (Result, float), optional
        Values as for ``simulate(starts=...)``, which may include inputs of the model and "time" (s); or ``(result, t)``, with
        the right limit at an event.
    parameters : mapping of str to float, optional
        Other values, as for ``simulate``.
    reduced : bool
        Leave out rigid-body motions and other integrals that no output depends on, such as the angle of a free shaft: the motions V
        with eigenvalue zero, A V in V and C V = 0. Angles become relative to one of them; the transfer function is unchanged. Regulators
        (``control.lqr``) and minimal models need this.

    Returns
    -------
    LinearModel
        A ``control.StateSpace`` with named states, inputs and outputs, and ``linearization``.

    Raises
    ------
    ParameterError
        For unknown names.
    ModelError
        If an output depends on the derivative of an input, if derivatives are not finite, or if the algebraic equations are singular.
    """
    plant = plant_of(plant)
    signals = signals_of(plant.compiled)
    point = operating_point(plant, at, parameters)
    driven = (
        list(plant.compiled.inputs)
        if inputs is None
        else [s if isinstance(s, str) else signals.pick(s).label for s in listed("inputs", inputs)]
    )
    shown = _default_outputs(plant.compiled) if outputs is None else listed("outputs", outputs)
    if not driven:
        lacking = "the model has no inputs" if inputs is None else "inputs is empty"
        raise ParameterError(
            f'{lacking}; name what drives the linear model, e.g. inputs=["source.y"] (a signal port) '
            'or inputs=["shaft.flange_a.tau"] (an external torque)'
        )
    return _linearizer(plant, tuple(driven), shown).at(point, flag("reduced", reduced))


@dataclass(frozen=True)
class Linear:
    """The matrices at an operating point, the indices of their states among those of the model, and the names of the outputs.

    ``one_sided``: as in ``Linearization``.
    """

    matrices: Matrices
    kept: NDArray[np.int64]
    outputs: tuple[str, ...]
    one_sided: tuple[str, ...]


def linear_at(plant: Plant[Any], inputs: Sequence[str], outputs: Sequence[Selector], point: OperatingPoint) -> Linear:
    """A linear model as numbers, for analyses at many operating points; arguments and errors as for ``linearize``."""
    linearizer = _linearizer(plant, tuple(inputs), outputs)
    matrices, kept, *_ = linearizer.reduced(point)
    return Linear(matrices, kept, linearizer.outputs, linearizer.one_sided(point))


def _linearizer(plant: Plant[Any], inputs: tuple[str, ...], outputs: Sequence[Selector]) -> _Linearizer:
    """The derivatives for this choice, built once for a plant."""
    signals = signals_of(plant.compiled)
    kept = _kept.setdefault(plant, {})
    key = (inputs, tuple(signals.identity(signals.pick(s)) for s in outputs))
    if key not in kept:
        kept[key] = _Linearizer(plant, inputs, outputs)
    return kept[key]


def _default_outputs(compiled: Compiled) -> list[str]:
    root = compiled.source.model
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
        perturbed = compile_perturbed(plant.model, self.driven) if self.driven else Perturbed(original, ())
        self.compiled = perturbed.compiled
        self.picked: list[Picked] = [signals_of(self.compiled).pick(s) for s in outputs]
        self.outputs = tuple(p.label for p in self.picked)
        self._refuse_twice("inputs", inputs)
        self._refuse_twice("outputs", self.outputs)
        self.transfer = transfer(original, self.compiled)
        self.derivatives = self._derivatives(perturbed)

    def _refuse_unknown(self) -> None:
        known = spots(self.original.source.components)
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
        """The Jacobian of (xdot, residual, outputs, motions that laws may hold) by (x, z, parameters, u_0, u_1, ...).

        Also by how much the condition of each switch is clear of zero, the speed of each friction law, and by how much each law that rests
        is clear of a limit.
        """
        dae, compiled = self.compiled.dae, self.compiled
        outputs = [p.expression for p in self.picked]
        self.holding = [f for f in dae.frictions if not f.algebraic and not f.prescribed]
        motions = [f.w for f in self.holding] + [e for c in dae.contacts for e in (c.speed, c.gap)]
        p = {name: dae.p[i] for i, name in enumerate(compiled.parameters)}
        coefficients = [c for k in range(ORDER + 1) for c in (row[k] for row in perturbed.coefficients)]
        rows = column([*scalars(dae.xdot), *scalars(dae.residual), *outputs, *motions])
        columns = column([*scalars(dae.x), *scalars(dae.z), *(p[n] for n in self.parameters), *coefficients])
        kinematic = ca.jacobian(dae.xdot, dae.x)
        at = ca.vertcat(dae.t, dae.x, dae.z, dae.m, column(coefficients))
        self.kinematic = np.array([_constant(kinematic[i, :], at) for i in range(dae.x.numel())], bool)
        clear, speeds = column([ca.fabs(s.g) - s.known for s in dae.switches]), column([f.w for f in dae.frictions])
        spare = column([*(_spare_torque(dae, f) for f in dae.frictions), *(_spare_force(dae, c) for c in dae.contacts)])
        return dae.function("linear", ca.jacobian(rows, columns), clear, speeds, spare)

    def _at(self, point: OperatingPoint, m: Array) -> tuple[NDArray[np.float64], Array, Array, Array]:
        """The values of ``_derivatives`` at a point in the modes ``m``."""
        x, z = self.transfer(point)
        p = np.zeros(self.compiled.dae.p.numel())
        p[: len(point.p)] = point.p
        p[len(point.p) : len(point.p) + 1] = point.t  # the reference of the perturbations
        jacobian, *margins = (found.full() for found in self.derivatives(point.t, x, z, m, p))
        clear, speeds, spare = (margin.ravel() for margin in margins)
        return jacobian, clear, speeds, spare

    def at(self, point: OperatingPoint, reduced: bool) -> LinearModel:
        """The linear model at an operating point."""
        matrices, free, gains, x = self.reduced(point)
        n = len(free)
        whole = Quotient(matrices, np.arange(n), np.zeros(0, int), np.zeros((n, 0)))
        return self._state_space(without_unseen(matrices) if reduced else whole, free, gains[free], x, point)

    def reduced(self, point: OperatingPoint) -> tuple[Matrices, NDArray[np.int64], NDArray[np.float64], Array]:
        """Matrices, indices of the states, the shifts of the states by the inputs, and the values of all states."""
        x, z = self.transfer(point)
        full = self._matrices(self._at(point, point.m)[0], z.size)
        proper, gains = substitute_inputs(full, self._improper)
        held = self._held(point.m)
        self._refuse_moved(proper.v[0][held])
        reduced, kept = free_motion(proper, np.array(held, int), self.kinematic)
        return reduced, kept, gains, x

    def one_sided(self, point: OperatingPoint) -> tuple[str, ...]:
        """The laws that may as well be in another mode at the point, with other derivatives."""
        dae, (slopes, clear, speeds, spare) = self.compiled.dae, self._at(point, point.m)
        resting: list[Law] = [*dae.frictions, *dae.contacts]
        found = [law.name for law, more in zip(resting, spare, strict=True) if more <= 0.0]
        count = dae.x.numel() + dae.z.numel() + len(self.outputs)
        turning = [law for law, at in zip(dae.switches, clear, strict=True) if at <= 0.0]
        others: list[tuple[Law, float]] = [(law, 1.0 - point.m[law.index]) for law in turning]
        slow = [law for law, w in zip(dae.frictions, speeds, strict=True) if abs(w) <= ZONE]
        others += [(law, -point.m[law.index]) for law in slow if abs(point.m[law.index]) == FORWARD]
        for law, mode in others:
            m = point.m.copy()
            m[law.index] = mode
            if not np.allclose(self._at(point, m)[0][:count], slopes[:count], rtol=SAME, atol=SAME):
                found.append(law.name)
        return tuple(found)

    def _refuse_moved(self, effects: NDArray[np.float64]) -> None:
        for name in self.parameters:
            if np.abs(effects[:, self.inputs.index(name)]).max(initial=0.0) > 0.0:
                raise ModelError(
                    f"the parameter {name} changes relative speeds or gaps that stuck friction or closed contacts hold at zero, "
                    "so another value of it means another operating point; it cannot be an input here"
                )

    def _matrices(self, jacobian: NDArray[np.float64], nz: int) -> Matrices:
        """Eliminate the algebraic unknowns; one input matrix for each derivative."""
        n, ny, npar, nu = self.compiled.dae.x.numel(), len(self.outputs), len(self.parameters), len(self.driven)
        self._refuse_infinite(jacobian, nz)
        rows = np.r_[0:n, n + nz : jacobian.shape[0]]
        columns = np.r_[0:n, n + nz : jacobian.shape[1]]
        inner = jacobian[n : n + nz, n : n + nz]
        reduced = jacobian[np.ix_(rows, columns)]
        if nz:
            sized = jacobian[n : n + nz, : n + nz] * self.compiled.dae.sizes
            sized /= np.maximum(np.abs(sized).max(axis=1, keepdims=True), np.finfo(float).tiny)
            if np.linalg.svd(sized[:, n:], compute_uv=False)[-1] < 1e-14:
                raise ModelError(
                    f"the algebraic equations of {type(self.compiled.source.model).__name__} are singular at this operating point, so "
                    "it has no linear model there; choose another point"
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
        self, found: Quotient, free: NDArray[np.int64], gains: NDArray[np.float64], x: Array, point: OperatingPoint
    ) -> LinearModel:
        from powertrain.analysis.linear_model import Linearization, LinearModel, minus

        names = [self.compiled.states[i] for i in free]
        gone = [names[i] for i in found.gone]
        relative = {
            names[i]: {g: float(r) for g, r in zip(gone, row, strict=True) if r}
            for i, row in zip(found.kept, found.relative, strict=True)
            if row.any()
        }
        states = [names[i] + minus(relative.get(names[i], {})) for i in found.kept]
        shifts = gains[found.kept] - found.relative @ gains[found.gone]
        compiled, known, matrices = self.compiled, spots(self.original.source.components), found.matrices
        units = {
            label: compiled.signals[names[i]].unit
            for label, i in zip(states, found.kept, strict=True)
            if names[i] in compiled.signals
        }
        units |= {p.label: p.unit for p in self.picked}
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
            removed=tuple(name for i, name in enumerate(compiled.states) if i not in free),
            one_sided=self.one_sided(point),
            unseen=tuple(gone),
            relative=relative,
            shifted={
                state: {self.inputs[j]: float(row[j]) for j in np.flatnonzero(row)}
                for state, row in zip(states, shifts, strict=True)
                if row.any()
            },
        )
        return LinearModel(
            matrices.a, matrices.b[0], matrices.c, matrices.d[0], note,
            states=states, inputs=self.inputs, outputs=self.outputs, name=type(self.model).__name__,
        )  # fmt: skip


def _spare_torque(dae: HybridDae, law: Friction) -> Symbol:
    """Torque of a stuck law below the limit at which it slips; positive if it slides, or has no limits."""
    stuck = ca.logic_and(dae.m[law.index] == STUCK, law.upper > law.lower)
    return ca.if_else(stuck, stuck_margin(law) - 2 * law.hysteresis, 1)


def _spare_force(dae: HybridDae, law: Contact) -> Symbol:
    """Force of a closed contact; gap or speed of an open one."""
    closed = pressure_margin(law) - 2 * law.hysteresis
    return ca.if_else(dae.m[law.index] == CLOSED, closed, ca.fmax(law.gap - ZONE, ca.fabs(law.speed) - ZONE))


def _constant(row: Symbol, at: Symbol) -> bool:
    return not row.nnz() or not any(ca.which_depends(row.nz[:], at, 1, True))
