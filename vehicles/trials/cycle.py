"""A vehicle on a drive cycle: how well it follows, what it burns, where the energy goes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d

import powertrain as pt
from powertrain.components.cycles import DriveCycle

SPEED_BAND = 2 / 3.6
"""How far a vehicle may leave the cycle [m/s]: 2 km/h, UN GTR No. 15, Annex 6, 2.6.8.3.1.2."""
TIME_BAND = 1.0
"""Within this time before and after [s], same place."""
RATE = 10
"""Samples per second."""
STANDS = 1.0
"""Distance [m] up to which a vehicle stands."""
Array = NDArray[np.float64]


@dataclass(frozen=True)
class CycleRun:
    """A vehicle that drove a cycle; ``message`` says why it ended early, if it did.

    The vehicle has the parts ``cycle``, ``engine`` and ``body``. ``table`` is what is usually asked.
    """

    cycle: DriveCycle
    plant: pt.Plant[Any]
    result: pt.Result[Any]
    parameters: dict[str, float]
    message: str = ""

    @property
    def distance(self) -> float:
        """Distance driven [m]."""
        return float(self.result["body.s"][-1] - self.result["body.s"][0])

    @property
    def fuel(self) -> float:
        """Fuel burnt [kg]."""
        return float(self.result["engine.fuel"][-1])

    @property
    def litres_per_100km(self) -> float:
        """Consumption [l/100 km]; nan where the vehicle stood."""
        return self._per_metre(self.fuel / self._of("engine.fuel_density") * 1e3) * 1e5

    @property
    def co2_per_km(self) -> float:
        """Carbon dioxide [g/km]; nan where the vehicle stood."""
        return self._per_metre(self.fuel * self._of("engine.co2_per_fuel") * 1e3) * 1e3

    @property
    def efficiency(self) -> float:
        """Mean efficiency of the engine: what it gave at its crank over the heat of its fuel [1]; nan where none was burnt."""
        return self._work() / (self.fuel * self._of("engine.heating_value")) if self.fuel > 0 else math.nan

    @cached_property
    def band(self) -> tuple[Array, Array, Array]:
        """Times [s] of the whole cycle, and the lowest and the highest speed [m/s] that the regulation allows then."""
        t = self.cycle.times[0] + np.arange(round(self.cycle.duration * RATE) + 1) / RATE
        wanted, size = np.interp(t, self.cycle.times, self.cycle.speeds), 2 * round(TIME_BAND * RATE) + 1
        low = minimum_filter1d(wanted, size, mode="nearest") - SPEED_BAND
        return t, low, maximum_filter1d(wanted, size, mode="nearest") + SPEED_BAND

    @cached_property
    def excess(self) -> Array:
        """How far the speed lies outside of the regulation's band at ``result.time`` [m/s]: positive above, negative below, else 0."""
        t, low, high = self.band
        time, v = self.result.time, self.result["body.v"]
        return np.asarray(np.maximum(v - np.interp(time, t, high), 0) + np.minimum(v - np.interp(time, t, low), 0))

    @property
    def time_outside(self) -> float:
        """Time outside of the band, with the time that was not driven [s]."""
        t = self.result.time
        outside = float(np.trapezoid((self.excess != 0).astype(float), t))
        return outside + float(self.cycle.times[-1] - t[-1])

    @cached_property
    def audit(self) -> pt.EnergyAudit:
        """Where the energy went."""
        return pt.energy_audit(self.result)

    @cached_property
    def table(self) -> pd.DataFrame:
        """The numbers by which vehicles are compared: value and unit."""
        deviation = self.excess[np.argmax(np.abs(self.excess))]
        rows = {
            "distance": (self.distance / 1e3, "km"),
            "fuel": (self.fuel, "kg"),
            "consumption": (self.litres_per_100km, "l/100 km"),
            "carbon dioxide": (self.co2_per_km, "g/km"),
            "work at the crank": (self._work() / 1e6, "MJ"),
            "mean efficiency of the engine": (self.efficiency, "1"),
            "time outside of the band": (self.time_outside, "s"),
            "largest excess over the band": (float(deviation) * 3.6, "km/h"),
        }
        return pd.DataFrame.from_dict(rows, orient="index", columns=["value", "unit"])

    def _work(self) -> float:
        power = np.maximum(self.result["engine.power"], 0)
        return float(np.trapezoid(power, self.result.time))

    def _per_metre(self, amount: float) -> float:
        return amount / self.distance if abs(self.distance) > STANDS else math.nan

    def _of(self, name: str) -> float:
        return float(self.parameters.get(name, self.plant.parameters[name]))


def drive_cycle(
    vehicle: pt.Component | pt.Plant[Any],
    cycle: DriveCycle | str | None = None,
    *,
    parameters: dict[str, float] | None = None,
    progress: bool | Callable[[float], None] = False,
    **options: Any,
) -> CycleRun:
    """Let a vehicle drive a cycle (``None``: the one it has; a name: one of the legislated).

    ``options`` go to ``pt.simulate``. A cycle that the vehicle cannot follow is driven as well as it goes; where the simulation ends
    early, what was driven is kept and ``message`` says why. Errors: those of building the model, and ParameterError for wrong names.
    """
    if isinstance(cycle, str):
        cycle = DriveCycle.named(cycle)
    if isinstance(vehicle, pt.Plant):
        if cycle is not None:
            raise pt.ParameterError("a compiled vehicle keeps its cycle: give the vehicle itself to drive another one")
        plant = vehicle
    else:
        if cycle is not None:
            vehicle = pt.replace(vehicle, cycle=pt.replace(vehicle.cycle, cycle=cycle))  # type: ignore[attr-defined]
        plant = pt.compile(vehicle)
    model: Any = plant.model
    driven: DriveCycle = model.cycle.cycle
    start, stop = float(driven.times[0]), float(driven.times[-1])
    times = np.linspace(start, stop, round((stop - start) * RATE) + 1)
    given, message = dict(parameters or {}), ""
    try:
        result = plant.simulate(stop, start=start, parameters=given, times=times, progress=progress, **options)
    except pt.SimulationError as error:
        if not isinstance(error.result, pt.Result) or error.result.time.size < 2:
            raise
        result, message = error.result, str(error)
    return CycleRun(driven, plant, result, given, message)
