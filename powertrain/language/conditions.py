"""Conditions of ``when`` and ``switch``: the expression whose zero is the event, and an event of its own for every comparison."""

from __future__ import annotations

import operator
from collections.abc import Callable

import casadi as ca

from powertrain.errors import ModelError
from powertrain.language.recorder import SwitchEntry, recorder
from powertrain.language.symbols import Symbol, free_symbols, key


def combined(condition: Symbol, name: str, relations: list[SwitchEntry]) -> Symbol:
    """Positive exactly while ``condition`` holds; of several comparisons, in terms of their truth, which only events change.

    The comparisons join ``relations``.
    """
    active, found, condition = recorder(), list[Symbol](), _unfolded(condition)

    def alone(relation: Symbol) -> Symbol:
        found.append(relation)
        return _residual(relation)

    def held(relation: Symbol) -> Symbol:
        g = _residual(relation)
        if is_held(g):
            return g
        known = next((r for r in relations if key(r.condition) == key(relation)), None)
        if known is None:
            mode = active.hold(f"{active.path}.{name}.relation{len(relations)}".lstrip("."))
            known = SwitchEntry(mode, g, active.place, True, relation)
            relations.append(known)
        return 2 * known.mode - 1

    g = crossing(condition, alone)
    return g if len(found) < 2 else crossing(condition, held)


def _unfolded(condition: Symbol) -> Symbol:
    """``|a| < b`` as ``a < b`` and ``-a < b``, and so on: a peak of ``b - |a|``, however narrow, lies between two events.

    Only where the parts are affine: others may jump where they do not count, as an angle does that begins anew.
    """
    inner = [condition.dep(i) for i in range(condition.n_dep())]
    for op, join in (ca.OP_AND, ca.logic_and), (ca.OP_OR, ca.logic_or), (ca.OP_NOT, ca.logic_not):
        if condition.is_op(op):
            return join(*map(_unfolded, inner))
    if not (condition.is_op(ca.OP_LT) or condition.is_op(ca.OP_LE)):
        return condition
    compare = operator.lt if condition.is_op(ca.OP_LT) else operator.le
    for k, joins in enumerate(((ca.logic_and, ca.logic_or), (ca.logic_or, ca.logic_and))):
        for op, join in zip((ca.OP_FMAX, ca.OP_FMIN), joins, strict=True):
            parts = _parts(inner[k], op)
            if parts and all(map(_affine, parts)):
                sides = [(part, inner[1]) if k == 0 else (inner[0], part) for part in parts]
                return join(*(_unfolded(compare(*side)) for side in sides))
    return condition


def _affine(expression: Symbol) -> bool:
    """Whether an expression is affine in what changes between events."""
    moving = [s for s in free_symbols(expression) if key(s) not in recorder().constants]
    return not moving or bool(ca.is_linear(expression, ca.vertcat(*moving)))


def _parts(value: Symbol, op: int) -> list[Symbol]:
    """What a value is the larger, or the smaller, of: |a| of a and -a, c - |a| of c - a and c + a."""
    inner, other = [value.dep(i) for i in range(value.n_dep())], ca.OP_FMIN if op == ca.OP_FMAX else ca.OP_FMAX
    if value.is_op(op):
        return inner
    if value.is_op(ca.OP_FABS) and op == ca.OP_FMAX:
        return [inner[0], -inner[0]]
    if value.is_op(ca.OP_NEG):
        return [-part for part in _parts(inner[0], other)]
    if value.is_op(ca.OP_ADD):
        return [p + inner[1] for p in _parts(inner[0], op)] or [inner[0] + p for p in _parts(inner[1], op)]
    if value.is_op(ca.OP_SUB):
        return [p - inner[1] for p in _parts(inner[0], op)] or [inner[0] - p for p in _parts(inner[1], other)]
    return []


def _residual(relation: Symbol) -> Symbol:
    """The expression that is positive exactly while a comparison holds: of what only events change, its truth."""
    g = relation.dep(1) - relation.dep(0)
    return 2 * relation - 1 if is_held(g) else g


def is_held(expression: Symbol) -> bool:
    """Whether only events change the value of an expression."""
    constants = recorder().constants
    return all(key(s) in constants for s in free_symbols(expression))


def crossing(condition: Symbol, of: Callable[[Symbol], Symbol] = _residual) -> Symbol:
    """The expression that is positive exactly while ``condition`` holds, from what its comparisons are positive ``of``."""
    if condition.is_op(ca.OP_LT) or condition.is_op(ca.OP_LE):
        return of(condition)
    if condition.is_op(ca.OP_AND):
        return ca.fmin(crossing(condition.dep(0), of), crossing(condition.dep(1), of))
    if condition.is_op(ca.OP_OR):
        return ca.fmax(crossing(condition.dep(0), of), crossing(condition.dep(1), of))
    if condition.is_op(ca.OP_NOT):
        return -crossing(condition.dep(0), of)
    if condition.is_constant():
        return condition - 0.5
    raise ModelError(f"{recorder().place}: {condition} is not a comparison such as w > 0")
