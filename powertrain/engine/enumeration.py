"""The last resort of mode finding: try all combinations of the laws that are involved and keep the consistent ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from math import prod

import casadi as ca
import numpy as np

from powertrain.compiler.hybrid import HybridDae
from powertrain.engine.buffers import Array, Memory
from powertrain.engine.indicators import EPS
from powertrain.engine.jam import law_values
from powertrain.engine.modes import ZONE

_LIMIT = 20_000
_SAME = 1e-7
"""Accelerations that differ by less than this share are one motion: stuck loops leave round-off of their torques, not of the motion."""
_SAME_IMPLICIT = 1e-6
"""What the hysteresis of implicit torques may do to the accelerations of parts that weigh little against these torques."""


@dataclass(frozen=True)
class Found:
    """The different consistent mode vectors, the laws that were tried, and how many combinations there were."""

    modes: tuple[Array, ...]
    involved: tuple[int, ...]
    combinations: int


def enumerate_modes(
    dae: HybridDae,
    memory: Memory,
    side: int,
    varied: set[int],
    attempt: Callable[[], Array | None],
    narrow: bool = False,
) -> Found:
    """Try them on ``memory.m``, which is left as it was; ``attempt`` gives the rates, or None if the modes contradict them.

    Combinations with the same rates count as one, and one that needs no hysteresis is preferred to those that do: a law that is about to
    slide is consistent in both of its modes. With peaks above one, those with most stuck laws are preferred.
    ``narrow``: only the laws in ``varied``, the others as they are.
    """
    m = memory.m
    start = m.copy()
    _free_or_not(dae, memory, side)
    choices = _choices(dae, memory, side, varied)
    if narrow:
        choices = {index: values for index, values in choices.items() if index in varied}
    steps = _steps(dae, choices)
    size = prod(len(values) for values in steps)
    if size > _LIMIT:
        m[:] = start
        return Found((), tuple(choices), size)
    found: list[tuple[Array, Array, bool]] = []
    within = _SAME_IMPLICIT if dae.z.numel() else _SAME
    for combination in product(*steps):
        for part in combination:
            for index, mode in part.items():
                m[index] = mode
        rates = attempt()
        if rates is not None:
            same = [k for k, (_, other, _) in enumerate(found) if _same(rates, other, within)]
            exact = strict(dae, memory, side)
            if not same:
                found.append((m.copy(), rates, exact))
            elif exact and not found[same[0]][2]:
                found[same[0]] = m.copy(), rates, exact
    m[:] = start
    if sum(exact for _, _, exact in found) == 1:
        found = [each for each in found if each[2]]
    modes = [each for each, _, _ in found]
    if len(modes) > 1 and (law_values(dae, memory, side)[:, 5] > 1.0).any():
        stuck = [sum(each[law.index] == 0 for law in dae.frictions) for each in modes]
        modes = [each for each, count in zip(modes, stuck, strict=True) if count == max(stuck)]
    return Found(tuple(modes), tuple(choices), size)


def strict(dae: HybridDae, memory: Memory, side: int) -> bool:
    """Whether stuck laws have no speed, and laws at rest keep to their limits without the hysteresis and the slack of round-off."""
    for friction, row in zip(dae.frictions, law_values(dae, memory, side).tolist(), strict=True):
        w, torque, lower, upper, rate, peak = row
        mode = memory.m[friction.index]
        if mode == 0.0 and not (friction.algebraic or abs(w) <= ZONE):
            return False
        if mode == 0.0 and not peak * lower <= torque <= peak * upper:
            return False
        if mode in (1.0, -1.0) and (friction.algebraic or abs(w) <= ZONE) and not mode * rate >= 0.0:
            return False
    return True


def _free_or_not(dae: HybridDae, memory: Memory, side: int) -> None:
    """Laws without a torque are free, whatever else is tried; laws that were, and have one, begin at rest.

    Sliding laws show their own bounds, those at rest the bounds that they share.
    """
    m = memory.m
    before = {friction.index: m[friction.index] for friction in dae.frictions if friction.may_free}
    m[list(before)] = 1.0
    for friction, row in zip(dae.frictions, law_values(dae, memory, side).tolist(), strict=True):
        if friction.index in before:
            free = row[3] - row[2] <= EPS
            m[friction.index] = 2.0 if free else 0.0 if before[friction.index] == 2.0 else before[friction.index]


def _choices(dae: HybridDae, memory: Memory, side: int, varied: set[int]) -> dict[int, tuple[float, ...]]:
    """The modes to try: of friction laws at rest or varied, of switches that depend on torques, of contacts that varied."""
    m = memory.m
    choices: dict[int, tuple[float, ...]] = {}
    speeds = law_values(dae, memory, side)[:, 0]
    for k, friction in enumerate(dae.frictions):
        at_rest = friction.algebraic or abs(speeds[k]) <= ZONE
        if m[friction.index] != 2 and at_rest:
            choices[friction.index] = (0.0, 1.0, -1.0)
    if memory.loaded is None:
        laws = ca.vertcat(*[dae.m[friction.index] for friction in dae.frictions])
        memory.loaded = frozenset(s.index for s in dae.switches if s.time is None and ca.depends_on(s.g, laws))
    for switch in dae.switches:
        if switch.index in varied or switch.index in memory.loaded:
            choices[switch.index] = (0.0, 1.0)
    for contact in dae.contacts:
        if contact.index in varied:
            choices[contact.index] = (0.0, 1.0)
    return choices


def _steps(dae: HybridDae, choices: dict[int, tuple[float, ...]]) -> list[list[dict[int, float]]]:
    """The choices as independent steps: laws on the same motion are stuck together, or all slide the same way."""
    steps: list[list[dict[int, float]]] = []
    grouped: set[int] = set()
    for group in dae.shared:
        members = {index: sign for index, sign in group.items() if choices.get(index) == (0.0, 1.0, -1.0)}
        if len(members) > 1:
            steps.append([{index: mode * sign for index, sign in members.items()} for mode in (0.0, 1.0, -1.0)])
            grouped |= set(members)
    steps += [[{index: mode} for mode in modes] for index, modes in choices.items() if index not in grouped]
    return steps


def _same(a: Array, b: Array, within: float) -> bool:
    return bool(np.all(np.abs(a - b) <= within * (1.0 + np.abs(a))))
