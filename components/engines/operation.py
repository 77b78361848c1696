"""Operating points of an engine: lowest fuel consumption over power, and the throttle for a torque."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain import Axis, Map, ParameterError, parameter, replace
from powertrain.components.electric import ElectricMachine
from powertrain.components.engines.interfaces import Engine

Array = NDArray[np.float64]
GRID = 201
"""Speeds at which each power is evaluated at first."""
FINER, ROUNDS = 21, 4
"""Speeds between the neighbours of the best, and how often they are refined."""
DENSE = 161
"""Powers from which the points of a line are chosen."""
HALVINGS = 32
"""Bisections of an interval of throttles."""
UNDER_LOAD, POINTS = 1.35, 20
"""The lowest speed of an operating line relative to idle speed, and the number of its points."""
BELOW_LIMIT = 0.98
"""Highest speed of a shift relative to the start of the rev limiter."""
ROUND = 1e-9
"""Round-off at the largest power."""
SHARE = parameter("1", "maximum torque relative to full load", above=0, max=1)
"""Torque that a line leaves for accelerating."""
SPEED, POWER = parameter("rad/s", "speed", above=0), parameter("W", "power", min=0)
"""Limits and powers of a line."""


@dataclass(frozen=True, eq=False)
class FuelLine:
    """Speed [rad/s], torque [N.m] and fuel flow [kg/s] over increasing power [W]."""

    power: Array
    speed: Array
    torque: Array
    fuel_rate: Array

    def speeds(self) -> Map:
        """From power to speed, constant beyond both ends: the set point of a ratio control."""
        return self._over_power(self.speed, "rad/s", "operating line")

    def torques(self) -> Map:
        """From power to torque, constant beyond both ends."""
        return self._over_power(self.torque, "N.m", "torque on the operating line")

    def _over_power(self, values: Array, unit: str, name: str) -> Map:
        return Map.curve(self.power, values, x="power", x_unit="W", unit=unit, name=name, outside="clip")


def best_fuel_line(
    engine: Engine,
    power: ArrayLike | None = None,
    *,
    w_min: float | str | None = None,
    w_max: float | str | None = None,
    share: float = 1.0,
    points: int = 30,
) -> FuelLine:
    """The speed and torque at which the engine delivers each power with the lowest fuel consumption.

    Parameters
    ----------
    engine : Engine
        The engine.
    power : array_like, optional
        Powers [W]; by default ``points`` values from zero to the largest power.
    w_min, w_max : float or str, optional
        Speed range [rad/s], also such as "1500 rpm"; by default from idle speed to the start of the rev limiter.
    share : float
        Largest torque relative to full load [1]: less than 1 leaves a torque reserve.
    points : int
        Number of powers if none are given.

    Returns
    -------
    FuelLine

    Raises
    ------
    ParameterError
        For a power that the engine cannot deliver within these limits, and for limits that contain no operating points.
    """
    engine = replace(engine)
    idle, limit = engine.speed_range
    low = idle if w_min is None else SPEED.check(w_min, "best_fuel_line: w_min")
    high = limit if w_max is None else SPEED.check(w_max, "best_fuel_line: w_max")
    share = SHARE.check(share, "best_fuel_line: share")
    if not low < high:
        raise ParameterError(f"best_fuel_line: speeds {low:g}..{high:g} rad/s contain no operating points")
    grid = np.linspace(low, high, GRID)
    top = float((grid * share * engine.full_load(grid)).max())
    if not top > 0:
        raise ParameterError(f"best_fuel_line: the engine gives no power between {low:g} and {high:g} rad/s")
    given = np.linspace(0, top, points) if power is None else np.ravel(power)
    P = np.array([POWER.check(one, "best_fuel_line: power") for one in given])
    outside = P[top * (1 + ROUND) < P]
    if outside.size:
        raise ParameterError(
            f"best_fuel_line: the engine gives 0 to {top:g} W between {low:g} and {high:g} rad/s, not {outside[0]:g} W"
        )
    w = _least_fuel(engine, P, low, high, share)
    return FuelLine(P, w, P / w, np.asarray(engine.fuel_flow(w, P / w)))


def sparse_fuel_line(
    engine: Engine, share: float = 1.0, *, w_min: float | str | None = None, points: int = 24
) -> FuelLine:
    """``best_fuel_line`` with its points placed where linear interpolation would cost most fuel; from zero to the largest power.

    Starting with both ends, the next point is added where interpolation exceeds the lowest fuel consumption most, or the torque
    ``share``. The points are therefore dense where the speed rises steeply, as towards the largest power.

    Parameters
    ----------
    engine : Engine
        The engine.
    share : float
        Largest torque relative to full load [1].
    w_min : float or str, optional
        Lowest speed [rad/s]; by default idle speed.
    points : int
        Number of points.

    Returns
    -------
    FuelLine
    """
    engine = replace(engine)
    ends = best_fuel_line(engine, w_min=w_min, share=share, points=2)
    dense = ends.power[-1] * np.sin(np.linspace(0, np.pi / 2, DENSE))
    line = best_fuel_line(engine, dense, w_min=w_min, share=share)
    chosen = [0, DENSE - 1]
    while len(chosen) < points:
        w = np.interp(line.power, line.power[chosen], line.speed[chosen])
        tau = line.power / w
        excess = engine.fuel_flow(w, tau) / line.fuel_rate
        excess = np.maximum(excess, tau / (share * engine.full_load(w)))
        excess[chosen] = 0
        chosen = sorted([*chosen, int(excess.argmax())])
    return FuelLine(*(values[chosen] for values in (line.power, line.speed, line.torque, line.fuel_rate)))


def operating_line(engine: Engine, share: float = 1.0) -> Map:
    """The speed [rad/s] of lowest fuel consumption over power [W], with torques up to ``share`` of full load, for a control.

    It is ``sparse_fuel_line`` from slightly above idle speed; between its points it takes at most 0.3 % more fuel. In a model
    it uses the parameters of the engine when the model is built: other values for a run do not move the line, just as a
    control unit keeps its tables.
    """
    engine = replace(engine)
    return sparse_fuel_line(engine, share, w_min=UNDER_LOAD * float(engine.w_idle), points=POINTS).speeds()


def _least_fuel(engine: Engine, power: Array, low: float, high: float, share: float) -> Array:
    """For each power the speed of lowest fuel consumption, on a grid that is refined between the neighbours of the best."""
    best = _best_of(engine, power, np.linspace(low, high, GRID)[None, :], share)
    step = np.full(power.size, (high - low) / (GRID - 1))
    for _ in range(ROUNDS):
        first, last = np.maximum(best - step, low), np.minimum(best + step, high)
        w = np.linspace(first, last, FINER, axis=1)
        best, step = _best_of(engine, power, w, share), (last - first) / (FINER - 1)
    return best


def _best_of(engine: Engine, power: Array, speeds: Array, share: float) -> Array:
    """For each power the best of these speeds: a row for each, or one for all."""
    tau = power[:, None] / speeds
    possible = tau <= share * engine.full_load(speeds) * (1 + 2 * ROUND)
    w = np.broadcast_to(speeds, tau.shape)
    flow = np.where(possible, engine.fuel_flow(w, tau), np.inf)
    return np.asarray(np.take_along_axis(w, flow.argmin(axis=1)[:, None], axis=1)[:, 0])


def pull_speeds(mover: Engine | ElectricMachine, ratios: Sequence[float]) -> tuple[float, ...]:
    """For each upshift, the speed [rad/s] from which the next gear pulls as hard or harder with the accelerator fully pressed.

    There the tractive forces of two neighbouring gears cross: full-load power at this speed equals that at the speed of the next gear, less
    by the step between the ``ratios``. Losses and inertias of the driveline are neglected. Where the forces do not cross below the rev
    limiter, or below the speed from which a machine's torque fades out, it is 98 % of this speed.
    """
    mover = replace(mover)
    low, limit = mover.speed_range
    w, found = np.linspace(low, BELOW_LIMIT * limit, GRID), []
    for one, other in pairwise(ratios):
        lower = w * other / one
        gain = w * mover.full_load(w) - lower * mover.full_load(lower)
        above = np.flatnonzero(gain > ROUND * np.max(w * mover.full_load(w)))
        last = int(above[-1]) if above.size else 0
        found.append(float(np.interp(0, -gain[last : last + 2], w[last : last + 2])))
    return tuple(found)


def throttle_table(engine: Engine, *, speeds: int = 41, torques: int = 61) -> Map:
    """The throttle [1] for a torque [N.m] at a speed [rad/s], as a map for a control; between motored and full load.

    Torques below motoring give 0, above full load 1. Speeds range from half of idle speed to the start of the rev limiter. The limiter and
    the idle controller, which adds throttle, are not included.
    """
    engine = replace(engine)
    idle, limit = engine.speed_range
    w = np.linspace(0.5 * idle, limit, speeds)
    tau = np.linspace(-np.max(engine.motoring(w)), np.max(engine.full_load(w)), torques)
    low, high = np.zeros((speeds, torques)), np.ones((speeds, torques))
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        enough = engine.torque(w[:, None], middle) >= tau
        low, high = np.where(enough, low, middle), np.where(enough, middle, high)
    axes = Axis("speed", "rad/s", w, "clip"), Axis("torque", "N.m", tau, "clip")
    return Map(axes, np.round((low + high) / 2, 9), "1", "throttle")
