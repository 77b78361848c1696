"""All modes of all laws at one instant, found together: fixed point, principal pivoting, enumeration."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

import casadi as ca
import numpy as np

from powertrain.compiler.hybrid import Contact, HybridDae, When
from powertrain.engine.buffers import Array, Bound, Memory, view
from powertrain.engine.consistent import Algebra, NotConsistent
from powertrain.engine.enumeration import enumerate_modes, strict
from powertrain.engine.jam import jam_message, undetermined_laws, undetermined_message
from powertrain.engine.recall import Recall
from powertrain.engine.redundancy import Redundancy
from powertrain.engine.resting import Resting
from powertrain.engine.steps import PREFIX
from powertrain.engine.uniqueness import Uniqueness
from powertrain.errors import SimulationError

_PASSES = 20
_ROUNDS = 10_000
_SLACK = 1e-9
_TRIES = 100_000
"""Combinations tried in one run, above which all laws are no longer tried where those that change do not suffice."""
REST_SPEED = 1e-4
"""A contact that would rebound slower than this (m/s or rad/s) stays closed."""


class Resolver:
    """Brings ``memory.m`` (and x, z after resets and impacts) to a consistent state on one side of the buffers."""

    def __init__(
        self, dae: HybridDae, memory: Memory, update: Sequence[Bound], fresh: Sequence[Bound], algebra: Algebra | None
    ) -> None:
        self.dae, self.memory, self.algebra = dae, memory, algebra
        self.n = dae.x.numel()
        self._update, self._fresh = update, fresh
        self._values = _Events(dae, memory) if dae.whens or dae.contacts else None
        self.extra: list[tuple[str, str]] = []
        self._unsolved: NotConsistent | None = None
        self.redundancy = Redundancy(dae, memory)
        self.uniqueness = Uniqueness(dae, memory)
        self.resting = Resting(dae, memory, self.redundancy)
        self._recall = Recall(memory.m)
        self._tries = 0
        self._flags = view(memory.flags)

    def resolve(self, side: int) -> None:
        """Find the modes at ``memory.time[0]`` for ``memory.y[side]``; ``memory.fire`` and ``memory.jumped`` are used and cleared."""
        self.extra, self._unsolved = [], None
        self.resting.look_back(side)
        for _ in range(_ROUNDS):
            if self._fixed_point(side):
                self.resting.look(side)
                return
        names = sorted({name for name, _ in self.extra})
        raise SimulationError(
            f"at t = {self.memory.time[0]:.9g} s resets follow each other without end: {', '.join(names)}"
        )

    def _fixed_point(self, side: int) -> bool:
        """Iterate the mode rules; False if a reset or an impact happened and the round must start again."""
        memory, call, flags = self.memory, self._update[side].call, self._flags
        m, held = memory.m, memory.held
        seen: set[bytes] = set()
        varied: set[int] = set()
        for n in range(_PASSES):
            if not self._solvable(side):
                break
            call()
            if (flags[1] or flags[2]) and self._discontinuity(side):
                return False
            if n == 0:
                memory.fire.fill(0.0)
                memory.jumped[0] = 0.0
            if not flags[0]:
                return self._finite(side, varied)
            if n > 2:
                varied.update(np.flatnonzero(m != held).tolist())
                key = m.tobytes()
                if key in seen:
                    break
                seen.add(key)
            m[:] = held
        return self._pivot(side, varied)

    def _pivot(self, side: int, varied: set[int]) -> bool:
        """Flip the first violated law only, until none is left or the modes repeat; then enumerate."""
        memory, call = self.memory, self._update[side].call
        m, held, flags = memory.m, memory.held, memory.flags
        seen: set[bytes] = set()
        while m.tobytes() not in seen:
            seen.add(m.tobytes())
            if not self._solvable(side):
                break
            call()
            if (flags[1] or flags[2]) and self._discontinuity(side):
                return False
            if not flags[0]:
                return self._finite(side, varied)
            changed = np.flatnonzero(m != held)
            varied.update(changed.tolist())
            m[changed[0]] = held[changed[0]]
        return self._enumerate(side, varied)

    def _finite(self, side: int, varied: set[int]) -> bool:
        """Stuck laws that lock the same motion leave their torques undetermined: look for a combination that gives the same motion."""
        if isfinite(self._flags[3]):
            self.redundancy.note(side)
            return True
        laws = undetermined_laws(self.dae, self.memory, side)
        if len(laws) < 2:
            return True
        self._enumerate(side, varied, undetermined_message(laws, self.memory.time[0]))
        self.redundancy.add(laws)
        return True

    def check_unique(self, side: int) -> None:
        """Refuse modes beside which others are possible with other torques."""
        others = self.uniqueness.others(side, lambda: self._try(side))
        if self.uniqueness.pieces:
            self._solve(side)
            self._update[side].call()
        if others:
            modes, pieces = [self.memory.m.copy(), *others], self.uniqueness.pieces
            raise SimulationError(jam_message(self.dae, self.memory, side, modes, pieces, 2 ** len(pieces)))

    @property
    def notes(self) -> list[str]:
        """What is not unique."""
        return self.redundancy.notes

    def forget(self) -> None:
        """Drop the notes of the last run."""
        self.redundancy.forget()
        self.resting.forget()
        self._recall.forget()
        self._tries = 0

    def _enumerate(self, side: int, varied: set[int], message: str | None = None) -> bool:
        if self._recall.again(lambda: self._try(side) is not None and strict(self.dae, self.memory, side)):
            self.redundancy.note(side)
            return True
        for narrow in (True, False):
            found = enumerate_modes(self.dae, self.memory, side, varied, lambda: self._try(side), narrow)
            self._tries += found.combinations
            if found.modes or self._tries > _TRIES:
                break
        if len(found.modes) == 1:
            before = self.memory.m.copy()
            self.memory.m[:] = found.modes[0]
            self._recall.keep(found.involved, before)
            self._solve(side)
            self.redundancy.note(side)
            return True
        if self._unsolved is not None and not found.involved:
            raise self._unsolved
        raise SimulationError(
            message or jam_message(self.dae, self.memory, side, found.modes, found.involved, found.combinations)
        )

    def _solvable(self, side: int) -> bool:
        """Solve the algebraic equations for the present modes; whether they have a solution."""
        if self.algebra is None:
            return True
        try:
            self._solve(side)
        except NotConsistent as error:
            self._unsolved = error
            return False
        return True

    def _try(self, side: int) -> Array | None:
        """The rates with the present modes, or None if these are not consistent."""
        memory = self.memory
        if self.algebra is not None:
            try:
                self.algebra.solve(side)
            except NotConsistent:
                return None
        rates = self._rates(side)
        largest = max(map(abs, rates.tolist()), default=0.0)
        if not largest < np.inf:
            return None
        memory.jumped[1] = _SLACK * (1.0 + largest)
        self._update[side].call()
        memory.jumped[1] = 0.0
        return None if memory.flags[0] else rates

    def _rates(self, side: int) -> Array:
        self._fresh[side].call()
        return self.memory.slope[1 - side][: self.n].copy()

    def _solve(self, side: int) -> None:
        if self.algebra is not None:
            self.algebra.solve(side)

    def _discontinuity(self, side: int) -> bool:
        """Apply the resets of all rising edges, else one impact of all closing contacts."""
        memory = self.memory
        assert self._values is not None
        if memory.flags[1]:
            rising = [when for k, when in enumerate(self.dae.whens) if memory.edges[k]]
            self._values.reset(side, rising)
            self.extra += [(when.name, "reset") for when in rising if any(not r.discrete for r in when.resets)]
        else:
            closing = [k for k in range(len(self.dae.contacts)) if memory.closing[k]]
            self._values.impact(side, closing)
            self.extra += [(self.dae.contacts[k].name, "impact") for k in closing]
        memory.jumped[0] = 1.0
        return True


class _Events:
    """Values of resets and impacts, evaluated when one happens."""

    def __init__(self, dae: HybridDae, memory: Memory) -> None:
        self.dae, self.memory = dae, memory
        inputs = [dae.t, dae.x, dae.z, dae.m, dae.p]
        values = ca.vertcat(*[reset.value for when in dae.whens for reset in when.resets])
        contacts = [ca.vertcat(*[getattr(c, field) for c in dae.contacts]) for field in ("speed", "restitution")]
        self._resets = ca.Function(PREFIX + "resets", inputs, [ca.densify(values)])
        outputs = [ca.densify(e) for e in (*contacts, dae.impact_x, dae.impact_a)]
        self._impact = ca.Function(PREFIX + "impact", inputs, outputs)
        self._first = {}
        count = 0
        for when in dae.whens:
            self._first[when.index] = count
            count += len(when.resets)

    def _arguments(self, side: int) -> list[ca.DM]:
        memory, n = self.memory, self.dae.x.numel()
        y = memory.y[side]
        nz, nm, np_ = self.dae.z.numel(), self.dae.m.numel(), self.dae.p.numel()
        return [ca.DM(v) for v in (memory.time[0], y[:n], y[n : n + nz], memory.m[:nm], memory.p[:np_])]

    def reset(self, side: int, rising: Sequence[When]) -> None:
        """Assign all right sides, evaluated with the values before."""
        values = np.array(self._resets(*self._arguments(side))).ravel()
        for when in rising:
            self.memory.m[when.index] = 1.0
            for k, reset in enumerate(when.resets, self._first[when.index]):
                target = self.memory.m if reset.discrete else self.memory.y[side]
                target[reset.index] = values[k]

    def impact(self, side: int, closing: Sequence[int]) -> None:
        """Impulses on the closing contacts and on closed ones that would move inwards; slow rebounds stay closed."""
        contacts: Sequence[Contact] = self.dae.contacts
        m = self.memory.m
        speed, restitution, on_x, on_a = (np.array(v) for v in self._impact(*self._arguments(side)))
        speed, restitution = speed.ravel(), restitution.ravel()
        closed = [k for k, c in enumerate(contacts) if m[c.index] and speed[k] < 0.0 and k not in closing]
        struck = [*closing, *closed]
        rebound = np.where(-restitution[struck] * speed[struck] < REST_SPEED, 0.0, restitution[struck])
        impulse = np.linalg.lstsq(on_a[np.ix_(struck, struck)], -(1.0 + rebound) * speed[struck], rcond=None)[0]
        self.memory.y[side][: self.dae.x.numel()] += on_x[:, struck] @ impulse
        for k, e in zip(struck, rebound, strict=True):
            m[contacts[k].index] = 1.0 if e == 0.0 else 0.0
