"""The modes of all laws at one instant, from one linear complementarity problem.

For given torques tau, the rates of the laws' speeds and their bounds are affine: v = a - G tau and L(tau) <= tau <= U(tau). Sliding laws
have tau = U (w > 0) or tau = L (w < 0). Laws at rest satisfy

    tau = L + q,   v = v+ - v-,   0 <= q  complementary to  v- >= 0,   0 <= U - tau  complementary to  v+ >= 0.

Where a condition g on torques changes sign, a bound has a kink: the bound is affine in g+, with g = g+ - g- and g+ complementary to g-. A
contact is a law with the torque -force between -inf and 0; its rate is the acceleration of its gap. Each law at rest has the compliance of
``powertrain.compiler.torques``; it makes the torques unique if several laws hold the same motion. Rates are scaled to torques, v_i/G_ii.

R. W. Cottle, J.-S. Pang, R. E. Stone, The Linear Complementarity Problem, SIAM 2009; B. Brogliato, Nonsmooth Mechanics, Springer 2016,
chapter 5 (the principle of Gauss with friction).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Protocol

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.torques import COMPLIANCE
from powertrain.dae.contact import CLOSED, OPEN
from powertrain.dae.friction import BACKWARD, FORWARD, FREE, STUCK
from powertrain.dae.hybrid import HybridDae, OperatingPoint
from powertrain.dae.tolerances import ALONE, LEAST_TORQUE, NO_WIDTH
from powertrain.language.reals import Array
from powertrain.modes.lemke import Long, lemke
from powertrain.numerics.buffers import Evaluated

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class LinearLaws:
    """Laws at one point for torques near ``tau``: value + slope (tau' - tau) for every quantity, with the implicit unknowns eliminated.

    ``peak``: the limits of a law at rest are this multiple of its bounds.
    """

    speed: Array
    rate: Array
    lower: Array
    upper: Array
    peak: Array
    reach: Array
    yields: Array
    g: Array
    rate_slope: Array
    lower_slope: Array
    upper_slope: Array
    g_slope: Array


@dataclass(frozen=True)
class Answer:
    """``modes`` (index in m: mode) and torques, or the laws (positions in ``tau``) of the ray on which Lemke's method ended."""

    modes: dict[int, float]
    tau: Array | None
    ray: tuple[int, ...]


class TorqueLaws(Protocol):
    """Laws as functions of their torques: their indices in m (frictions, then contacts) and those of the switches."""

    count: int
    frictions: int
    index: list[int]
    switches: list[int]
    may_free: Mask

    def at(self, point: OperatingPoint, tau: Array) -> LinearLaws:
        """The laws near ``tau`` (``-force`` for contacts)."""
        ...

    def at_rest(self, point: OperatingPoint, near: LinearLaws, zone: float) -> Mask:
        """The laws whose direction of motion is unknown; the others slide in the direction of their speed."""
        ...


class Laws:
    """All friction laws and contacts of a model as functions of their torques."""

    def __init__(self, dae: HybridDae) -> None:
        opened = dae.opened
        assert opened is not None
        self.dae = dae
        self.count = opened.tau.numel()
        self.index = [f.index for f in dae.frictions] + [c.index for c in dae.contacts]
        self.switches = [s.index for s in dae.switches]
        self.frictions = len(dae.frictions)
        self.algebraic = np.array([f.algebraic for f in dae.frictions] + [False] * len(dae.contacts), bool)
        self.may_free = np.array([f.may_free for f in dae.frictions] + [False] * len(dae.contacts), bool)
        self._model_unknowns = opened.residual.numel()
        z = dae.z[: self._model_unknowns] if self._model_unknowns else ca.SX(0, 1)
        moved = ca.vertcat(z, opened.tau)
        values = [opened.residual, opened.speed, opened.rate, opened.lower, opened.upper, opened.conditions]
        slopes = [ca.densify(ca.jacobian(e, moved)) for e in values]
        inputs = [dae.t, dae.x, z, dae.m, dae.p, opened.tau]
        single = [opened.reach, opened.compliance, opened.peak]
        outputs = [*map(ca.densify, values), *slopes, *map(ca.densify, single)]
        self._values = Evaluated(ca.Function("powertrain_laws_opened", inputs, outputs))

    def at(self, point: OperatingPoint, tau: Array) -> LinearLaws:
        """The laws near ``tau`` (``-force`` for contacts); nan where an equation has no value there."""
        z = point.z[: self._model_unknowns]
        sign = np.where(np.arange(self.count) < self.frictions, 1.0, -1.0)
        found = self._values(point.t, point.x, z, point.m, point.p, sign * tau)
        residual, speed, rate, lower, upper, g = (v.ravel() for v in found[:6])
        n = self._model_unknowns
        slopes = []
        step: NDArray[np.floating] = np.zeros(n)
        moved: NDArray[np.floating] = np.zeros((n, self.count))
        if n:
            r_z, r_tau = found[6][:, :n], found[6][:, n:] * sign
            try:
                step, moved = -np.linalg.solve(r_z, residual), -np.linalg.solve(r_z, r_tau)
            except np.linalg.LinAlgError:
                step, moved = np.full(n, np.nan), np.full((n, self.count), np.nan)
        for value, slope in zip((speed, rate, lower, upper, g), found[7:12], strict=True):
            value += slope[:, :n] @ step
            slopes.append(slope[:, n:] * sign + slope[:, :n] @ moved)
        # where a speed is given, as on a part without inertia, the proximal step halves the compliance
        reach, yields, peak = found[12].ravel(), COMPLIANCE / 2 * found[13].ravel(), found[14].ravel()
        peak = np.where(self._keeps_peak(point.m), peak, 1.0)
        return LinearLaws(speed, rate, lower, upper, peak, reach, yields, g, *slopes[1:])

    def _keeps_peak(self, m: Array) -> Mask:
        """Stuck laws, and those that others hold at rest at their limit."""
        marks = [0.0 if f.rests is None else m[f.rests] for f in self.dae.frictions]
        kept: Mask = np.array([*marks, *[0.0] * (self.count - self.frictions)]) > 0.0
        kept |= m[self.index] == STUCK
        return kept

    def at_rest(self, point: OperatingPoint, near: LinearLaws, zone: float) -> Mask:
        """Friction laws whose speed does not decide their mode; contacts that are closed or close without an impact."""
        rest: Mask = (np.abs(near.speed) <= zone) | self.algebraic
        for k, contact in enumerate(self.dae.contacts, self.frictions):
            rest[k] = point.m[contact.index] > 0.5
        rest &= ~(self.may_free & (near.upper - near.lower <= NO_WIDTH))
        return rest


@dataclass(frozen=True)
class _Bends:
    """Conditions on torques at which bounds and rates have kinks, and the change of slope that each adds for g > 0, per unit of g."""

    places: list[int]
    rate: Array
    lower: Array
    upper: Array


class Complementarity:
    """Solves the complementarity problem of one model at any point."""

    def __init__(self, dae: HybridDae, laws: TorqueLaws | None = None) -> None:
        self.dae, self.laws = dae, Laws(dae) if laws is None else laws
        self.switches = self.laws.switches
        self.continuous = np.array([s.continuous for s in dae.switches], bool)
        known = ca.vertcat(*[f.hysteresis for f in dae.frictions], *[c.hysteresis for c in dae.contacts])
        self._known = Evaluated(dae.function("known", known))

    def known(self, point: OperatingPoint) -> Array:
        """Uncertainty of the torques of all laws in the present modes [N.m, N]."""
        return self._known(*point)[0].ravel()

    def solve(self, point: OperatingPoint, tau: Array, zone: float, bends: bool, known: Array | float = 0.0) -> Answer:
        """The modes for laws that are linear near ``tau``.

        ``bends``: kinks of the bounds are part of the problem; otherwise conditions keep their sides. ``known``: how far a law at rest may
        exceed its bounds, the hysteresis of the mode rules.
        """
        laws = self.laws
        near = laws.at(point, tau)
        if np.isnan([near.speed, near.lower, near.upper]).any():
            return Answer({}, None, ())
        places = self.bending(near) if bends else []
        m = point.m.copy()
        m[[self.switches[k] for k in places]] = 0.0
        base = laws.at(replace(point, m=m), tau) if places else near
        bend = self._bends(replace(point, m=m), tau, base, places)
        rest = laws.at_rest(point, base, zone)
        holds = np.where(rest, base.peak, 1.0)
        wide = _widened(base, bend, holds, np.where(rest, known, 0.0))
        answer = _Problem(laws, *wide, tau, rest, zone).answer()
        for law, hold in zip(self.dae.frictions, holds, strict=False):
            # at its peak, but not sliding yet; on a light part its creep would be too large to tell that others hold it
            if law.rests is not None and hold > 1.0:
                answer.modes[law.rests] = float(abs(answer.modes.get(law.index, 0.0)) == 1.0)
        return answer

    def bending(self, near: LinearLaws) -> list[int]:
        """The continuous conditions that depend on torques, as positions in ``switches``."""
        moving = np.flatnonzero(np.abs(near.g_slope).max(axis=1, initial=0.0) > 0.0)
        return [int(k) for k in moving if self.continuous[k]]

    def _bends(self, point: OperatingPoint, tau: Array, base: LinearLaws, places: list[int]) -> _Bends:
        """Slope changes at the kinks: the slopes of a bound on both sides differ by a multiple of the slope of the condition."""
        found = [np.zeros((self.laws.count, len(places))) for _ in range(3)]
        for j, k in enumerate(places):
            m = point.m.copy()
            m[self.switches[k]] = 1.0
            other = self.laws.at(replace(point, m=m), tau)
            along = base.g_slope[k] / (base.g_slope[k] @ base.g_slope[k])
            for column, a, b in zip(
                found,
                (other.rate_slope, other.lower_slope, other.upper_slope),
                (base.rate_slope, base.lower_slope, base.upper_slope),
                strict=True,
            ):
                column[:, j] = np.nan_to_num(a - b) @ along
        return _Bends(places, *found)


def _widened(near: LinearLaws, bend: _Bends, factor: Array, added: Array) -> tuple[LinearLaws, _Bends]:
    """The same laws with all bounds multiplied by ``factor`` and then moved apart by ``added`` on both sides."""
    rows = factor[:, None]
    wide = replace(
        near,
        lower=factor * near.lower - added,
        upper=factor * near.upper + added,
        lower_slope=rows * near.lower_slope,
        upper_slope=rows * near.upper_slope,
    )
    return wide, replace(bend, lower=rows * bend.lower, upper=rows * bend.upper)


class _Problem:
    """The problem at one point: the torques of all laws, those of sliding laws already substituted."""

    def __init__(self, laws: TorqueLaws, near: LinearLaws, bend: _Bends, tau: Array, rest: Mask, zone: float) -> None:
        size = np.abs(near.g_slope[bend.places]).max(axis=1, initial=1e-300)  # conditions count as torques
        bend = replace(bend, rate=bend.rate * size, lower=bend.lower * size, upper=bend.upper * size)
        self.laws, self.near, self.bend, self.rest = laws, near, bend, rest
        n, self.places = laws.count, np.flatnonzero(rest)
        lower, upper = _finite(near.lower), _finite(near.upper)
        self.forward = (near.speed > zone) & ~rest
        slope_l, slope_u = np.nan_to_num(near.lower_slope), np.nan_to_num(near.upper_slope)
        near_tau: Long = tau.astype(np.longdouble)  # large terms cancel, and the effect of the compliance must survive
        l0, u0 = lower - slope_l @ near_tau, upper - slope_u @ near_tau
        # tau = base + own q + added g+: laws at rest have lower + q, sliding laws are at their bound
        bound, slope = np.where(self.forward, u0, l0), np.where(self.forward[:, None], slope_u, slope_l)
        added = np.where(self.forward[:, None], bend.upper, bend.lower)
        # a law at rest without a lower limit is measured downwards from its upper limit; an open contact has both limits at zero here
        self.hangs = rest & np.isinf(near.lower)
        bound = np.where(self.hangs, u0, bound)
        slope = np.where(self.hangs[:, None], slope_u, slope)
        added = np.where(self.hangs[:, None], bend.upper, added)
        inverse = _inverse(np.eye(n) - slope)
        own = np.zeros((n, self.places.size))
        own[self.places, np.arange(self.places.size)] = np.where(self.hangs[self.places], -1.0, 1.0)
        self.tau_0, self.tau_q, self.tau_g = inverse @ bound, inverse @ own, inverse @ added
        self.two = self.places[np.isfinite(near.lower[self.places]) & np.isfinite(near.upper[self.places])]
        self.rate_0, self.width_0 = near.rate - near.rate_slope @ near_tau, u0 - l0
        self.width_slope = slope_u - slope_l
        self.g_slope = near.g_slope[bend.places] / size[:, None]
        self.g_0 = near.g[bend.places] / size - self.g_slope @ near_tau

    def answer(self) -> Answer:
        """The modes of laws at rest, of sliding laws and of the conditions with kinks."""
        M, q, scale = self._matrices()
        if not (np.isfinite(M).all() and np.isfinite(q).all()):
            return Answer({}, None, ())
        found = lemke(M, q / scale)
        r, t = self.places.size, self.two.size
        if found.z is None or found.w is None:
            kinds = [*self.places, *self.two]
            return Answer({}, None, tuple(sorted({int(kinds[k]) for k in found.ray if k < r + t})))
        z, w = found.z * scale, found.w * scale
        tau = self.tau_0 + self.tau_q @ z[:r] + self.tau_g @ z[r + t :]
        modes = {self.laws.index[k]: mode for k, mode in (*self._at_rest(z, w), *self._sliding(tau))}
        nothing = LEAST_TORQUE + ALONE * scale
        for j, k in enumerate(self.bend.places, r + t):
            if z[j] > nothing or w[j] > nothing:  # a condition at zero keeps its side
                modes[self.laws.switches[k]] = 1.0 if z[j] > nothing else 0.0
        return Answer(modes, tau.astype(np.float64), ())

    def _at_rest(self, z: Long, w: Long) -> Iterator[tuple[int, float]]:
        """Laws at rest and their modes: with a rate they slide, or contacts open; with a rate of zero they stick."""
        up = {int(k): z[j] > 0.0 for j, k in enumerate(self.two, self.places.size)}
        for i, k in enumerate(self.places.tolist()):
            first = FORWARD if self.hangs[k] else BACKWARD
            mode = first if w[i] > 0.0 else -first if up.get(k) else STUCK
            yield k, mode if k < self.laws.frictions else CLOSED if mode == STUCK else OPEN

    def _sliding(self, tau: NDArray[np.floating]) -> Iterator[tuple[int, float]]:
        """Sliding friction laws and their modes; the torques may change the limits of a law that these free."""
        free = self.laws.may_free & (self.width_0 + self.width_slope @ tau <= NO_WIDTH)
        for k in np.flatnonzero(~self.rest[: self.laws.frictions]).tolist():
            yield k, FREE if free[k] else FORWARD if self.forward[k] else BACKWARD

    def _matrices(self) -> tuple[Long, Long, float]:
        """Matrix, vector and scale of the problem in (q, v+ of laws with two limits, g+), with rates scaled to torques."""
        R, T, s = self.places, self.two, len(self.bend.places)
        r, t = R.size, T.size
        size = self.near.reach[R]
        tau_z = np.hstack([self.tau_q, np.zeros((self.laws.count, t)), self.tau_g])
        v_z = self.near.rate_slope @ tau_z
        v_z[:, r + t :] += self.bend.rate
        v_0 = self.rate_0 + self.near.rate_slope @ self.tau_0
        yields = self.near.yields[R] / size
        v_z, v_0 = v_z[R] / size[:, None] - yields[:, None] * tau_z[R], v_0[R] / size - yields * self.tau_0[R]
        turn = np.where(self.hangs[R], -1.0, 1.0)
        M, q = np.zeros((r + t + s, r + t + s), np.longdouble), np.zeros(r + t + s, np.longdouble)
        M[:r], q[:r] = -turn[:, None] * v_z, -turn * v_0
        rows = {int(k): i for i, k in enumerate(R)}
        for j, k in enumerate(T.tolist()):
            i = rows[k]
            M[i, r + j] += 1.0
            M[r + j] = self.width_slope[k] @ tau_z
            M[r + j, r + t :] += self.bend.upper[k] - self.bend.lower[k]
            M[r + j, i] -= 1.0
            q[r + j] = self.width_0[k] + self.width_slope[k] @ self.tau_0
        M[r + t :] = -self.g_slope @ tau_z
        M[r + t :, r + t :] += np.eye(s)
        q[r + t :] = -(self.g_0 + self.g_slope @ self.tau_0)
        return M, q, max(LEAST_TORQUE, float(np.abs(q).max(initial=0.0)))


def _inverse(matrix: Array) -> Long:
    """The inverse in extended precision: one Newton step from the inverse in double precision; nan for a singular matrix."""
    try:
        found = np.linalg.inv(matrix).astype(np.longdouble)
    except np.linalg.LinAlgError:
        return np.full(matrix.shape, np.nan, np.longdouble)
    better: Long = found @ (2 * np.eye(len(matrix)) - matrix @ found)
    return better


def _finite(bounds: Array) -> Array:
    return np.where(np.isfinite(bounds), bounds, 0.0)
