"""The two sweeps through a run: forward with derivatives of s for each unknown, or backward with the adjoint of one objective."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.engine.trajectory import Samples
from powertrain.language.reals import Array
from powertrain.result import Result
from powertrain.variational.begin import Start
from powertrain.variational.corners import Corner, Corners
from powertrain.variational.functional import Functional
from powertrain.variational.instants import NotDifferentiable
from powertrain.variational.objectives import Reading
from powertrain.variational.partials import Block, Partials, System
from powertrain.variational.record import STAGES, Record, edge
from powertrain.variational.saltation import Saltation, SaltationMap, row_of
from powertrain.variational.simultaneous import Parts
from powertrain.variational.transitions import Batch, Reverse, VariationalRates, transitions
from powertrain.variational.unknowns import Unknowns

APART = 0.01
"""One-sided derivatives may differ from the mean by this share of it,"""
_SEEN = 1e-4
"""or by so little that a 100 % change of the unknown changes the result by this share,"""
_FELT = 1e-9
"""or by so little that one unit of an unknown that is zero changes it by this share."""
_BESIDE = 1e-6
"""Distance of both sides of an extremum from it, as a share of a step."""


class Model:
    """The functions for one model, one choice of unknowns and one objective, built once. Serves one thread."""

    def __init__(self, result: Result[Any], wanted: Unknowns, of: Functional) -> None:
        self.system = System(result.compiled, wanted.parameters, wanted.segments, len(wanted.inputs))
        self.of = of
        self.flow = VariationalRates(self.system, of.integrand)
        self.saltation = Saltation(self.flow)
        self.read = Partials(self.system, of.expressions)
        self.start = Start(result, self.system)
        self.corners = Corners(self.system, ca.vertcat(self.flow.expressions, self.system.dae.residual))

    @cached_property
    def bare_flow(self) -> VariationalRates:
        """The flow without derivatives with respect to q."""
        return VariationalRates(System(self.system.compiled, (), ()), self.of.integrand)

    @cached_property
    def reverse(self) -> Reverse:
        """The reverse derivative of the flow."""
        return Reverse(self.flow)


@dataclass(frozen=True)
class Read:
    """The derivatives of one reading: with respect to s and q, and along the motion."""

    reading: Reading
    sample: Samples
    boundary: int
    s: Array
    q: Array
    rate: float


@dataclass(frozen=True)
class Passage:
    """The data of a run for the sweeps: steps, jumps at events, readings, the start, and corners."""

    run: Record
    jumps: list[SaltationMap]
    reads: list[Read]
    begin: NDArray[np.float64]
    given: NDArray[np.float64]
    """The same before laws that stick from the start remove their speed."""
    corners: list[Corner]

    @cached_property
    def events(self) -> dict[int, list[int]]:
        """The events at the boundaries before steps."""
        return _by_place([self.run.steps.before(t) for t in self.run.instants.times.tolist()])

    @cached_property
    def between(self) -> dict[int, list[int]]:
        """The readings at the boundaries before steps, except those at events."""
        return _by_place([read.boundary for read in self.reads])

    @cached_property
    def corners_between(self) -> dict[int, list[int]]:
        """The corners at the boundaries before steps."""
        return _by_place([self.run.steps.before(corner.time) for corner in self.corners])

    @cached_property
    def at_events(self) -> dict[tuple[int, int], Read]:
        """The readings at events, by event and side."""
        return {(read.reading.instant, read.reading.side): read for read in self.reads if read.boundary < 0}


def passage(model: Model, result: Result[Any], wanted: Unknowns, of: Functional, cuts: Array) -> Passage:
    """Everything of a run except the matrices of its steps. NotDifferentiable names an event without a derivative."""
    run, corners = model.corners.cut(result, np.union1d(of.cuts, cuts))
    jumps = model.saltation.jumps(run)
    begin = np.zeros((model.flow.size, len(wanted.names)))
    begin[: model.system.size] = model.start.derivatives(result, run, wanted)
    caught, at_q = model.saltation.caught(run.p, run.first, model.saltation.stuck(run.first))
    given = begin
    begin = caught @ begin + at_q @ wanted.chain(np.array([run.start]), after=True)[0]
    reads = [_read(model, result, run, r) for r in of.readings]
    return Passage(run, jumps, reads, begin, given, corners)


def _read(model: Model, result: Result[Any], run: Record, reading: Reading) -> Read:
    if reading.instant >= 0:
        side = run.instants.left if reading.side < 0 else run.instants.right
        sample, boundary = row_of(side, reading.instant), -1
    else:
        sample, boundary = result.samples_at([reading.time]), run.steps.before(reading.time)
    on_s, on_q, rate = _slopes(model, run, sample, reading.signal)
    if reading.turning:
        on_s, on_q = _at_extremum(model, result, run, reading)
    return Read(reading, sample, boundary, np.pad(on_s, (0, model.flow.integrals)), on_q, rate)


def _slopes(model: Model, run: Record, sample: Samples, k: int) -> tuple[Array, Array, float]:
    """The derivatives of signal k with respect to s and q, and along the motion."""
    slopes, rates = model.read(sample, run.p), model.flow.rates(sample, run.p)[:, : model.system.size]
    return slopes.s[0, k], slopes.q[0, k], float(slopes.along(rates)[0, k])


def _at_extremum(model: Model, result: Result[Any], run: Record, reading: Reading) -> tuple[Array, Array]:
    """The derivatives of an extremum, between those on both sides of it.

    If it is a corner, where one branch rises by a and the other falls by b, the corner moves by d(tau) = (d_2 - d_1)/(a + b) for changes
    d_1 and d_2 of the branches, and the extremum by d_1 + a d(tau). The same mean belongs to a smooth extremum, where a = b = 0.
    """
    one, two = (
        _slopes(model, run, edge(result, np.array([reading.time]), before, _BESIDE), reading.signal)
        for before in (True, False)
    )
    fall = one[2] - two[2]
    share = float(np.clip(one[2] / fall, 0.0, 1.0)) if fall else 0.5
    on_s, on_q = ((1.0 - share) * d_1 + share * d_2 for d_1, d_2 in zip(one[:2], two[:2], strict=True))
    return on_s, on_q


def forward(model: Model, wanted: Unknowns, way: Passage, keep: bool) -> tuple[Parts, Block]:
    """The derivatives of the objective, and the deviation of the one-sided derivatives from them (two rows).

    With ``keep``, also the derivatives of s at all boundaries (before step i: row i), one block after the other.
    """
    run, steps = way.run, way.run.steps
    phi, psi = transitions(model.flow, steps, model.flow.linear(steps, run.p))
    psi = psi @ wanted.chain(steps.times + 0.5 * steps.durations, after=True) if wanted.inputs else psi @ wanted.plain
    lefts, rights = (wanted.chain(run.instants.times, after=a) for a in (False, True))
    n, (size, count) = model.system.size, way.begin.shape
    s, gradient = np.hstack([way.begin, np.zeros((size, count))]), np.zeros(2 * count)
    kept = np.empty((len(steps.times) + 1 if keep else 0, *s.shape))
    chains = wanted.chain(np.array([r.reading.time for r in way.reads]), after=True)

    def alone(value: Array) -> Array:
        """The value, with zeros for the deviation."""
        return np.concatenate([value, np.zeros_like(value)], axis=-1)

    for i in range(len(steps.times) + 1):
        for j in way.events.get(i, ()):
            jump = way.jumps[j]
            moved = alone(jump.shifts[0].s @ s[:n, :count] + jump.shifts[0].q @ lefts[j]) if jump.shifts else 0.0
            after = jump.s @ s + alone(jump.left @ lefts[j] + jump.right @ rights[j])
            if jump.apart is not None:
                after[:, count:] += jump.apart[0] @ s[:n, :count] + jump.apart[1] @ lefts[j]
            for side, here, chain in ((-1, s, lefts[j]), (1, after, rights[j])):
                if (j, side) in way.at_events:
                    read = way.at_events[j, side]
                    gradient += read.reading.weight * (read.s @ here + alone(read.q @ chain) + read.rate * moved)
            s = after
        for r in way.between.get(i, ()):
            read = way.reads[r]
            gradient += read.reading.weight * (read.s @ s + alone(read.q @ chains[r]))
        if keep:
            kept[i] = s
        if i < len(steps.times):
            s = phi[i] @ s + alone(psi[i])
    if model.flow.integrals:
        gradient += s[-1]
    return gradient.reshape(2, count), kept


def refuse_apart(wanted: Unknowns, way: Passage, found: Parts, value: float) -> None:
    """Reject one-sided derivatives that differ noticeably. ``found``: derivatives, and the deviation of the one-sided ones."""
    derivatives, off = np.abs(found)
    sizes = np.abs(wanted.values)
    seen = np.where(sizes == 0.0, off > _FELT * abs(value), off * sizes > _SEEN * abs(value))
    apart = (off > APART * derivatives) & seen
    if not apart.any():
        return
    names = [wanted.names[k] for k in np.flatnonzero(apart)]
    jump = next(jump for jump in way.jumps if jump.apart is not None)
    raise NotDifferentiable(
        f"at t = {jump.time:.9g} s {', '.join(shift.name for shift in jump.shifts)} switch together and act on each other, while "
        f"{', '.join(names[:6])}{' ...' if len(names) > 6 else ''} would let one of them switch first: the run has no derivative with "
        f"respect to that; both sides differ by {200.0 * (off / derivatives.clip(1e-300))[apart].max():.2g} %. "
        "Leave it out of wrt, or change a value so that they switch apart"
    )


def _by_place(places: list[int]) -> dict[int, list[int]]:
    """The indices in ``places`` for each place; negative places have none."""
    found: dict[int, list[int]] = {}
    for k, place in enumerate(places):
        if place >= 0:
            found.setdefault(place, []).append(k)
    return found


def adjoint(model: Model, wanted: Unknowns, way: Passage) -> Parts:
    """The same by one backward sweep; the second row is the adjoint of the deviations at events with two sides."""
    run, steps = way.run, way.run.steps
    kept = list(model.bare_flow.linear(steps, run.p))
    phi = transitions(model.bare_flow, steps, kept)[0]
    lefts, rights = (wanted.chain(run.instants.times, after=a) for a in (False, True))
    chains = wanted.chain(np.array([r.reading.time for r in way.reads]), after=True)
    n, gradient = model.system.size, np.zeros((2, len(wanted.names)))
    sides = 2 if any(jump.apart is not None for jump in way.jumps) else 1
    lam = np.zeros((sides, model.flow.size))
    lam[0, n:] = 1.0
    ends = np.empty((len(steps.times), *lam.shape))
    for i in range(len(steps.times), -1, -1):
        if i < len(steps.times):
            ends[i] = lam
            lam = lam @ phi[i]
        for r in way.between.get(i, ()):
            read = way.reads[r]
            lam[0] += read.reading.weight * read.s
            gradient[0] += read.reading.weight * (read.q @ chains[r])
        for j in reversed(way.events.get(i, ())):
            jump, own = way.jumps[j], np.zeros_like(lam)
            for side, chain in ((-1, lefts[j]), (1, rights[j])):
                if (j, side) not in way.at_events:
                    continue
                read = way.at_events[j, side]
                weight = read.reading.weight
                (lam if side > 0 else own)[0] += weight * read.s
                gradient[0] += weight * (read.q @ chain)
                if jump.shifts:
                    own[0, :n] += weight * read.rate * jump.shifts[0].s
                    gradient[0] += weight * read.rate * (jump.shifts[0].q @ lefts[j])
            if jump.apart is not None:
                own[1, :n] += lam[0] @ jump.apart[0]
                gradient[1] += (lam[0] @ jump.apart[1]) @ lefts[j]
            gradient[:sides] += (lam @ jump.left) @ lefts[j] + (lam @ jump.right) @ rights[j]
            lam = lam @ jump.s + own
    gradient[:sides] += lam @ way.begin
    for side in range(sides):
        gradient[side] += _from_steps(model, wanted, run, ends[:, side], kept)
    return gradient


def _from_steps(model: Model, wanted: Unknowns, run: Record, ends: Block, kept: Sequence[Batch]) -> Array:
    """The direct effect of q within the steps, by the adjoint stages of every step."""
    found = np.zeros(len(wanted.names))
    if not model.system.free.numel():
        return found
    for batch in kept:
        places = model.flow.places
        w = (ends[batch.here][:, None, places] @ batch.effects).reshape(len(batch.samples.t), len(places))
        q = model.reverse(batch.samples, run.p, w, batch.slopes)
        q = q.reshape(len(batch.effects), STAGES, q.shape[1]).sum(axis=1)
        times = run.steps.times[batch.here] + 0.5 * run.steps.durations[batch.here]
        found += (
            np.einsum("kq,kqu->u", q, wanted.chain(times, after=True))
            if wanted.inputs
            else q.sum(axis=0) @ wanted.plain
        )
    return found
