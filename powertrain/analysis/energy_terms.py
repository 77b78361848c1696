"""The energy terms of a model as expressions: power through ports, losses, stored energies and their rates of change.

Every component has its own balance: power that enters through its ports is lost in it, stored in it or, in a boundary (source, ground),
taken out of the model. A port that is connected to parts inside its component passes its power on to them; connections keep nothing,
also where they reach a part inside another component.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NoReturn

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.assemble import Compiled
from powertrain.compiler.flat import Face, Flat
from powertrain.compiler.operations import COMPARISONS, EQUALITIES, affine_root, operation
from powertrain.compiler.texts import guarded
from powertrain.engine.trajectory import Samples
from powertrain.errors import ModelError, ParameterError
from powertrain.language.component import Component
from powertrain.language.connectors import Connector, Signal
from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol, column, scalars
from powertrain.numerics.batch import Lanes
from powertrain.numerics.tape import graph_of
from powertrain.signals import Signals, signals_of

Matrix = NDArray[np.float64]
_BLOCK = 2_000_000
_DEPTH = 100
"""Depth to which conditions of switches are compared."""


@dataclass(frozen=True)
class Part:
    """A component in the balance: the indices of its ports, of those that are not connected to parts inside it, and of its direct parts."""

    path: str
    kind: str
    boundary: bool
    ports: tuple[int, ...]
    own: tuple[int, ...]
    parts: tuple[int, ...]


@dataclass(frozen=True)
class EnergyValues:
    """One row per sample: power into the component through each port; loss, stored energy and its rate for each part."""

    power: Matrix
    loss: Matrix
    energy: Matrix
    rate: Matrix


@dataclass(frozen=True)
class WrittenTerms:
    """The power through ports, losses and stored energies of a model, as expressions of (t, x, z, m, p).

    ``said`` is the power as connectors declare it, in the variables of the model.
    """

    parts: list[Part]
    ports: list[str]
    power: list[Symbol]
    loss: list[Symbol]
    energy: list[Symbol]
    said: list[Symbol]


def written_terms(compiled: Compiled) -> WrittenTerms:
    """The terms of a compiled model. ModelError if one cannot be computed."""
    parts, ports, texts = _without_idle(_texts(compiled.source), compiled.source.nodes)
    power = [p for t in texts for p in t.power.values()]
    written = _resolved(signals_of(compiled), [*power, *(t.loss for t in texts), *(t.energy for t in texts)], texts)
    n, k = len(power), len(power) + len(texts)
    return WrittenTerms(parts, ports, written[:n], written[n:k], written[k:], power)


def _resolved(signals: Signals, expressions: list[Symbol], texts: list[_Text]) -> list[Symbol]:
    try:
        return signals.resolve(expressions)
    except ParameterError as error:
        for text in texts:
            try:
                signals.resolve([*text.power.values(), text.loss, text.energy])
            except ParameterError:
                raise ModelError(
                    f"{text.path}: power(), loss() or energy() of {text.kind} cannot be computed: {error}"
                ) from None
        raise


class EnergyTerms:
    """The terms of one compiled model. ``parts`` are in the order of the model, each before its own parts; the first is the model."""

    def __init__(self, compiled: Compiled) -> None:
        self._signals = signals_of(compiled)
        terms = written_terms(compiled)
        self.parts, self.ports, self._power = terms.parts, terms.ports, len(terms.ports)
        self.own = own_power(self.parts, len(self.ports))
        written = [*terms.power, *terms.loss, *terms.energy]
        dae, energy = compiled.dae, column(terms.energy)
        self._dae, self._losses = dae, terms.loss
        rate = _rate(energy, dae.t, dae.x, dae.xdot)
        self._nz, slopes = dae.z.numel(), ca.jacobian(energy, dae.z)
        rows = [column(written), rate]
        self._implicit = bool(self._nz and slopes.nnz())
        if self._implicit:
            rows += [
                ca.vec(ca.densify(slopes).T),
                ca.vec(ca.densify(ca.jacobian(dae.residual, dae.z)).T),
                _rate(dae.residual, dae.t, dae.x, dae.xdot),
            ]
        self._said, self._open = terms.said, compiled.open
        self._lanes = Lanes(dae.arguments, ca.cse(ca.vertcat(*rows)))

    @cached_property
    def opened(self) -> Symbol:
        """The power through ports for given torques of the laws."""
        return column(self._open(scalars(self._signals.bound(self._said))))

    def instants(self, p: Array) -> list[float]:
        """Instants at which time conditions in losses change: switches that appear only in ``loss()`` are not events of the run."""
        dae = self._dae
        nodes = graph_of(*(loss for loss in self._losses if ca.depends_on(loss, dae.t))).values()
        sides = [both for node, both in nodes if operation(node) in COMPARISONS | EQUALITIES]
        conditions = ca.substitute([left - right for left, right in sides], [dae.p], [Symbol(p[: dae.p.numel()])])
        roots = [affine_root(condition, dae.t) for condition in conditions]
        return [float(root) for root in roots if root is not None and root.is_constant()]

    def values(self, samples: Samples, p: Array) -> EnergyValues:
        """The terms at the samples. ModelError if one is not finite."""
        rows = self._lanes(self._signals.corrected(samples, p), p)
        n, k = len(self.parts), self._power
        found = rows[:, : k + 3 * n]
        if self._implicit:
            found[:, k + 2 * n :] += self._implicit_rate(rows[:, k + 3 * n :])
        bad = np.argwhere(~np.isfinite(found))
        if bad.size:
            self._refuse(int(bad[0, 0]), int(bad[0, 1]), samples.t)
        return EnergyValues(*np.split(found, [k, k + n, k + 2 * n], axis=1))

    def _refuse(self, row: int, place: int, t: Array) -> NoReturn:
        owners = [part.path or "the model" for part in self.parts]
        names = [f"power through {port}" for port in self.ports]
        names += [f"{term} of {owner}" for term in ("loss", "energy", "rate of the energy") for owner in owners]
        raise ModelError(f"the {names[place]} is not finite at t = {t[row]:.9g} s")

    def _implicit_rate(self, rows: Matrix) -> Matrix:
        """The contribution of the algebraic unknowns: dE/dz dz/dt with dr/dz dz/dt = -dr/dt."""
        n, nz = len(self.parts), self._nz
        slopes = rows[:, : n * nz].reshape(-1, n, nz)
        inner = rows[:, n * nz : (n + nz) * nz].reshape(-1, nz, nz)
        return -(slopes @ np.linalg.solve(inner, rows[:, (n + nz) * nz :, None]))[:, :, 0]

    @property
    def block(self) -> int:
        """The number of samples whose terms fit comfortably into memory."""
        return max(1, _BLOCK // max(1, self._lanes.size))


def own_power(parts: list[Part], ports: int) -> Matrix:
    """The matrix that gives the power that each part takes itself, which is not passed on to its parts."""
    own = np.zeros((len(parts), ports))
    for i, part in enumerate(parts):
        own[i, list(part.own)] = 1.0
    return own


def with_parts(parts: list[Part], own: Matrix) -> Matrix:
    """Values of components (first axis) with those of their parts, which come after them, added."""
    whole = np.array(own, float)
    for i in reversed(range(len(parts))):
        whole[i] += whole[list(parts[i].parts)].sum(axis=0)
    return whole


@dataclass
class _Text:
    path: str
    kind: str
    boundary: bool
    power: dict[str, Symbol]
    loss: Symbol
    energy: Symbol


def _texts(source: Flat) -> list[_Text]:
    """The power, loss and energy terms that the components declare.

    A switch in a term is identified with the switch of the equations that has the same condition; without one, it follows its condition
    without an event.
    """
    texts: dict[str, _Text] = {}
    with source.reading("energy") as apart:
        for component in source.components:
            path = component._path
            if not isinstance(component, Connector):
                texts[path] = _Text(
                    path,
                    type(component).__name__,
                    component.boundary,
                    {},
                    _said(component, "loss"),
                    _said(component, "energy"),
                )
            elif not isinstance(component, Signal):
                power, owner = _said(component, "power"), path.rpartition(".")[0]
                if owner in texts and not Symbol(power).is_zero():
                    texts[owner].power[path] = power
    old: list[Symbol] = []
    new: list[Symbol] = []
    for entry in apart.switches:
        g = ca.substitute(entry.g, column(old), column(new)) if old else entry.g
        same = [switch.mode for switch in source.recorder.switches if ca.is_equal(switch.g, g, _DEPTH)]
        old.append(entry.mode)
        new.append(same[0] if same else ca.if_else(g > 0, 1.0, 0.0))

    def plain(expression: Symbol) -> Symbol:
        return ca.substitute(Symbol(expression), column(old), column(new)) if old else Symbol(expression)

    for text in texts.values():
        text.loss, text.energy = plain(text.loss), plain(text.energy)
        text.power = {name: plain(power) for name, power in text.power.items()}
    return list(texts.values())


def _said(component: Component, name: str) -> Symbol:
    """The expression that a component declares for its loss, energy or power. ModelError if it is not an expression."""
    with guarded(component):
        said = getattr(component, name)()
    if isinstance(said, bool) or not isinstance(said, int | float | Symbol) or not Symbol(said).is_scalar():
        where = component._path or "the model"
        raise ModelError(
            f"{where}: {name}() of {type(component).__name__} returns {said!r} instead of one expression; write  return ..."
        )
    return Symbol(said)


def _without_idle(texts: list[_Text], nodes: Sequence[Sequence[Face]]) -> tuple[list[Part], list[str], list[_Text]]:
    """The parts with their ports, without parts that have no energy (signal sources, sensors of signals)."""
    busy = {""}
    for text in texts:
        if text.power or not text.loss.is_zero() or not text.energy.is_zero():
            path = text.path
            while path:
                busy.add(path)
                path = path.rpartition(".")[0]
    texts = [t for t in texts if t.path in busy]
    ports = [name for t in texts for name in t.power]
    place = {name: i for i, name in enumerate(ports)}
    inside: dict[str, list[int]] = {}
    for i, t in enumerate(texts):
        if t.path:
            inside.setdefault(t.path.rpartition(".")[0], []).append(i)
    passed_on = {name for node in nodes for name, from_inside in node if from_inside}
    parts = [
        Part(
            t.path,
            t.kind,
            t.boundary,
            tuple(place[name] for name in t.power),
            tuple(place[name] for name in t.power if name not in passed_on),
            tuple(inside.get(t.path, ())),
        )
        for t in texts
    ]
    return parts, ports, texts


def _rate(expression: Symbol, t: Symbol, x: Symbol, xdot: Symbol) -> Symbol:
    """d/dt by t and x; held values do not change between events."""
    return ca.densify(ca.jtimes(expression, ca.vertcat(t, x), ca.vertcat(Symbol(1), xdot)))
