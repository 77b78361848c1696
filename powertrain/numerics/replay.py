"""A scalar tape replayed along a row of points that differ in only one quantity x.

Expressions without x are computed once for the row. Those affine in x are a + b x, two numbers for the row, and their signs
are known everywhere from the two ends. In given modes most torques are affine. Of multiples b x, the size and the sign are known where x
keeps its sign.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import casadi as ca

from powertrain.language.symbols import Symbol
from powertrain.numerics.tape import applied, replayed, results_of


@dataclass(frozen=True)
class Affine:
    """a + b x, where None is zero."""

    a: Symbol | None = None
    b: Symbol | None = None

    @property
    def constant(self) -> bool:
        """Whether it is the same at every x."""
        return self.b is None

    def at(self, x: Symbol) -> Symbol:
        """Its value."""
        a = Symbol(0) if self.a is None else self.a
        return a if self.b is None else a + self.b * x

    def __add__(self, other: Affine) -> Affine:
        return Affine(_sum(self.a, other.a), _sum(self.b, other.b))

    def __neg__(self) -> Affine:
        return self.each(lambda part: -part)

    def times(self, factor: Symbol | None) -> Affine:
        """A multiple."""
        return Affine() if factor is None else self.each(lambda part: factor * part)

    def each(self, change: Callable[[Symbol], Symbol]) -> Affine:
        """Both parts changed, where they are not zero."""
        return Affine(*(None if part is None else change(part) for part in (self.a, self.b)))


def _sum(a: Symbol | None, b: Symbol | None) -> Symbol | None:
    return b if a is None else a if b is None else a + b


Form = Affine | Symbol
"""Along a row: affine in x, or any other expression of x."""


def value(form: Form, x: Symbol) -> Symbol:
    """The expression of x."""
    return form.at(x) if isinstance(form, Affine) else form


@dataclass(frozen=True)
class RowForms:
    """Outputs along a row; valid where ``fits`` holds."""

    outputs: list[Affine]
    fits: Symbol


_OF_SIGNS = {ca.OP_DIV, ca.OP_SIGN, ca.OP_EQ, ca.OP_NE, ca.OP_LT, ca.OP_LE}
"""Operations on multiples of x that depend on the sign of x alone."""
_OF_SIZES = {ca.OP_FABS, ca.OP_FMIN, ca.OP_FMAX}
"""Operations on multiples of x that are multiples of |x|."""


class _Replay:
    """Arithmetic of forms of ``x``, whose sign is ``way``; ``away_from_zero``: they hold only on rows that do not pass x = 0."""

    def __init__(self, x: Symbol, way: Symbol) -> None:
        self.x, self._way = x, way
        self.away_from_zero = False

    def constant(self, value: float) -> Form:
        return Affine(Symbol(value)) if value else Affine()

    def call(self, function: ca.Function, operands: list[Form]) -> list[Form]:
        results = results_of(function, [value(each, self.x) for each in operands])
        return [Affine(e) for e in results] if all(map(_constant, operands)) else [*results]

    def operate(self, code: int, operands: list[Form]) -> Form:
        if all(map(_constant, operands)):
            return Affine(self._applied(code, operands))
        affine = [each for each in operands if isinstance(each, Affine)]
        found = self._affine(code, *affine) if len(affine) == len(operands) else None
        return self._applied(code, operands) if found is None else found

    def _applied(self, code: int, operands: list[Form]) -> Symbol:
        return applied(code, [value(each, self.x) for each in operands])

    def _affine(self, code: int, first: Affine, *others: Affine) -> Affine | None:
        last = others[0] if others else first
        if code == ca.OP_ADD:
            return first + last
        if code == ca.OP_SUB:
            return first + -last
        if code == ca.OP_NEG:
            return -first
        if code == ca.OP_TWICE:
            return first + first
        if code == ca.OP_MUL and (first.constant or last.constant):
            return last.times(first.a) if first.constant else first.times(last.a)
        if code == ca.OP_IF_ELSE_ZERO and first.constant:
            condition = first.at(self.x)
            return last.each(lambda part: ca.if_else(condition, part, 0))
        if code == ca.OP_DIV and last.constant and (divisor := last.a) is not None:
            return first.each(lambda part: part / divisor)
        if code in _OF_SIGNS | _OF_SIZES and first.a is None and last.a is None:
            return self._of_multiples(code, [first, *others])
        return None

    def _of_multiples(self, code: int, operands: Sequence[Affine]) -> Affine:
        """An operation on multiples of x: with the sign of x, each is a multiple of |x|."""
        self.away_from_zero = True
        found = applied(code, [Symbol(0) if each.b is None else self._way * each.b for each in operands])
        return Affine(b=self._way * found) if code in _OF_SIZES else Affine(found)


def _constant(form: Form) -> bool:
    return isinstance(form, Affine) and form.constant


def row_forms(
    x: Symbol,
    ends: Symbol,
    symbols: Sequence[Symbol],
    wanted: list[Symbol],
    margins: list[Symbol],
    rivals: list[list[Symbol]],
) -> RowForms | None:
    """Expressions of x and of the other ``symbols`` along a row whose least and greatest x are ``ends``; None if they are not affine.

    ``margins`` must not be negative anywhere; in each group of ``rivals`` one margin must be negative everywhere.
    """
    flat = [*margins, *(m for rival in rivals for m in rival)]
    expressions, replay = [ca.densify(e) for e in ca.cse([*wanted, *flat])], _Replay(x, ca.if_else(ends[0] > 0, 1, -1))
    arguments: list[Form] = [Affine(b=Symbol(1)), *map(Affine, symbols)]
    tape = ca.Function("powertrain_row", [x, *symbols], expressions)
    forms, n = replayed(tape, expressions, lambda i, _: arguments[i], replay), len(wanted) + len(margins)
    outputs, fits = [form for form in forms[:n] if isinstance(form, Affine)], Symbol(1)
    if len(outputs) < n:
        return None
    for form in outputs[len(wanted) :]:
        for end in _at_ends(form, ends):
            fits = fits * (end >= 0)
    distinct = {id(form): form for form in forms[n:] if isinstance(form, Affine)}  # rivals share most margins
    negative = {place: _negative(form, ends) for place, form in distinct.items()}
    for rival in rivals:
        found = [negative[id(form)] for form in forms[n : n + len(rival)] if id(form) in negative]
        fits = fits * (sum(found, Symbol(0)) > 0)  # a sum: of columns, fmax takes six times as long
        n += len(rival)
    if replay.away_from_zero:
        fits = fits * (ends[0] * ends[1] > 0)
    return RowForms(outputs[: len(wanted)], fits)


def _at_ends(form: Affine, ends: Symbol) -> list[Symbol]:
    return [form.at(ends[0])] if form.constant else [form.at(ends[0]), form.at(ends[1])]


def _negative(form: Affine, ends: Symbol) -> Symbol:
    """One if the values of an affine margin at the ends show that it is negative all along the row."""
    found = Symbol(1)
    for end in _at_ends(form, ends):
        found = found * (end < 0)
    return found
