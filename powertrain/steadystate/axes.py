"""The grid of a map: its axes, its dimensions, and its points in an order that suits the computer."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from math import prod
from reprlib import repr as short
from typing import Any

import numpy as np
from numpy.typing import NDArray

from powertrain.errors import ParameterError
from powertrain.language.arguments import array
from powertrain.language.labelled import stated_unit
from powertrain.language.reals import Array
from powertrain.numerics.batch import Rows

_COMPARED = 4096
"""Up to this number, the values of axes are compared to find out whether grids are the same."""


@dataclass(frozen=True)
class GridAxis:
    """The values of one name, over its own dimensions; ``coords`` are the coordinates of a DataArray, ``unit`` is what it says."""

    name: str
    dims: tuple[str, ...]
    values: NDArray[np.float64]
    coords: Mapping[str, Any] = field(default_factory=dict)
    unit: str = ""

    @property
    def coordinate(self) -> str:
        """The name of the axis in the result: that of its dimension if the dimension is its own."""
        own = self.dims == (self.name.rpartition(".")[2],)
        return self.dims[0] if own else self.name


@dataclass(frozen=True)
class Grid:
    """Axes that span the dimensions ``dims``, whose sizes are ``shape``."""

    axes: tuple[GridAxis, ...]
    dims: tuple[str, ...]
    shape: tuple[int, ...]

    @property
    def size(self) -> int:
        """Number of points."""
        return prod(self.shape)

    def ordered(self, dims: Sequence[str]) -> Grid:
        """The same grid with its dimensions in another order, the first one slowest."""
        sizes = dict(zip(self.dims, self.shape, strict=True))
        return Grid(self.axes, tuple(dims), tuple(sizes[d] for d in dims))

    def sample(self, most: int) -> tuple[tuple[int, ...], Rows]:
        """A coarse grid of about ``most`` points: its shape, and its points."""
        each = max(2, int(most ** (1.0 / max(len(self.shape), 1))))
        picks = [np.unique(np.linspace(0, n - 1, min(n, each)).round().astype(int)) for n in self.shape]
        shape = tuple(p.size for p in picks)
        rows = [
            self._spread(a)[np.ix_(*[p if n > 1 else [0] for p, n in zip(picks, self._spread(a).shape, strict=True)])]
            for a in self.axes
        ]
        return shape, np.array([np.broadcast_to(r, shape).ravel() for r in rows]).reshape(len(rows), prod(shape))

    def of(self, axes: Sequence[GridAxis]) -> tuple[list[str], Rows]:
        """The names of some of the axes, and all sets of values that they have together."""
        sizes = {d: n for d, n in zip(self.dims, self.shape, strict=True) if any(d in a.dims for a in axes)}
        part = Grid(tuple(axes), tuple(sizes), tuple(sizes.values()))
        return [a.name for a in axes], part.at(np.arange(part.size))

    def identity(self) -> tuple[object, ...]:
        """What distinguishes grids with regard to the order of their points."""
        return (
            self.dims,
            self.shape,
            *((a.name, a.dims, a.values.tobytes() if a.values.size <= _COMPARED else a.values.size) for a in self.axes),
        )

    def rows(self, fast: int) -> NDArray[np.float64]:
        """The values of all axes but one along all dimensions but the last, one column per point."""
        outer = self.shape[:-1]
        others = [np.broadcast_to(self._spread(a)[..., 0], outer).ravel() for i, a in enumerate(self.axes) if i != fast]
        return np.array(others).reshape(len(others), prod(outer))

    def at(self, places: NDArray[np.intp]) -> Rows:
        """The points with these numbers."""
        index = np.unravel_index(places, self.shape) if self.shape else ()
        rows = []
        for axis in self.axes:
            spread = self._spread(axis)
            rows.append(
                spread[tuple(i if n > 1 else np.zeros_like(i) for i, n in zip(index, spread.shape, strict=True))]
            )
        return np.array([np.broadcast_to(r, places.shape) for r in rows]).reshape(len(rows), places.size)

    def points(self) -> list[Array]:
        """The values of every axis at all points."""
        return [np.broadcast_to(self._spread(axis), self.shape).ravel() for axis in self.axes]

    def _spread(self, axis: GridAxis) -> NDArray[np.float64]:
        """The values with a dimension of length one for each dimension that the axis lacks."""
        order = sorted(axis.dims, key=self.dims.index)
        values = axis.values.transpose([axis.dims.index(d) for d in order])
        return values.reshape([n if d in axis.dims else 1 for d, n in zip(self.dims, self.shape, strict=True)])


def make_grid(given: Mapping[str, Any], results: Collection[str] = ()) -> Grid:
    """A grid of numbers (constant), sequences and DataArrays.

    A sequence has a dimension of its own, named by the last part of its name; by the whole name where the last part is that of another
    axis or of one of the ``results``.
    """
    if not isinstance(given, Mapping) or not all(isinstance(name, str) for name in given):
        raise ParameterError(f'grid = {short(given)}: pass values by name, such as {{"engine.w": [100.0, 200.0]}}')
    last = [n.rpartition(".")[2] for n in given]
    axes: list[GridAxis] = []
    sizes: dict[str, int] = {}
    for name, end in zip(given, last, strict=True):
        value = given[name]
        values = array(f"grid: {name}", value)
        if not values.size:
            raise ParameterError(f"grid: {name} has no values")
        if hasattr(value, "dims"):
            dims = tuple(str(d) for d in value.dims)
        elif values.ndim > 1:
            raise ParameterError(
                f"grid: {name} has {values.ndim} dimensions; pass a number, a sequence, or a DataArray that names them"
            )
        else:
            dims = ((end if last.count(end) == 1 and end not in results else name),) * values.ndim
        for d, n in zip(dims, values.shape, strict=True):
            if sizes.setdefault(d, n) != n:
                raise ParameterError(f"grid: {name} has {n} values along {d}, but others have {sizes[d]}")
        coords = {str(n): c.variable for n, c in getattr(value, "coords", {}).items()}
        axes.append(GridAxis(name, dims, values, coords, stated_unit(value)))
    _check_coordinates(axes)
    return Grid(tuple(axes), tuple(sizes), tuple(sizes.values()))


def _check_coordinates(axes: Sequence[GridAxis]) -> None:
    """Values at the same place of a dimension must belong together."""
    seen = {a.coordinate: (a.name, a.dims, a.values) for a in axes}
    for axis in axes:
        for n, c in axis.coords.items():
            other, dims, values = seen.setdefault(n, (axis.name, c.dims, c.values))
            if other != axis.name and (dims != c.dims or not np.array_equal(values, c.values)):
                raise ParameterError(
                    f"grid: {axis.name} and {other} have different values of {n}; align them, or drop the coordinate"
                )
