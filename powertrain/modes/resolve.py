"""Finds the modes of all laws at one instant together: semismooth Newton first, then the complementarity problem."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from itertools import islice, product
from typing import NoReturn

import numpy as np

from powertrain.dae.contact import CLOSED, OPEN
from powertrain.dae.friction import BACKWARD, FORWARD, STUCK
from powertrain.dae.hybrid import JUMPED, START, HybridDae, OperatingPoint
from powertrain.dae.tolerances import ZONE
from powertrain.errors import SimulationError
from powertrain.language.reals import Array
from powertrain.modes.algebra import AlgebraicSolver, NotConsistent
from powertrain.modes.complementarity import Complementarity
from powertrain.modes.discontinuities import Discontinuities
from powertrain.modes.jam import jam_message, not_found_message, several_message
from powertrain.modes.resting import resting
from powertrain.modes.uniqueness import others, pieces_of
from powertrain.numerics.buffers import CHANGES, CLOSING, IDLE, JUMPS, Call, Memory, view

Alternatives = tuple[list[int], list[tuple[float, ...]]]
"""Places in the held values and the values that they may have together."""

PASSES = 20
"""Passes of the semismooth Newton method before it counts as not converging."""
_ROUNDS = 10_000
"""Resets and impacts at one instant."""
_LINEARIZED = 16
"""Linearisations of the complementarity problem, if laws are nonlinear in the torques or conditions on speeds change."""
_EXCHANGES = 200
"""Laws whose modes are exchanged one by one."""
_MOST_PIECES = 12
"""Conditions on torques in the bounds; with more there are too many combinations to try."""
_MOST_COMBINATIONS = 5000
"""Combinations of modes that are tried one by one if bounds depend on torques."""


class ModeResolver:
    """Brings ``memory.m`` (and x, z after resets and impacts) to a consistent state on one side of the buffers."""

    def __init__(
        self,
        dae: HybridDae,
        memory: Memory,
        update: Sequence[Call],
        fresh: Sequence[Call],
        algebra: AlgebraicSolver | None,
        carry: Callable[[int], bool],
    ) -> None:
        self.dae, self.memory, self.algebra, self._carry = dae, memory, algebra, carry
        self.n = dae.x.numel()
        self._update, self._fresh = update, fresh
        self._discontinuities = Discontinuities(dae, memory) if dae.whens or dae.barriers else None
        self.extra: list[tuple[str, str]] = []
        self.applied: list[int] = []
        """The places of the modes of the ``when`` laws whose resets were applied, also of those that are false again."""
        self.notes: list[str] = []
        self._unsolved: NotConsistent | None = None
        self._pieces = pieces_of(dae)
        self._rests = [f.rests for f in dae.frictions if f.rests is not None]
        self._flags, self._jump, self._begins = view(memory.flags), JUMPED, False

    def resolve(self, side: int, jumped: float) -> None:
        """Find the modes at ``memory.time[0]`` for ``memory.y[side]``; uses and clears ``memory.fire``.

        ``jumped``: ``START``, ``JUMPED`` if held values have jumped since the last modes, otherwise 0.
        """
        memory = self.memory
        memory.jumped[0], self._jump, self._begins = jumped, jumped or JUMPED, jumped == START
        self.extra, self.applied, self._unsolved = [], [], None
        if self._discontinuities is not None:
            self._discontinuities.impulses[:] = 0.0
        seen = set[bytes]()
        while len(seen) < _ROUNDS:
            if self._found(side) and not self._reset(side):
                memory.fire.fill(0.0)
                return
            if (state := self._state(side)) in seen:
                break
            seen.add(state)
        names = sorted({name for name, _ in self.extra} | {w.name for w in self.dae.whens if w.index in self.applied})
        if not names:
            at_limit = [f.index for f in self.dae.frictions if f.rests is not None]
            raise SimulationError(not_found_message(self.dae, memory, side, at_limit))
        raise SimulationError(
            f"at t = {memory.time[0]:.9g} s resets follow one another without end: {', '.join(names)}"
        )

    @property
    def impulses(self) -> tuple[float, ...]:
        """What each barrier has transmitted at this instant (N.m.s, N.s); empty without an impact."""
        found = self._discontinuities.impulses if self._discontinuities is not None else np.zeros(0)
        return tuple(found.tolist()) if found.any() else ()

    def _state(self, side: int) -> bytes:
        """What the next round depends on: if it recurs, the rounds repeat without end."""
        memory = self.memory
        return b"".join(a.tobytes() for a in (memory.y[side], memory.m, memory.jumped, memory.fire))

    def _found(self, side: int) -> bool:
        """Modes starting from the present ones, else from the complementarity problem; False after an impact."""
        happened = self._newton(side)
        return self._complementary(side) if happened is None else happened

    def _newton(self, side: int, slack: float = 0.0) -> bool | None:
        """Semismooth Newton: the rules of all laws are applied at the same torques.

        True if the resulting modes are consistent, False after an impact, None if the iteration does not converge. Modes without a solution
        on the way are not its end: the rules judge them by the last one, and those of conditions on the states settle.
        """
        memory, flags = self.memory, self._flags
        seen: set[bytes] = set()
        for _ in range(PASSES):
            if self._jump == JUMPED and self._carry(side):
                memory.jumped[0] = JUMPED
            solved = self._judged(side, slack)
            if not solved and not flags[CHANGES]:
                return None
            # what is struck while held values still change the motions may not be struck by their last values
            if solved and flags[CLOSING] and not flags[JUMPS]:
                self._impact(side)
                return False
            memory.jumped[0] = 0.0
            if not flags[CHANGES]:
                return True
            key = memory.m.tobytes()
            if key in seen:
                return None
            seen.add(key)
            memory.m[:], memory.jumped[0] = memory.held, self._jump * flags[JUMPS]
        return None

    @cached_property
    def _problem(self) -> Complementarity:
        return Complementarity(self.dae)

    def _complementary(self, side: int) -> bool:
        """Solve the complementarity problem of all laws; False after an impact."""
        if self.dae.opened is None:
            return self._jam(side, set(), 1)
        start, pieces, against = self.memory.m.copy(), self._pieces, set[int]()
        found, laws = self._linearized(side, held=False)
        if found is not None:
            return found
        self.memory.m[:] = start
        if self._one_by_one(side):
            return True
        if len(pieces) > _MOST_PIECES:
            raise SimulationError(not_found_message(self.dae, self.memory, side, sorted({*laws, *pieces})))
        for piece in product((0.0, 1.0), repeat=len(pieces)):  # each piece is a separate problem
            self.memory.m[:] = start
            self.memory.m[pieces] = piece
            found, ray = self._linearized(side, held=True)
            laws |= ray
            against |= set(np.flatnonzero(self.memory.m != self.memory.held).tolist()).difference(pieces)
            if found is not None:
                return found
        return self._tried(side, start, laws, against)

    def _one_by_one(self, side: int) -> bool:
        """Change the mode of one law at a time, the first that its rule would change; False if modes recur.

        K. G. Murty, Note on a Bard-type scheme for solving the complementarity problem, Opsearch 11 (1974) 123.
        """
        m, held, seen = self.memory.m, self.memory.held, set[bytes]()
        for _ in range(_EXCHANGES):
            if self._consistent(side):
                return True
            wanted = [group for group in self._groups if m[group[0]] != held[group[0]]]
            if not wanted or (key := m.tobytes()) in seen:
                return False
            seen.add(key)
            m[wanted[0]] = held[wanted[0]]
        return False

    @cached_property
    def _groups(self) -> list[list[int]]:
        """The places of each law in the held values: its mode, and whether others hold it at rest at its limit."""
        frictions = [[f.index] if f.rests is None else [f.index, f.rests] for f in self.dae.frictions]
        contacts, switches = [[c.index] for c in self.dae.contacts], [[s.index] for s in self.dae.switches]
        return [*frictions, *contacts, *switches]

    def _tried(self, side: int, start: Array, laws: set[int], against: set[int]) -> bool:
        """Try all modes of ``laws`` (on a ray) and ``against``, then of all laws at rest, in all pieces.

        If bounds depend on torques, a ray proves nothing.
        """
        m, pieces, problem = self.memory.m, self._pieces, self._problem
        m[:] = start
        point = self._point(side)
        rest = problem.laws.at_rest(point, problem.laws.at(point, np.zeros(problem.laws.count)), ZONE)
        few, count = laws | against, 0
        all_at_rest = few | {problem.laws.index[k] for k in np.flatnonzero(rest)}
        for varied in (few, all_at_rest) if len(few) < len(all_at_rest) else (few,):
            # the pieces before the event come first
            tried: list[Alternatives] = [([i], [(start[i],), (1.0 - start[i],)]) for i in pieces]
            tried += self._alternatives(varied)
            places = [i for group, _ in tried for i in group]
            for modes in islice(product(*(values for _, values in tried)), _MOST_COMBINATIONS):
                m[places] = [value for values in modes for value in values]
                if self._consistent(side):
                    return True
            count = math.prod(len(values) for _, values in tried)
        if count > _MOST_COMBINATIONS:
            raise SimulationError(not_found_message(self.dae, self.memory, side, sorted({*laws, *pieces})))
        return self._jam(side, laws, 2 ** len(pieces))

    def _alternatives(self, varied: set[int]) -> list[Alternatives]:
        """The possible modes of these laws; those that others hold at their limits are marked when modes are judged."""
        dae = self.dae
        options = [(STUCK, FORWARD, BACKWARD)] * len(dae.frictions) + [(OPEN, CLOSED)] * len(dae.contacts)
        groups = [each for each in zip(self._groups, options, strict=False) if each[0][0] in varied]
        return [(places, [(mode, 0.0)[: len(places)] for mode in modes]) for places, modes in groups]

    def _linearized(self, side: int, held: bool) -> tuple[bool | None, set[int]]:
        """Linearise the laws at the last solution and solve for their modes, until these are consistent.

        Returns True, False or None as ``_newton`` does, and the laws of the ray on which the search ended. The first problem includes the
        kinks of the bounds, unless ``held``.
        """
        memory, problem = self.memory, self._problem
        m, ray, known = memory.m, set[int](), problem.known(self._point(side))
        tau = np.zeros(problem.laws.count)
        for n in range(_LINEARIZED):
            answer = problem.solve(self._point(side), tau, ZONE, bends=n == 0 and not held, known=known)
            if answer.tau is None:
                ray |= {problem.laws.index[k] for k in answer.ray}
                if n or held:
                    break
                continue
            tau = answer.tau
            for index, mode in answer.modes.items():
                m[index] = mode
            modes = m.copy()
            happened = self._newton(side, slack=1.0)  # exact except for the compliance
            if happened is not None:
                return happened, ray
            m[:] = modes
            if not self._judged(side):
                continue
            turned = [i for i in np.flatnonzero(m != memory.held).tolist() if i not in problem.laws.index]
            if held and not set(turned).isdisjoint(self._pieces):
                break
            m[turned], memory.jumped[0] = memory.held[turned], self._jump * self._flags[JUMPS]
        return None, ray

    def _jam(self, side: int, laws: set[int], pieces: int) -> NoReturn:
        """Raise the error that no modes of these laws, and of those with contradictory rules, are consistent."""
        if self._unsolved is not None and not laws:
            raise self._unsolved
        against = np.flatnonzero(self.memory.m != self.memory.held).tolist()
        raise SimulationError(jam_message(self.dae, self.memory, side, sorted({*laws, *against}), pieces))

    def _point(self, side: int) -> OperatingPoint:
        t, *values = self.memory.instant(side)
        return OperatingPoint(t, *(value.copy() for value in values))

    def check_unique(self, side: int) -> None:
        """Reject modes if other modes with other torques are also consistent."""
        found = others(self.memory, self._pieces, side, lambda: self._consistent(side))
        if self._pieces:
            self._judged(side)
        if found:
            modes = [self.memory.m.copy(), *found]
            raise SimulationError(several_message(self.dae, self.memory, side, modes, self._pieces))

    def _solvable(self, side: int) -> bool:
        """Solve the algebraic equations for the present modes; False, and the unknowns as they were, if they have no solution."""
        if self.algebra is None:
            return True
        z = self.memory.y[side][self.n :]
        guess = z.copy()
        try:
            self.algebra.solve(side)
        except NotConsistent as error:
            self._unsolved, z[:] = error, guess
            return False
        return True

    def _judged(self, side: int, slack: float = 0.0) -> bool:
        """Apply the mode rules to the solution for the present modes; False if there is none. Laws that others hold are marked first."""
        solved = self._solvable(side)
        self._apply_rules(side, slack)
        if self._marked(side):
            solved = self._solvable(side)
            self._apply_rules(side, slack)
        return solved

    def _marked(self, side: int) -> bool:
        """Mark the laws at a limit that others hold at rest in the present modes; whether this changes any mark."""
        m = self.memory.m
        before = m[self._rests]
        if not (before.any() or self._flags[IDLE] > 0.0):
            return False
        m[self._rests] = 0.0
        m[resting(self._problem, self._point(side))] = 1.0
        return not np.array_equal(m[self._rests], before)

    def _apply_rules(self, side: int, slack: float) -> None:
        """One pass of the mode rules; ``slack`` as in ``mode_pass``."""
        self.memory.jumped[1] = slack
        self._update[side]()
        self.memory.jumped[1] = 0.0

    def _consistent(self, side: int) -> bool:
        """Whether the present modes are consistent, with finite rates."""
        if not self._judged(side, slack=1.0) or self._flags[CHANGES]:
            return False
        self._fresh[side]()
        return bool(np.isfinite(self.memory.reached[1 - side][: self.n]).all())

    def _reset(self, side: int) -> bool:
        """Apply the resets of all conditions that have become true, judged with consistent modes; False if there are none.

        What is true at the start has not become true, but for conditions that count ``initially`` and instants that are now.
        """
        rising = [when for k, when in enumerate(self.dae.whens) if self.memory.edges[k]]
        if self._begins:
            self.memory.m[[when.index for when in rising]] = 1.0
            rising = [when for when in rising if when.initially or when.time is not None]
        if not rising:
            return False
        assert self._discontinuities is not None
        self._discontinuities.reset(side, rising)
        self.applied += [when.index for when in rising]
        self.extra += [(when.name, "reset") for when in rising if any(not r.discrete for r in when.resets)]
        self.memory.jumped[0], self._begins = JUMPED, False
        return True

    def _impact(self, side: int) -> None:
        """One impact of all barriers that are struck."""
        assert self._discontinuities is not None
        struck = np.flatnonzero(self.memory.closing).tolist()
        self.extra += [(name, "impact") for name in self._discontinuities.impact(side, struck)]
        self.memory.jumped[0] = JUMPED
