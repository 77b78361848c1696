"""A scalar tape replayed along a row of points that differ in only one quantity x.

Expressions without x are computed once for the row. Those affine in x are a + b x, two numbers for the row, and their signs
are known everywhere from the two ends. In given modes most torques are affine.
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
    """Outputs along a row; valid where ``fits`` holds (for the row) and ``fits_along`` (None, or for every point)."""

    outputs: list[Form]
    fits: Symbol
    fits_along: Symbol | None

    @property
    def flat(self) -> bool:
        """Whether everything is affine in x."""
        return self.fits_along is None and all(isinstance(form, Affine) for form in self.outputs)


class _Replay:
    """Arithmetic of forms of ``x``; ``away_from_zero``: they hold only on rows that do not pass x = 0."""

    def __init__(self, x: Symbol) -> None:
        self.x = x
        self.away_from_zero = False

    def constant(self, value: float) -> Form:
        return Affine(Symbol(value)) if value else Affine()

    def call(self, function: ca.Function, operands: list[Form]) -> list[Form]:
        results = results_of(function, [value(each, self.x) for each in operands])
        return [Affine(e) for e in results] if all(map(_constant, operands)) else [*results]

    def operate(self, code: int, operands: list[Form]) -> Form:
        first, last, constant = operands[0], operands[-1], all(map(_constant, operands))
        if isinstance(first, Affine) and isinstance(last, Affine) and not constant:
            found = self._affine(code, first, last)
            if found is not None:
                return found
        result = applied(code, [value(each, self.x) for each in operands])
        return Affine(result) if constant else result

    def _affine(self, operation: int, first: Affine, last: Affine) -> Affine | None:
        if operation == ca.OP_ADD:
            return first + last
        if operation == ca.OP_SUB:
            return first + -last
        if operation == ca.OP_NEG:
            return -first
        if operation == ca.OP_TWICE:
            return first + first
        if operation == ca.OP_MUL and (first.constant or last.constant):
            return last.times(first.a) if first.constant else first.times(last.a)
        if operation == ca.OP_IF_ELSE_ZERO and first.constant:
            condition = first.at(self.x)
            return last.each(lambda part: ca.if_else(condition, part, 0))
        if operation == ca.OP_DIV and last.constant and (divisor := last.a) is not None:
            return first.each(lambda part: part / divisor)
        if operation == ca.OP_DIV and first.a is None and last.a is None and first.b is not None and last.b is not None:
            self.away_from_zero = True
            return Affine(first.b / last.b)
        return None


def _constant(form: Form) -> bool:
    return isinstance(form, Affine) and form.constant


def row_forms(
    x: Symbol,
    ends: Symbol,
    symbols: Sequence[Symbol],
    wanted: list[Symbol],
    margins: list[Symbol],
    rivals: list[list[Symbol]],
) -> RowForms:
    """Expressions of x and of the other ``symbols`` along a row whose least and greatest x are ``ends``.

    ``margins`` must not be negative anywhere; in each group of ``rivals`` some margin must be negative everywhere.
    """
    flat = [*margins, *(m for rival in rivals for m in rival)]
    expressions, replay = [ca.densify(e) for e in ca.cse([*wanted, *flat])], _Replay(x)
    arguments: list[Form] = [Affine(b=Symbol(1)), *map(Affine, symbols)]
    tape = ca.Function("powertrain_row", [x, *symbols], expressions)
    forms, n = replayed(tape, expressions, lambda i, _: arguments[i], replay), len(wanted)
    fits, along = Symbol(1), None
    for form in forms[n : n + len(margins)]:
        if isinstance(form, Affine):
            for end in _at_ends(form, ends):
                fits = fits * (end >= 0)
        else:
            along = (form >= 0) if along is None else along * (form >= 0)
    start = n + len(margins)
    for rival in rivals:
        group = forms[start : start + len(rival)]
        affine = [form for form in group if isinstance(form, Affine)]
        if len(affine) == len(group):
            fits = fits * _fails(affine, ends)
        else:
            holds = Symbol(1)
            for form in group:
                holds = holds * (value(form, x) >= 0)
            along = (1 - holds) if along is None else along * (1 - holds)
        start += len(rival)
    if replay.away_from_zero:
        fits = fits * (ends[0] * ends[1] > 0)
    return RowForms(forms[:n], fits, along)


def _at_ends(form: Affine, ends: Symbol) -> list[Symbol]:
    return [form.at(ends[0])] if form.constant else [form.at(ends[0]), form.at(ends[1])]


def _fails(forms: Sequence[Affine], ends: Symbol) -> Symbol:
    """One if the values of affine margins at the ends show that one of them is negative all along the row."""
    found = Symbol(0)
    for form in forms:
        negative = Symbol(1)
        for end in _at_ends(form, ends):
            negative = negative * (end < 0)
        found = ca.fmax(found, negative)
    return found
