"""Rejects undeclared jumps in equations and laws: such a jump has no event, and its derivative is zero.

Values that change only at events (parameters, modes, discrete variables, and variables that depend on these alone) may jump freely.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import casadi as ca
import numpy as np

from powertrain.compiler.calls import marks
from powertrain.compiler.flat import Flat, rewritten
from powertrain.compiler.operations import JUMPING, KINKS, STEPS, Ways, behind_jumps, may_jump
from powertrain.compiler.walks import Jump, Setting, find_jump
from powertrain.errors import ModelError, ParameterError
from powertrain.language.recorder import Place
from powertrain.language.symbols import Symbol, column, free_symbols, key, time
from powertrain.numerics.tape import graph_of

_JUMPS, _CALLS, _NAN, _MOVES, _BENDS = 1, 2, 4, 8, 16
_TOLD = JUMPING | KINKS | {ca.OP_DIV, ca.OP_TAN}
"""Operations that add marks to those of their operands."""
_LONGEST = 60
_REPEATS = (
    "for a signal of time write schedule(times, values), or switch(time >= t, a, b); for one that repeats count the periods in a discrete "
    "variable: when(time >= (n + 1)*period, reinit(n, n + 1))"
)
_COUNTS = "count with a discrete variable: when(x >= n + 1, reinit(n, n + 1)) and when(x < n, reinit(n, n - 1))"
_SWITCHES = (
    "write switch(condition, a, b) for a change between two expressions, friction(w, torque, lower, upper) for what sticks, "
    "unilateral(gap, force) for a contact, when(condition, reinit(...)) for a value that is set"
)
_EQUAL = (
    "an equality holds at one instant alone; compare with < or >, or declare the change with switch(condition, a, b)"
)


def refuse_jumps(flat: Flat) -> Flat:
    """ModelError for an undeclared jump. In the result, variables that depend on held values alone are expressed by these."""
    texts = [*flat.lines(), *flat.recorder.differentiated]
    found = _marks(flat, [e for _, e in texts])
    held = _Held(flat) if any(mark & _JUMPS for mark in found) else None
    settled: dict[int, Symbol] = {}
    for (place, expression), mark in zip(texts, found, strict=True):
        if mark & _NAN:
            raise ModelError(f"{place}\n  a value in this line is not a number (nan)")
        if mark & _CALLS:
            _check_calls(expression, place)
        if mark & _JUMPS and held is not None:
            settled[key(expression)] = held.settled(expression)
            jump = find_jump(settled[key(expression)], held.setting)
            if jump is not None:
                raise ModelError(_said(jump, place, held))
    return rewritten(flat, lambda listed: [settled.get(key(e), e) for e in listed]) if settled else flat


def _marks(flat: Flat, expressions: Sequence[Symbol]) -> list[int]:
    """For each expression, whether it may jump, calls a function, or is not a number."""
    symbols = free_symbols(column(list(expressions)))
    moves = [_MOVES * (key(s) not in flat.recorder.constants) for s in symbols]

    def mark(tape: ca.Function, k: int, inner: list[int]) -> int:
        operation = tape.instruction_id(k)
        if operation == ca.OP_INPUT:
            return moves[tape.instruction_input(k)[1]]
        if operation == ca.OP_CONST:
            return _NAN if np.isnan(tape.instruction_constant(k)) else 0
        if operation == ca.OP_CALL:
            return _CALLS
        if operation not in _TOLD:
            return 0
        of = [Ways(bool(bits & _MOVES), bool(bits & _BENDS)) for bits in inner]
        return _JUMPS * may_jump(operation, of) | _BENDS * Ways.of(operation, of).bends

    return marks(expressions, mark)


def _check_calls(expression: Symbol, place: Place) -> None:
    """ModelError for a call of a function that has no derivatives or hides a jump."""
    for node, _ in graph_of(expression).values():
        if node.is_output():
            for function in _inside(node.dep(0).which_function()):
                _check_function(function, place)


def _inside(function: ca.Function) -> Iterator[ca.Function]:
    """A function and all functions that it calls."""
    yield function
    if function.class_name() == "MXFunction":
        for k in range(function.n_instructions()):
            if function.instruction_id(k) == ca.OP_CALL:
                yield from _inside(function.instruction_MX(k).which_function())


def _check_function(function: ca.Function, place: Place) -> None:
    name, kind = function.name(), function.class_name()
    if kind in ("SXFunction", "MXFunction"):
        if JUMPING & {function.instruction_id(k) for k in range(function.n_instructions())}:
            raise ModelError(
                f"{place}\n  {name} contains a comparison or another operation that may jump, for which no event can be located; "
                "build the function without the option never_inline"
            )
        return
    try:
        function.forward(1)
    except RuntimeError:
        said = "a Python callback" if kind == "CallbackInternal" else f"a function ({kind})"
        raise ModelError(
            f"{place}\n  {name} is {said} without derivatives, which an equation cannot call. Equations may call maps (powertrain.Map), "
            "casadi.interpolant, and functions of CasADi expressions. For a numerical function, compute a table once and call its map, "
            f'Map.curve(points, [float({name}(x)) for x in points], outside="clip", method="smooth")'
        ) from None


class _Held:
    """Values that are constant between events: parameters, held values, and variables that equations determine by these alone."""

    def __init__(self, flat: Flat) -> None:
        self.constants = flat.recorder.constants
        self.values: dict[int, Symbol] = {}
        self._find(flat)
        numbers = {key(c.symbol): c for c in flat.parameters}
        starts = {key(d.symbol): d.value for d in flat.discretes}

        def draw(symbol: Symbol, generator: np.random.Generator, k: int) -> float:
            """The model's own value on every third line, otherwise other allowed values; whole numbers for held values."""
            constant, normal = numbers.get(key(symbol)), float(generator.normal())
            if constant is None:
                return (starts.get(key(symbol), 0.0), float(round(3 * normal)), 3 * normal)[k % 3]
            if k % 3 == 0:
                return constant.value
            try:
                return constant.check(constant.value * (1 + 0.1 * normal) if constant.value else abs(normal), "")
            except ParameterError:
                return constant.value

        switches = [(s.mode, self.settled(s.g)) for s in (*flat.recorder.switches, *flat.recorder.relations)]
        limits = [(g.value, g.low, g.high) for g in flat.recorder.guards if g.action == "error"]
        self.setting = Setting(self.moves, draw, switches, limits)

    def moves(self, symbol: Symbol) -> bool:
        """Whether a symbol changes between events."""
        return key(symbol) not in self.constants

    def settled(self, expression: Symbol) -> Symbol:
        """The expression with held values for the variables that decide where it jumps, if these are known."""
        inside = [s for s in behind_jumps(expression) if key(s) in self.values]
        if not inside:
            return expression
        (found,) = ca.substitute([expression], [column(inside)], [column([self.values[key(s)] for s in inside])])
        return Symbol(found)

    def _find(self, flat: Flat) -> None:
        """Follow equations that are linear in one variable and otherwise contain only held values."""
        open_: list[set[int]] = []
        users: dict[int, list[int]] = {}
        for i, e in enumerate(flat.equations):
            open_.append({key(s) for s in free_symbols(e.residual) if self.moves(s)})
            for k in open_[-1]:
                users.setdefault(k, []).append(i)
        pending = [i for i, inside in enumerate(open_) if len(inside) == 1]
        while pending:
            i = pending.pop()
            if len(open_[i]) != 1:
                continue
            (k,) = open_[i]
            value = self._solved(flat, i, k)
            if value is None:
                continue
            self.values[k] = value
            for j in users[k]:
                open_[j].discard(k)
                pending += [j] * (len(open_[j]) == 1)

    def _solved(self, flat: Flat, i: int, k: int) -> Symbol | None:
        unknown = flat.unknowns.get(k)
        if unknown is None:
            return None
        residual = flat.equations[i].residual
        known = [s for s in free_symbols(residual) if key(s) in self.values]
        residual = ca.substitute(residual, column(known), column([self.values[key(s)] for s in known]))
        slope = ca.jacobian(residual, unknown.symbol)
        if not slope.is_constant() or not float(slope) or k in map(key, behind_jumps(residual)):
            return None
        return -ca.substitute(residual, unknown.symbol, 0) / slope


def _said(jump: Jump, place: Place, held: _Held) -> str:
    """The message: the line, the operation that jumps, and what to write instead."""
    text = str(jump.operation)
    text = text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."
    moving = {key(s) for s in free_symbols(jump.operation) if held.moves(s)}
    if moving == {key(time)}:
        advice = _REPEATS
    elif jump.operation.op() in STEPS:
        advice = _COUNTS
    else:
        advice = _EQUAL if jump.operation.op() in (ca.OP_EQ, ca.OP_NE) else _SWITCHES
    return (
        f"{place}\n  {text} makes this jump from {jump.before:.4g} to {jump.after:.4g}, and no event is declared for it: "
        f"a solver steps over it or sees no slope. Instead {advice}"
    )
