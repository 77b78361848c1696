"""CoupledClutches written by hand for ``scipy.integrate.solve_ivp``: one call per mode, stopped by its events."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Modes = list[int]
Event = Callable[[float, Array], float]
J = np.ones(4)
PEAK, MUE, FN_MAX, STOP = 1.1, 0.5, 20.0, 1.5
STEPS = (0.4, 0.9)
GRID = np.linspace(0.0, STOP, 1501)
_EPS = 1e-10


def limits(t: float, pressed: tuple[bool, bool]) -> Array:
    """Friction torque of each clutch."""
    return MUE * FN_MAX * np.array([math.sin(2 * math.pi * 0.2 * t + math.pi / 2), pressed[0], pressed[1]])


def motion(t: float, modes: Modes, pressed: tuple[bool, bool]) -> tuple[Array, Array, Array]:
    """Torques of the clutches, accelerations, and the limits; torques of stuck clutches solve a_rel = 0."""
    limit = limits(t, pressed)
    drive = 10.0 * math.sin(2 * math.pi * 5.0 * t)
    matrix, right = np.eye(3), np.zeros(3)
    for k, mode in enumerate(modes):
        if mode == 0:
            matrix[k, k] = 1 / J[k] + 1 / J[k + 1]
            if k > 0:
                matrix[k, k - 1] = -1 / J[k]
            if k < 2:
                matrix[k, k + 1] = -1 / J[k + 1]
            right[k] = -drive / J[0] if k == 0 else 0.0
        elif mode != 2:
            right[k] = mode * limit[k]
    tau: Array = np.asarray(np.linalg.solve(matrix, right), np.float64)
    a = np.array([drive + tau[0], tau[1] - tau[0], tau[2] - tau[1], -tau[2]]) / J
    return tau, a, limit


def events_of(modes: Modes, pressed: tuple[bool, bool]) -> list[Event]:
    """Terminal events that end the validity of the modes."""
    found: list[Event] = []
    for k, mode in enumerate(modes):
        if mode == 0:
            found += [partial(_margin, modes, pressed, k, sign) for sign in (1.0, -1.0)]
        elif mode != 2:
            found.append(partial(_speed, k, mode))
        found.append(partial(_limit, pressed, k, -1.0 if mode == 2 else 1.0))
    for event in found:
        event.terminal, event.direction = True, -1.0  # type: ignore[attr-defined]
    return found


def _margin(modes: Modes, pressed: tuple[bool, bool], k: int, sign: float, t: float, x: Array) -> float:
    tau, _, limit = motion(t, modes, pressed)
    return float(PEAK * limit[k] - sign * tau[k]) + _EPS


def _speed(k: int, mode: int, t: float, x: Array) -> float:
    return float(mode * (x[5 + k] - x[4 + k])) + _EPS


def _limit(pressed: tuple[bool, bool], k: int, sign: float, t: float, x: Array) -> float:
    return float(sign * limits(t, pressed)[k]) + _EPS


def resolve(t: float, x: Array, modes: Modes, pressed: tuple[bool, bool]) -> Modes:
    """The modes at an instant, updated together until none changes; speeds of stuck clutches become equal."""
    for _ in range(20):
        tau, a, limit = motion(t, modes, pressed)
        new = [_mode(k, modes[k], x[5 + k] - x[4 + k], a[k + 1] - a[k], tau[k], limit[k]) for k in range(3)]
        if new == modes:
            for k in range(3):
                if modes[k] == 0:
                    x[5 + k] = x[4 + k]
            return modes
        modes = new
    raise RuntimeError(f"the modes do not settle at t = {t}")


def _mode(k: int, old: int, w: float, rate: float, tau: float, limit: float) -> int:
    if limit <= (0.5 * _EPS if old == 2 else -0.5 * _EPS):
        return 2
    if old != 0 and abs(w) > 2 * _EPS:
        return 1 if w > 0 else -1
    if old == 0:
        slack = 0.5 * _EPS
        return 1 if tau > PEAK * limit + slack else -1 if tau < -PEAK * limit - slack else 0
    return old if old in (1, -1) and old * rate > 0 else 0


def _rates(modes: Modes, pressed: tuple[bool, bool], t: float, x: Array) -> Array:
    return np.concatenate([x[4:], motion(t, modes, pressed)[1]])


def simulate_by_hand(
    method: Literal["BDF", "Radau"] = "BDF", rtol: float = 1e-6, atol: float = 1e-8
) -> tuple[Array, list[float]]:
    """Angles and speeds (phi1..phi4, w1..w4) at the grid, and the instants of events."""
    from scipy.integrate import solve_ivp

    t, x = 0.0, np.array([0, 0, 0, 0, 10, 0, 0, 0], float)
    pressed = (False, False)
    modes = resolve(t, x, [-1, 2, 2], pressed)
    out, instants = np.empty((len(GRID), 8)), []
    while t < STOP:
        stop = next((s for s in STEPS if s > t), STOP)

        rates: Any = partial(_rates, modes, pressed)
        inside = GRID[np.logical_and(t <= GRID, stop > GRID)]
        asked = np.append(inside, stop)
        done: Any = solve_ivp(
            rates, (t, stop), x, method, asked, events=events_of(modes, pressed), rtol=rtol, atol=atol
        )
        if not done.success:
            raise RuntimeError(done.message)
        reached = np.reshape(done.y, (8, -1)).T
        first = len(GRID) - int(np.count_nonzero(t <= GRID))
        rows = reached[: len(inside)]
        out[first : first + len(rows)] = rows
        hits = [float(times[0]) for times in done.t_events if len(times)]
        if hits:
            t = min(hits)
            x = next(
                y[0].copy()
                for times, y in zip(done.t_events, done.y_events, strict=True)
                if len(times) and times[0] == t
            )
        else:
            t, x = stop, reached[-1].copy()
        pressed = (t >= STEPS[0], t >= STEPS[1])
        instants.append(t)
        modes = resolve(t, x, modes, pressed)
    out[-1] = x
    return out, instants
