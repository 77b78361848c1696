"""Tables: gridded data over named axes with units, interpolated, with a stated rule outside every axis' range."""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any, Literal, TypeAlias, get_args, overload

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain.errors import ModelError, ParameterError, suggestion
from powertrain.language import htmltext, tables
from powertrain.language.arguments import array, one_of, row, text
from powertrain.language.dimensions import measure, unit_of
from powertrain.language.gridtable import read_grid
from powertrain.language.labelled import check_unit, in_order
from powertrain.language.laws import within
from powertrain.language.reals import sealed
from powertrain.language.recorder import recorder, recording
from powertrain.language.symbols import Symbol
from powertrain.language.units import checked_unit, told_apart, with_unit

Outside: TypeAlias = Literal["error", "clip", "linear"]
Method: TypeAlias = Literal["linear", "smooth"]
FEW = 32
"""Up to this many points a piecewise linear curve is written out as an expression."""


@dataclass(frozen=True, init=False)
class Axis:
    """One argument of a map: name, unit, increasing grid points, and what holds outside the grid.

    ``outside`` is "error" (the value is rejected, and a simulation ends there), "clip" (held at the edge; a simulation
    counts the steps) or "linear" (continued with the slope at the edge).
    """

    name: str
    unit: str
    points: tuple[float, ...]
    outside: Outside = "error"

    def __init__(self, name: str, unit: str, points: ArrayLike, outside: Outside = "error") -> None:
        check_unit(f"axis {text('name', name)}", points, unit)
        grid = row(f"axis {name}", points)
        if grid.size == 0:
            raise ParameterError(f"axis {name} has no points")
        one_of(f"axis {name}: outside", outside, get_args(Outside))
        if np.any(steps := np.diff(grid) <= 0):
            i = int(np.argmax(steps))
            raise ParameterError(
                f"axis {name}: the points must increase, but {grid[i + 1]:g} follows {grid[i]:g} [{unit}]"
            )
        object.__setattr__(self, "name", name)
        object.__setattr__(self, "unit", checked_unit(unit))
        object.__setattr__(self, "points", tuple(grid.tolist()))
        object.__setattr__(self, "outside", outside)

    @property
    def low(self) -> float:
        """First grid point."""
        return self.points[0]

    @property
    def high(self) -> float:
        """Last grid point."""
        return self.points[-1]

    @property
    def slack(self) -> float:
        """How far a value may leave the range before it counts as outside (round-off)."""
        return 1e-9 * max(self.high - self.low, abs(self.low), abs(self.high))

    def clipped(self, value: Symbol) -> Symbol:
        """``value`` held at the edges."""
        return ca.fmin(ca.fmax(value, self.low), self.high)


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Map:
    """Data on an n-dimensional grid. A call interpolates them, for numbers, arrays or symbols in equations.

    ``method`` is "linear" (multilinear, continuous) or "smooth" (cubic B-spline, twice differentiable, at least 4
    points per axis). Every axis states what holds outside its grid, see ``Axis``. An axis with one point makes the map
    constant along it. Errors: ParameterError for unusable data, and for a number outside an axis with the rule "error".

    >>> friction = Map.curve([0, 10], [0.5, 0.3], x="w_rel", x_unit="rad/s", outside="clip")
    >>> friction(5.0), friction(20.0)
    (0.4, 0.3)
    """

    axes: tuple[Axis, ...]
    values: NDArray[np.float64]
    unit: str
    name: str
    method: Method

    def __init__(
        self, axes: Sequence[Axis], values: ArrayLike, unit: str, name: str = "map", method: Method = "linear"
    ) -> None:
        if not isinstance(axes, Sequence) or not all(isinstance(axis, Axis) for axis in axes):
            raise ParameterError(f"map {name}: axes = {axes!r}: give a list of Axis(name, unit, points)")
        check_unit(f"map {name}", values, unit)
        values = in_order(f"map {name}", values, {axis.name: axis.points for axis in axes})
        grid = sealed(array(f"map {name}", values).copy())
        object.__setattr__(self, "axes", tuple(axes))
        object.__setattr__(self, "values", grid)
        object.__setattr__(self, "unit", checked_unit(unit))
        object.__setattr__(self, "name", name)
        object.__setattr__(self, "method", method)
        self._check()

    def _check(self) -> None:
        shape = tuple(len(axis.points) for axis in self.axes)
        if not self.axes:
            raise ParameterError(f"map {self.name} needs at least one axis")
        if len({axis.name for axis in self.axes}) < len(self.axes):
            raise ParameterError(
                f"map {self.name}: two axes have the same name: {', '.join(a.name for a in self.axes)}"
            )
        if self.values.shape != shape:
            said = " x ".join(f"{axis.name}: {n}" for axis, n in zip(self.axes, shape, strict=True))
            raise ParameterError(
                f"map {self.name} has values of shape {self.values.shape}, but its axes require {shape} ({said})"
            )
        one_of(f"map {text('name', self.name)}: method", self.method, get_args(Method))
        if self.method == "smooth" and min(shape) < 4:
            short = self.axes[shape.index(min(shape))]
            raise ParameterError(
                f"map {self.name}: a smooth map needs at least 4 points on every axis, {short.name} has {min(shape)}; "
                'give more points, or use method="linear"'
            )

    @classmethod
    def curve(
        cls,
        points: ArrayLike,
        values: ArrayLike,
        *,
        x: str = "x",
        x_unit: str = "1",
        unit: str = "1",
        name: str = "map",
        outside: Outside = "error",
        method: Method = "linear",
    ) -> Map:
        """A map of one argument ``x``. One point makes it a constant.

        Parameters
        ----------
        points, values : array_like
            Places along ``x``, in increasing order, and the values there.
        x, x_unit : str
            Name and unit of the argument.
        unit, name : str
            Unit of the values, and the name of the map in errors.
        outside : {"error", "clip", "linear"}
            What holds beyond the first and the last point.
        method : {"linear", "smooth"}
            Interpolation between the points.

        Returns
        -------
        Map

        Raises
        ------
        ParameterError
            For points that do not increase and values that are not finite.

        Examples
        --------
        >>> import powertrain as pt
        >>> float(pt.Map.curve([0, 100], [0, 50], x="w", x_unit="rad/s", unit="N.m")(40.0))
        20.0
        """
        return cls((Axis(x, x_unit, points, outside),), row(f"map {name}", values), unit, name, method)

    @classmethod
    def constant(cls, value: float, *, x: str = "x", x_unit: str = "1", unit: str = "1", name: str = "map") -> Map:
        """The same value everywhere.

        Parameters
        ----------
        value : float
            The value.
        x, x_unit : str
            Name and unit of the argument that the map takes.
        unit, name : str
            Unit of the value, and the name of the map in errors.

        Returns
        -------
        Map
        """
        return cls.curve([0.0], [value], x=x, x_unit=x_unit, unit=unit, name=name, outside="linear")

    @classmethod
    def from_csv(
        cls, path: str | Path, *, outside: Outside | Mapping[str, Outside] = "error", method: Method = "linear"
    ) -> Map:
        """Read a table with one row per grid point.

        The header names a column for every axis and, last, the value, each with its unit:
        ``speed [rad/s], torque [N.m], loss [W]``. The rows may be in any order but must fill the grid. Columns are
        separated by commas, or by semicolons or tabs, then also with decimal commas; see ``TextTable``. Units of every
        day are converted: rpm to rad/s, km/h to m/s, kW to W, Nm to N.m, % to 1, kPa to Pa. ``outside`` is one rule for
        all axes or a rule for each name.
        Errors: ParameterError naming the file, and the line or the column.
        """
        found = read_grid(path)
        names = [head.name for head in found.axes]
        rules: Mapping[str, Outside] = outside if isinstance(outside, Mapping) else dict.fromkeys(names, outside)
        for name in rules:
            if name not in names:
                near = suggestion(str(name), names)
                raise ParameterError(f"{found.path}: outside: the table has no axis {name}{near}")
        axes = [Axis(*h, g, rules.get(h.name, "error")) for h, g in zip(found.axes, found.grids, strict=True)]
        return cls(axes, found.values, found.value.unit, found.value.name, method)

    @overload
    def __call__(self, *arguments: float) -> float: ...
    @overload
    def __call__(self, *arguments: Symbol) -> Symbol: ...
    @overload
    def __call__(self, *arguments: ArrayLike) -> Any: ...
    def __call__(self, *arguments: Any) -> Any:
        """The interpolated value; arguments in the order of the axes. Numbers give a number; arrays are broadcast."""
        if len(arguments) != len(self.axes):
            said = ", ".join(f"{a.name} [{a.unit}]" for a in self.axes)
            raise ParameterError(f"map {self.name} takes {len(self.axes)} arguments ({said}), got {len(arguments)}")
        if any(isinstance(a, ca.SX) for a in arguments):
            symbols = [Symbol(a) for a in arguments]
            if not all(s.is_constant() and s.is_scalar() for s in symbols):
                return self._symbolic(symbols)
            return Symbol(self._numeric([float(s) for s in symbols]).item())
        result = self._numeric(arguments)
        return result.item() if result.ndim == 0 else result

    def _symbolic(self, arguments: Sequence[Symbol]) -> Symbol:
        if recording():
            self._check_units(arguments)
            for axis, argument in zip(self.axes, arguments, strict=True):
                if axis.outside != "linear" and len(axis.points) > 1:
                    action = "error" if axis.outside == "error" else "count"
                    low, high = axis.low - axis.slack, axis.high + axis.slack
                    within(argument, low, high, name=f"{self.name}: {axis.name}", unit=axis.unit, action=action)
        result = self._expression(arguments)
        if recording() and self.unit != "1" and not (result.is_symbolic() or result.is_constant()):
            recorder().measured(result, self.unit)
        return result

    def _check_units(self, arguments: Sequence[Symbol]) -> None:
        """An axis over another unit than that of the variable it is asked for; "1" stands for anything."""
        for axis, argument in zip(self.axes, arguments, strict=True):
            unit = unit_of(argument, recorder().units)
            if unit is None or "1" in (unit, axis.unit) or measure(unit) == measure(axis.unit):
                continue
            raise ModelError(
                f"{recorder().place}: map {self.name}: the axis {axis.name} is in {axis.unit}, but it is called with a variable in {unit}; "
                f"give the axis in {unit}, or convert the variable where the map is called"
            )

    def _expression(self, arguments: Sequence[Symbol]) -> Symbol:
        varying = [(axis, a) for axis, a in zip(self.axes, arguments, strict=True) if len(axis.points) > 1]
        if not varying:
            return Symbol(float(self.values.ravel()[0]))
        if self.method == "linear":
            held = [a if axis.outside == "linear" else axis.clipped(a) for axis, a in varying]
            if len(held) == 1 and len(varying[0][0].points) <= FEW:
                return _ramps(varying[0][0].points, self.values.ravel(), held[0])
            return Symbol(self._interpolant(ca.vertcat(*held)))
        held = [axis.clipped(a) for axis, a in varying]
        inner = ca.SX.sym("inner", len(held))
        value = Symbol(self._interpolant(inner))
        for i, (axis, a) in enumerate(varying):
            if axis.outside == "linear":
                value += ca.jacobian(Symbol(self._interpolant(inner)), inner[i]) * (a - held[i])
        return ca.substitute(value, inner, ca.vertcat(*held))

    @cached_property
    def _interpolant(self) -> ca.Function:
        grid = tuple(axis.points for axis in self.axes if len(axis.points) > 1)
        values, options = self.values.ravel(order="F"), dict[str, Any](inline=False)
        name = f"powertrain_map_{sha256(repr((self.method, grid)).encode() + self.values.tobytes()).hexdigest()[:16]}"
        if self.method == "smooth":
            return ca.interpolant(name, "bspline", grid, values, options)
        modes = tuple("exact" if _uniform(points) else "binary" for points in grid)
        function = ca.interpolant(name, "linear", grid, values, options | {"lookup_mode": modes})
        self.__dict__["_table"] = tables.known.setdefault(name, tables.LinearTable(grid, modes, values))
        return function

    @cached_property
    def _function(self) -> ca.Function:
        arguments = [ca.SX.sym(axis.name) for axis in self.axes]
        return ca.Function("powertrain_map", [ca.vertcat(*arguments)], [self._expression(arguments)])

    def _numeric(self, arguments: Sequence[ArrayLike]) -> NDArray[np.float64]:
        given = [array(f"map {self.name}: {axis.name}", a) for axis, a in zip(self.axes, arguments, strict=True)]
        for axis, numbers in zip(self.axes, given, strict=True):
            bad = (numbers < axis.low - axis.slack) | (numbers > axis.high + axis.slack)
            if axis.outside == "error" and len(axis.points) > 1 and bad.any():
                said = with_unit(told_apart(numbers[bad].flat[0], (axis.low, axis.high)), axis.unit)
                allowed = with_unit(f"[{axis.low:g}, {axis.high:g}]", axis.unit)
                raise ParameterError(f"map {self.name}: {axis.name} = {said} is outside its range {allowed}")
        try:
            full = np.broadcast_arrays(*given)
        except ValueError:
            shapes = ", ".join(f"{a.name} {g.shape}" for a, g in zip(self.axes, given, strict=True))
            raise ParameterError(
                f"map {self.name}: the shapes of the arguments do not fit together: {shapes}"
            ) from None
        if full[0].size == 0:
            return np.zeros(full[0].shape)
        result = np.asarray(self._function(np.vstack([f.ravel() for f in full])), float)
        return result.reshape(full[0].shape)

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Map)
            and (self.axes, self.unit, self.name, self.method) == (other.axes, other.unit, other.name, other.method)
            and np.array_equal(self.values, other.values)
        )

    def __hash__(self) -> int:
        return hash((self.axes, self.values.tobytes(), self.unit, self.name, self.method))

    def __getstate__(self) -> dict[str, Any]:
        return {k: v for k, v in self.__dict__.items() if k not in ("_interpolant", "_table", "_function")}

    def __repr__(self) -> str:
        said = ", ".join(f"{a.name} [{a.unit}] {a.low:g}..{a.high:g} ({len(a.points)}, {a.outside})" for a in self.axes)
        data = zlib.crc32(repr(self.axes).encode() + self.values.tobytes())
        return f"Map({self.name} [{self.unit}] over {said}; {self.method}; {data:08x})"

    def _repr_html_(self) -> str:
        low, high = float(self.values.min()), float(self.values.max())
        rows: list[tuple[str, ...]] = [
            (a.name, a.unit, f"{a.low:g} to {a.high:g}", str(len(a.points)), a.outside) for a in self.axes
        ]
        rows.append((f"values of {self.name}", self.unit, f"{low:g} to {high:g}", str(self.values.size), self.method))
        head = ("axis", "unit", "range", "points", "outside, method")
        picture = self._curve() if len(self.axes) == 1 and self.values.size > 1 else ""
        return htmltext.heading("Map", self.name) + htmltext.table(head, rows) + picture

    def _curve(self) -> str:
        """The values along the only axis as a small picture."""
        return htmltext.curve(self.axes[0].points, self.values.ravel().tolist())


def _ramps(points: Sequence[float], values: NDArray[np.float64], argument: Symbol) -> Symbol:
    """A piecewise linear curve as a sum of one ramp per segment; the first and the last go on outside."""
    result = Symbol(float(values[0]))
    last = len(points) - 2
    for i in range(last + 1):
        length, rise = points[i + 1] - points[i], float(values[i + 1] - values[i])
        if rise == 0.0:
            continue
        part = (argument - points[i]) / length
        if i > 0:
            part = ca.fmax(part, 0.0)
        if i < last:
            part = ca.fmin(part, 1.0)
        result += rise * part
    return result


def _uniform(points: Sequence[float]) -> bool:
    steps = np.diff(points)
    return bool(np.allclose(steps, steps[0], rtol=1e-12, atol=0.0))
