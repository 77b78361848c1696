"""The duty of a split-path transmission, and the limits of its variable unit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

import powertrain as pt
from powertrain.language.arguments import limits, row
from powertrain.language.makers import arguments_checked

if TYPE_CHECKING:
    import pandas as pd

Vector = NDArray[np.float64]
Unit = tuple[float, float] | float | None
"""The range (low, high) of V of a variable unit; or its span V_max/V_min; or None for unlimited."""
R_O = "transmission.differential.ratio"
SIGNALS = ("V", "efficiency", "K", "P_1", "P_2", "P_3")
_POINTS = 31


@dataclass(frozen=True)
class Duty:
    """The operating points of a transmission: ratio r, share of the delivered energy, magnitude of the output torque, input speed.

    ``low`` and ``high`` are the required range of r; its ends, and r = 1 within it, are also checked, with zero share. Between the
    points torque and speed are interpolated over r, and constant before the first and after the last; a ``sampled`` duty consists only of
    its points. Points at r = 0 deliver no energy; they only require a ratio of the unit. Errors: ParameterError for shares that are
    negative or all zero.
    """

    r: Vector
    weight: Vector
    torque: Vector
    speed: Vector
    low: float
    high: float
    sampled: bool = False

    @classmethod
    def over(cls, r: tuple[float, float], table: pd.DataFrame | Mapping[str, ArrayLike] | None = None) -> Duty:
        """A duty from a table with columns r, weight and optionally torque (N.m) and speed (rad/s); uniform without a table."""
        low, high = limits("the required range of r", row("the required range of r", r))
        given = {} if table is None else {str(n): row(f"duty: {n}", v) for n, v in table.items()}
        unknown = [n for n in given if n not in ("r", "weight", "torque", "speed")]
        if unknown or (table is not None and "r" not in given):
            raise pt.ParameterError(
                f"a duty has the columns r (required), weight, torque and speed, not {', '.join(given)}"
            )
        at = given.get("r", np.linspace(low, high, _POINTS))
        ends = np.array([low, high] + [x for x in (0.0, 1.0) if low < x < high])
        columns = {"weight": 1.0, "torque": 10.0, "speed": 100.0}
        full = {n: np.broadcast_to(given.get(n, np.array([d])), at.shape).copy() for n, d in columns.items()}
        full["weight"][at == 0] = 0.0
        total = full["weight"].sum()
        if not total > 0 or (full["weight"] < 0).any():
            raise pt.ParameterError(
                f"the weights of a duty are shares of the delivered energy: none may be negative, and at least one must be positive; "
                f"the smallest is {full['weight'].min():g}, their sum {total:g}"
            )
        if (at < low).any() or (at > high).any():
            raise pt.ParameterError(f"the duty has points outside the required range of r from {low:g} to {high:g}")
        full["weight"] /= total
        sampled = np.unique(at).size < at.size
        ends = ends[~np.isin(ends, at)]
        known = np.argsort(at, kind="stable")
        between = {n: np.interp(ends, at[known], full[n][known]) for n in columns} | {"weight": np.zeros(ends.size)}
        order = np.argsort(np.append(at, ends), kind="stable")
        rest = {n: np.append(full[n], between[n])[order] for n in columns}
        return cls(np.append(at, ends)[order], **rest, low=low, high=high, sampled=sampled)

    @classmethod
    def driven(cls, w_in: ArrayLike, w_out: ArrayLike, torque: ArrayLike) -> Duty:
        """A duty from a drive cycle sampled at equal intervals: speeds (rad/s) of input and output, torque (N.m) that the output delivers.

        Samples in which the output takes up no power (standstill, braking, coasting) do not count.
        """
        one, two, tau = row("w_in", w_in), row("w_out", w_out), row("torque", torque)
        drives = (two * tau > 0) & (one > 0)
        if not drives.any():
            raise pt.ParameterError("in this drive cycle the output never takes power at a positive input speed")
        one, two, tau = one[drives], two[drives], tau[drives]
        r = two / one
        columns = {"r": r, "weight": two * tau, "torque": np.abs(tau), "speed": one}
        return replace(cls.over((float(r.min()), float(r.max())), columns), sampled=True)

    @classmethod
    @arguments_checked
    def together(cls, duties: Sequence[tuple[Duty, float]]) -> Duty:
        """Several duties combined, each with its share of the delivered energy. Errors: ParameterError for negative or all-zero shares."""
        shares = row("shares", [share for _, share in duties])
        if not (shares >= 0).all() or not shares.sum() > 0:
            raise pt.ParameterError(
                f"duties have the shares {shares.tolist()}: none may be negative, and at least one must be positive"
            )
        columns = {n: np.concatenate([getattr(d, n) for d, _ in duties]) for n in ("r", "torque", "speed")}
        weight = np.concatenate([d.weight * share for (d, _), share in zip(duties, shares / shares.sum(), strict=True)])
        order = np.argsort(columns["r"], kind="stable")
        low, high = min(d.low for d, _ in duties), max(d.high for d, _ in duties)
        return cls(weight=weight[order], **{n: v[order] for n, v in columns.items()}, low=low, high=high, sampled=True)

    def grid(self, ratios: Sequence[float] | Vector) -> dict[str, Any]:
        """The grid for ``pt.steady``; the load opposes the motion."""
        import xarray as xr

        return {R_O: xr.DataArray(np.asarray(ratios, float), dims="R_o"), **_points(self.r, self.torque, self.speed)}

    def points(self) -> dict[str, Any]:
        """The grid of the points at which energy is delivered."""
        some = self.weight > 0
        return _points(self.r[some], self.torque[some], self.speed[some])

    def at(self, r: Vector) -> dict[str, Any]:
        """The grid of other points of the range."""
        return _points(r, np.interp(r, self.r, self.torque), np.interp(r, self.r, self.speed))

    def halves(self) -> tuple[Duty, Duty]:
        """The parts below and above r = 1. Half of the energy delivered at r = 1 counts before the shift, half after."""
        at_one = np.where(self.r == 1, 0.5, 1.0)
        below, above = (
            replace(self, r=self.r[m], weight=(self.weight * at_one)[m], torque=self.torque[m], speed=self.speed[m])
            for m in (self.r <= 1, self.r >= 1)
        )
        return replace(below, high=1.0), replace(above, low=1.0)


def _points(r: Vector, torque: Vector, speed: Vector) -> dict[str, Any]:
    import xarray as xr

    points = {"r": r, "load": np.where(r < 0, torque, -torque), "drive.w_fixed": speed}
    return {n: xr.DataArray(v, dims="point") for n, v in points.items()}


def check_unit(unit: Unit) -> None:
    """Errors: ParameterError for a range that is not low < high, and for a span that must be greater than 1."""
    if isinstance(unit, tuple):
        if not unit[0] < unit[1]:
            raise pt.ParameterError(f"the range of the variable unit from V = {unit[0]:g} to {unit[1]:g} is empty")
    elif unit is not None and not unit > 1:
        raise pt.ParameterError(f"the span V_max/V_min = {unit:g} of the variable unit must be greater than 1")


def unit_margins(V: Vector, unit: Unit) -> Vector:
    """Not negative if the unit meets the demand."""
    if unit is None:
        return np.zeros(1)
    low, high = float(V.min()), float(V.max())
    if isinstance(unit, tuple):
        return np.array([low - unit[0], unit[1] - high])
    return np.array([unit * low - high, low] if high > 0 else [low - unit * high, -high])
