"""From the index-reduced equations to an ordered list of assignments: matching, block lower triangular form, linear blocks, tearing.

Blocks that are linear in their unknowns are eliminated symbolically. In other blocks as many unknowns as possible are assigned in turn;
the few tearing variables remain algebraic unknowns z, each with a residual.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from powertrain.compiler import calls
from powertrain.compiler.alias import Base
from powertrain.compiler.generic import generic_values
from powertrain.compiler.index import Differentiated
from powertrain.compiler.matching import Matching, components
from powertrain.errors import ModelError
from powertrain.language.recorder import Place
from powertrain.language.symbols import Symbol, column, free_symbols, key, scalars
from powertrain.numerics.sparse_lu import SingularBlock, solve


@dataclass
class Solved:
    """``names[i]`` := ``expressions[i]`` in order; the ``implicit`` unknowns make the ``residuals`` zero."""

    names: list[Symbol] = field(default_factory=list)
    expressions: list[Symbol] = field(default_factory=list)
    implicit: list[Symbol] = field(default_factory=list)
    residuals: list[Symbol] = field(default_factory=list)
    places: list[Place] = field(default_factory=list)


@dataclass
class _SquareSystem:
    """Residuals, unknowns, and the entries of the Jacobian by row with their values at the reference point."""

    residuals: list[Symbol]
    places: list[Place]
    unknowns: list[Symbol]
    entries: list[dict[int, Symbol]]
    numbers: list[dict[int, float]]
    constant: list[set[int]]
    varying: list[set[int]]
    values: dict[int, float]
    """Values of the parameters, by the keys of their symbols."""


def solve_blocks(system: Differentiated, states: list[Base], values: dict[int, float]) -> Solved:
    """Assign every unknown that is not a state."""
    square = _square(system, states, values)
    matching = Matching(lambda e: _candidates(square, e))
    for e in sorted(range(len(square.residuals)), key=lambda e: len(square.entries[e])):
        if not matching.augment(e):
            raise ModelError(_not_determined(square, sorted(matching.seen_equations)))
    owner = matching.equation_of
    graph = [[owner[j] for j in row if owner[j] != e] for e, row in enumerate(square.entries)]
    solved = Solved()
    for block in components(graph):
        _solve(square, sorted(block), sorted(matching.variable_of[e] for e in block), solved)
    return solved


def _square(system: Differentiated, states: list[Base], values: dict[int, float]) -> _SquareSystem:
    known, reduced = set(states), system.reduced
    residuals = [r for chain in system.chains for r in chain]
    places = [p for chain, p in zip(system.chains, system.places, strict=True) for _ in chain]
    unknowns = [
        reduced.derivative(reduced.symbols[b], order)
        for b, top in system.top.items()
        for order in range(top + 1)
        if (b, order) not in known
    ]
    by = column(unknowns)
    jacobian = calls.jacobian(residuals, by)
    numbers = np.array(generic_values(jacobian, values).nonzeros(), float)
    entries: list[dict[int, Symbol]] = [{} for _ in residuals]
    numeric: list[dict[int, float]] = [{} for _ in residuals]
    constant: list[set[int]] = [set() for _ in residuals]
    varying: list[set[int]] = [set() for _ in residuals]
    elements = scalars(jacobian.nz[:])
    for i, j, entry, number in zip(*jacobian.sparsity().get_triplet(), elements, numbers, strict=True):
        entries[i][j] = entry
        numeric[i][j] = float(number) if np.isfinite(number) else 1.0
        if entry.is_constant():
            constant[i].add(j)
        elif any(key(s) not in reduced.flat.recorder.constants for s in free_symbols(entry)):
            varying[i].add(j)
    return _SquareSystem(residuals, places, unknowns, entries, numeric, constant, varying, values)


def _candidates(square: _SquareSystem, e: int) -> list[int]:
    usable = [j for j in square.entries[e] if square.numbers[e][j] != 0.0]
    return sorted(usable, key=lambda j: (j not in square.constant[e], j))


def _solve(square: _SquareSystem, rows: list[int], columns: list[int], solved: Solved) -> None:
    inside = {key(square.unknowns[j]) for j in columns}
    entries = [{j: square.entries[i][j] for j in columns if j in square.entries[i]} for i in rows]
    if all(key(s) not in inside for row in entries for entry in row.values() for s in free_symbols(entry)):
        _solve_linear(square, rows, columns, entries, solved)
    else:
        _tear(square, rows, columns, solved)


def _solve_linear(
    square: _SquareSystem, rows: list[int], columns: list[int], entries: list[dict[int, Symbol]], solved: Solved
) -> None:
    unknowns = column([square.unknowns[j] for j in columns])
    residuals = column([square.residuals[i] for i in rows])
    right = scalars(-ca.substitute(residuals, unknowns, ca.DM.zeros(len(columns))))
    try:
        numbers = [{j: square.numbers[i][j] for j in row} for i, row in zip(rows, entries, strict=True)]
        solution = solve(entries, right, numbers, varying=[square.varying[i] for i in rows])
    except SingularBlock:
        raise ModelError(_not_determined(square, rows)) from None
    for j in columns:
        solved.names.append(square.unknowns[j])
        solved.expressions.append(solution[j])


def _tear(square: _SquareSystem, rows: list[int], columns: list[int], solved: Solved) -> None:
    """Assign every unknown that appears alone and linearly in some equation; if there is none, make one unknown implicit."""
    open_rows, open_columns = list(rows), set(columns)
    while open_columns:
        step = _next_assignment(square, open_rows, open_columns)
        if step is None:
            j = max(open_columns, key=lambda j: (sum(j in square.entries[i] for i in open_rows), -j))
            solved.implicit.append(square.unknowns[j])
        else:
            i, j = step
            open_rows.remove(i)
            u = square.unknowns[j]
            solved.names.append(u)
            solved.expressions.append(-ca.substitute(square.residuals[i], u, Symbol(0)) / square.entries[i][j])
        open_columns.discard(j)
    solved.residuals += [square.residuals[i] for i in open_rows]
    solved.places += [square.places[i] for i in open_rows]


def _next_assignment(square: _SquareSystem, rows: list[int], columns: set[int]) -> tuple[int, int] | None:
    for i in rows:
        inside = [j for j in square.entries[i] if j in columns]
        if len(inside) == 1 and square.numbers[i][inside[0]] and square.entries[i][inside[0]].is_constant():
            return i, inside[0]
    return None


def _not_determined(square: _SquareSystem, rows: list[int]) -> str:
    quoted = "\n  ".join(dict.fromkeys(str(square.places[i]) for i in rows[:8]))
    names = sorted({square.unknowns[j].name() for i in rows for j in square.entries[i]})[:8]
    zeros = _zeros(square, rows)
    if zeros:
        told, which = (
            ("is 0, which removes", "another value") if len(zeros) == 1 else ("are 0, which removes", "other values")
        )
        unknown = "an unknown" if len(names) > 1 else "it"
        hint = (
            f"; {' and '.join(zeros)} {told} {unknown} from them: give {which}, or connect a part that determines "
            f"{' or '.join(names)}, such as an inertia"
        )
    elif any(name.startswith("der(") for name in names):
        hint = "; if a shaft without inertia lies between torques that do not depend on its speed, give it an inertia"
    else:
        hint = ""
    return f"the equations below do not determine {', '.join(names)}: one of them repeats or contradicts the others{hint}\n  {quoted}"


def _zeros(square: _SquareSystem, rows: list[int]) -> list[str]:
    """The parameters that are zero and take unknowns out of the equations, such as an inertia of 0."""
    gone = [square.entries[i][j] for i in rows for j, number in square.numbers[i].items() if number == 0.0]
    return sorted({s.name() for entry in gone for s in free_symbols(entry) if square.values.get(key(s)) == 0.0})
