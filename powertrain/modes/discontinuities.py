"""Resets of states and discrete variables, and impacts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NoReturn

import casadi as ca
import numpy as np

from powertrain.dae.hybrid import Barrier, HybridDae, Reset, When
from powertrain.dae.tolerances import INTEGRATED, JUMP, REST_SPEED, STRUCK, ZONE
from powertrain.errors import SimulationError
from powertrain.language.reals import Array
from powertrain.language.units import with_unit
from powertrain.modes.lemke import lemke
from powertrain.numerics.buffers import Evaluated, Memory

_SLACK = 1e-5
"""Barriers may close by this share of the speed that counts as zero: round-off. Otherwise dependent ones (two walls, and bodies that touch
between them) could contradict each other."""


def reset_values(dae: HybridDae) -> ca.Function:
    """The right-hand sides of all resets of all laws in order: (t, x, z, m, p) -> values."""
    values = ca.vertcat(*[reset.value for when in dae.whens for reset in when.resets])
    return dae.function("resets", values)


class Discontinuities:
    """Evaluates resets and impacts when they happen."""

    def __init__(self, dae: HybridDae, memory: Memory) -> None:
        self.dae, self.memory, self.barriers = dae, memory, dae.barriers
        self.impulses = np.zeros(len(self.barriers))
        barriers = [
            ca.vertcat(*[getattr(b, part) for b in self.barriers]) for part in ("speed", "restitution", "rests")
        ]
        self._resets = Evaluated(reset_values(dae))
        self._impact = Evaluated(dae.function("impact", *barriers, dae.impact_x, dae.impact_a))
        self._first = {}
        count = 0
        for when in dae.whens:
            self._first[when.index] = count
            count += len(when.resets)

    def reset(self, side: int, rising: Sequence[When]) -> None:
        """Assign all right-hand sides, evaluated with the values before the reset. SimulationError if two of one variable differ."""
        values = self._resets(*self.memory.instant(side))[0].ravel()
        assigned: dict[tuple[bool, int], tuple[When, float]] = {}
        for when in rising:
            self.memory.m[when.index] = 1.0
            for k, reset in enumerate(when.resets, self._first[when.index]):
                first = assigned.setdefault((reset.discrete, reset.index), (when, values[k]))
                if abs(values[k] - first[1]) > JUMP * (1.0 + abs(first[1])):
                    self._refuse_ambiguous(reset, first, (when, values[k]))
                target = self.memory.m if reset.discrete else self.memory.y[side]
                target[reset.index] = values[k]

    def _refuse_ambiguous(self, reset: Reset, *assigned: tuple[When, float]) -> None:
        dae = self.dae
        variable = dae.m[reset.index].name() if reset.discrete else dae.state_names[reset.index]
        said = ", ".join(f"{w.name} ({w.where}) to {with_unit(f'{value:.9g}', reset.unit)}" for w, value in assigned)
        raise SimulationError(
            f"at t = {self.memory.time[0]:.9g} s {variable} is reset to two values: by {said}. "
            "Reset it by one law only, or let their conditions exclude each other"
        )

    def impact(self, side: int, struck: Sequence[int]) -> list[str]:
        """Moreau's impact law for the struck barriers together with all those at rest: impulses I change the speeds v to v'.

            v' = v + G I,   0 <= I,   0 <= v' + e min(v, 0),   I' (v' + e min(v, 0)) = 0.

        Returns the names of barriers with a noticeable impulse, and adds all impulses to ``impulses``. Slow rebounds are suppressed
        (e = 0). Where nothing rebounds, one-way laws that overrun take part, as they have no gap: v' is the speed nearest to v without any
        motion backward. With a rebound their impulse might add energy, I (v + v')/2 > 0; those that it throws backward are struck next.
        J. J. Moreau, Unilateral contact and dry friction in finite freedom dynamics, CISM 302, Springer 1988, section 12.
        """
        barriers, m = self.barriers, self.memory.m
        speed, restitution, rests, on_x, on_a = self._impact(*self.memory.instant(side))
        rebound = np.where(-restitution * speed < REST_SPEED, 0.0, restitution).ravel()
        touching = [*struck, *(k for k in np.flatnonzero(rests.ravel()).tolist() if k not in struck)]
        if not rebound[touching].any():
            touching += [k for k in range(len(self.dae.contacts), len(barriers)) if k not in touching]
        speed, rebound = speed.ravel()[touching], rebound[touching]
        effect, nothing = on_a[np.ix_(touching, touching)], ZONE + STRUCK * np.abs(speed).max()
        impulse = self._impulses(effect, speed + rebound * speed, _SLACK * nothing, [barriers[k] for k in touching])
        self.memory.y[side][: self.dae.x.numel()] += on_x[:, touching] @ impulse
        self.impulses[touching] += impulse
        after = speed + effect @ impulse
        felt = np.diag(effect) * impulse > INTEGRATED
        for k, away, some in zip(touching, after > nothing, felt, strict=True):
            if away or some or k in struck:
                m[barriers[k].index] = barriers[k].left if away else barriers[k].held
        return [barriers[k].name for k, some in zip(touching, felt, strict=True) if some]

    def _impulses(self, effect: Array, goal: Array, slack: float, barriers: Sequence[Barrier]) -> Array:
        """The impulses I >= 0 for which goal + effect I >= 0, with equality where they act; found with ``slack``, then without."""
        size = np.sqrt(np.diag(effect))
        size[size == 0.0] = 1.0
        largest, scaled = np.abs(goal / size).max(), effect / np.outer(size, size)
        allowed = slack / size / largest
        found = lemke(scaled, goal / size / largest + allowed)
        if found.z is None:
            self._refuse(barriers, found.ray)
        impulse, acts = np.asarray(found.z, np.float64), found.z > 0.0
        impulse[acts] += np.linalg.lstsq(scaled[np.ix_(acts, acts)], allowed[acts])[0]
        return np.asarray(impulse * largest / size)

    def _refuse(self, barriers: Sequence[Barrier], ray: Sequence[int]) -> NoReturn:
        """The error if there are no impulses: a ray lists the barriers that nothing opens; without a ray, round-off ended the search."""
        named = ", ".join(f"{barrier.name} ({barrier.where})" for barrier in ([barriers[k] for k in ray] or barriers))
        if ray:
            problem = f"a motion that no force can stop closes {named}: it is prescribed, or held against the contact by others"
            where = "between the prescribed motion and the contact, or an elastic contact in its place"
        else:
            problem = f"no impulses were found, though there may be some, for what is struck together: {named}"
            where = "between some of them, or an elastic contact in the place of one"
        raise SimulationError(f"at t = {self.memory.time[0]:.9g} s {problem}. Put a compliance {where}")
