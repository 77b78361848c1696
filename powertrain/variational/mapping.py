"""How resets and impacts carry the states over an event: s+ = R(t, s-, q), with its derivatives.

    reset:   s_i+ = value(t, s-, q)
    impact:  x+ = x- + X j,   A j = -(1 + e) v   for the contacts that are struck,

v the speeds of their gaps, e the restitution, X and A the responses of the states and of the gaps to impulses j.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.hybrid import When
from powertrain.language.symbols import column
from powertrain.modes.resolve import REST_SPEED
from powertrain.numerics.buffers import Array
from powertrain.signals import Samples
from powertrain.variational.partials import Partials, Slopes, System
from powertrain.variational.record import Record

_ROUNDS = 20


@dataclass
class _Carried:
    """s after some rounds, and its derivatives with respect to t, s and q before the event."""

    x: Array
    m: Array
    t: Array
    s: NDArray[np.float64]
    q: NDArray[np.float64]


class Mapping:
    """The map of the states over the events of one model. Serves one thread."""

    def __init__(self, system: System) -> None:
        dae = system.dae
        self.system, self.dae = system, dae
        self.resets = Partials(system, column([r.value for w in dae.whens for r in w.resets])) if dae.whens else None
        self.contact_values = self._contacts() if dae.contacts else None
        combined = [w for w in dae.whens if w.relations]
        conditions = ca.densify(column([w.g for w in combined]))
        self.combined = [w.index for w in combined]
        self.conditions = ca.Function("powertrain_combined", [*system.inputs], [conditions])

    def _contacts(self) -> Partials:
        """Speeds, restitutions, and the responses to impulses."""
        dae = self.dae
        parts = [c.speed for c in dae.contacts] + [c.restitution for c in dae.contacts]
        return Partials(self.system, column([*parts, ca.vec(dae.impact_x), ca.vec(dae.impact_a)]))

    def map(
        self, run: Record, k: int, fired: set[int]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], Array] | None:
        """R_s, R_q and R_t at event k, where laws with modes at ``fired`` started it; None where the run went another way."""
        events, n, nd = run.instants, self.system.states, len(self.system.discretes)
        left_m, right_m = events.left.m[k], events.right.m[k]
        size, nq = n + nd, self.system.free.numel()
        now = _Carried(events.left.x[k].copy(), left_m.copy(), np.zeros(size), np.eye(size), np.zeros((size, nq)))
        fired = fired | self._combined(run, k, fired)
        rising = [w for w in self.dae.whens if left_m[w.index] < 0.5 and (w.index in fired or right_m[w.index] > 0.5)]
        rounds = [[w for w in rising if w.index in fired], [w for w in rising if w.index not in fired]]
        for whens in rounds:
            if whens:
                self._reset(run, k, now, whens)
        if follow := self._following(run, k, now, rising):
            self._reset(run, k, now, follow)
        struck = [j for j, c in enumerate(self.dae.contacts) if (c.name, "impact") in events.extra[k]]
        if struck:
            self._impact(run, k, now, struck)
        reached = np.concatenate([now.x, now.m[self.system.discretes]])
        found = np.concatenate([events.right.x[k], right_m[self.system.discretes]])
        if _differ(reached, found).any():
            return None
        return now.s, now.q, now.t

    def _following(self, run: Record, k: int, now: _Carried, done: Sequence[When]) -> list[When]:
        """Laws that what was reset before has set off, and that are over again at the right: their resets are what was found there."""
        if self.resets is None:
            return []
        values = self.resets(self._sample(run, k, now), run.p).value[0]
        right, found, first = run.instants.right, [], 0
        for when in self.dae.whens:
            pairs = [
                (value, (now.m if r.discrete else now.x)[r.index], (right.m if r.discrete else right.x)[k][r.index])
                for r, value in zip(when.resets, values[first:], strict=False)
            ]
            first += len(when.resets)
            if when not in done and any(_differ(old, new) for _, old, new in pairs):
                found += [when] if not any(_differ(value, new) for value, _, new in pairs) else []
        return found

    def _combined(self, run: Record, k: int, fired: set[int]) -> set[int]:
        """The laws whose combined conditions hold with the comparisons that turn at event k."""
        left = run.instants.left
        m = left.m[k].copy()
        turned = [r.index for r in self.dae.relations if r.index in fired]
        m[turned] = 1.0 - m[turned]
        values = self.conditions(left.t[k], left.x[k], left.z[k], m, run.p)
        return {i for i, g in zip(self.combined, np.array(values).ravel(), strict=True) if turned and g > 0.0}

    def _sample(self, run: Record, k: int, now: _Carried) -> Samples:
        left = run.instants.left
        return Samples(left.t[k : k + 1], now.x[None], left.z[k : k + 1], now.m[None])

    def _reset(self, run: Record, k: int, now: _Carried, whens: Sequence[When]) -> None:
        """All right sides with the values before."""
        assert self.resets is not None
        slopes = self.resets(self._sample(run, k, now), run.p)
        old = (now.t.copy(), now.s.copy(), now.q.copy())
        first = 0
        for when in self.dae.whens:
            for j, reset in enumerate(when.resets, first):
                if when not in whens:
                    continue
                row = self.system.states + self.system.discretes.index(reset.index) if reset.discrete else reset.index
                (now.m if reset.discrete else now.x)[reset.index] = slopes.value[0, j]
                now.t[row], now.s[row], now.q[row] = _chain(slopes, j, *old)
            first += len(when.resets)
        for when in whens:
            now.m[when.index] = 1.0

    def _impact(self, run: Record, k: int, now: _Carried, struck: list[int]) -> None:
        assert self.contact_values is not None
        slopes = self.contact_values(self._sample(run, k, now), run.p)
        n, count = self.system.states, len(self.dae.contacts)
        closed = [j for j, c in enumerate(self.dae.contacts) if now.m[c.index] and slopes.value[0, j] < 0.0]
        struck = [*struck, *(j for j in closed if j not in struck)]
        v, e = np.array(struck), count + np.array(struck)
        on_x = 2 * count + np.arange(n * count).reshape(count, n).T[:, struck]
        on_a = 2 * count + n * count + np.arange(count * count).reshape(count, count).T[np.ix_(struck, struck)]
        value = slopes.value[0]
        bounces = -value[e] * value[v] >= REST_SPEED
        factor = 1.0 + np.where(bounces, value[e], 0.0)
        impulse = np.linalg.solve(value[on_a], -factor * value[v])
        old = (now.t.copy(), now.s.copy(), now.q.copy())
        changes = [_chain(slopes, j, *old) for j in range(slopes.value.shape[1])]

        def effect(pick: int) -> NDArray[np.float64]:
            """The change of the states by the change of all values, for t, s or q."""
            d = np.array([np.atleast_1d(c[pick]) for c in changes])
            uneven = np.einsum("ijv,j->iv", d[on_a], impulse)
            turned = factor[:, None] * d[v] + (bounces * value[v])[:, None] * d[e]
            d_impulse = -np.linalg.solve(value[on_a], uneven + turned)
            return np.asarray(np.einsum("ijv,j->iv", d[on_x], impulse) + value[on_x] @ d_impulse)

        now.t[:n] += effect(0)[:, 0]
        now.s[:n] += effect(1)
        now.q[:n] += effect(2)
        now.x = now.x + value[on_x] @ impulse


def _differ(one: Any, other: Any) -> Any:
    """Whether values are more than round-off apart."""
    return np.abs(one - other) > 1e-7 * (1.0 + np.abs(other))


def _chain(
    slopes: Slopes, j: int, t: Array, s: NDArray[np.float64], q: NDArray[np.float64]
) -> tuple[Array, Array, Array]:
    """The derivatives of value j with respect to t, s and q before the event, through s as it is now."""
    row = slopes.s[0, j]
    return slopes.t[0, j] + row @ t, row @ s, slopes.q[0, j] + row @ q
