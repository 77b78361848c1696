"""Second derivatives across an event.

An event at tau(s-, q) maps s- to s+, the states that the flows before and after it have at the nominal instant. Over the short time d to
the event these flows are s + f d + f' d^2/2 with f' = f_t + f_s f. With the tangents at the event itself, D = d(tau),

    W- = S- + f- D,   F- = f-_t D + f-_s W- + f-_q Q,   W+ = R_t D + R_s W- + R_q Q,   F+ alike,

with a o b = a^T b + b^T a, and h the indicator that falls through zero, the second derivatives of s before the event, of tau and
of s+ are

    U  = F- o D - f-' D^T D + f- D2,
    D2 = -(h''[W-, W-] + h_s (F- o D - f-' D^T D)) / (dh/dt along f-),
    S2 = R''[W-, W-] + R_s U + R_t D2 - (F+ o D - f+' D^T D) - f+ D2,

The adjoint takes one combination of these. A corner is an event at which only the derivatives of f change, but neither s nor f.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from powertrain.engine.trajectory import Samples
from powertrain.language.reals import Array
from powertrain.language.symbols import column
from powertrain.result import Result
from powertrain.variational.curvature import Curvature, tangents
from powertrain.variational.instants import NotDifferentiable, Shift
from powertrain.variational.partials import Partials, Slopes
from powertrain.variational.record import Record, edge, spans
from powertrain.variational.saltation import Saltation, SaltationMap, row_of
from powertrain.variational.transitions import VariationalRates

Matrix = NDArray[np.float64]
_BESIDE = 1e-5
"""Derivatives at an instant are extrapolated from this share of a step away from it and twice that: |w| has its corner at w = 0."""
_ROOM = 1e-13
"""Distances from an instant, in s and relative to the time, below which two events count as simultaneous."""
_EQUAL = 1e-6
"""Instants are different if their derivatives differ by more than this share."""
_ROUNDING = 1e-12
_AT_REST = 1e-9
"""Derivatives of a speed below this share of their terms count as zero."""


@dataclass(frozen=True)
class Side:
    """The rates on one side of an instant, and their derivatives."""

    f: Array
    t: Array
    s: Matrix
    q: Matrix

    @property
    def bend(self) -> Array:
        """The second derivative of s along the motion, f' = f_t + f_s f."""
        return self.t + self.s @ self.f[: self.s.shape[1]]

    def along(self, t: Array, s: Matrix, q: Matrix) -> Matrix:
        """The derivatives for tangents of (t, s, q)."""
        return np.outer(self.t, t) + self.s @ s[: self.s.shape[1]] + self.q @ q


def beside(partials: Partials, result: Result[Any], p: Array, times: Array, before: bool) -> Slopes:
    """Values and derivatives of expressions just before or after instants."""
    return extrapolated(partials, p, *(edge(result, times, before, share) for share in (_BESIDE, 2.0 * _BESIDE)))


def extrapolated(partials: Partials, p: Array, near: Samples, far: Samples) -> Slopes:
    """Values and derivatives at instants, extrapolated from a distance and twice that distance."""
    one, two = partials(near, p), partials(far, p)
    with np.errstate(invalid="ignore"):
        value, t, s, q = (2.0 * getattr(one, n) - getattr(two, n) for n in ("value", "t", "s", "q"))
    return Slopes(value, t, s, q, one.weights)


def has_room(result: Result[Any], run: Record, before: bool) -> NDArray[np.bool_]:
    """Whether there is time between an event and the one before or after it, or the end of the run."""
    times = run.instants.times
    return np.asarray(spans(result.trajectory, times, before) * _BESIDE > _ROOM * (1.0 + np.abs(times)))


def beside_events(result: Result[Any], run: Record, before: bool) -> tuple[Samples, Samples]:
    """Samples near the events of a run and twice as far away; the limits themselves if there is no room."""
    times, limits = run.instants.times, run.instants.left if before else run.instants.right
    room = has_room(result, run, before)
    near, far = (edge(result, times, before, share) for share in (_BESIDE, 2.0 * _BESIDE))

    def chosen(samples: Samples) -> Samples:
        pairs = zip(samples, limits, strict=True)
        return Samples(*(np.where(room if a.ndim == 1 else room[:, None], a, b) for a, b in pairs))

    return chosen(near), chosen(far)


