"""Affine aliases: variables that are a multiple of another one (or of its derivative) plus a constant.

    a = k * der^n(b) + c          k, c depend on parameters only

Connections, rigid flanges, w == der(phi), gear ratios and unconnected flows have this form. Eliminating them first leaves a much smaller
model, in which rigidly connected parts already share one angle.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import casadi as ca

from powertrain.compiler.flat import Equation, Flat, ModelVariable
from powertrain.compiler.generic import generic_values
from powertrain.errors import ModelError
from powertrain.language.symbols import Symbol, column, free_symbols, key, scalars, time
from powertrain.numerics.pivots import difference

Coefficient = float | Symbol
"""A number if possible, else an expression of parameters."""
Base = tuple[int, int]
"""A variable, by the key of its symbol, and the order of its derivative."""
CONSTANT = -1
"""Marks a constant variable in ``ties``."""
_CONTRADICTS = 1e-12
"""A redundant equation with a larger residual (in its unit) is reported as a contradiction."""
_QUOTED = 10
"""Lines that a message quotes at most."""


@dataclass(frozen=True)
class Affine:
    """factor * der^order(root) + offset; root None stands for a constant."""

    factor: Coefficient
    root: int | None
    order: int
    offset: Coefficient

    @property
    def plain(self) -> bool:
        """Whether this is just another name of (a derivative of) the root."""
        return (
            isinstance(self.factor, float)
            and self.factor == 1.0
            and isinstance(self.offset, float)
            and self.offset == 0.0
        )


@dataclass(frozen=True)
class Reduced:
    """The model after eliminating aliases: ``equations`` contain only roots and their derivatives.

    ``originals`` are the same equations before elimination; ``ties`` lists the variables of each equation that became an alias.
    """

    flat: Flat
    equations: list[Equation] = field(default_factory=list)
    originals: list[Equation] = field(default_factory=list)
    ties: dict[int, list[int]] = field(default_factory=dict)
    aliases: dict[int, Affine] = field(default_factory=dict)
    symbols: dict[int, Symbol] = field(default_factory=dict)

    def affine(self, base: int) -> Affine:
        """A variable in terms of its root, which it may be itself."""
        return self.aliases.get(base) or Affine(1.0, base, 0, 0.0)

    def expression(self, base: int, order: int) -> Symbol:
        """der^order of a variable in terms of its root."""
        alias = self.affine(base)
        offset = alias.offset if order == 0 else 0.0
        if alias.root is None:
            return Symbol(offset)
        root = self.derivative(self.symbols[alias.root], alias.order + order)
        return root if alias.plain else alias.factor * root + offset

    def named(self) -> dict[Base, list[ModelVariable]]:
        """The variables of the model by the derivative of a root that they are another name of.

        Those nearest to the top of the model come first, quantities with a unit before the signals that measure them.
        """
        found: dict[Base, list[ModelVariable]] = {}
        for k, unknown in self.flat.unknowns.items():
            alias = self.affine(k)
            if alias.root is not None and alias.plain:
                found.setdefault((alias.root, alias.order), []).append(unknown)
        for variables in found.values():
            variables.sort(key=lambda v: (v.name.count("."), v.unit == "1"))
        return found

    def written(self, equation: int) -> Equation:
        """One of the ``equations`` as it was before elimination."""
        return (self.originals if equation < len(self.originals) else self.equations)[equation]

    def variables(self, equations: Sequence[Equation]) -> list[int]:
        """The variables in equations, by the keys of their symbols."""
        bases = self.flat.recorder.bases
        symbols = [s for e in equations for s in free_symbols(e.residual)]
        return list(dict.fromkeys(key(bases.get(key(s), (s, 0))[0]) for s in symbols))

    def tied_by(self, variables: Sequence[int]) -> list[Equation]:
        """The equations behind the aliases on the shortest paths between the variables; from a constant to what makes it constant."""
        users: dict[int, list[int]] = {}
        for i, bases in self.ties.items():
            for base in bases:
                users.setdefault(base, []).append(i)
        found: dict[int, None] = {}
        done: set[int] = set()
        pending = list(variables)
        for first in pending:
            if first in done:
                continue
            came = self._reach(first, users)
            done |= {first} | (set(came) if CONSTANT not in came else set())
            for target in [*variables, CONSTANT]:
                base = target
                while base in came:
                    i, base = came[base]
                    found[i] = None
                    if target == CONSTANT:
                        pending += [b for b in self.ties[i] if b != CONSTANT]
        return [self.flat.equations[i] for i in found]

    def _reach(self, first: int, users: dict[int, list[int]]) -> dict[int, tuple[int, int]]:
        """Everything tied to ``first``: for each variable the equation and the variable through which it was reached."""
        came: dict[int, tuple[int, int]] = {}
        queue = deque([first])
        fixed = self._is_fixed(first)
        while queue:
            at = queue.popleft()
            if at == CONSTANT or (not fixed and self._is_fixed(at)):
                continue
            for i in users.get(at, []):
                for base in self.ties[i]:
                    if base not in came and base != first:
                        came[base] = (i, at)
                        queue.append(base)
        if not fixed:
            came.pop(CONSTANT, None)
        return came

    def _is_fixed(self, base: int) -> bool:
        return self.affine(base).root is None

    def derivative(self, symbol: Symbol, order: int) -> Symbol:
        """The symbol of der^order(symbol)."""
        for _ in range(order):
            symbol = self.flat.recorder.derivative(symbol)
        return symbol

    def rewrite(self, expressions: list[Symbol]) -> list[Symbol]:
        """The expressions with every variable replaced by its root."""
        whole = column(expressions)
        bases = self.flat.recorder.bases
        pairs = [(s, bases.get(key(s), (s, 0))) for s in ca.symvar(whole) if key(s) not in self.flat.recorder.constants]
        pairs = [(s, base) for s, base in pairs if key(base[0]) in self.aliases]
        if not pairs:
            return expressions
        new = [self.expression(key(base), order) for _, (base, order) in pairs]
        (out,) = ca.substitute([whole], [column([s for s, _ in pairs])], [column(new)])
        return scalars(out)


@dataclass
class _Row:
    """sum of coefficient * der^order(base) + constant = 0."""

    equation: int
    terms: list[tuple[Coefficient, Base]]
    constant: Coefficient


def eliminate_aliases(flat: Flat, parameters: dict[int, float]) -> Reduced:
    """Solve every suitable affine equation for one variable with a numeric coefficient, until none is left.

    ``parameters`` are the values used to tell a redundant equation from a contradiction.
    """
    reduced = Reduced(flat, symbols={k: u.symbol for k, u in flat.unknowns.items()})
    work = _Elimination(reduced, parameters)
    rows = _affine_rows(flat)
    for row in rows:
        for _, (base, _) in row.terms:
            work.watching.setdefault(base, set()).add(row.equation)
    work.rows = {row.equation: row for row in rows}
    for work.parametric in (False, True):
        pending = sorted(set(work.rows) - work.used, key=lambda i: len(work.rows[i].terms), reverse=True)
        while pending:
            pending.extend(work.solve(pending.pop()))
    for base in list(reduced.aliases):
        work.resolve(base)
    kept = [e for i, e in enumerate(flat.equations) if i not in work.used]
    residuals = reduced.rewrite([e.residual for e in kept])
    equations = [Equation(r, e.place) for r, e in zip(residuals, kept, strict=True)]
    return replace(reduced, equations=equations, originals=kept)


class _Elimination:
    def __init__(self, reduced: Reduced, parameters: dict[int, float]) -> None:
        self.reduced, self.parameters = reduced, parameters
        self.rows: dict[int, _Row] = {}
        self.used: set[int] = set()
        self.watching: dict[int, set[int]] = {}
        self.parametric = False

    def resolve(self, base: int) -> Affine:
        """The alias of ``base``, followed to its final root."""
        path = []
        while (
            (alias := self.reduced.aliases.get(base)) is not None
            and alias.root is not None
            and alias.root in self.reduced.aliases
        ):
            path.append(base)
            base = alias.root
        result = self.reduced.affine(base)
        for b in reversed(path):
            result = self.reduced.aliases[b] = _compose(self.reduced.aliases[b], result)
        return result

    def solve(self, index: int) -> set[int]:
        """Use one equation if possible; return the equations that may have become usable."""
        if index in self.used:
            return set()
        row = self.rows[index]
        terms, constant = self._collect(row)
        if not terms or self._closes_loop(row, terms):
            self._redundant(index, terms, constant)
            return set()
        if len(terms) > 2:
            return set()
        for base, coefficient in terms.items():
            others = [b for b in terms if b != base]
            if base[1] == 0 and isinstance(coefficient, float) and self._allowed(base, others, terms):
                return self._eliminate(index, base[0], coefficient, others, terms, constant)
        return set()

    def _closes_loop(self, row: _Row, terms: dict[Base, Coefficient]) -> bool:
        """Whether a rigid loop leaves (expression of parameters) * variable = 0. A torque may be zero; a motion should not."""
        moving = sum(self.resolve(base).root is not None for _, (base, _) in row.terms)
        if len(terms) > 1 or moving < 2 or len(terms) >= moving or isinstance(next(iter(terms.values())), float):
            return False
        return not any(self.reduced.flat.unknowns[base].flow for _, (base, _) in row.terms)

    def _allowed(self, base: Base, others: list[Base], terms: dict[Base, Coefficient]) -> bool:
        """Reject aliases in terms of themselves, and torques as inertia times acceleration: torques remain explicit unknowns."""
        if not others:
            return True
        numeric = isinstance(terms[others[0]], float)
        return others[0][0] != base[0] and (numeric or (self.parametric and others[0][1] == 0))

    def _collect(self, row: _Row) -> tuple[dict[Base, Coefficient], Coefficient]:
        terms: dict[Base, Coefficient] = {}
        constant = row.constant
        for coefficient, (base, order) in row.terms:
            alias = self.resolve(base)
            if order == 0:
                constant = constant + coefficient * alias.offset if not _is_zero(alias.offset) else constant
            if alias.root is not None:
                place = (alias.root, alias.order + order)
                terms[place] = _sum(terms.get(place, 0.0), coefficient * alias.factor)
        return {b: c for b, c in terms.items() if not _is_zero(c)}, constant

    def _eliminate(
        self,
        index: int,
        base: int,
        coefficient: float,
        others: list[Base],
        terms: dict[Base, Coefficient],
        constant: Coefficient,
    ) -> set[int]:
        self.used.add(index)
        bases = [b for _, (b, _) in self.rows[index].terms]
        first_constant = not others and all(self.resolve(b).root is not None for b in bases)
        self.reduced.ties[index] = bases + [CONSTANT] * first_constant
        if others:
            (root, order), factor = others[0], -terms[others[0]] / coefficient
            self.reduced.aliases[base] = Affine(factor, root, order, -constant / coefficient)
        else:
            self.reduced.aliases[base] = Affine(0.0, None, 0, -constant / coefficient)
        woken = self.watching.pop(base, set())
        if others:
            self.watching.setdefault(others[0][0], set()).update(woken)
        return {i for i in woken if i not in self.used and len(self.rows[i].terms) <= 4}

    def _redundant(self, index: int, terms: dict[Base, Coefficient], constant: Coefficient) -> None:
        """An equation between variables that are already tied: it repeats or contradicts other equations."""
        flat = self.reduced.flat
        left = next(iter(terms.values()), constant)
        bases = [base for _, (base, _) in self.rows[index].terms]
        loop = [flat.equations[index], *self.reduced.tied_by(bases)]
        symbols = ca.symvar(column([*(e.residual for e in loop), Symbol(left)]))
        used = {s.name(): self.parameters[key(s)] for s in symbols if key(s) in self.parameters}
        value = float(generic_values(Symbol(left), self.parameters))
        values = f"\n  with {', '.join(f'{n} = {v:g}' for n, v in used.items())}" if used else ""
        quoted = quote(loop) + values
        if abs(value) > _CONTRADICTS:
            except_at = ", except at standstill" if terms else ""
            raise ModelError(f"contradiction: these equations cannot all hold{except_at}\n  {quoted}")
        if any(flat.unknowns[base].flow for base in bases):
            raise ModelError(
                f"loose part: these equations determine the same torques or forces twice, so one motion is not determined; "
                f"connect the open port to something with inertia, or remove the part\n  {quoted}"
            )
        raise ModelError(
            f"rigid loop: these equations connect the same parts twice, so the torques in the loop are not determined; "
            f"remove one of the connections, or give it a compliance\n  {quoted}"
        )


def quote(equations: Sequence[Equation]) -> str:
    """Source lines of equations for a message; connections only if there are no others."""
    lines = list(dict.fromkeys(str(e.place) for e in equations))
    telling = [line for line in lines if "connect(" not in line] or lines
    return "\n  ".join(telling[:_QUOTED] + ["..."] * (len(telling) > _QUOTED))


def _compose(outer: Affine, inner: Affine) -> Affine:
    """The outer alias applied to the inner one: outer.factor * der^outer.order(inner) + outer.offset."""
    offset = outer.offset + (outer.factor * inner.offset if outer.order == 0 else 0.0)
    return Affine(outer.factor * inner.factor, inner.root, outer.order + inner.order, offset)


def _sum(a: Coefficient, b: Coefficient) -> Coefficient:
    """A + b; zero if the sum of two numbers is round-off, so that a loop of ratios 1.13, 1.99 and 2.2487 closes."""
    return a + b if isinstance(a, Symbol) or isinstance(b, Symbol) else difference(a, -b)


def _is_zero(coefficient: Coefficient) -> bool:
    return bool(coefficient.is_zero()) if isinstance(coefficient, Symbol) else coefficient == 0.0


def _number(expression: Symbol) -> Coefficient:
    return float(expression) if expression.is_constant() else expression


def _affine_rows(flat: Flat) -> list[_Row]:
    """The equations that are affine in the variables with coefficients of parameters only."""
    residuals = column([e.residual for e in flat.equations])
    held = flat.recorder.constants
    moved = held - {key(c.symbol) for c in flat.parameters}
    symbols = [s for s in ca.symvar(residuals) if key(s) not in held and key(s) != key(time)]
    moving = [s for s in ca.symvar(residuals) if key(s) in moved] + [time]
    unknowns, bases = column(symbols), flat.recorder.bases
    jacobian = ca.jacobian(residuals, unknowns)
    entries = scalars(jacobian.nz[:])
    varying = ca.which_depends(column(entries), ca.vertcat(unknowns, *moving), 1, True) if entries else []
    constants = scalars(ca.substitute(residuals, unknowns, ca.DM.zeros(unknowns.shape)))
    timed = ca.which_depends(residuals, column(moving), 1, True)
    terms: list[list[tuple[Coefficient, Base]] | None] = [[] for _ in flat.equations]
    rows, columns = jacobian.sparsity().get_triplet()
    for i, j, entry, varies in zip(rows, columns, entries, varying, strict=True):
        row = terms[i]
        if varies or row is None:
            terms[i] = None
            continue
        base, order = bases.get(key(symbols[j]), (symbols[j], 0))
        row.append((_number(entry), (key(base), order)))
    return [
        _Row(i, row, _number(constants[i])) for i, row in enumerate(terms) if row and not timed[i] and len(row) <= 8
    ]
