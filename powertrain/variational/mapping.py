"""The map of the states over an event with resets and impacts, s+ = R(t, s-, q), with its derivatives.

    reset:   s_i+ = value(t, s-, q)
    impact:  x+ = x- + X j,   A j = -(1 + e) v   for the barriers that are struck (contacts, one-way laws),

v their speeds, e the restitution, X and A the responses of the states and of the barriers' speeds to impulses j.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.dae.hybrid import When
from powertrain.dae.tolerances import REST_SPEED
from powertrain.engine.trajectory import Samples
from powertrain.language.reals import Array
from powertrain.language.symbols import column
from powertrain.modes.projection import at_rest
from powertrain.numerics.many import Many
from powertrain.variational.curvature import Curvature, Tangents
from powertrain.variational.partials import Block, Partials, System
from powertrain.variational.record import Record

_ROUNDS = 20


@dataclass(frozen=True)
class Round:
    """One round of resets or impacts: the map s -> e(t, s, q) of some entries of s; the others are unchanged.

    ``before``: the derivatives of s before the round with respect to t, s and q before the event; ``s``: those of s after the round with
    respect to s before it; ``assigned``: which expression is assigned to which entry; ``impact``: the barriers struck, and which bounce.
    """

    sample: Samples
    before: tuple[Array, Block, Block]
    s: Block
    assigned: dict[int, int]
    impact: tuple[tuple[int, ...], tuple[bool, ...]] | None = None


@dataclass(frozen=True)
class Step:
    """The states and held values after one law has switched, and the map of s by its resets, with respect to s and t.

    ``changed``: the entries of s that are not as before.
    """

    x: Array
    m: Array
    s: Block
    t: Array
    changed: NDArray[np.intp]


@dataclass
class Carried:
    """s after some rounds, and its derivatives with respect to t, s and q before the event."""

    x: Array
    m: Array
    t: Array
    s: Block
    q: Block
    rounds: list[Round]

    def follow(self, t: Array, s: Block, q: Block) -> None:
        """Apply one more round with these derivatives."""
        self.t, self.s, self.q = s @ self.t + t, s @ self.s, s @ self.q + q


class Mapping:
    """The map of the states over the events of one model. Serves one thread."""

    def __init__(self, system: System) -> None:
        dae = system.dae
        self.system, self.dae = system, dae
        self.values = column([r.value for w in dae.whens for r in w.resets])
        self.resets = Partials(system, self.values) if dae.whens else None
        self.barrier_values = self._barriers() if dae.barriers else None
        combined = [w for w in dae.whens if w.relations]
        self.combined = [w.index for w in combined]
        self.conditions = dae.function("combined", column([w.g for w in combined]))
        reset = {*system.discretes, *(w.index for w in dae.whens)}
        self.given = [i for i in dae.free_held if i not in reset]
        self._curvatures: dict[object, Curvature] = {}

    def _barriers(self) -> Partials:
        """Speeds, restitutions, and the responses to impulses."""
        dae = self.dae
        parts = [b.speed for b in dae.barriers] + [b.restitution for b in dae.barriers]
        return Partials(self.system, column([*parts, ca.vec(dae.impact_x), ca.vec(dae.impact_a)]))

    @cached_property
    def _at_rest(self) -> Many:
        return Many(self.dae.arguments, ca.densify(at_rest(self.dae)))

    def settled(self, run: Record, k: int) -> Array:
        """The states before event k, where what is stuck has lost the drift of its speed, as when the simulator resolves the event."""
        rows = self._at_rest(Samples(*(v[k : k + 1] for v in run.instants.left)), run.p)
        return np.asarray(rows[0])

    def map(self, run: Record, k: int, fired: set[int]) -> Carried | None:
        """R and its derivatives at event k, caused by laws with modes at ``fired``; None if the run took another path.

        The resets see the switches and signals as they were before the event if they cause their changes, else with their new values.
        """
        events = run.instants
        return self._map(run, k, fired, events.left.m[k]) or self._map(run, k, fired, events.right.m[k])

    def _map(self, run: Record, k: int, fired: set[int], seen: Array) -> Carried | None:
        events = run.instants
        left_m, right_m = events.left.m[k], events.right.m[k]
        now = self._begin(self.settled(run, k), left_m)
        now.m[self.given] = seen[self.given]
        fired = fired | self._combined(run, k, fired)
        rising = [w for w in self.dae.whens if left_m[w.index] < 0.5 and (w.index in fired or right_m[w.index] > 0.5)]
        rounds = [[w for w in rising if w.index in fired], [w for w in rising if w.index not in fired]]
        for whens in rounds:
            if whens:
                self._reset(run, k, now, whens)
        if follow := self._following(run, k, now, rising):
            self._reset(run, k, now, follow)
        if struck := self._struck(run, k):
            now.m[self.given] = right_m[self.given]  # switches and signals strike with their new values
            self._impact(run, k, now, struck)
        reached = np.concatenate([now.x, now.m[self.system.discretes]])
        found = np.concatenate([events.right.x[k], right_m[self.system.discretes]])
        if differ(reached, found).any():
            return None
        return now

    def step(self, run: Record, k: int, x: Array, m: Array, fired: set[int], index: int) -> Step:
        """The resets and impacts at event k due to the law with its mode at ``index``, the last of those that ``fired``, at x and m."""
        by_now = {index} | self._combined(run, k, fired)
        rising, now = [w for w in self.dae.whens if m[w.index] < 0.5 and w.index in by_now], self._begin(x, m)
        if rising:
            self._reset(run, k, now, rising)
        if struck := [j for j in self._struck(run, k) if self.dae.barriers[j].index == index]:
            self._impact(run, k, now, struck)
        changed = np.append(now.x != x, (now.m != m)[self.system.discretes])
        changed |= (now.s != np.eye(len(now.s))).any(axis=1) | (now.t != 0.0)
        return Step(now.x, now.m, now.s, now.t, np.flatnonzero(changed))

    def _struck(self, run: Record, k: int) -> list[int]:
        return [j for j, b in enumerate(self.dae.barriers) if (b.name, "impact") in run.instants.extra[k]]

    def _begin(self, x: Array, m: Array) -> Carried:
        size, nq = self.system.size, self.system.free.numel()
        return Carried(x.copy(), m.copy(), np.zeros(size), np.eye(size), np.zeros((size, nq)), [])

    def hessian(self, p: Array, rounds: Sequence[Round], weights: Array, along: Tangents) -> Block:
        """(w^T R)''[V, V]: the sum over the rounds, each with the weights after it and the tangents before it."""
        count = along.s.shape[2]
        found = np.zeros((count, count))
        for each in reversed(rounds):
            curvature = self._curvature(each)
            seeds = np.zeros((1, curvature.explicit))
            seeds[0, list(each.assigned.values())] = weights[list(each.assigned)]
            t, s, q = each.before
            moved = t[:, None] * along.t + s @ along.s + q @ along.q
            found += curvature(each.sample, p, seeds, Tangents(along.t, moved, along.q))
            weights = weights @ each.s
        return found

    def _curvature(self, of: Round) -> Curvature:
        """The curvature of the values of the resets, or of x + X j for the barriers struck, some of which bounce."""
        if of.impact not in self._curvatures:
            values, dae = self.values, self.dae
            if of.impact is not None:
                struck, bounces = list(of.impact[0]), of.impact[1]
                laws = [dae.barriers[j] for j in struck]
                speeds = [(1 + b.restitution if back else 1) * b.speed for b, back in zip(laws, bounces, strict=True)]
                values = dae.x - dae.impact_x[:, struck] @ ca.solve(dae.impact_a[struck, struck], column(speeds))
            self._curvatures[of.impact] = Curvature(self.system, values)
        return self._curvatures[of.impact]

    def _following(self, run: Record, k: int, now: Carried, done: Sequence[When]) -> list[When]:
        """Laws triggered by previous resets and over again at the right limit, recognised by the values that their resets left."""
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
            if when not in done and any(differ(old, new) for _, old, new in pairs):
                found += [when] if not any(differ(value, new) for value, _, new in pairs) else []
        return found

    def _combined(self, run: Record, k: int, fired: set[int]) -> set[int]:
        """The laws whose combined conditions hold with the comparisons that change at event k."""
        left = run.instants.left
        m = left.m[k].copy()
        turned = [r.index for r in self.dae.relations if r.index in fired]
        m[turned] = 1.0 - m[turned]
        values = self.conditions(left.t[k], left.x[k], left.z[k], m, run.p)
        return {i for i, g in zip(self.combined, np.array(values).ravel(), strict=True) if turned and g > 0.0}

    def _sample(self, run: Record, k: int, now: Carried) -> Samples:
        left = run.instants.left
        return Samples(left.t[k : k + 1], now.x[None].copy(), left.z[k : k + 1], now.m[None].copy())

    def _reset(self, run: Record, k: int, now: Carried, whens: Sequence[When]) -> None:
        """Assign all right-hand sides, evaluated with the values before."""
        assert self.resets is not None
        sample = self._sample(run, k, now)
        slopes = self.resets(sample, run.p)
        t, s, q = np.zeros_like(now.t), np.eye(len(now.t)), np.zeros_like(now.q)
        first, assigned = 0, dict[int, int]()
        for when in self.dae.whens:
            for j, reset in enumerate(when.resets, first):
                if when not in whens:
                    continue
                row = self.system.states + self.system.discretes.index(reset.index) if reset.discrete else reset.index
                (now.m if reset.discrete else now.x)[reset.index] = slopes.value[0, j]
                t[row], s[row], q[row] = slopes.t[0, j], slopes.s[0, j], slopes.q[0, j]
                assigned[row] = j
            first += len(when.resets)
        now.rounds.append(Round(sample, (now.t, now.s, now.q), s, assigned))
        now.follow(t, s, q)
        for when in whens:
            now.m[when.index] = 1.0

    def _impact(self, run: Record, k: int, now: Carried, struck: list[int]) -> None:
        assert self.barrier_values is not None
        sample = self._sample(run, k, now)
        slopes = self.barrier_values(sample, run.p)
        n, count = self.system.states, len(self.dae.barriers)
        v, e = np.array(struck), count + np.array(struck)
        on_x = 2 * count + np.arange(n * count).reshape(count, n).T[:, struck]
        on_a = 2 * count + n * count + np.arange(count * count).reshape(count, count).T[np.ix_(struck, struck)]
        value = slopes.value[0]
        bounces = -value[e] * value[v] >= REST_SPEED
        factor = 1.0 + np.where(bounces, value[e], 0.0)
        impulse = np.linalg.solve(value[on_a], -factor * value[v])

        def effect(d: Block) -> Block:
            """The change of the states due to the change of all values, for t, s or q."""
            uneven = np.einsum("ijv,j->iv", d[on_a], impulse)
            turned = factor[:, None] * d[v] + (bounces * value[v])[:, None] * d[e]
            d_impulse = -np.linalg.solve(value[on_a], uneven + turned)
            return np.asarray(np.einsum("ijv,j->iv", d[on_x], impulse) + value[on_x] @ d_impulse)

        t, s, q = np.zeros_like(now.t), np.eye(len(now.t)), np.zeros_like(now.q)
        t[:n] = effect(slopes.t[0][:, None])[:, 0]
        s[:n] += effect(slopes.s[0])
        q[:n] = effect(slopes.q[0])
        pattern = tuple(struck), tuple(bounces.tolist())
        now.rounds.append(Round(sample, (now.t, now.s, now.q), s, {i: i for i in range(n)}, pattern))
        now.follow(t, s, q)
        now.x = now.x + value[on_x] @ impulse


def differ(one: Any, other: Any) -> Any:
    """Whether values differ by more than round-off."""
    return np.abs(one - other) > 1e-7 * (1.0 + np.abs(other))