def side_of(flow: VariationalRates, slopes: Slopes, k: int) -> Side:
    """The rates at one of several samples; those of discrete variables are zero."""

    def whole(rows: Array | Matrix) -> Any:
        found = np.zeros((flow.size, *rows.shape[1:]))
        found[flow.places] = rows
        return found

    return Side(whole(slopes.value[k]), whole(slopes.t[k]), whole(slopes.s[k]), whole(slopes.q[k]))


def moved(weights: Array, side: Side, rates: Matrix, instant: Array) -> Matrix:
    """w^T (F o D - f' D^T D): the contribution of a moving instant to the second derivatives of s."""
    one = np.outer(weights @ rates, instant)
    return np.asarray(one + one.T - (weights @ side.bend) * np.outer(instant, instant))


@dataclass(frozen=True)
class Crossed:
    """The contribution of S2 to the sum at an event, and the tangents there: of the instant, and of s and its rates on both sides."""

    hessian: Matrix
    instant: Array
    instant_hessian: Matrix
    left: Matrix
    left_rates: Matrix
    right: Matrix
    right_rates: Matrix


@dataclass(frozen=True)
class Causes:
    """Derivatives of the possible causes of the events of a run, and the two samples from which they are extrapolated."""

    slopes: Slopes
    near: Samples
    far: Samples


@dataclass(frozen=True)
class Meets:
    """The events of a run: rates on both sides, and possible causes as they are before and at the events.

    The limits of a clutch are zero before it engages, and begin to open at the event.
    """

    run: Record
    before: list[Side]
    after: list[Side]
    causes: Causes
    opening: Causes


