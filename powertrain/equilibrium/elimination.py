"""The unknowns of a steady problem that have a closed form: which conditions determine which unknowns, and what solves these blocks.

A block has a closed form if it is linear, or a fraction of two affine expressions in one unknown, such as the ratio of a gear as a
function of a speed ratio.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from powertrain.compiler.generic import generic_values
from powertrain.compiler.matching import Matching, components
from powertrain.compiler.operations import operation
from powertrain.equilibrium.placed import Placed, rest_of
from powertrain.errors import ParameterError
from powertrain.language.symbols import Symbol, column, free_symbols, key
from powertrain.numerics.batch import dependence
from powertrain.numerics.replay import Affine
from powertrain.numerics.sparse_lu import Numbers, Row, SingularBlock, solve
from powertrain.numerics.tape import applied, graph_of, replayed


@dataclass(frozen=True)
class Unknown:
    """A state, an algebraic unknown, or an input or parameter to be found."""

    symbol: Symbol
    name: str


@dataclass(frozen=True)
class Condition:
    """What is zero at a steady state, and its text for messages."""

    zero: Symbol
    text: str


def blocks_of(
    placed: Placed, unknowns: list[Unknown], conditions: list[Condition]
) -> list[tuple[list[int], list[int]]]:
    """Conditions and unknowns of the blocks, in order of solution."""
    symbols, rows = [u.symbol for u in unknowns], [c.zero for c in conditions]
    entries = dependence(rows, symbols)
    # For a stuck law its speed (for a closed contact its gap) replaces the rates that depend on its mode.
    through = dependence(rows, [placed.dae.m[law.index] for law in placed.laws])
    moved = dependence(placed.put([rest_of(law) for law in placed.laws]), symbols)
    entries = entries | (through.astype(int) @ moved.astype(int) > 0)
    adjacent = [[int(j) for j in np.flatnonzero(row)] for row in entries]
    matching = Matching(lambda e: adjacent[e])
    for e in sorted(range(len(rows)), key=lambda e: len(adjacent[e])):
        if not matching.augment(e):
            texts = [conditions[k].text for k in sorted(matching.seen_equations)]
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
    numbers = np.array(generic_values(jacobian).nonzeros(), float)
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


_ONE = Affine(Symbol(1))


@dataclass(frozen=True)
class _Fraction:
    """A fraction of two affine expressions in x."""

    above: Affine
    below: Affine = _ONE

    @property
    def value(self) -> Symbol | None:
        """Its value if that is the same at every x."""
        constant = self.above.constant and self.below.constant
        return self.above.at(Symbol(0)) / self.below.at(Symbol(0)) if constant else None

    def times(self, factor: Symbol) -> _Fraction:
        return _Fraction(self.above.times(None if factor.is_zero() else factor), self.below)


class _NoFraction(Exception):
    pass


_CHECKS, _ALIKE = 5, 1e-9
"""Number of cross-ratios compared, and the difference that counts as round-off."""
_RATIONAL = (ca.OP_ADD, ca.OP_SUB, ca.OP_MUL, ca.OP_DIV, ca.OP_NEG, ca.OP_TWICE, ca.OP_SQ, ca.OP_INV)
_KNOTS = (0.382, -0.618, 1.618)
"""Arguments at which expressions are sampled; ratios at which nothing special happens."""


def root_of_fraction(residual: Symbol, x: Symbol) -> Symbol | None:
    """The x where ``residual`` is zero, if it is a fraction of two affine expressions in x; infinite if only an infinite x gives zero.

    A fraction not written as one, such as the ratio of a network of gears, is recognised by the cross-ratio of four values.
    """
    others = [s for s in free_symbols(residual) if key(s) != key(x)]
    root = _written(residual, x, others)
    return _by_cross_ratio(residual, x, others) if root is None else root


def _by_cross_ratio(residual: Symbol, x: Symbol, others: list[Symbol]) -> Symbol | None:
    """(f_4 - f_1)(f_3 - f_2)/((f_4 - f_2)(f_3 - f_1)) of the values of a fraction equals the same expression of its arguments."""
    if not _rational(residual, x):
        return None
    function = ca.Function("powertrain_values", [x, column(others)], [ca.densify(residual)])
    rng = np.random.default_rng(0)
    for _ in range(_CHECKS):
        point, at = rng.uniform(0.3, 2.0, len(others)), (*_KNOTS, float(rng.uniform(-3.0, 3.0)))
        values = np.array([float(function(v, point)) for v in at])
        steep = np.ptp(values)
        if not (np.isfinite(values).all() and steep > 0.0 and abs(_cross_ratio(*values) - _cross_ratio(*at)) < _ALIKE):
            return None
    f = [ca.substitute(residual, x, Symbol(v)) for v in _KNOTS]
    a, b, c = _KNOTS
    k = f[0] * (f[2] - f[1]) / (f[1] * (f[2] - f[0])) * ((c - a) / (c - b))  # (x - a)/(x - b)
    return (a - k * b) / (1 - k)


def _rational(residual: Symbol, x: Symbol) -> bool:
    """Whether an expression is a polynomial or a rational function of x: without kinks, roots and the like."""
    moved: dict[int, bool] = {}
    for place, (node, operands) in graph_of(residual).items():
        through = any(moved[key(operand)] for operand in operands)
        if through and operation(node) not in _RATIONAL:
            return False
        moved[place] = through or place == key(x)
    return True


def _cross_ratio(a: float, b: float, c: float, d: float) -> float:
    return (d - a) * (c - b) / ((d - b) * (c - a))


def _written(residual: Symbol, x: Symbol, others: list[Symbol]) -> Symbol | None:
    """The root by the operations in the expression."""
    tape = ca.Function("powertrain_fraction", [x, column(others)], [ca.densify(residual)])

    def argument(i: int, j: int) -> _Fraction:
        return _Fraction(Affine(others[j]) if i else Affine(b=Symbol(1)))

    try:
        (fraction,) = replayed(tape, [residual], argument, _Fractions())
    except _NoFraction:
        return None
    found = fraction.above
    return None if found.b is None else -(Symbol(0) if found.a is None else found.a) / found.b


class _Fractions:
    """Operations on fractions whose results are fractions of affine expressions again."""

    def constant(self, value: float) -> _Fraction:
        return _Fraction(Affine(Symbol(value) if value else None))

    def call(self, function: ca.Function, operands: list[_Fraction]) -> list[_Fraction]:
        raise _NoFraction

    def operate(self, code: int, operands: list[_Fraction]) -> _Fraction:
        first, last = operands[0], operands[-1]
        known = [each.value for each in operands if each.value is not None]
        if len(known) == len(operands):
            return _Fraction(Affine(applied(code, known)))
        if code == ca.OP_NEG:
            return first.times(Symbol(-1))
        if code == ca.OP_TWICE:
            return first.times(Symbol(2))
        if code == ca.OP_ADD:
            return _sum(first, last)
        if code == ca.OP_SUB:
            return _sum(first, last.times(Symbol(-1)))
        if code == ca.OP_MUL and len(known) == 1:
            return (last if first.value is not None else first).times(known[0])
        if code == ca.OP_INV:
            return _Fraction(first.below, first.above)
        if code == ca.OP_DIV:
            return _quotient(first, last)
        raise _NoFraction


def _sum(f: _Fraction, g: _Fraction) -> _Fraction:
    if _same(f.below, g.below):
        return _Fraction(f.above + g.above, f.below)
    if f.value is not None:
        f, g = g, f
    if g.value is not None:
        return _Fraction(f.above + f.below.times(g.value), f.below)
    raise _NoFraction


def _quotient(f: _Fraction, g: _Fraction) -> _Fraction:
    if g.value is not None and g.value.is_zero():
        raise _NoFraction
    if g.value is not None:
        return f.times(1 / g.value)
    if _same(f.below, g.below):
        return _Fraction(f.above, g.above)
    if f.value is not None:
        return _Fraction(g.below, g.above).times(f.value)
    raise _NoFraction


def _same(f: Affine, g: Affine) -> bool:
    """Whether these are the same denominator."""
    return all(a is b if a is None or b is None else ca.is_equal(a, b, 20) for a, b in ((f.a, g.a), (f.b, g.b)))
