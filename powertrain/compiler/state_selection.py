"""The states of a model: variables that no differentiated constraint determines (dummy derivatives).

S. E. Mattsson and G. Soderlind, SIAM J. Sci. Comput. 14 (1993) 677.
"""

from __future__ import annotations

import heapq

import casadi as ca
import numpy as np

from powertrain.compiler.alias import Base, Reduced, quote
from powertrain.compiler.generic import generic_values
from powertrain.compiler.index import Differentiated
from powertrain.errors import ModelError
from powertrain.language.symbols import free_symbols, key
from powertrain.numerics.pivots import difference

_SHARE = 1e-6
"""Equations that contribute a smaller share to a redundant one are not quoted."""
VARYING = 35
"""Ten times the preference of a variable with a varying coefficient in a constraint: above friction speeds, below reset variables."""


def given(system: Differentiated) -> set[int]:
    """The variables that equations determine one after another, such as a motion that follows a signal through a filter.

    Without those of which only the highest derivative is determined: nothing returns these to a value, and the angle of a given speed grows
    without bound.
    """
    residuals = [chain[0] for chain in system.chains if system.known.isdisjoint(map(key, free_symbols(chain[0])))]
    inside, found = [{*system.bases(residual)} for residual in residuals], set[int]()
    while new := {base for bases in inside if len(left := {base for base, _ in bases} - found) == 1 for base in left}:
        found |= new
    determined = [bases for bases in inside if found.issuperset(base for base, _ in bases)]
    return {base for bases in determined for base, order in bases if order < system.top[base]}


def select_states(system: Differentiated, preference: dict[int, int], values: dict[int, float]) -> list[Base]:
    """The states: variables below their highest derivative that no constraint determines.

    At each level below the highest, the differentiated equations determine as many derivatives ("dummies"). These are chosen by sparse
    elimination with numeric pivots at the point ``values``, first among the variables with the lowest ``preference``. A variable with a
    varying coefficient in a constraint stays a state if possible: solving for it would divide by a coefficient that may pass through zero.
    """
    dummies: set[int] = set(system.top)
    states: list[Base] = []
    level = 1
    while True:
        candidates = [b for b, top in system.top.items() if top >= level]
        if not candidates:
            return states
        rows = [i for i, chain in enumerate(system.chains) if len(chain) > level]
        columns = [b for b in candidates if b in dummies]
        chosen = _pivots(system, rows, columns, preference, values)
        states += [(b, system.top[b] - level) for b in candidates if b not in chosen]
        dummies = chosen
        level += 1


def _pivots(
    system: Differentiated,
    rows: list[int],
    columns: list[int],
    preference: dict[int, int],
    values: dict[int, float],
) -> set[int]:
    if not rows:
        return set()
    reduced = system.reduced
    tops = [reduced.derivative(reduced.symbols[b], system.top[b]) for b in columns]
    jacobian = ca.jacobian(ca.vertcat(*(system.chains[i][-1] for i in rows)), ca.vertcat(*tops))
    numbers = generic_values(jacobian, values)
    table: list[dict[int, float]] = [{} for _ in rows]
    wanted = [10 * preference.get(b, 0) for b in columns]
    for k, (i, j, a) in enumerate(zip(*jacobian.sparsity().get_triplet(), np.array(numbers.nonzeros()), strict=True)):
        if a != 0.0:
            table[i][j] = float(a)
        if any(key(s) not in reduced.flat.recorder.constants for s in free_symbols(jacobian.nz[k])):
            wanted[j] = max(wanted[j], VARYING + preference.get(columns[j], 0))
    chosen, free = eliminate(table, wanted)
    if free:
        raise ModelError(_repeated(reduced, [rows[i] for i in involved(numbers, free)]))
    return {columns[j] for j in chosen}


def involved(matrix: ca.DM, free: list[int]) -> list[int]:
    """The rows without a pivot, and those of which they are combinations."""
    full = np.array(matrix)
    others = [i for i in range(len(full)) if i not in free]
    shares = np.linalg.lstsq(full[others].T, full[free].T, rcond=None)[0]
    return sorted([*free, *(i for i, share in zip(others, shares, strict=True) if np.abs(share).max() > _SHARE)])


def _repeated(reduced: Reduced, equations: list[int]) -> str:
    said = [reduced.written(i) for i in equations]
    ties = reduced.tied_by([b for b in reduced.variables(said) if b in reduced.flat.unknowns])
    return f"these constraints repeat or contradict each other; remove one of them\n  {quote([*said, *ties])}"


def eliminate(table: list[dict[int, float]], preference: list[int]) -> tuple[list[int], list[int]]:
    """Pivot columns of full row rank, lowest preference first, and rows without a pivot. It only chooses; it solves nothing."""
    holders: dict[int, set[int]] = {}
    for i, row in enumerate(table):
        for j in row:
            holders.setdefault(j, set()).add(i)
    chosen: list[int] = []
    open_rows = set(range(len(table)))
    for limit in sorted(set(preference)) or [0]:
        heap = [(sum(preference[j] <= limit for j in table[i]), i) for i in open_rows]
        heapq.heapify(heap)
        while heap:
            count, i = heapq.heappop(heap)
            allowed = [j for j in table[i] if preference[j] <= limit] if i in open_rows else []
            if not allowed or len(allowed) != count:
                if i in open_rows and allowed:
                    heapq.heappush(heap, (len(allowed), i))
                continue
            largest = max(abs(table[i][j]) for j in allowed)
            large = [j for j in allowed if abs(table[i][j]) >= 0.05 * largest]
            j = min(large, key=lambda j: (len(holders[j]), j))
            chosen.append(j)
            open_rows.discard(i)
            for k in holders.pop(j) - {i}:
                if k in open_rows:
                    _subtract(table, holders, k, i, j)
                    heapq.heappush(heap, (sum(preference[n] <= limit for n in table[k]), k))
    return chosen, sorted(open_rows)


def _subtract(table: list[dict[int, float]], holders: dict[int, set[int]], k: int, i: int, j: int) -> None:
    target, factor = table[k], table[k][j] / table[i][j]
    for n, a in table[i].items():
        new = difference(target.get(n, 0.0), factor * a)
        if n == j or new == 0.0:
            target.pop(n, None)
            if n in holders:
                holders[n].discard(k)
        else:
            target[n] = new
            holders.setdefault(n, set()).add(k)
