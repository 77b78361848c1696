"""Expressions with rounded kinks, for methods that need second derivatives.

A corner where two branches meet, at side = 0, becomes a hyperbola of the width h:

    |s| -> sqrt(s^2 + h^2),  max(a, b) -> (a + b + sqrt((a - b)^2 + h^2))/2,  (s > 0) -> (1 + s/sqrt(s^2 + h^2))/2

h is a share of the largest |side| along a given course; only corners that the course reaches are rounded. Decreasing h in steps is the
smoothing homotopy of C. Chen, O. L. Mangasarian, Comput. Optim. Appl. 5 (1996) 97-138. Comparisons of time and parameters alone are not
rounded, nor is anything if a branch has no value on the other branch's side.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TypeAlias

import casadi as ca
import numpy as np

from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol, column
from powertrain.numerics.tape import applied, replayed, results_of

FIXED, MOVING, ROUND = range(3)
"""The kind of an expression: independent of the unknowns, dependent on them, or a truth value between 0 and 1."""
Moving: TypeAlias = tuple[Symbol, int]
_NEAR = 0.01
"""A course reaches a corner if its side falls to this share of its largest value."""
_ROUND_OFF = 1e-9
"""A side this close to zero, relative to 1 and to its operands, is zero: a width of its size would give an unbounded curvature."""


def rounded(function: ca.Function, course: Sequence[Array], moving: Sequence[str]) -> tuple[ca.Function, int]:
    """``function`` with one more entry in its last input, the relative width of its corners, and the number of corners.

    ``course`` are the inputs along a course, one column per instant; ``moving`` names the inputs in which kinks are rounded.
    """
    inputs = function.sx_in()
    found = _Rounding(Symbol.sym("width"))
    _replay(function, inputs, moving, found)
    at_course = ca.Function("sides", inputs, [column(found.sides), column(found.compared)])
    values, compared = (np.array(v, float) for v in at_course(*course))
    sides = np.where(np.abs(values) > _ROUND_OFF * (1 + compared), np.abs(values), 0.0)
    sizes = np.where(np.isfinite(sides), sides, 0.0).max(axis=1, initial=0.0)
    crossed = np.array([np.ptp(np.sign(row)) > 1 for row in values], bool)
    sizes[~crossed & (sides.min(axis=1, initial=np.inf) > _NEAR * sizes)] = 0.0
    made = _made(function, moving, sizes)
    if not _finite(made(*course[:-1], np.vstack([course[-1], np.full((1, course[-1].shape[1]), 1.0)]))):
        sizes[:] = 0.0  # a branch has no value on the other one's side
        made = _made(function, moving, sizes)
    return made, int((sizes > 0.0).sum())


def _made(function: ca.Function, moving: Sequence[str], sizes: Array) -> ca.Function:
    inputs, width = function.sx_in(), Symbol.sym("width")
    outputs = _replay(function, inputs, moving, _Rounding(width, sizes))
    names = (
        [function.name_in(k) for k in range(function.n_in())],
        [function.name_out(k) for k in range(function.n_out())],
    )
    return ca.Function(function.name(), [*inputs[:-1], ca.vertcat(inputs[-1], width)], outputs, *names)


def _finite(values: ca.DM | tuple[ca.DM, ...]) -> bool:
    return all(np.isfinite(np.array(v)).all() for v in (values if isinstance(values, tuple) else (values,)))


def _replay(function: ca.Function, inputs: list[Symbol], moving: Sequence[str], found: _Rounding) -> list[Symbol]:
    entries = [ca.densify(e) for e in function.call(inputs)]
    flat = [e.nz[k] for e in entries for k in range(e.numel())]
    scalar = ca.Function("powertrain_kinks", [ca.vec(i) for i in inputs], flat)
    solved = [function.name_in(k) in moving for k in range(function.n_in())]
    results = replayed(scalar, flat, lambda i, j: (inputs[i].nz[j], MOVING if solved[i] else FIXED), found)
    values = [value for value, _ in results]
    ends = np.cumsum([0, *(e.numel() for e in entries)])
    return [ca.reshape(column(values[a:b]), *e.shape) for e, (a, b) in zip(entries, pairwise(ends), strict=True)]


class _Rounding:
    """Replays a tape with corners rounded by ``sizes``; without them, unchanged.

    ``sides`` are zero at the corners, ``compared`` the sizes of their operands.
    """

    def __init__(self, width: Symbol, sizes: Array | None = None) -> None:
        self.width, self.sizes = width, sizes
        self.sides: list[Symbol] = []
        self.compared: list[Symbol] = []

    def constant(self, value: float) -> Moving:
        """A number does not depend on the unknowns."""
        return Symbol(value), FIXED

    def operate(self, code: int, operands: list[Moving]) -> Moving:
        """The operation, rounded if it has a corner that depends on the unknowns."""
        inner, ways = [e for e, _ in operands], [way for _, way in operands]
        if max(ways) > FIXED and code in _CORNERS:
            return self._corner(code, inner)
        if ways[0] == ROUND and code == ca.OP_IF_ELSE_ZERO:
            return inner[0] * inner[1], MOVING
        if max(ways) == ROUND and code in _LOGIC:
            return _LOGIC[code](*inner), ROUND
        return applied(code, inner), min(max(ways), MOVING)

    def call(self, function: ca.Function, operands: list[Moving]) -> list[Moving]:
        """A function is called unchanged and never inlined: interpolation has no symbolic value."""
        way = min(max((way for _, way in operands), default=FIXED), MOVING)
        return [(e, way) for e in results_of(function, [e for e, _ in operands])]

    def _corner(self, code: int, inner: list[Symbol]) -> Moving:
        side = inner[0] if code == ca.OP_FABS else inner[1] - inner[0]
        self.sides.append(side)
        self.compared.append(ca.fabs(inner[0]) + ca.fabs(inner[-1]))
        size = 0.0 if self.sizes is None else float(self.sizes[len(self.sides) - 1])
        if size == 0.0:
            return applied(code, inner), MOVING
        length = ca.sqrt(side**2 + (self.width * size) ** 2)
        if code == ca.OP_FABS:
            return length, MOVING
        if code in (ca.OP_LT, ca.OP_LE):
            return (1 + side / length) / 2, ROUND
        return (inner[0] + inner[1] + (length if code == ca.OP_FMAX else -length)) / 2, MOVING


_CORNERS = frozenset({ca.OP_FABS, ca.OP_FMIN, ca.OP_FMAX, ca.OP_LT, ca.OP_LE})
_LOGIC: dict[int, Callable[..., Symbol]] = {
    ca.OP_NOT: lambda a: 1 - a,
    ca.OP_AND: lambda a, b: a * b,
    ca.OP_OR: lambda a, b: a + b - a * b,
}
"""Logic operations for truth values from 0 to 1."""
