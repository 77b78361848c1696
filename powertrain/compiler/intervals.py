"""Interval arithmetic: what values the operations of an expression may have."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import casadi as ca

Interval = tuple[float, float]
ALL: Interval = (-math.inf, math.inf)
UNIT: Interval = (-1.0, 1.0)
POSITIVE: Interval = (0.0, math.inf)


def interval_of(code: int, inside: Sequence[Interval], same: bool = False) -> Interval:
    """The interval of an operation from those of its operands, which may be the ``same``."""
    if code not in _RANGES:
        return ALL
    found = _square(inside[0]) if code == ca.OP_MUL and same else _RANGES[code](*inside)
    return ALL if any(map(math.isnan, found)) else found


def _square(a: Interval) -> Interval:
    ends = sorted((a[0] * a[0], a[1] * a[1]))
    return (0.0 if a[0] <= 0.0 <= a[1] else ends[0], ends[1])


def _product(a: Interval, b: Interval) -> Interval:
    ends = [0.0 if 0.0 in (x, y) else x * y for x in a for y in b]
    return min(ends), max(ends)


def _quotient(a: Interval, b: Interval) -> Interval:
    if b[0] < 0.0 < b[1] or (b[0] == 0.0 == b[1]):
        return ALL
    ends = sorted(1.0 / e if e else math.copysign(math.inf, b[0] + b[1]) for e in b)
    return _product(a, (ends[0], ends[1]))


def _size(a: Interval) -> Interval:
    return (0.0 if a[0] <= 0.0 <= a[1] else min(map(abs, a)), max(map(abs, a)))


def _power(a: Interval, b: Interval) -> Interval:
    return POSITIVE if a[0] >= 0.0 or (b[0] == b[1] and b[0] % 2.0 == 0.0) else ALL


_RANGES: dict[int, Callable[..., Interval]] = {
    ca.OP_ADD: lambda a, b: (a[0] + b[0], a[1] + b[1]),
    ca.OP_SUB: lambda a, b: (a[0] - b[1], a[1] - b[0]),
    ca.OP_NEG: lambda a: (-a[1], -a[0]),
    ca.OP_MUL: _product,
    ca.OP_TWICE: lambda a: (2.0 * a[0], 2.0 * a[1]),
    ca.OP_DIV: _quotient,
    ca.OP_INV: lambda a: _quotient((1.0, 1.0), a),
    ca.OP_SQ: _square,
    ca.OP_FABS: _size,
    ca.OP_FMAX: lambda a, b: (max(a[0], b[0]), max(a[1], b[1])),
    ca.OP_FMIN: lambda a, b: (min(a[0], b[0]), min(a[1], b[1])),
    ca.OP_SQRT: lambda a: (math.sqrt(max(a[0], 0.0)), math.sqrt(max(a[1], 0.0))),
    ca.OP_POW: _power,
    ca.OP_CONSTPOW: _power,
    ca.OP_EXP: lambda a: POSITIVE,
    ca.OP_COSH: lambda a: (1.0, math.inf),
    ca.OP_HYPOT: lambda a, b: (math.hypot(_size(a)[0], _size(b)[0]), math.inf),
    ca.OP_SIN: lambda a: UNIT,
    ca.OP_COS: lambda a: UNIT,
    ca.OP_TANH: lambda a: UNIT,
    ca.OP_IF_ELSE_ZERO: lambda a, b: (min(b[0], 0.0), max(b[1], 0.0)),
    **dict.fromkeys((ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_AND, ca.OP_OR), lambda a, b: (0.0, 1.0)),
    ca.OP_NOT: lambda a: (0.0, 1.0),
}
"""The interval of an operation from those of its operands; others may have any value."""
