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
from powertrain.components.body import RoadProfile
from powertrain.components.cycles import DriveCycle

SPEED_BAND = 2 / 3.6
"""How far a vehicle may leave the cycle [m/s]: 2 km/h, UN GTR No. 15, Annex 6, 2.6.8.3.1.2."""
TIME_BAND = 1.0
"""Within this time before and after [s], same place."""
RATE = 10
"""Samples per second."""
STANDS = 1.0
"""Distance [m] up to which a vehicle stands."""
LITTLE = 1.0
"""Torque [N.m] by which a marginal efficiency is told, and from which an engine fires."""
STALLED, LASTING = 1.0, 2.0
"""Speed [rad/s] below which an engine stands, and the time [s] after which it is not about to start."""
ON, ASKED = 0.5, 0.1
"""Switch from which an engine shall run; part of a cycle's distance that must be more than ``STANDS`` for a vehicle to be missed."""
Array = NDArray[np.float64]


@dataclass(frozen=True)
class CycleRun:
    """A vehicle that drove a cycle; ``message`` says why it ended early or stood, if it did.

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
        """Mean efficiency of the engine: work of its combustion at the crank over the heat of its fuel [1]; nan where none was burnt."""
        return self._work() / (self.fuel * self._of("engine.heating_value")) if self.fuel > 0 else math.nan

    @cached_property
    def marginal_efficiency(self) -> float:
        """Efficiency of a little more torque at the same speed, on average over the work of the engine [1]; nan where it gave none."""
        given = {name.removeprefix("engine."): v for name, v in self.parameters.items() if name.startswith("engine.")}
        engine = pt.replace(self.plant.model.engine, given)
        fires = (self.result["engine.firing"] > LITTLE) & (self._power() > 0)
        w, tau = (self.result[f"engine.{name}"][fires] for name in ("w", "tau"))
        if not w.size:
            return math.nan
        heat = (engine.fuel_flow(w, tau + LITTLE) - engine.fuel_flow(w, tau)) * float(engine.heating_value)
        share = (np.gradient(self.result.time) * self._power())[fires]
        return float(share.sum() / (share @ (heat / (LITTLE * w))))

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
        return float(np.trapezoid(np.maximum(self._power(), 0), self.result.time))

    def _power(self) -> Array:
        """Power at the crank without the starter's [W]."""
        return np.asarray((self.result["engine.firing"] - self.result["engine.drag"]) * self.result["engine.w"])

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

    ``options`` go to ``pt.simulate``. The grades of a cycle become the vehicle's road. A cycle that the vehicle cannot follow is driven as well as it goes; where the simulation ends
    early, what was driven is kept and ``message`` says why; it also tells of an engine that stalled for good and of a vehicle that stood.
    Errors: those of building the model, and ParameterError for wrong names.
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
        if (driven := vehicle.cycle.cycle).grades:  # type: ignore[attr-defined]
            vehicle = pt.replace(vehicle, road=RoadProfile(profile=driven.slope()))
        plant = pt.compile(vehicle)
    model: Any = plant.model
    driven = model.cycle.cycle
    start, stop = float(driven.times[0]), float(driven.times[-1])
    times = np.linspace(start, stop, round((stop - start) * RATE) + 1)
    given, message = dict(parameters or {}), ""
    try:
        result = plant.simulate(stop, start=start, parameters=given, times=times, progress=progress, **options)
    except pt.SimulationError as error:
        if not isinstance(error.result, pt.Result) or error.result.time.size < 2:
            raise
        result, message = error.result, str(error)
    return CycleRun(driven, plant, result, given, message or _standing(driven, result))


def _standing(cycle: DriveCycle, result: pt.Result[Any]) -> str:
    """What to say of a vehicle whose engine stalled for good, or which did not move though it was asked to; else nothing."""
    distance = abs(float(result["body.s"][-1] - result["body.s"][0]))
    driven = f"the vehicle drove {distance:.0f} m of the {cycle.distance:.0f} m of {cycle.name}"
    runs = np.flatnonzero((result["engine.w"] > STALLED) | (result["engine.on"] < ON))
    last = float(result.time[runs[-1] if runs.size else 0])
    if result.time[-1] - last > LASTING:
        return (
            f"{driven}: its engine stands from t = {last:.4g} s on, although it is switched on. Look at what loads the crank (clutch, "
            "accessories), at engine.tau_starter, which has to overcome that at rest, and at the idle controller"
        )
    if distance < STANDS < ASKED * cycle.distance:
        return f"{driven}: it stands. Look at what its wheels are given and what holds them"
    return ""
