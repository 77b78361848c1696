"""A scalar tape replayed along a row of points that differ in only one quantity x.

Expressions without x are computed once for the row. Expressions affine in x are represented as a + b x, two numbers for the row, and
their signs are known everywhere from the two ends. In given modes most torques are affine.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from powertrain.language.symbols import Symbol
from powertrain.numerics.tape import applied, replayed, results_of


@dataclass(frozen=True)
class Form:
    """a + b x, where None is zero; or any other expression ``curve`` of x."""

    a: Symbol | None = None
    b: Symbol | None = None
    curve: Symbol | None = None

    @property
    def constant(self) -> bool:
        """Whether it is constant along the row."""
        return self.b is None and self.curve is None


@dataclass(frozen=True)
class RowForms:
    """Outputs along a row; valid where ``fits`` holds (for the row) and ``fits_along`` (None, or for every point)."""

    outputs: list[Form]
    fits: Symbol
    fits_along: Symbol | None

    @property
    def flat(self) -> bool:
        """Whether everything is affine in x."""
        return self.fits_along is None and all(f.curve is None for f in self.outputs)


class _Replay:
    """Replays a tape on forms; ``ends`` are the least and greatest x of the row."""

    def __init__(self, x: Symbol) -> None:
        self.x = x
        self.away_from_zero = False

    def run(self, expressions: Sequence[Symbol], symbols: Sequence[Symbol], arguments: Sequence[Form]) -> list[Form]:
        scalar = ca.Function("powertrain_row", list(symbols), list(expressions))
        results = replayed(scalar, expressions, lambda i, _: arguments[i], self)
        return [results.get(i, Form()) for i in range(scalar.n_out())]

    def constant(self, value: float) -> Form:
        return Form(Symbol(value)) if value else Form()

    def value(self, form: Form) -> Symbol:
        if form.curve is not None:
            return form.curve
        a = Symbol(0) if form.a is None else form.a
        return a if form.b is None else a + form.b * self.x

    def call(self, function: ca.Function, operands: list[Form]) -> list[Form]:
        results = results_of(function, [self.value(each) for each in operands])
        constant = all(each.constant for each in operands)
        return [Form(a=e) if constant else Form(curve=e) for e in results]

    def operate(self, code: int, operands: list[Form]) -> Form:
        if all(each.constant for each in operands):
            return Form(applied(code, [self.value(each) for each in operands]))
        if all(each.curve is None for each in operands):
            found = self._affine(code, operands[0], operands[-1])
            if found is not None:
                return found
        return Form(curve=applied(code, [self.value(each) for each in operands]))

    def _affine(self, operation: int, first: Form, last: Form) -> Form | None:
        if operation == ca.OP_ADD:
            return Form(_sum(first.a, last.a), _sum(first.b, last.b))
        if operation == ca.OP_SUB:
            return Form(_sum(first.a, _negative(last.a)), _sum(first.b, _negative(last.b)))
        if operation == ca.OP_NEG:
            return Form(_negative(first.a), _negative(first.b))
        if operation == ca.OP_TWICE:
            return Form(_sum(first.a, first.a), _sum(first.b, first.b))
        if operation == ca.OP_MUL and (first.constant or last.constant):
            factor, form = (first, last) if first.constant else (last, first)
            return Form(_product(factor.a, form.a), _product(factor.a, form.b))
        if operation == ca.OP_IF_ELSE_ZERO and first.constant:
            return Form(*(None if part is None else _where(first.a, part) for part in (last.a, last.b)))
        if operation == ca.OP_DIV and last.constant and last.a is not None:
            return Form(*(None if part is None else part / last.a for part in (first.a, first.b)))
        if operation == ca.OP_DIV and first.a is None and last.a is None and first.b is not None and last.b is not None:
            self.away_from_zero = True
            return Form(first.b / last.b)
        return None


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
    replay = _Replay(x)
    expressions = [ca.densify(e) for e in ca.cse([*wanted, *flat])]
    forms = replay.run(expressions, [x, *symbols], [Form(b=Symbol(1)), *(Form(s) for s in symbols)])
    n = len(wanted)
    fits, along = Symbol(1), None
    for form in forms[n : n + len(margins)]:
        if form.curve is None:
            for end in _at_ends(form, ends):
                fits = fits * (end >= 0)
        else:
            along = (form.curve >= 0) if along is None else along * (form.curve >= 0)
    start = n + len(margins)
    for rival in rivals:
        group = forms[start : start + len(rival)]
        if all(form.curve is None for form in group):
            fits = fits * _fails(group, ends)
        else:
            holds = Symbol(1)
            for form in group:
                holds = holds * (replay.value(form) >= 0)
            along = (1 - holds) if along is None else along * (1 - holds)
        start += len(rival)
    if replay.away_from_zero:
        fits = fits * (ends[0] * ends[1] > 0)
    return RowForms(forms[:n], fits, along)


def _at_ends(form: Form, ends: Symbol) -> list[Symbol]:
    a = Symbol(0) if form.a is None else form.a
    return [a] if form.b is None else [a + form.b * ends[0], a + form.b * ends[1]]


def _fails(forms: Sequence[Form], ends: Symbol) -> Symbol:
    """One if the values of affine margins at the ends show that one of them is negative all along the row."""
    found = Symbol(0)
    for form in forms:
        negative = Symbol(1)
        for end in _at_ends(form, ends):
            negative = negative * (end < 0)
        found = ca.fmax(found, negative)
    return found


def _where(condition: Symbol | None, value: Symbol) -> Symbol:
    return Symbol(0) if condition is None else ca.if_else(condition, value, 0)


def _sum(a: Symbol | None, b: Symbol | None) -> Symbol | None:
    return b if a is None else a if b is None else a + b


def _negative(a: Symbol | None) -> Symbol | None:
    return None if a is None else -a


def _product(a: Symbol | None, b: Symbol | None) -> Symbol | None:
    return None if a is None or b is None else a * b
