"""Expressions whose kinks are rounded, for methods that need second derivatives.

A corner where two branches meet, at side = 0, becomes a hyperbola of the width h:

    |s| -> sqrt(s^2 + h^2),  max(a, b) -> (a + b + sqrt((a - b)^2 + h^2))/2,  (s > 0) -> (1 + s/sqrt(s^2 + h^2))/2

h is a part of the largest |side| along a given course; h -> 0 in steps is the smoothing homotopy of C. Chen, O. L. Mangasarian,
Comput. Optim. Appl. 5 (1996) 97-138. Comparisons of time and parameters alone stay sharp.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TypeAlias

import casadi as ca
import numpy as np

from powertrain.language.symbols import Symbol, column
from powertrain.numerics.buffers import Array
from powertrain.numerics.tape import replayed

Moving: TypeAlias = tuple[Symbol, bool]
"""An expression, and whether it depends on what is solved for."""
_LEAST = 1e-12
"""Width of a corner at whose side the course stays all the time."""


def rounded(function: ca.Function, course: Sequence[Array], moving: Sequence[str]) -> tuple[ca.Function, int]:
    """``function`` with one entry more in its last input, the relative width of its corners, and the number of these.

    ``course`` are the inputs along a course, a column for an instant; ``moving`` names the inputs in which kinks are rounded.
    """
    inputs = function.sx_in()
    found = _Rounding(Symbol.sym("width"))
    _replay(function, inputs, moving, found)
    sides = np.abs(np.array(ca.Function("sides", inputs, [column(found.sides)])(*course), float))
    sizes = np.where(np.isfinite(sides), sides, 0.0).max(axis=1, initial=_LEAST)
    width = Symbol.sym("width")
    outputs = _replay(function, inputs, moving, _Rounding(width, sizes))
    names = (
        [function.name_in(k) for k in range(function.n_in())],
        [function.name_out(k) for k in range(function.n_out())],
    )
    made = ca.Function(function.name(), [*inputs[:-1], ca.vertcat(inputs[-1], width)], outputs, *names)
    return made, len(found.sides)


def _replay(function: ca.Function, inputs: list[Symbol], moving: Sequence[str], found: _Rounding) -> list[Symbol]:
    entries = [ca.densify(e) for e in function.call(inputs)]
    flat = [e.nz[k] for e in entries for k in range(e.numel())]
    scalar = ca.Function("powertrain_kinks", [ca.vec(i) for i in inputs], flat)
    solved = [function.name_in(k) in moving for k in range(function.n_in())]
    results = replayed(scalar, flat, lambda i, j: (inputs[i].nz[j], solved[i]), found)
    values = [results[k][0] if k in results else Symbol(0.0) for k in range(len(flat))]
    ends = np.cumsum([0, *(e.numel() for e in entries)])
    return [ca.reshape(column(values[a:b]), *e.shape) for e, (a, b) in zip(entries, pairwise(ends), strict=True)]


class _Rounding:
    """Replays a tape with rounded corners; without ``sizes``, as it is. ``sides`` are zero where the corners are."""

    def __init__(self, width: Symbol, sizes: Array | None = None) -> None:
        self.width, self.sizes = width, sizes
        self.sides: list[Symbol] = []

    def constant(self, value: float) -> Moving:
        """A number does not move."""
        return Symbol(value), False

    def operate(self, code: int, operands: list[Moving]) -> Moving:
        """The operation, rounded where it has a corner that moves."""
        inner, moves = [e for e, _ in operands], any(m for _, m in operands)
        if moves and code in (ca.OP_FABS, ca.OP_FMIN, ca.OP_FMAX, ca.OP_LT, ca.OP_LE):
            return self._corner(code, inner), True
        if moves and self.sizes is not None and code in _LOGIC:
            return _LOGIC[code](*inner), True
        return ca.SX.unary(code, *inner) if len(inner) == 1 else ca.SX.binary(code, *inner), moves

    def call(self, function: ca.Function, operands: list[Moving]) -> list[Moving]:
        """A function is taken as it is."""
        moves = any(m for _, m in operands)
        places = np.cumsum([0, *(function.numel_in(k) for k in range(function.n_in()))])
        inner = [
            ca.reshape(column([e for e, _ in operands[a:b]]), *function.size_in(k))
            for k, (a, b) in enumerate(pairwise(places))
        ]
        return [(e.nz[j], moves) for e in map(ca.densify, function.call(inner)) for j in range(e.numel())]

    def _corner(self, code: int, inner: list[Symbol]) -> Symbol:
        side = inner[0] if code == ca.OP_FABS else inner[1] - inner[0]
        self.sides.append(side)
        if self.sizes is None:
            return ca.SX.unary(code, *inner) if len(inner) == 1 else ca.SX.binary(code, *inner)
        length = ca.sqrt(side**2 + (self.width * float(self.sizes[len(self.sides) - 1])) ** 2)
        if code == ca.OP_FABS:
            return length
        if code in (ca.OP_LT, ca.OP_LE):
            return (1 + side / length) / 2
        return (inner[0] + inner[1] + (length if code == ca.OP_FMAX else -length)) / 2


_LOGIC: dict[int, Callable[..., Symbol]] = {
    ca.OP_NOT: lambda a: 1 - a,
    ca.OP_AND: lambda a, b: a * b,
    ca.OP_OR: lambda a, b: a + b - a * b,
    ca.OP_IF_ELSE_ZERO: lambda a, b: a * b,
}
"""What stands for logic where truth is a number from 0 to 1."""
