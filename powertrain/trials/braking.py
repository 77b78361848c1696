"""A braking test: from a speed to rest with the brake pedal pressed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq

import powertrain as pt
from powertrain.components.control import OpenPedals
from powertrain.trials.anatomy import anatomy

SPEED = pt.parameter("m/s", "Speed at which the test begins", above=0)
PEDAL = pt.parameter("1", "Position of the brake pedal", above=0, max=1)
STEP, LONGEST = 0.05, 300.0
"""Time [s] between decisions of the driver, and the longest time [s] to reach the speed, or to come to rest."""
REST = 0.01
"""Speed [m/s] that counts as rest: the last 0.01 m/s take less than a millimetre."""
FULLY_DEVELOPED = 0.8, 0.1
"""Shares of the initial speed between which the deceleration is averaged over the distance (UN Regulation No. 13)."""


@dataclass(frozen=True)
class BrakingTest:
    """The run, and what it shows from passing the initial speed to rest."""

    result: pt.Result[Any]
    distance: float
    """Braking distance [m]."""
    time: float
    """Braking time [s]."""
    mfdd: float
    """Mean fully developed deceleration [m/s2]."""


def braking(vehicle: pt.Component, speed: float | str, brake: float = 1.0) -> BrakingTest:
    """Accelerate from rest to a speed, then release the accelerator and press the brake pedal until the vehicle stands.

      distance: from passing ``speed`` to rest
      mfdd = (v_b^2 - v_e^2)/(2 (s_e - s_b)),  v_b = 0.8 speed,  v_e = 0.1 speed

    The pedal is pressed at once, slightly above ``speed``; reaction and swell time are not included. The driveline stays engaged as the
    schedule has it. Nothing keeps slipping wheels from locking. Source of mfdd: UN Regulation No. 13.

    Parameters
    ----------
    vehicle : Component
        A vehicle with a body and pedals. On a road with a slope it brakes where it has reached the speed.
    speed : float or str
        Speed at which the braking begins [m/s], or with a unit, "80 km/h".
    brake : float
        Position of the brake pedal, above 0 to 1.

    Raises
    ------
    ParameterError
        For a speed that is not above 0, and a position outside its range.
    SimulationError
        If the vehicle does not reach the speed, or does not come to rest, within five minutes.
    """
    v_0, pressed = SPEED.check(speed, "braking: speed"), PEDAL.check(brake, "braking: brake")
    parts = anatomy(vehicle)
    pedals, v, s = parts.the("pedals"), f"{parts.the('body')}.v", f"{parts.the('body')}.s"
    run = pt.compile(pt.replace(vehicle, {pedals: OpenPedals()})).start()
    foot, other = f"{pedals}.accelerator_pedal", f"{pedals}.brake_pedal"
    run.step(STEP, **{foot: 1.0})
    while run[v] <= v_0:
        if run.time > LONGEST:
            raise pt.SimulationError(
                f"{parts.vehicle} does not reach {v_0:g} m/s within {LONGEST:g} s: its speed is {run[v]:.4g} m/s",
                run.result(),
            )
        run.step(STEP)
    begin = run.time
    run.step(STEP, **{foot: 0.0, other: pressed})
    while run[v] > REST:
        if run.time > begin + LONGEST:
            raise pt.SimulationError(
                f"{parts.vehicle} does not come to rest within {LONGEST:g} s: its speed is {run[v]:.4g} m/s",
                run.result(),
            )
        run.step(STEP)
    result = run.result()

    def passed(level: float) -> float:
        """When the speed falls through a level after ``begin``."""
        after = result.time >= begin
        times, above = result.time[after], result[v][after] > level
        k = int(np.flatnonzero(~above)[0])
        return float(brentq(lambda t: float(result.at(t, v)) - level, times[k - 1], times[k]))

    high, low = (share * v_0 for share in FULLY_DEVELOPED)
    times = [passed(level) for level in (v_0, high, low, REST)]
    first, s_b, s_e, last = (float(result.at(t, s)) for t in times)
    return BrakingTest(result, last - first, times[-1] - times[0], (high**2 - low**2) / (2 * (s_e - s_b)))
