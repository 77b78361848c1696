"""The energy management of a flywheel hybrid: fuel flow and flywheel power for each throttle of the engine."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

import powertrain as pt
from powertrain.components.control import FlywheelCharging, PlannedCharge
from powertrain.components.cycles import DriveCycle
from powertrain.language.reals import Array
from powertrain.trials.backward import demand
from powertrain.trials.cycle import on_cycle
from powertrain.trials.management import Management, along_cycle, with_parameters_of
from powertrain.trials.operating import on_rolling_road
from powertrain.vehicles.flywheel_hybrid import W_START, FlywheelHybrid

THROTTLES = (0.55, 0.7, 0.85, 1.0)
"""Throttle positions of the engine [1]."""
SLOWEST, SPEEDS, STORES, LEVELS = 0.2, 28, 6, np.linspace(-0.7, 0.9, 17)
SLIP = 1e-4
"""Slip at which a clutch transmits torque on the bench as if locked."""
EFFICIENCY = 0.35
"""Efficiency for converting the energy of an engine start, and of the flywheel, to fuel."""
FUEL, RATE, FORCE = "engine.fuel_rate", "der(flywheel.w)", "body.force"


def flywheel_management(
    vehicle: FlywheelHybrid, cycle: DriveCycle | str, *, throttles: ArrayLike = THROTTLES
) -> Management:
    """The energy management of a flywheel hybrid over a cycle: in every row the engine is off, or on with one of several throttles.

    Parameters
    ----------
    vehicle
        The hybrid with its own rules.
    cycle
        A cycle or its name.
    throttles
        Throttle positions of the engine [1].

    Returns
    -------
    Management
        Its state is the energy of the flywheel [J]; a start costs the fuel for the kinetic energy of the engine.
    """
    cycle = DriveCycle.of(cycle)
    driven, choices = on_cycle(vehicle, cycle), np.asarray(throttles, float)
    step_up, inertia = float(vehicle.step_up.ratio), float(vehicle.flywheel.J)
    heat = float(vehicle.engine.heating_value) * EFFICIENCY

    def gained(before: float, after: float) -> float:
        return after - before

    def energy(model: Any) -> Any:
        return inertia * model.flywheel.w**2 / 2

    def inputs(mode: int, control: int) -> dict[str, float]:
        return {"charge.engine_on": float(mode), "charge.engine_throttle": float(mode * choices[control])}

    bench = FlywheelBench(vehicle, np.linspace(SLOWEST, 1.02 * cycle.top_speed, SPEEDS), choices)
    cost, rate = bench.along(*demand(driven, cycle))
    started = float(vehicle.engine.J) * W_START**2 / 2 / heat
    stages = pt.Stages(
        np.diff(cycle.times), inertia * bench.store**2 / 2, cost, rate, np.array([[0.0, started], [0.0, 0.0]])
    )
    start = inertia * (W_START / step_up) ** 2 / 2
    planned = pt.replace(vehicle, charge=with_parameters_of(vehicle.charge, PlannedCharge(), FlywheelCharging))
    return Management(driven, planned, cycle, stages, start, 1 / heat, gained, inputs, energy)


class FlywheelBench:
    """The hybrid without driver and controls on a rolling road.

    The torque of the clutch at the transmission's output is given by its pressure: at the ratio at which it just slips, or at the lowest
    ratio if it slips anyway. It only drives in this way; when braking it is open.
    """

    def __init__(self, vehicle: FlywheelHybrid, speeds: Array, throttles: Array) -> None:
        self.vehicle, self.speeds, self.throttles = vehicle, speeds, throttles
        drive, step_up = vehicle.drive, float(vehicle.step_up.ratio)
        low, high = float(drive.w_empty + drive.w_band), float(drive.w_full - drive.w_band)
        self.store = np.linspace(low, high, STORES) / step_up
        self.plant = pt.compile(on_rolling_road(pt.bench(vehicle, without=["driver", "drive", "charge"])))
        v, w, level = (
            xr.DataArray(values, dims=name)
            for name, values in (("speed", speeds), ("store", self.store), ("level", LEVELS))
        )
        locked = self._output() * v / (w * step_up)
        lowest = float(drive.ratio_min)
        ratio = np.clip(locked * (1 + SLIP * np.sign(level)), lowest, float(drive.ratio_max))
        pressure = abs(level) * ((level > 0) | (locked >= lowest))
        self.grid = {"body.speed": v, "flywheel.w": w, "drive.ratio": ratio, "drive.clutch": pressure}

    def _output(self) -> float:
        """Speed behind the clutch [rad/s] divided by the speed of the vehicle [m/s]."""
        store, ratio = float(self.store[0]), float(self.vehicle.drive.ratio_min)
        point = self._steady({"body.speed": 1.0, "flywheel.w": store, "drive.ratio": ratio}, ["output.w"])
        return float(point["output.w"])

    def _steady(self, grid: dict[str, Any], outputs: list[str], on: float = 0.0) -> xr.Dataset:
        given = {"charge.on": on, "charge.clutch": on}
        held = ["flywheel.w"]
        return pt.steady(
            self.plant, grid, inputs=given, free=[], held=held, outputs=outputs, side=1, first=True, progress=False
        )

    def along(self, v: Array, force: Array) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Fuel flow [kg/s] and power into the flywheel [W] in every row of a cycle, of shape (rows, 2, throttles, stores)."""
        dims = ("speed", "level", "throttle", "store")
        throttle = xr.DataArray(self.throttles, dims="throttle", coords={"throttle": self.throttles})
        off = self._steady(self.grid, [FORCE, FUEL])
        on = self._steady(self.grid | {"charge.throttle": throttle}, [FORCE, FUEL], on=1.0)
        cost, rate = along_cycle(self.speeds, off, on, (FORCE, FUEL, RATE), dims, v, force)
        return cost, rate * float(self.vehicle.flywheel.J) * self.store
