"""The common part of hybrids: engine and battery, and the rules that start and stop the engine."""

from __future__ import annotations

from typing import ClassVar

from powertrain import Equations, connect
from powertrain.components.control import HybridSupervisor
from powertrain.components.electric import AccessoryLoad, BatteryCooling, ConditionedBattery, PolarizedBattery
from powertrain.components.engines import Engine, EngineCooling, WarmEngine, WillansEngine, throttle_table
from powertrain.vehicles.car import Car


class HybridCar(Car):
    """Partial: a car with an engine and a battery; the engine is stopped at the start."""

    stores: ClassVar[tuple[str, ...]] = ("battery",)
    engine: Engine = WillansEngine()
    battery: PolarizedBattery = PolarizedBattery(R=0.2, B=2000, overvoltage=4.2 / 4.15)
    battery_cooling: BatteryCooling = ConditionedBattery()
    accessories: AccessoryLoad = AccessoryLoad(P=300)
    cooling: EngineCooling = WarmEngine()

    def _engine_by(self, control: HybridSupervisor) -> Equations:
        """The control receives the data of vehicle, charge and engine, and sets the engine's throttle and switch."""
        yield connect(self.body.v, control.v)
        yield connect(self.engine.speed, control.w)
        yield connect(self.battery.state_of_charge, control.soc)
        yield control.tau_open.value == self.engine.full_load(self.engine.w)
        throttle = throttle_table(self.engine, speeds=21, torques=31)
        firing = throttle.axes[0].clipped(self.engine.w)  # a stopped engine receives no demand
        yield control.opening.value == throttle(firing, control.torque.value)
        yield connect(control.on, self.engine.on)
        yield from self._cooled(self.engine, self.cooling)
        yield connect(control.throttle, self.engine.throttle)

    def initial(self) -> Equations:
        """At rest, with the engine stopped."""
        yield self.engine.w == 0
