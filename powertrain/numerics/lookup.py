"""Linear tables looked up at columns of points. CasADi's interpolants take one point at a time, and their derivatives search again.

In every direction s is the position within the interval, x = x_i + s (x_i+1 - x_i). The value is linear in each s, and the slope in one
direction is the difference between the ends of the interval divided by its length.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from itertools import product
from operator import add
from typing import Any, Protocol

import casadi as ca

from powertrain.language.tables import LinearTable, known

REVERSE, FORWARD = "adj1_wrap_", "fwd1_wrap_"
"""CasADi's names for derivatives of an interpolant: (x, nothing, seed) -> seed times slopes, and (x, nothing, seeds) -> their sum."""


class Searches(Protocol):
    """Columns of points in place of numbers, with arithmetic operations."""

    def interval(self, points: Sequence[float], mode: str, x: Any) -> Any:
        """The number of the interval between ``points`` that contains x, found by the method ``mode``."""
        ...

    def entries(self, numbers: Sequence[float], places: Sequence[Any]) -> list[Any]:
        """The numbers at these places."""
        ...


def looked_up(
    function: ca.Function, operands: Sequence[Any], searches: Searches, lookups: dict[tuple[int, ...], Lookup]
) -> list[Any] | None:
    """The value or derivative of a table's function; None for other functions. ``lookups`` are those made already."""
    name = function.name()
    table = known.get(name.removeprefix(REVERSE).removeprefix(FORWARD))
    if table is None:
        return None
    count = len(table.points)
    place = tuple(id(each) for each in (table, *operands[:count]))  # the lookup keeps these alive
    if place not in lookups:
        lookups[place] = Lookup(table, operands[:count], searches)
    found = lookups[place]
    if name.startswith(REVERSE):
        return [operands[-1] * slope for slope in found.slopes()]
    if name.startswith(FORWARD):
        return [reduce(add, (slope * seed for slope, seed in zip(found.slopes(), operands[-count:], strict=True)))]
    return [found.value()]


class Lookup:
    """One table at the columns ``arguments``, one per axis."""

    def __init__(self, table: LinearTable, arguments: Sequence[Any], searches: Searches) -> None:
        self.of = table, arguments
        self._count = len(table.points)
        self._shares: list[Any] = []
        self._lengths: list[Any] = []
        intervals, stride, strides = list[Any](), 1, list[int]()
        for points, mode, x in zip(table.points, table.modes, arguments, strict=True):
            intervals.append(searches.interval(points, mode, x))
            first, last = searches.entries(points, [intervals[-1], intervals[-1] + 1.0])
            self._lengths.append(last - first)
            self._shares.append((x - first) / self._lengths[-1])
            strides.append(stride)
            stride *= len(points)
        place = reduce(add, (float(n) * each for n, each in zip(strides, intervals, strict=True)))
        corners = product((0, 1), repeat=self._count)  # the last axis the fastest
        offsets = [float(sum(i * n for i, n in zip(c, strides, strict=True))) for c in corners]
        self._corners = searches.entries(table.values.tolist(), [place + offset for offset in offsets])

    def value(self) -> Any:
        """The interpolated values."""
        return self._reduced(None)

    def slopes(self) -> list[Any]:
        """The derivatives with respect to all arguments."""
        return [self._reduced(k) for k in range(self._count)]

    def _reduced(self, by: int | None) -> Any:
        """The corners combined axis by axis; along ``by`` as a slope."""
        values = self._corners
        for k in reversed(range(self._count)):
            ends = zip(values[::2], values[1::2], strict=True)
            if k == by:
                values = [(high - low) / self._lengths[k] for low, high in ends]
            else:
                values = [low + self._shares[k] * (high - low) for low, high in ends]
        return values[0]