class Crossing:
    """Second derivatives at the events of one model's runs. Serves one thread."""

    def __init__(self, saltation: Saltation) -> None:
        self.saltation = saltation
        self.causes = Curvature(saltation.system, saltation.asked)
        self.speeds = Curvature(saltation.system, column([law.w for law in saltation.sticking]))

    def event(self, meets: Meets, k: int, jump: SaltationMap, weights: Array, s: Matrix, q: Matrix) -> Crossed:
        """Second derivatives at event k, for tangents ``s`` before it and the adjoint ``weights`` after it."""
        before, after, run = meets.before[k], meets.after[k], meets.run
        n, (r_s, r_q, r_t) = self.saltation.system.size, jump.across
        instant, instant_hessian = self._instant(meets, k, jump, s, q)
        left: Matrix = np.asarray(s + np.outer(before.f, instant), float)
        right = np.outer(r_t, instant) + r_s @ left + r_q @ q
        left_rates, right_rates = before.along(instant, left, q), after.along(instant, right, q)
        on_left = weights @ r_s
        hessian = moved(on_left, before, left_rates, instant) - moved(weights, after, right_rates, instant)
        hessian += (on_left @ before.f + weights @ r_t - weights @ after.f) * instant_hessian
        if self.saltation.mapping is not None:
            along = tangents(left[:n], q, instant)
            hessian += self.saltation.mapping.hessian(run.p, jump.rounds, weights[:n], along)
        return Crossed(hessian, instant, instant_hessian, left, left_rates, right, right_rates)

    def meets(self, result: Result[Any], run: Record) -> Meets:
        """Everything at the events of a run that second derivatives need, except the tangents."""
        left, right = (beside_events(result, run, before) for before in (True, False))
        before, after = (self._sides(run, *samples) for samples in (left, right))
        for k in (
            np.flatnonzero(~has_room(result, run, before=True)[1:]) + 1
        ):  # consecutive events without room share the rates between them
            before[k] = after[k - 1]
        limits = run.instants.left, run.instants.left
        causes, opening = (
            Causes(extrapolated(self.saltation.before, run.p, *samples), *samples) for samples in (left, limits)
        )
        return Meets(run, before, after, causes, opening)

    def _sides(self, run: Record, near: Samples, far: Samples) -> list[Side]:
        """The rates on one side of all events."""
        flow = self.saltation.flow
        slopes = extrapolated(flow.partials, run.p, near, far)
        return [side_of(flow, slopes, k) for k in range(len(run.instants.times))]

    def _instant(self, meets: Meets, k: int, jump: SaltationMap, s: Matrix, q: Matrix) -> tuple[Array, Matrix]:
        """D and D2, the same for all laws that cause the event."""
        causes = [shift for shift in jump.moved or jump.shifts[:1] if not shift.flat]
        found = [self._moves(meets, k, shift, s, q) for shift in causes]
        if not found:
            return np.zeros(s.shape[1]), np.zeros((s.shape[1], s.shape[1]))
        for other in found[1:]:
            _refuse_apart(jump, found[0], other)
        return found[0]

    def _moves(self, meets: Meets, k: int, shift: Shift, s: Matrix, q: Matrix) -> tuple[Array, Matrix]:
        """D and D2 of one law."""
        n, before, j = len(shift.s), meets.before[k], shift.row
        if j < 0:  # a knot of an input, which is no unknown here
            return np.zeros(s.shape[1]), np.zeros((s.shape[1], s.shape[1]))
        causes, factor = meets.causes, 1.0
        if j < len(self.saltation.indicators):
            causes, fall = self._falling(meets, k, j)
            factor = -1.0 / fall
        on_s, on_q = causes.slopes.s[k, j], causes.slopes.q[k, j]
        instant = factor * (on_s @ s[:n] + on_q @ q)
        left: Matrix = np.asarray(s + np.outer(before.f, instant), float)
        seeds = np.zeros((1, self.causes.explicit))
        seeds[0, j] = factor
        along = tangents(left[:n], q, instant)
        near, far = (self.causes(row_of(each, k), meets.run.p, seeds, along) for each in (causes.near, causes.far))
        weights = np.append(factor * on_s, np.zeros(len(s) - n))
        return instant, 2.0 * near - far + moved(weights, before, before.along(instant, left, q), instant)

    def _falling(self, meets: Meets, k: int, j: int) -> tuple[Causes, float]:
        """An indicator, before the event if it falls there, else at the event from which on it falls; and its rate."""
        n = self.saltation.system.size
        for causes in (meets.causes, meets.opening):
            fall = float(causes.slopes.t[k, j] + causes.slopes.s[k, j] @ meets.before[k].f[:n])
            if fall < 0.0:
                return causes, fall
        name, t = self.saltation.indicators[j].law.name, float(meets.run.instants.times[k])
        raise NotDifferentiable(
            f"at t = {t:.9g} s {name} switches without falling through zero: there is no second derivative"
        )

    def caught(self, p: Array, sample: Samples, laws: Sequence[int], weights: Array, s: Matrix, q: Matrix) -> Matrix:
        """Laws that stick at a speed that is already zero and that no unknown changes: -B (W B)^-1 w''[V, V].

        NotDifferentiable if an unknown changes it: the law would slide for a while, in a direction that depends on the sign of the change.
        """
        found = np.zeros((s.shape[1], s.shape[1]))
        for i, effect, row, on_q in self.saltation.catches(p, sample, laws):
            law = self.saltation.sticking[i]
            speeds = np.abs(row @ s + on_q @ q)
            if (speeds > _AT_REST * (np.abs(row) @ np.abs(s) + np.abs(on_q) @ np.abs(q))).any():
                raise NotDifferentiable(
                    f"{law.name} ({law.where}) sticks from t = {float(sample.t[0]):.9g} s on at a speed that is zero by coincidence, and "
                    "an unknown changes that speed: second derivatives differ on the two sides"
                )
            seeds = np.zeros((1, self.speeds.explicit))
            seeds[0, i] = -(weights @ effect)
            found += self.speeds(sample, p, seeds, tangents(s[: self.saltation.system.size], q))
        return found


def _refuse_apart(jump: SaltationMap, one: tuple[Array, Matrix], two: tuple[Array, Matrix]) -> None:
    """Reject laws that switch together if the derivatives of their instants differ."""
    for a, b in zip(one, two, strict=True):
        size = np.maximum(np.abs(a), np.abs(b))
        if (np.abs(a - b) > _EQUAL * (size + size.max(initial=0.0)) + _ROUNDING).any():
            raise NotDifferentiable(
                f"at t = {jump.time:.9g} s {', '.join(shift.name for shift in jump.moved)} switch together, and an unknown moves their "
                "instants apart: there is no second derivative. Leave it out of wrt, or change a value so that they switch apart"
            )
