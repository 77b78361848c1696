"""The record of a vehicle on a drive cycle: how well it followed, what it consumed, where the energy went."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

import powertrain as pt
from powertrain.components.common_units import GALLON, KM_H, KWH, MILE
from powertrain.components.cycles import DriveCycle
from powertrain.language import htmltext
from powertrain.language.component import children
from powertrain.language.reals import Array
from powertrain.trials.anatomy import Anatomy, anatomy, value_at
from powertrain.trials.plausible import notes
from powertrain.trials.standing import STANDS

SPEED_BAND = 2 * KM_H
"""Speed tolerance [m/s]: 2 km/h, UN GTR No. 15, Annex 6, 2.6.8.3.1.2."""
TIME_BAND = 1.0
"""Time tolerance [s], same source."""
RATE = 10
"""Samples per second."""
LITTLE = 1.0
"""Torque [N.m] for evaluating the marginal efficiency, and above which an engine fires."""
GASOLINE = 33.705 * KWH
"""Energy of a US gallon of gasoline [J], 40 CFR 600.116-12."""
SHARE = pt.parameter("1", "a share: 88 % is 0.88", above=0, max=1)
"""Efficiency of a charger, usable share of a charge."""


@dataclass(frozen=True)
class CycleRun:
    """The run of a vehicle over a cycle; ``message`` gives the reason if it ended early or did not move.

    ``title`` names both in figures and pages, the vehicle by its ``name`` if it has one, else by its class. ``anatomy`` has the paths
    of the vehicle's body, engines and batteries. ``table`` has the main results.
    """

    cycle: DriveCycle
    plant: pt.Plant[Any]
    result: pt.Result[Any]
    parameters: dict[str, float]
    message: str = ""
    name: str = ""

    @property
    def title(self) -> str:
        """Such as "ManualCar over wltc"."""
        return f"{self.name or self.anatomy.vehicle} over {self.cycle.name}"

    @cached_property
    def anatomy(self) -> Anatomy:
        """The parts of the vehicle."""
        return anatomy(self.plant.model)

    @cached_property
    def vehicle(self) -> Any:
        """The vehicle with the parameters of the run."""
        return pt.replace(self.plant.model, self.parameters)

    @cached_property
    def speed(self) -> Array:
        """Speed [m/s] at ``result.time``."""
        return self.result[f"{self.anatomy.the('body')}.v"]

    @property
    def distance(self) -> float:
        """Distance driven [m]."""
        path = self.result[f"{self.anatomy.the('body')}.s"]
        return float(path[-1] - path[0])

    @property
    def fuel(self) -> float:
        """Fuel burnt by all engines [kg]."""
        return sum(self._burnt(engine) for engine in self.anatomy.engines)

    @property
    def litres_per_100km(self) -> float:
        """Consumption of fuel [l/100 km]; nan if the vehicle did not move forward."""
        litres = sum(self._burnt(engine) / self._of(f"{engine}.fuel_density") for engine in self.anatomy.engines) * 1e3
        return self._per_metre(litres) * 1e5

    @property
    def co2_per_km(self) -> float:
        """Carbon dioxide at the tailpipe [g/km]; nan if the vehicle did not move forward."""
        grams = sum(self._burnt(engine) * self._of(f"{engine}.co2_per_fuel") for engine in self.anatomy.engines) * 1e3
        return self._per_metre(grams) * 1e3

    @cached_property
    def electricity(self) -> float:
        """Energy taken from the batteries' charge [J], including their own losses; negative if they were charged."""
        if not self.anatomy.batteries:
            return 0.0
        stored = self.audit.components["stored"]
        return -float(sum(stored.loc[battery] for battery in self.anatomy.batteries))

    @property
    def wh_per_km(self) -> float:
        """Energy taken from the batteries' charge [W.h/km]; nan if the vehicle did not move forward."""
        return self._per_metre(self.electricity / KWH) * 1e6

    @property
    def net_energy_change(self) -> float:
        """Energy gained by the batteries over the energy of the fuel [1] (NEC of SAE J1711); nan if no fuel was burnt."""
        return -self.electricity / self.heat if self.fuel > 0 else math.nan

    @cached_property
    def demand(self) -> float:
        """Energy demand of the cycle [J]: the positive work against the road load and the inertia of body, wheels and trailers.

        Source: UN GTR No. 15, Annex 7, 5.
        """
        body, read = self.anatomy.the("body"), self.result
        power = (read[f"{body}.front.f"] + read[f"{body}.rear.f"]) * self.speed
        for trailer in self.anatomy.trailers:
            power = power + read[f"{trailer}.hitch.f"] * self.speed
        for wheel in self.anatomy.wheels:
            power = power + read[f"{wheel}.hub.tau"] * read[f"{wheel}.w"] - read[f"{wheel}.f"] * read[f"{wheel}.v"]
        return float(np.trapezoid(np.maximum(power, 0.0), read.time))

    def mpg(self, charging: float | str = 1.0) -> float:
        """Miles per US gallon; electric energy counts as gasoline of 33.705 kW.h per gallon, via a charger of this efficiency.

        nan if the vehicle did not move forward or consumed nothing. Source: 40 CFR 600.116-12 (the energy of a gallon).
        Errors: ParameterError for an efficiency that is not above 0 and at most 1.
        """
        efficiency: float = SHARE.check(charging, "charging")
        gallons = self.litres_per_100km / 1e8 * self.distance / GALLON
        gallons += max(self.electricity, 0.0) / efficiency / GASOLINE
        return self.distance / MILE / gallons if gallons > 0 else math.nan

    def range(self, usable: float | str = 1.0) -> float:
        """Distance [m] that the vehicle can drive on its batteries at this consumption; ``usable`` is the usable share of the charge.

        nan if none is consumed or the vehicle did not move forward. The charge is that at a state of charge of 1.
        Errors: ParameterError for a share that is not above 0 and at most 1.
        """
        share: float = SHARE.check(usable, "usable")
        if not (self.electricity > 0 and self.distance > STANDS):
            return math.nan
        whole = sum(float(value_at(self.vehicle, battery).full_energy()) for battery in self.anatomy.batteries)
        return share * whole / self.electricity * self.distance

    @property
    def efficiency(self) -> float:
        """Mean efficiency of the engines: work of combustion at the crankshaft over the heat of the fuel [1]; nan if no fuel was burnt."""
        return self._work() / self.heat if self.fuel > 0 else math.nan

    @property
    def heat(self) -> float:
        """Chemical energy of the fuel burnt [J]."""
        return sum(self._burnt(engine) * self._of(f"{engine}.heating_value") for engine in self.anatomy.engines)

    @cached_property
    def marginal_efficiency(self) -> float:
        """Efficiency of a small additional torque at the same speed, averaged over the work of the engines [1]; nan without work."""
        found = [self._marginal(path) for path in self.anatomy.engines]
        work, heat = sum(work for work, _ in found), sum(heat for _, heat in found)
        return work / heat if work > 0 else math.nan

    def _marginal(self, path: str) -> tuple[float, float]:
        """Work of an engine [J], and the heat for as much work at its marginal efficiency."""
        engine, power = value_at(self.vehicle, path), self._power(path)
        fires = (self.result[f"{path}.firing"] > LITTLE) & (power > 0)
        w, tau = (self.result[f"{path}.{name}"][fires] for name in ("w", "tau"))
        if not w.size:
            return 0.0, 0.0
        heat = (engine.fuel_flow(w, tau + LITTLE) - engine.fuel_flow(w, tau)) * float(engine.heating_value)
        share = (np.gradient(self.result.time) * power)[fires]
        return float(share.sum()), float(share @ (heat / (LITTLE * w)))

    @cached_property
    def band(self) -> tuple[Array, Array, Array]:
        """Times [s] of the whole cycle, and the lowest and highest speeds [m/s] that the regulation allows at these times."""
        from scipy.ndimage import maximum_filter1d, minimum_filter1d

        t = self.cycle.times[0] + np.arange(round(self.cycle.duration * RATE) + 1) / RATE
        wanted, size = np.interp(t, self.cycle.times, self.cycle.speeds), 2 * round(TIME_BAND * RATE) + 1
        low = minimum_filter1d(wanted, size, mode="nearest") - SPEED_BAND
        return t, low, maximum_filter1d(wanted, size, mode="nearest") + SPEED_BAND

    @cached_property
    def excess(self) -> Array:
        """Deviation of the speed beyond the regulation's tolerance at ``result.time`` [m/s]: positive above, negative below, else 0."""
        t, low, high = self.band
        time, v = self.result.time, self.speed
        return np.asarray(np.maximum(v - np.interp(time, t, high), 0) + np.minimum(v - np.interp(time, t, low), 0))

    @property
    def time_outside(self) -> float:
        """Time outside the speed tolerance, including the time that was not driven [s]."""
        t = self.result.time
        outside = float(np.trapezoid((self.excess != 0).astype(float), t))
        return outside + float(self.cycle.times[-1] - t[-1])

    @cached_property
    def audit(self) -> pt.EnergyAudit:
        """The energy audit of the run."""
        return pt.energy_audit(self.result)

    @property
    def supplied(self) -> float:
        """Energy of the sources, and the decrease of stored energy: a battery, a car driven downhill [J]."""
        table = self.audit.components
        parts = [name for name, _ in children(self.plant.model) if name in table.index]
        return float(table["sources"][""] - table["stored"][parts].clip(upper=0).sum())

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """Numbers of the vehicle that look like mistakes, such as a diameter for a radius (``trials.notes``); notes of the simulation."""
        return (*notes(self.vehicle), *self.result.notes)

    @cached_property
    def table(self) -> pd.DataFrame:
        """The numbers for comparing vehicles: value and unit."""
        deviation = self.excess[np.argmax(np.abs(self.excess))]
        rows = {"distance": (self.distance / 1e3, "km")}
        if self.anatomy.engines:
            rows |= {
                "fuel": (self.fuel, "kg"),
                "consumption": (self.litres_per_100km, "l/100 km"),
                "carbon dioxide": (self.co2_per_km, "g/km"),
                "work at the crank": (self._work() / 1e6, "MJ"),
                "mean efficiency of the engine": (self.efficiency, "1"),
            }
        if self.anatomy.batteries:
            rows["from the battery"] = (self.wh_per_km, "W.h/km")
        if self.anatomy.batteries and not self.anatomy.engines:
            rows["range with the whole charge"] = (self.range() / 1e3, "km")
        if self.anatomy.batteries and self.fuel > 0:
            rows["net energy change over the fuel's energy"] = (self.net_energy_change, "1")
        rows["fuel economy"] = (self.mpg(), "mpge" if self.anatomy.batteries else "mpg")
        rows |= {
            "time outside the speed tolerance": (self.time_outside, "s"),
            "largest deviation beyond the tolerance": (float(deviation) / KM_H, "km/h"),
        }
        return pd.DataFrame.from_dict(rows, orient="index", columns=["value", "unit"])

    def __repr__(self) -> str:
        said = f", {self.message.splitlines()[0]}" if self.message else ""
        main = ", ".join(f"{what} {value:.4g} {unit}" for what, value, unit in self.table.head(3).itertuples())
        return f"CycleRun({self.title}: {main}{said})"

    def _repr_html_(self) -> str:
        rows = [(str(what), f"{value:.4g}", str(unit)) for what, value, unit in self.table.itertuples()]
        said = htmltext.heading("Ended early:", self.message) if self.message else ""
        said += "".join(htmltext.heading("Note:", note) for note in self.notes)
        return htmltext.heading("CycleRun", self.title) + said + htmltext.table(("quantity", "value", "unit"), rows)

    def explore(self, file: str | PathLike[str] | None = None, *signals: str) -> Path:
        """The interactive page of the run with its main results, see ``pt.explore``; by default it plots speed and prime movers."""
        parts = self.anatomy
        movers = [f"{path}.{name}" for name in ("w", "tau") for path in parts.prime_movers]
        shown = signals or (f"{parts.the('body')}.v", *movers)
        return pt.explore(self, file, *shown, name=self.title)

    def _burnt(self, engine: str) -> float:
        fuel = self.result[f"{engine}.fuel"]
        return float(fuel[-1] - fuel[0])

    def _work(self) -> float:
        return sum(
            float(np.trapezoid(np.maximum(self._power(engine), 0), self.result.time)) for engine in self.anatomy.engines
        )

    def _power(self, engine: str) -> Array:
        """Power at the crank without the starter's [W]."""
        torque = self.result[f"{engine}.firing"] - self.result[f"{engine}.drag"]
        return np.asarray(torque * self.result[f"{engine}.w"])

    def _per_metre(self, amount: float) -> float:
        return amount / self.distance if self.distance > STANDS else math.nan

    def _of(self, name: str) -> float:
        return float(self.parameters.get(name, self.plant.parameters[name]))
