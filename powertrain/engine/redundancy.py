"""Stuck laws that hold the same motion together: the motion is unique, their torques are not. Found from the rank of their motions."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.hybrid import Friction, HybridDae
from powertrain.engine.buffers import Memory, view
from powertrain.engine.jam import undetermined_note

_RANK = 1e-9
_STILL = 1e-12
_DRAWS = 16
"""States and modes drawn to find a load under which the bounds of a law are not zero."""


class Redundancy:
    """Notes, once for each set of stuck laws of a run, those whose speeds depend on each other."""

    def __init__(self, dae: HybridDae, memory: Memory) -> None:
        self.dae, self.memory = dae, memory
        self.notes: list[str] = []
        self._noted: set[tuple[str, ...]] = set()
        self._laws = [law for law in dae.frictions if not (law.algebraic or law.prescribed)]
        self._places, self._m = [law.index for law in self._laws], view(memory.m)
        self._last: tuple[int, ...] = ()
        self._seen: dict[tuple[int, ...], list[Friction]] = {}
        self._gradients: ca.Function | None = None
        self._widths: ca.Function | None = None
        self._room: NDArray[np.bool_] | None = None
        self._constant, self._p = False, memory.p.copy()

    def forget(self) -> None:
        """Drop the notes of the last run."""
        self.notes = []
        self._noted, self._last = set(), ()
        same = np.array_equal(self._p, self.memory.p)
        if not same:
            self._room, self._p = None, self.memory.p.copy()
        if not (self._constant and same):
            self._seen = {}

    def note(self, side: int) -> None:
        """Look at the laws that are stuck now."""
        m = self._m
        stuck = tuple([k for k, place in enumerate(self._places) if m[place] == 0.0])
        if not stuck or stuck == self._last:
            return
        self._last = stuck
        if stuck not in self._seen:
            self._seen[stuck] = self._dependent(stuck, side)
        if self._seen[stuck]:
            self.add(self._seen[stuck])

    def add(self, laws: Sequence[Friction], text: str | None = None) -> None:
        """Note that these laws share a torque, or what ``text`` says of them."""
        if not self.noted(laws):
            self._noted.add(_names(laws))
            self.notes.append(text or undetermined_note(laws, self.memory.time[0]))

    def noted(self, laws: Sequence[Friction]) -> bool:
        """Whether there is a note about these laws."""
        return _names(laws) in self._noted

    def _dependent(self, held: Sequence[int], side: int) -> list[Friction]:
        dae, memory = self.dae, self.memory
        if self._room is None:
            self._room = self._with_room()
        stuck = [k for k in held if self._room[k]]
        if not stuck:
            return []
        if self._gradients is None:
            gradients = ca.densify(ca.jacobian(ca.vertcat(*(law.w for law in self._laws)), dae.x))
            self._gradients = ca.Function("powertrain_motions", [dae.t, dae.x, dae.z, dae.m, dae.p], [gradients])
            self._constant = gradients.is_constant()
        n, nz, nm, count = dae.x.numel(), dae.z.numel(), dae.m.numel(), dae.p.numel()
        y = memory.y[side]
        rows = np.array(self._gradients(memory.time[0], y[:n], y[n : n + nz], memory.m[:nm], memory.p[:count]))[stuck]
        sizes = np.linalg.norm(rows, axis=1, keepdims=True)
        rows = np.where(sizes > _STILL, rows / np.maximum(sizes, _STILL), 0.0)
        left, sizes, _ = np.linalg.svd(rows, full_matrices=True)
        rank = int((sizes > _RANK).sum())
        involved = (np.abs(left[:, rank:]) > 1e-6).any(axis=1)
        return [self._laws[k] for k, found in zip(stuck, np.atleast_1d(involved).tolist(), strict=True) if found]

    def _with_room(self) -> NDArray[np.bool_]:
        """Which laws may carry a torque at all: not so a mesh without loss, whose bounds are zero whatever its load."""
        dae = self.dae
        if self._widths is None:
            widths = ca.vertcat(*(ca.fabs(law.lower) + ca.fabs(law.upper) for law in self._laws))
            self._widths = ca.Function("powertrain_room", [dae.t, dae.x, dae.z, dae.m, dae.p], [ca.densify(widths)])
        sizes, draws = [v.numel() for v in (dae.t, dae.x, dae.z, dae.m)], np.random.default_rng(1)
        anything = [[draws.normal(scale=100.0, size=n) for n in sizes] for _ in range(_DRAWS)]
        found = [np.array(self._widths(*each, self.memory.p[: dae.p.numel()])).ravel() != 0.0 for each in anything]
        return np.asarray(np.any(found, axis=0))


def _names(laws: Sequence[Friction]) -> tuple[str, ...]:
    return tuple(law.name for law in laws)
