"""Second derivatives of an objective of a run, forward over adjoint.

A run is a chain of maps: the start, steps, events, readings. With the tangents V at the input of each map and the adjoint w at its
output, the second derivatives of the whole are the sum of those of the maps,

    d2g/dp2 = sum over all maps M of (w^T M)''[V, V].

This is the second-order adjoint mu, d(mu)/dt = -f_s^T mu - (w^T f)_ss S - (w^T f)_sq Q, multiplied by the tangents and integrated: one
forward sweep gives the tangents for all unknowns, so mu itself is not needed. The steps contribute through the collocation of the
variational equations, so the sum is the exact derivative of what ``pt.gradient`` computes on the same dense output.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from powertrain.language.reals import Array
from powertrain.result import Result
from powertrain.variational.corners import Corner
from powertrain.variational.crossing import Crossed, Crossing, Matrix, Meets, Side, beside, moved, side_of
from powertrain.variational.curvature import Curvature, Tangents, tangents
from powertrain.variational.functional import Functional
from powertrain.variational.instants import NotDifferentiable
from powertrain.variational.partials import Block
from powertrain.variational.record import Record, Steps
from powertrain.variational.saltation import row_of
from powertrain.variational.sweeps import Model, Passage, Read, passage
from powertrain.variational.transitions import Batch, stage_tangents, transitions
from powertrain.variational.unknowns import Unknowns

_STATIONARY = 1e-3
"""An extremum between events is within this share of a step of a zero of the signal's rate."""
_EQUAL = 1e-6
_ROUND_OFF = 1e-12
_HALVINGS = 8
"""Most halvings of a step of a run at rest: 256 pieces resolve forty periods of a vibration."""
NO_CUTS = np.zeros(0)


@dataclass(frozen=True)
class _Way:
    """A run with its tangents: of q, of s at the boundaries before steps (after the events there), and of s before events."""

    passage: Passage
    phi: Block
    batches: list[Batch]
    q: Matrix
    s: Block
    before: list[Matrix]


