"""The blocks of a steady problem: which conditions determine which unknowns; linear blocks are solved."""

from __future__ import annotations

import casadi as ca
import numpy as np

from powertrain.compiler.hybrid import Friction, Switch
from powertrain.compiler.index import generic
from powertrain.compiler.matching import Matching, components
from powertrain.equilibrium.fraction import root_of_fraction
from powertrain.equilibrium.placed import Placed, Unknown
from powertrain.errors import ParameterError
from powertrain.language.symbols import Symbol, column
from powertrain.numerics.batch import dependence
from powertrain.numerics.sparse_lu import Numbers, Row, SingularBlock, solve


def blocks_of(
    placed: Placed, unknowns: list[Unknown], conditions: list[tuple[Symbol, str]], rows: list[Symbol]
) -> list[tuple[list[int], list[int]]]:
    """Rows and unknowns of the blocks, in order of solution."""
    symbols = [u.symbol for u in unknowns]
    entries = dependence(rows, symbols)
    if placed.laws and rows:
        # For a stuck law its speed (for a closed contact its gap) replaces the rates that depend on its mode.
        movable = [k for k, law in enumerate(placed.laws) if not isinstance(law, Switch)]
        through = dependence(rows, [placed.dae.m[placed.laws[k].index] for k in movable])
        speeds = placed.put(
            [law.w if isinstance(law, Friction) else law.gap for law in placed.laws if not isinstance(law, Switch)]
        )
        moved = dependence(speeds, symbols)
        if through.size and moved.size:
            entries = entries | (through.astype(int) @ moved.astype(int) > 0)
    adjacent = [[int(j) for j in np.flatnonzero(row)] for row in entries]
    matching = Matching(lambda e: adjacent[e])
    for e in sorted(range(len(rows)), key=lambda e: len(adjacent[e])):
        if not matching.augment(e):
            texts = [conditions[k][1] for k in sorted(matching.seen_equations)]
            names = sorted(unknowns[j].name for j in matching.seen_variables)
            raise ParameterError(_unbalanced(texts, names))
    graph = [[matching.equation_of[j] for j in row if matching.equation_of[j] != e] for e, row in enumerate(adjacent)]
    return [(sorted(block), sorted(matching.variable_of[e] for e in block)) for block in components(graph)]


def _unbalanced(texts: list[str], names: list[str]) -> str:
    found = (
        f"can only be met by {', '.join(names)}"
        if names
        else "cannot be met: nothing that is to be found influences them"
    )
    return (
        f"steady: the conditions {'; '.join(texts)} {found}. "
        "Prescribe a speed on the grid, or let an input or parameter be found: free=[...]"
    )


def solved_block(rows: list[Symbol], unknowns: list[Symbol], modes: list[Symbol]) -> list[Symbol] | None:
    """The unknowns of a block as expressions, or None if it is nonlinear or not the same in all modes."""
    jacobian = ca.jacobian(column(rows), column(unknowns))
    slopes = [jacobian.nz[i] for i in range(jacobian.nnz())]
    if dependence(slopes, modes).any():
        return None
    if dependence(slopes, unknowns).any():
        root = root_of_fraction(rows[0], unknowns[0]) if len(rows) == 1 else None
        return None if root is None or dependence([root], modes).any() else [root]
    symbols = ca.symvar(jacobian)
    point = [generic(s) for s in symbols]
    numbers = np.array(ca.Function("powertrain_block", [column(symbols)], [jacobian])(point).nonzeros(), float)
    right = ca.vertsplit(-ca.substitute(column(rows), column(unknowns), ca.DM.zeros(len(unknowns))))
    entries: list[Row] = [{} for _ in rows]
    sizes: list[Numbers] = [{} for _ in rows]
    for k, (i, j) in enumerate(zip(*jacobian.sparsity().get_triplet(), strict=True)):
        if numbers[k] == 0.0:
            continue
        entries[i][j], sizes[i][j] = jacobian.nz[k], float(numbers[k])
    try:
        solution = solve(entries, right, sizes)
    except SingularBlock:
        return None
    return [solution[j] for j in range(len(unknowns))]
