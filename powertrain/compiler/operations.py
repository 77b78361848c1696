"""Operations of an expression that jump, and the expression with these made explicit."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from powertrain.compiler.intervals import ALL, Interval, interval_of
from powertrain.language.symbols import Symbol, column, free_symbols, key
from powertrain.numerics.tape import again, graph_of

COMPARISONS = frozenset({ca.OP_LT, ca.OP_LE})
EQUALITIES = frozenset({ca.OP_EQ, ca.OP_NE})
LOGIC = frozenset({ca.OP_AND, ca.OP_OR, ca.OP_NOT, ca.OP_IF_ELSE_ZERO})
STEPS = frozenset({ca.OP_FLOOR, ca.OP_CEIL, ca.OP_FMOD, ca.OP_REMAINDER})
SIDES = frozenset({ca.OP_SIGN, ca.OP_COPYSIGN, ca.OP_ATAN2})
JUMPING = COMPARISONS | EQUALITIES | LOGIC | STEPS | SIDES
"""Operations that are not continuous."""
KINKS = frozenset(
    {ca.OP_FABS, ca.OP_SQRT, ca.OP_FMIN, ca.OP_FMAX, ca.OP_HYPOT, ca.OP_POW, ca.OP_CONSTPOW, ca.OP_ASIN, ca.OP_ACOS}
)
"""Operations that are not smooth. If dividend and divisor vanish together and one has a kink, the quotient jumps: |w|/w."""
_TRUTHS = COMPARISONS | EQUALITIES | LOGIC - {ca.OP_IF_ELSE_ZERO}
TRIFLE = 1e-12
"""A number below this only avoids a division by zero: beside values of 1 to 1e3 it is round-off, and w/(|w| + 1e-15) is a sign."""


@dataclass(frozen=True)
class JumpingOperation:
    """An operation that jumps where ``code`` changes. ``side`` is zero there; at that point itself the value is ``alone``."""

    node: Symbol
    code: Symbol
    side: Symbol | None = None
    stand_in: Symbol | None = None
    natural: Symbol | None = None
    alone: float = 0.0


def operation(node: Symbol) -> int:
    """The kind of an operation; -1 for symbols, numbers and results of calls."""
    return -1 if node.is_symbolic() or node.is_constant() or node.is_output() else int(node.op())


@dataclass(frozen=True)
class Ways:
    """How the value of an operation varies: whether it changes between events, whether it has a kink that does, and within what range."""

    moves: bool = False
    bends: bool = False
    range: Interval = ALL

    @classmethod
    def of(cls, op: int, inner: Sequence[Ways]) -> Ways:
        """The ways of an operation from those of its operands."""
        moves = any(n.moves for n in inner)
        bends = any(n.bends for n in inner) or (moves and op in KINKS)
        return cls(moves, bends, interval_of(op, [n.range for n in inner]))

    @classmethod
    def of_node(cls, node: Symbol, inner: Sequence[Ways], moves: Callable[[Symbol], bool]) -> Ways:
        """The ways of a node; ``moves`` tells of a symbol whether it changes between events."""
        if node.is_symbolic():
            return cls(moves(node))
        if node.is_constant():
            return cls(range=(float(node), float(node)))
        return cls.of(operation(node), inner)


def may_jump(op: int, inner: Sequence[Ways]) -> bool:
    """Whether an operation on such operands may jump; a quotient jumps only where its divisor is zero."""
    if op == ca.OP_DIV:
        low, high = inner[1].range
        return inner[1].moves and low < TRIFLE and high > -TRIFLE and any(n.bends for n in inner)
    return (op in JUMPING or op == ca.OP_TAN) and any(n.moves for n in inner)


def behind_jumps(expression: Symbol) -> list[Symbol]:
    """The symbols that decide where operations in the expression jump."""
    deciding = [
        inner[:1] if operation(n) == ca.OP_IF_ELSE_ZERO else inner
        for n, inner in graph_of(expression).values()
        if operation(n) in JUMPING
    ]
    return free_symbols(column([n for listed in deciding for n in listed]))


def affine_root(expression: Symbol, symbol: Symbol) -> Symbol | None:
    """Where an expression that is affine in a symbol is zero; None for any other expression."""
    slope = ca.jacobian(expression, symbol)
    if slope.is_zero() or ca.depends_on(slope, symbol) or key(symbol) in map(key, behind_jumps(expression)):
        return None
    return Symbol(-ca.substitute(expression, symbol, 0) / slope)


def opened(expression: Symbol, moves: Callable[[Symbol], bool]) -> tuple[list[JumpingOperation], Symbol]:
    """The operations that jump, and the expression with a symbol for each that has a special value at a single point."""
    walk = _Opening()
    for place, (node, inner) in graph_of(expression).items():
        ways = [walk.ways[key(n)] for n in inner]
        walk.ways[place] = Ways.of_node(node, ways, moves)
        walk.new[place] = walk.rewritten(node, inner) if inner and walk.ways[place].moves else node
    return walk.found, walk.new[key(expression)]


class _Opening:
    """What a walk through an expression has found: operations that jump, and nodes with symbols in place of special values."""

    def __init__(self) -> None:
        self.found: list[JumpingOperation] = []
        self.new: dict[int, Symbol] = {}
        self.ways: dict[int, Ways] = {}
        self._truths: dict[int, Symbol] = {}

    def rewritten(self, node: Symbol, inner: Sequence[Symbol]) -> Symbol:
        """A node that moves, of the rewritten operands."""
        op, changed = operation(node), [self.new[key(n)] for n in inner]
        if op == ca.OP_SIGN:
            return self._stand_in(node, inner[0], node, 0.0)
        if op in EQUALITIES:
            same = self._stand_in(node, inner[0] - inner[1], inner[0] == inner[1], 1.0)
            return same if op == ca.OP_EQ else 1 - same
        if op in LOGIC:
            picks = 1 if op == ca.OP_IF_ELSE_ZERO else len(inner)
            changed[:picks] = [self._truth(n) for n in inner[:picks]]
        elif op in COMPARISONS:
            self.found.append(JumpingOperation(node, node, inner[1] - inner[0]))
        elif may_jump(op, [self.ways[key(n)] for n in inner]):
            self.found.append(_quotient(node, inner, self.ways) if op == ca.OP_DIV else _stepping(node, inner, op))
        return again(node, changed)

    def _stand_in(self, node: Symbol, side: Symbol, natural: Symbol, alone: float) -> Symbol:
        symbol = Symbol.sym("alone")
        self.found.append(JumpingOperation(node, ca.sign(side), side, symbol, natural, alone))
        return symbol

    def _truth(self, node: Symbol) -> Symbol:
        """The operand as a truth value; a number is true if it is not zero."""
        if not self.ways[key(node)].moves or operation(node) in _TRUTHS:
            return self.new[key(node)]
        if key(node) not in self._truths:
            self._truths[key(node)] = 1 - self._stand_in(node, node, node == 0, 1.0)
        return self._truths[key(node)]


def _stepping(node: Symbol, inner: Sequence[Symbol], op: int) -> JumpingOperation:
    if op in (ca.OP_FLOOR, ca.OP_CEIL):
        return JumpingOperation(node, node)
    if op in (ca.OP_FMOD, ca.OP_REMAINDER):
        return JumpingOperation(node, ca.floor((inner[0] - node) / inner[1] + 0.5))
    if op == ca.OP_TAN:
        return JumpingOperation(node, ca.floor(inner[0] / np.pi + 0.5))
    side = inner[1] if op == ca.OP_COPYSIGN else inner[0]
    return JumpingOperation(node, ca.sign(side), side)


def _quotient(node: Symbol, inner: Sequence[Symbol], ways: Mapping[int, Ways]) -> JumpingOperation:
    """A quotient jumps where the divisor passes zero; if the divisor only touches zero, as |w| does, the dividend's sign decides."""
    code = ca.sign(inner[1])
    return JumpingOperation(node, code + 3 * ca.sign(inner[0]) if ways[key(inner[1])].bends else code)
