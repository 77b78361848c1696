"""The energy management of a power-split hybrid: fuel flow and battery power for each power of the engine."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

import powertrain as pt
from powertrain.components.control import PlannedPowerSplit, PowerSplit
from powertrain.components.cycles import DriveCycle
from powertrain.components.engines import operating_line
from powertrain.components.evaluation import numbers
from powertrain.language.reals import Array
from powertrain.trials.anatomy import charge_at_start
from powertrain.trials.backward import demand
from powertrain.trials.cycle import on_cycle
from powertrain.trials.management import Management, along_cycle, with_parameters_of
from powertrain.trials.operating import on_rolling_road
from powertrain.vehicles.power_split_hybrid import SHARE, PowerSplitHybrid

POWERS = (5e3, 7.5e3, 10e3, 12.5e3, 15e3, 18e3, 21e3, 25e3, 30e3, 36e3, 43e3, 50e3)
"""Powers of the engine [W]."""
MARGIN = 0.8
"""Share of the battery's power up to which torques are tabulated; the rest covers the losses of the machines."""
SLOWEST, SPEEDS, LEVELS, CHARGES = 0.3, 24, 31, (0.35, 0.6, 0.85)
EFFICIENCY = 0.35
"""Efficiency for converting the energy of an engine start, and of the battery's charge, to fuel."""
FUEL, CHARGING, FORCE = "engine.fuel_rate", "der(battery.soc)", "body.force"


def power_split_management(
    vehicle: PowerSplitHybrid, cycle: DriveCycle | str, *, powers: ArrayLike = POWERS
) -> Management:
    """The energy management of a power-split hybrid over a cycle: in every row the engine is off, or on with one of several powers.

    Parameters
    ----------
    vehicle
        The hybrid with its own rules.
    cycle
        A cycle or its name.
    powers
        Powers of the engine [W].

    Returns
    -------
    Management
        Its state is the charge of the battery; a start costs the fuel for the kinetic energy of the engine.
    """
    cycle = DriveCycle.of(cycle)
    driven, choices = on_cycle(vehicle, cycle), np.asarray(powers, float)
    bench = PowerSplitBench(vehicle, np.linspace(SLOWEST, 1.02 * cycle.top_speed, SPEEDS), choices)
    battery, engine = vehicle.battery, vehicle.engine
    heat = float(engine.heating_value) * EFFICIENCY

    def gained(before: float, after: float) -> float:
        soc = np.linspace(before, after, 101)
        return float(battery.Q) * float(np.trapezoid(np.asarray(battery.ocv(soc), float), soc))

    def inputs(mode: int, control: int) -> dict[str, float]:
        return {"control.engine_on": float(mode), "control.engine_power": float(mode * choices[control])}

    started = float(engine.J) * float(operating_line(engine, SHARE)(choices[0])) ** 2 / 2 / heat
    cost, rate = bench.along(*demand(driven, cycle))
    stages = pt.Stages(np.diff(cycle.times), np.array(CHARGES), cost, rate, np.array([[0.0, started], [0.0, 0.0]]))
    soc = charge_at_start(vehicle, "battery")
    planned = pt.replace(vehicle, control=with_parameters_of(vehicle.control, PlannedPowerSplit(), PowerSplit))
    return Management(
        driven, planned, cycle, stages, soc, gained(soc, soc + 0.01) / 0.01 / heat, gained, inputs, "battery.soc"
    )


