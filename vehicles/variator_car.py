"""A front-wheel-drive car with a belt variator behind a torque converter."""

from __future__ import annotations

from typing import Annotated

import casadi as ca

from powertrain import Equations, Parameter, connect, parameter
from powertrain.components.body import Axle, Body, LumpedAxle, VehicleBody
from powertrain.components.control import AlwaysOn, Driver, EngineSwitch, OperatingLineControl, Pedals
from powertrain.components.cvu import CVU, Actuator, RatioActuator, VariableUnit
from powertrain.components.differentials import ChurningLoss
from powertrain.components.engines import (
    Accessories,
    AccessoryDrive,
    Engine,
    EngineCooling,
    WarmEngine,
    WillansEngine,
    operating_line,
)
from powertrain.components.rotational import IdealGear, Inertia, SpeedSensor
from powertrain.components.transmissions import StartingConverter, StartingDevice
from powertrain.vehicles.car import Car


class VariatorCar(Car):
    """A front-wheel-drive car of 1,300 kg: engine, torque converter, belt variator, final drive, wheels.

    The control gives the engine the speed of lowest fuel consumption for the demanded power, but at least ``w_least``, where engine and
    lock-up still run smoothly, with torques up to ``share`` of full load: the rest remains for the acceleration of the engine itself.
    The variator's ratio V = w_b/w_a ranges from 0.4 to 2.6; its drag includes belt, pump and bearings, and its efficiency the loss of the
    final drive.
    The driver follows ``cycle``; ``start_stop`` decides whether the engine runs. The numbers are invented, for a compact car with a
    1.6 l engine. ``front`` and ``rear`` accept axles, see ``Car``; with a ``DrivenAxle``, which has a differential and two tyres, it also
    drives in bends.
    """

    share: Annotated[float, "1"] = 0.85
    w_least: Parameter = parameter("rad/s", "Least speed of the engine on its line", default=125.0, above=0)
    driver: Pedals = Driver(k_a=1300 / 6000, hold=0.3)
    control: OperatingLineControl = OperatingLineControl(ratio_min=0.4, ratio_max=2.6)
    start_stop: EngineSwitch = AlwaysOn()
    engine: Engine = WillansEngine()
    cooling: EngineCooling = WarmEngine()
    accessories: Accessories = AccessoryDrive()
    start: StartingDevice = StartingConverter()
    shaft: Inertia = Inertia(J=0.03)
    churning: ChurningLoss = ChurningLoss(d=0.015)
    actuator: Actuator = RatioActuator(T=0.2, rate=1.0, ratio_min=0.4, ratio_max=2.6, ratio_start=0.4)
    unit: VariableUnit = CVU(eta_ab=0.91, eta_ba=0.91)
    pulley: Inertia = Inertia(J=0.01)
    output: SpeedSensor = SpeedSensor()
    front: Axle = LumpedAxle(final_drive=IdealGear(ratio=5.4))
    body: Body = VehicleBody(m=1300, A=2.1)

    def check(self) -> Equations:
        """The line begins below the rev limiter."""
        yield self.w_least < self.engine.w_limit

    def equations(self) -> Equations:
        """Engine to road."""
        yield connect(self.engine.crank, self.accessories.flange, self.start.flange_a)
        yield connect(self.start.flange_b, self.shaft.flange_a)
        yield connect(self.shaft.flange_b, self.churning.flange, self.unit.flange_a)
        yield connect(self.unit.flange_b, self.pulley.flange_a)
        yield connect(self.pulley.flange_b, self.output.flange)
        yield from self._to_the_road(self.pulley.flange_b, self.driver.brake)
        yield from self._signals()

    def _signals(self) -> Equations:
        yield from self._on_the_cycle()
        yield from self._cooled(self.engine, self.cooling)
        yield connect(self.body.v, self.control.v, self.start_stop.v)
        yield connect(self.driver.accelerator, self.control.accelerator, self.start_stop.accelerator)
        yield connect(self.start_stop.on, self.engine.on)
        yield connect(self.output.w, self.control.w_out)
        line = operating_line(self.engine, self.share)
        yield self.control.w_best.value == ca.fmax(line(self.control.power.value), self.w_least)
        yield from self._on_its_line(self.engine, self.control)
        yield connect(self.control.clutch, self.start.pressed)
        yield connect(self.driver.brake, self.start.brake)
        yield connect(self.driver.accelerator, self.start.accelerator)
        yield connect(self.control.ratio, self.actuator.demand)
        yield connect(self.actuator.ratio, self.unit.ratio)

    def initial(self) -> Equations:
        """At rest, with the engine idling."""
        yield self.engine.w == self.engine.w_idle
