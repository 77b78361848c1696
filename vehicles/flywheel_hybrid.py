"""Yu & Beachley's flywheel hybrid: a split-path CVT between a flywheel and the wheels, an engine that charges the flywheel."""

from __future__ import annotations

from typing import ClassVar

from powertrain import Equations, connect
from powertrain.components.body import Axle, Body, LumpedAxle, RollingAxle, VehicleBody
from powertrain.components.control import Driver, FlywheelCharge, FlywheelCharging, FlywheelDrive, Pedals
from powertrain.components.cvu import Actuator, RatioActuator
from powertrain.components.differentials import ChurningLoss, CrownGear
from powertrain.components.engines import Engine, EngineCooling, WarmEngine, WillansEngine
from powertrain.components.rotational import BearingFriction, Clutch, IdealGear, Inertia, SpeedSensor
from powertrain.components.transmissions import SplitPathTransmission, UnitRatio, unit_ratio
from powertrain.components.wheels import WheelBrake
from powertrain.vehicles.car import Car
from powertrain.vehicles.split_path_car import BASIC_RATIO, LAYOUT, TRANSMISSION, by_overall_ratio

V_MIN, V_MAX = (unit_ratio(LAYOUT, BASIC_RATIO, r) for r in (0.15, 2.0))
W_START = 370.0
"""Initial speed of the flywheel's shaft [rad/s]."""


class FlywheelHybrid(Car):
    """A car of 1,400 kg driven by a flywheel: the transmission's ratio accelerates the car, and returns its energy during braking.

    The flywheel (1.1 kg.m2, a steel disk of 35 kg and half a metre) turns three times as fast as the transmission's input shaft, at
    most at 1,700 rad/s, where it stores 1.6 MJ; the car at 130 km/h has 0.9 MJ. The engine charges it at an efficient load, or is stopped.
    The transmission is that of the split-path car with a wider range, r from 0.15 to 2; below it the clutch at its output slips.
    With ``drive.recovery`` = 0 the friction brakes do all the braking.
    ``front`` and ``rear`` accept axles, see ``Car``.
    Source of the concept: D. Yu, N. Beachley, Gear Technology, July/August 1986, p. 9 and 16; the numbers are invented.
    """

    stores: ClassVar[tuple[str, ...]] = ("flywheel",)
    driver: Pedals = Driver(k_a=1 / 3.5)
    drive: FlywheelDrive = FlywheelDrive()
    charge: FlywheelCharging = FlywheelCharge()
    engine: Engine = WillansEngine()
    cooling: EngineCooling = WarmEngine()
    engine_clutch: Clutch = Clutch(fn_max=250, mue_pos=((0.0, 1.0),))
    step_up: IdealGear = IdealGear(ratio=1 / 3)
    flywheel: Inertia = Inertia(J=1.1)
    bearing: BearingFriction = BearingFriction(tau_pos=((0.0, 0.1),))
    air: ChurningLoss = ChurningLoss(d2=1.5e-7)
    input: SpeedSensor = SpeedSensor()
    unit_ratio: UnitRatio = UnitRatio(layout=LAYOUT, basic_ratio=BASIC_RATIO)
    actuator: Actuator = RatioActuator(T=0.2, rate=0.5, ratio_min=V_MIN, ratio_max=V_MAX, ratio_start=V_MIN)
    transmission: SplitPathTransmission = TRANSMISSION
    shaft: Inertia = Inertia(J=0.02)
    before: SpeedSensor = SpeedSensor()
    clutch: Clutch = Clutch(fn_max=600, mue_pos=((0.0, 1.0),))
    output: SpeedSensor = SpeedSensor()
    front: Axle = LumpedAxle(
        final_drive=CrownGear(ratio=3.3, eta_ab=0.97, eta_ba=0.97), brakes=WheelBrake(tau_max=1500)
    )
    rear: Axle = RollingAxle(brakes=WheelBrake(tau_max=750))
    body: Body = VehicleBody(m=1400, A=2.1)

    def equations(self) -> Equations:
        """Engine and flywheel on one shaft, and the connection to the road."""
        yield connect(self.engine.crank, self.engine_clutch.flange_a)
        yield connect(self.engine_clutch.flange_b, self.step_up.flange_a, self.transmission.flange_a, self.input.flange)
        yield connect(self.step_up.flange_b, self.flywheel.flange_a)
        yield connect(self.flywheel.flange_b, self.bearing.flange_a, self.air.flange)
        yield connect(self.transmission.flange_b, self.shaft.flange_a)
        yield connect(self.shaft.flange_b, self.clutch.flange_a, self.before.flange)
        yield connect(self.clutch.flange_b, self.output.flange)
        yield from self._to_the_road(self.clutch.flange_b, self.drive.friction)
        yield from self._signals()

    def _signals(self) -> Equations:
        yield from self._on_the_cycle()
        yield from self._cooled(self.engine, self.cooling)
        yield connect(self.body.v, self.charge.v)
        yield connect(self.driver.accelerator, self.drive.accelerator)
        yield connect(self.driver.brake, self.drive.brake)
        yield connect(self.input.w, self.drive.w_in, self.charge.w_in)
        yield connect(self.output.w, self.drive.w_out)
        yield from by_overall_ratio(self.drive.ratio, self.unit_ratio, self.actuator, self.transmission)
        yield connect(self.before.w, self.drive.w_before)
        yield connect(self.drive.clutch, self.clutch.f_normalized)
        yield connect(self.engine.speed, self.charge.w)
        yield connect(self.charge.on, self.engine.on)
        yield connect(self.charge.throttle, self.engine.throttle)
        yield connect(self.charge.clutch, self.engine_clutch.f_normalized)

    def initial(self) -> Equations:
        """At rest, with the flywheel half charged and the engine stopped."""
        yield self.flywheel.w * self.step_up.ratio == W_START
        yield self.engine.w == 0