class PowerSplitBench:
    """The hybrid without driver and control on a rolling road: torques at its ring gear from full regeneration to full drive."""

    def __init__(self, vehicle: PowerSplitHybrid, speeds: Array, powers: Array) -> None:
        self.vehicle, self.speeds, self.powers = vehicle, speeds, powers
        self.plant = pt.compile(on_rolling_road(pt.bench(vehicle, without=["driver", "control"])))
        names = ["machine_2.w", "battery.charge_power", "battery.discharge_power"]
        point = self._steady({"body.speed": 1.0, "battery.soc": 0.6, "engine.w": 0.0}, [], names)
        teeth, self.charge, self.discharge = (float(point[name]) for name in names)
        self.ring = xr.DataArray(teeth * speeds, dims="speed", coords={"speed": speeds})
        control, w_ring = vehicle.control, self.ring.values
        self.slowest, self.fastest = (
            self.ring.copy(data=numbers(lambda w, k=k: control.speeds_of_carrier(w)[k], w_ring)) for k in (0, 1)
        )

    def _steady(self, grid: dict[str, Any], free: Sequence[str], outputs: Sequence[str], on: float = 0.0) -> xr.Dataset:
        inputs = {"control.on": on}
        held = ["battery.soc"] if free else ["battery.soc", "engine.w"]
        return pt.steady(
            self.plant, grid, inputs=inputs, free=free, held=held, outputs=outputs, side=1, first=True, progress=False
        )

    def _wanted(self, engine_power: xr.DataArray | float) -> xr.DataArray:
        """Torques at the ring gear that the control may request."""
        control, full = self.vehicle.control, float(self.vehicle.control.tau_full)
        v, turning = self.ring.speed, self.ring.clip(min=float(control.w_fade))
        fade = (v / float(control.v_fade)).clip(max=self.ring / float(control.w_fade)).clip(max=1.0)
        low: xr.DataArray = -fade * (float(control.F_most) * v).clip(max=self.charge) / turning
        high = ((MARGIN * self.discharge + engine_power) / turning).clip(max=full)
        return low + xr.DataArray(np.linspace(0, 1, LEVELS), dims="level") * (high - low)

    @cached_property
    def off(self) -> xr.Dataset:
        """Engine without fuel: over speed, level and charge.

        It stands, or machine 1 turns it where machine 1 would exceed w_sun otherwise; the gear's losses between them are neglected.
        """
        ratio, w = float(self.vehicle.control.ratio), self.slowest.clip(min=0)
        drag = w.copy(data=np.asarray(self.vehicle.engine.motoring(w.values), float)).where(w > 0, 0.0)
        grid = {
            "body.speed": self.speeds,
            "engine.w": w,
            "control.tau_1": drag / (1 + ratio),
            "control.tau_2": self._wanted(-drag * w) + ratio / (1 + ratio) * drag,
            "battery.soc": list(CHARGES),
        }
        return self._steady(grid, [], [FORCE, FUEL])

    @cached_property
    def on(self) -> xr.Dataset:
        """Engine at each power, at the speed of lowest fuel consumption that machine 1 allows: over speed, level, power and charge."""
        engine, control = self.vehicle.engine, self.vehicle.control
        power = xr.DataArray(self.powers, dims="power", coords={"power": self.powers})
        best = xr.DataArray(np.asarray(operating_line(engine, SHARE)(self.powers), float), dims="power")
        w = best.clip(min=self.slowest, max=self.fastest).transpose("speed", "power").assign_coords(power=self.powers)
        full, drag = (w.copy(data=np.asarray(law(w.values), float)) for law in (engine.full_load, engine.motoring))
        torque: xr.DataArray = (power / w).clip(max=full).transpose("speed", "power")
        part: xr.DataArray = ((torque + drag) / (full + drag)).clip(0, 1)
        share = float(control.ratio) / (1 + float(control.ratio))
        grid = {
            "body.speed": self.speeds,
            "engine.w": w,
            "control.throttle": w.copy(data=np.asarray(engine.opening(w.values, part.values), float)),
            "control.tau_2": self._wanted(torque * w) - share * torque,
            "battery.soc": list(CHARGES),
        }
        return self._steady(grid, ["control.tau_1"], [FORCE, FUEL], on=1.0)

    def along(self, v: Array, force: Array) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Fuel flow [kg/s] and rate of the charge [1/s] in every row of a cycle, of shape (rows, 2, powers, charges)."""
        dims = ("speed", "level", "power", "soc")
        cost, rate = along_cycle(self.speeds, self.off, self.on, (FORCE, FUEL, CHARGING), dims, v, force)
        return cost, rate
