"""Why a vehicle stood, rolled back or stalled on a cycle, for the error message."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import powertrain as pt
from powertrain.components.cycles import DriveCycle
from powertrain.language.reals import Array
from powertrain.trials.anatomy import Anatomy
from powertrain.trials.starting import empty

STANDS = 1.0
"""Distance [m] up to which a vehicle stands, in both directions."""
STALLED, LASTING = 1.0, 2.0
"""Speed [rad/s] below which an engine stands, and the time [s] after which it is not about to start."""
ON, ASKED = 0.5, 0.1
"""Value of ``on`` from which an engine should run; share of a cycle's distance that must exceed ``STANDS`` for it to ask for motion."""


def standing(cycle: DriveCycle, result: pt.Result[Any], parts: Anatomy) -> str:
    """The message for a vehicle whose engine turned backwards or stalled, or which did not follow the cycle; empty for others."""
    path = result[f"{parts.the('body')}.s"]
    distance = float(path[-1] - path[0])
    driven = f"the vehicle drove {max(distance, 0.0):.0f} m of the {cycle.distance:.0f} m of {cycle.name}"
    for engine in parts.engines:
        w = result[f"{engine}.w"]
        backwards = np.flatnonzero(w < -STALLED)
        if backwards.size:
            return (
                f"its engine is turned backwards from t = {result.time[backwards[0]]:.4g} s on, down to {w.min():.4g} rad/s. Check "
                "what loads the crank: an accessory takes its torque while it turns, as BearingFriction does, and does not turn it"
            )
        begin, end = _longest(result.time, (w <= STALLED) & (result[f"{engine}.on"] >= ON))
        if end - begin > LASTING:
            until = "on" if end == result.time[-1] else f"to {end:.4g} s"
            return (
                f"{driven}: its engine stands from t = {begin:.4g} s {until}, although it is switched on. Check what loads the crank "
                f"(clutch, accessories), {engine}.tau_starter, which has to overcome that load at rest, and the idle controller"
            )
    if distance < -STANDS or distance < STANDS < ASKED * cycle.distance:
        causes = [_most(result, path) for path in parts.prime_movers] + [
            empty(result, path) for path in parts.batteries
        ]
        return (
            f"{driven}: {_moved(distance)}. {'; '.join(filter(None, causes))}. Check the signs of the "
            "ratios, the torque at low speed, what closes the clutch and selects the gear, and what holds the brakes"
        )
    return ""


def _longest(time: Array, holds: NDArray[np.bool_]) -> tuple[float, float]:
    """The longest time [s] through which something holds, from the last sample before it to its end; of no length where it never does."""
    changes = np.flatnonzero(np.diff(np.concatenate([[False], holds, [False]])))
    spans = [(float(time[max(a - 1, 0)]), float(time[b - 1])) for a, b in zip(changes[::2], changes[1::2], strict=True)]
    return max(spans, key=lambda span: span[1] - span[0], default=(0.0, 0.0))


def _moved(distance: float) -> str:
    return f"it rolled back by {-distance:.3g} m" if distance < -STANDS else "it does not move"


def _most(result: pt.Result[Any], path: str) -> str:
    """The largest torque that an engine or a machine delivered."""
    tau, w = result[f"{path}.tau"], result[f"{path}.w"]
    most = int(np.argmax(tau))
    return f"{path} delivers at most {tau[most]:.4g} N.m, at {w[most]:.4g} rad/s"