class SecondOrder:
    """Second derivatives for one model, one choice of unknowns and one objective. Serves one thread."""

    def __init__(self, model: Model) -> None:
        self.model, system = model, model.system
        self.rates = Curvature(system, model.flow.expressions)
        self.readings = Curvature(system, model.of.expressions)
        self.crossing = Crossing(model.saltation)

    def __call__(self, result: Result[Any], wanted: Unknowns, of: Functional) -> Matrix:
        """The second derivatives. NotDifferentiable if the run has none."""
        model = self.model
        way = self._forward(result, wanted, of)
        passed, run = way.passage, way.passage.run
        meets = self.crossing.meets(result, run)
        found = np.zeros((len(wanted.names), len(wanted.names)))
        weights = np.zeros(model.flow.size)
        weights[model.system.size :] = 1.0
        ends = np.empty((len(way.phi), len(weights)))
        for i in range(len(ends), -1, -1):
            if i < len(ends):
                ends[i] = weights
                weights = weights @ way.phi[i]
            for read in (passed.reads[r] for r in passed.between.get(i, ())):
                found += self._read(result, run, read, way.s[i], way.q)
                weights = weights + read.reading.weight * read.s
            for c in passed.corners_between.get(i, ()):
                found += self._corner(result, run, passed.corners[c], weights, way.s[i], way.q)
            for k in reversed(passed.events.get(i, ())):
                hessian, weights = self._event(way, meets, k, weights)
                found += hessian
        found += self._start(result, wanted, way, weights) + self._steps(way, ends)
        if not np.isfinite(found).all():
            raise NotDifferentiable(
                "a rate, a condition or what is read has no finite second derivative on the run, such as a square root at zero"
            )
        return found

    def _forward(self, result: Result[Any], wanted: Unknowns, of: Functional, cuts: Array = NO_CUTS) -> _Way:
        """The run and its tangents, in pieces where its steps do not resolve them."""
        model = self.model
        through = passage(model, result, wanted, of, cuts)
        run, q = through.run, wanted.plain
        kept = list(model.flow.linear(run.steps, run.p))
        if not cuts.size and (pieces := self._pieces(run.steps, kept)).size:
            return self._forward(result, wanted, of, pieces)
        phi, psi = transitions(model.flow, run.steps, kept)
        s, at, before = through.begin, np.empty((len(phi) + 1, *through.begin.shape)), []
        for i in range(len(phi) + 1):
            for jump in (through.jumps[k] for k in through.events.get(i, ())):
                before.append(s)
                s = jump.s @ s + (jump.left + jump.right) @ q
            at[i] = s
            if i < len(phi):
                s = phi[i] @ s + psi[i] @ q
        return _Way(through, phi, kept, q, at, before)

    def _pieces(self, steps: Steps, kept: Sequence[Batch]) -> Array:
        """The instants at which steps of a run at rest are cut: they do not resolve the vibrations of the tangents."""
        found = [NO_CUTS]
        for batch in kept:
            times, durations = steps.times[batch.here], steps.durations[batch.here]
            counts = 2 ** self.model.flow.halvings(durations, batch.slopes.s).clip(max=_HALVINGS)
            found += [t + h * np.arange(1, n) / n for t, h, n in zip(times, durations, counts, strict=True)]
        return np.concatenate(found)

    def _steps(self, way: _Way, ends: Block) -> Matrix:
        """Contribution of the steps: f'' at every stage, along its tangents, times the effect of the stage on the objective."""
        flow, run = self.model.flow, way.passage.run
        found = np.zeros((way.q.shape[1], way.q.shape[1]))
        for batch in way.batches:
            seeds = ends[batch.here][:, None, flow.places] @ batch.effects
            seeds = seeds.reshape(len(batch.samples.t), len(flow.places))
            s = stage_tangents(flow, run.steps.durations[batch.here], batch.slopes, way.s[batch.here], way.q)
            along = Tangents(np.zeros((len(s), 1, s.shape[2])), s, np.broadcast_to(way.q, (len(s), *way.q.shape)))
            found += self.rates(batch.samples, run.p, seeds, along)
        return found

    def _event(self, way: _Way, meets: Meets, k: int, weights: Array) -> tuple[Matrix, Array]:
        """Contribution of an event and of the readings there, and the adjoint before it."""
        run, jump, n = way.passage.run, way.passage.jumps[k], self.model.system.size
        here = [r for r in way.passage.reads if r.boundary < 0 and r.reading.instant == k]
        for read in here:
            weights = weights + read.reading.weight * read.s * (read.reading.side > 0)
        sample, s = row_of(run.instants.right, k), way.before[k]
        found = np.zeros((s.shape[1], s.shape[1]))
        uncaught = weights @ self.model.saltation.caught(run.p, sample, jump.caught)[0]
        crossed = self.crossing.event(meets, k, jump, uncaught, s, way.q)
        reached = crossed.right - np.outer(meets.after[k].f, crossed.instant)
        found += self.crossing.caught(run.p, sample, jump.caught, weights, reached, way.q)
        weights = weights @ jump.s
        for read in here:
            side = (meets.before if read.reading.side < 0 else meets.after)[k]
            found += self._read_moving(run, read, crossed, side, way.q)
            weights = weights + read.reading.weight * read.s * (read.reading.side < 0)
            if jump.shifts:
                weights[:n] += read.reading.weight * read.rate * jump.shifts[0].s
        return found + crossed.hessian, weights

    def _read_moving(self, run: Record, read: Read, crossed: Crossed, side: Side, q: Matrix) -> Matrix:
        """Contribution of a reading at an event, before or after it."""
        left = read.reading.side < 0
        s, rates = (crossed.left, crossed.left_rates) if left else (crossed.right, crossed.right_rates)
        hessian = self._curved(run, read, tangents(s[: self.model.system.size], q, crossed.instant))
        on_instant = moved(read.s, side, rates, crossed.instant) + read.rate * crossed.instant_hessian
        return hessian + read.reading.weight * on_instant

    def _read(self, result: Result[Any], run: Record, read: Read, s: Matrix, q: Matrix) -> Matrix:
        """Contribution of a reading at a fixed instant, or at an extremum between events."""
        if read.reading.turning:
            return self._turning(result, run, read, s, q)
        slope = read.s @ s + read.q @ q
        fixed = self._curved(run, read, tangents(s[: self.model.system.size], q))
        return fixed + read.reading.bend * np.outer(slope, slope)

    def _turning(self, result: Result[Any], run: Record, read: Read, s: Matrix, q: Matrix) -> Matrix:
        """Contribution of an extremum y(T, p) with y_T = 0: y_pp - y_pT y_Tp/y_TT. The instant T is one more unknown."""
        flow, count = self.model.flow, s.shape[1]
        side = side_of(flow, flow.partials(read.sample, run.p), 0)
        instant = np.append(np.zeros(count), 1.0)
        s, q = (np.hstack([v, np.zeros((len(v), 1))]) for v in (s, q))
        s = s + np.outer(side.f, instant)
        hessian = self._curved(run, read, tangents(s[: self.model.system.size], q, instant))
        hessian += read.reading.weight * moved(read.s, side, side.along(instant, s, q), instant)
        sizes, starts, t = result.trajectory.sizes, result.trajectory.times, read.reading.time
        step = float(sizes[max(int(starts.searchsorted(t)) - 1, 0)])
        if not abs(read.reading.weight * read.rate) <= _STATIONARY * step * abs(hessian[count, count]):
            raise NotDifferentiable(
                f"of: the extremum at t = {t:.9g} s lies at a corner of the signal or on a plateau, which has no second derivative"
            )
        return np.asarray(
            hessian[:count, :count] - np.outer(hessian[:count, count], hessian[count, :count]) / hessian[count, count]
        )

    def _curved(self, run: Record, read: Read, along: Tangents) -> Matrix:
        """Contribution of the curvature of the expression read."""
        seeds = np.zeros((1, self.readings.explicit))
        seeds[0, read.reading.signal] = read.reading.weight
        return self.readings(read.sample, run.p, seeds, along)

    def _corner(self, result: Result[Any], run: Record, corner: Corner, weights: Array, s: Matrix, q: Matrix) -> Matrix:
        """Contribution of a corner: the same s and f on both sides, but other derivatives of f."""
        flow, t = self.model.flow, np.array([corner.time])
        before, after = (side_of(flow, beside(flow.partials, result, run.p, t, b), 0) for b in (True, False))
        change = np.abs(np.hstack([before.s - after.s, (before.t - after.t)[:, None], before.q - after.q]))
        if (change <= _EQUAL * (1.0 + np.abs(before.s).max(initial=0.0))).all():
            return np.zeros((s.shape[1], s.shape[1]))
        n, slopes = self.model.system.size, beside(self.model.corners.slopes, result, run.p, t, True)
        rows = list(corner.sides)
        falls = slopes.along(before.f[None, :n])[0, rows]
        on_s, on_q = slopes.s[0, rows], slopes.q[0, rows]
        moves, terms = on_s @ s[:n] + on_q @ q, np.abs(on_s) @ np.abs(s[:n]) + np.abs(on_q) @ np.abs(q)
        fixed = np.abs(moves) <= _ROUND_OFF * terms  # such as those at a corner of a signal of time
        with np.errstate(divide="ignore", invalid="ignore"):
            instants = np.where(fixed, 0.0, -moves / falls[:, None])
        instant = instants[0]
        if not (np.abs(instants - instant) <= _EQUAL * (1.0 + np.abs(instant))).all():
            raise NotDifferentiable(
                f"at t = {corner.time:.9g} s the rates have two corners at once, or one that is only touched, and an unknown moves them "
                "apart: there is no second derivative"
            )
        left: Matrix = np.asarray(s + np.outer(before.f, instant), float)
        return moved(weights, before, before.along(instant, left, q), instant) - moved(
            weights, after, after.along(instant, left, q), instant
        )

    def _start(self, result: Result[Any], wanted: Unknowns, way: _Way, weights: Array) -> Matrix:
        """Contribution of the start: laws that stick from there on, and the conditions."""
        model, run, s, n = self.model, way.passage.run, way.passage.given, self.model.system.size
        stuck = model.saltation.stuck(run.first)
        found = self.crossing.caught(run.p, run.first, stuck, weights, s, way.q)
        weights = weights @ model.saltation.caught(run.p, run.first, stuck)[0]
        return found + model.start.hessian(result, run, wanted, weights[:n], tangents(s[:n], way.q))
