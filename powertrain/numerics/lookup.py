"""Linear tables looked up at columns of points. CasADi's interpolants take one point after the other, and their slopes once more each.

In every direction s is the share of the interval that is passed, x = x_i + s (x_i+1 - x_i); the value is linear in each s, and the
slope in one direction is the difference between the ends of that interval over its length.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import casadi as ca

from powertrain.language.tables import LinearTable, known

ADJOINT = "adj1_wrap_"
"""CasADi's name for the derivative of an interpolant: (x, nothing, seed) -> the seed times the slopes."""


def table_of(function: ca.Function) -> tuple[LinearTable | None, bool]:
    """The table that a function looks up, if it does, and whether it gives slopes."""
    name = function.name()
    slopes = name.startswith(ADJOINT)
    return known.get(name.removeprefix(ADJOINT)), slopes


class Lookup:
    """One table at the columns ``arguments``, one for each axis."""

    def __init__(self, table: LinearTable, arguments: Sequence[ca.MX]) -> None:
        self.of = table, arguments
        self._count = len(table.points)
        self._shares: list[ca.MX] = []
        self._lengths: list[ca.MX] = []
        place, stride, strides = ca.MX(0.0), 1, []
        for points, mode, x in zip(table.points, table.modes, arguments, strict=True):
            interval, grid = ca.low(ca.DM(points), x, {"lookup_mode": mode}), ca.MX(ca.DM(points))
            first, last = grid.nz[interval], grid.nz[interval + 1]
            self._lengths.append(last - first)
            self._shares.append((x - first) / self._lengths[-1])
            place = place + stride * interval
            strides.append(stride)
            stride *= len(points)
        values = ca.MX(ca.DM(table.values))
        corners = product((0, 1), repeat=self._count)  # the last axis the fastest
        self._corners = [values.nz[place + sum(i * n for i, n in zip(c, strides, strict=True))] for c in corners]

    def value(self) -> ca.MX:
        """The interpolated values."""
        return self._reduced(None)

    def slopes(self) -> list[ca.MX]:
        """The derivatives by all arguments."""
        return [self._reduced(k) for k in range(self._count)]

    def _reduced(self, by: int | None) -> ca.MX:
        """The corners brought together axis by axis; ``by`` this one as a slope."""
        values = self._corners
        for k in reversed(range(self._count)):
            ends = zip(values[::2], values[1::2], strict=True)
            if k == by:
                values = [(high - low) / self._lengths[k] for low, high in ends]
            else:
                values = [low + self._shares[k] * (high - low) for low, high in ends]
        return values[0]
