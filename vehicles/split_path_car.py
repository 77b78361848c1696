"""Yu & Beachley's split-path CVT in a car: the engine runs on its line of lowest fuel consumption."""

from __future__ import annotations

from powertrain import Equations, Output, connect
from powertrain.components.body import Axle, Body, LumpedAxle, VehicleBody
from powertrain.components.control import LaggingDriver, OperatingLineControl, Pedals
from powertrain.components.cvu import CVU, Actuator, RatioActuator
from powertrain.components.differentials import CrownGear, FundamentalDifferential
from powertrain.components.engines import Engine, EngineCooling, WarmEngine, WillansEngine, operating_line
from powertrain.components.rotational import Clutch, Inertia, SpeedSensor
from powertrain.components.transmissions import (
    Layout,
    RatioOfUnit,
    SplitPathTransmission,
    UnitRatio,
    VariableTransmission,
)
from powertrain.vehicles.car import Car

LAYOUT: Layout = "abH"
BASIC_RATIO = -1.7
TRANSMISSION = SplitPathTransmission(
    layout=LAYOUT,
    differential=FundamentalDifferential(ratio=BASIC_RATIO, eta_ab=0.95, eta_ba=0.95),
    cvu=CVU(eta_ab=0.9, eta_ba=0.9),
)
"""Type 4 of the paper, Figs. 8 and 11, curve 4, which it calls attractive: high efficiency, little power through the unit."""
SHARE = 0.85
"""Share of the full-load torque: a sixth remains for the acceleration of the engine itself."""


def by_overall_ratio(
    ratio: Output, unit: RatioOfUnit, actuator: Actuator, transmission: VariableTransmission
) -> Equations:
    """The actuator of the transmission brings its overall ratio to the demand.

    The basic ratio of the installed differential is that of ``unit``, so it is not a separate parameter.
    """
    yield connect(ratio, unit.r)
    yield connect(unit.V, actuator.demand)
    yield connect(actuator.ratio, transmission.ratio)
    if isinstance(unit, UnitRatio) and isinstance(transmission, SplitPathTransmission):
        built_in = transmission.differential
        if isinstance(built_in, FundamentalDifferential):
            yield unit.basic_ratio == built_in.ratio


class SplitPathCar(Car):
    """A front-wheel-drive car of 1,300 kg: engine, start clutch, split-path CVT, final drive, wheels.

    The transmission has the paper's differential (R_o = -1.7, 95 %) in the layout a, b, H (its type 4) and a variable unit with an
    efficiency of 90 % whose ratio V passes zero, like that of a hydrostatic or electric unit. With V from -0.27 to 2.59 the ratio r ranges
    from 0.2 to 2. Above r = 0.37 the power splits; below it a part recirculates through the unit. The slots ``transmission``
    and ``unit_ratio`` accept any other transmission with a variable unit, such as one of the design program:
    ``NetworkTransmission.of(network)`` and ``NetworkRatio(network=network)``. The driver follows ``cycle``; the control gives the engine
    the speed of lowest fuel consumption for the demanded power. Below r = 0.2, i.e. below walking pace, the start clutch slips.
    ``front`` and ``rear`` accept axles, see ``Car``: ``DrivenAxle`` has a selectable differential, half shafts and two tyres.
    Source of the transmission: D. Yu, N. Beachley, Gear Technology, July/August 1986, Figs. 8 and 11, curve 4.
    """

    driver: Pedals = LaggingDriver(k_a=1300 / 6000)
    control: OperatingLineControl = OperatingLineControl(ratio_min=0.2)
    engine: Engine = WillansEngine()
    cooling: EngineCooling = WarmEngine()
    clutch: Clutch = Clutch(fn_max=300, mue_pos=((0.0, 1.0),))
    shaft: Inertia = Inertia(J=0.02)
    unit_ratio: RatioOfUnit = UnitRatio(layout=LAYOUT, basic_ratio=BASIC_RATIO)
    actuator: Actuator = RatioActuator(T=0.2, rate=0.5, ratio_start=-0.27)
    transmission: VariableTransmission = TRANSMISSION
    output: SpeedSensor = SpeedSensor()
    front: Axle = LumpedAxle(final_drive=CrownGear(ratio=4.5, eta_ab=0.97, eta_ba=0.97))
    body: Body = VehicleBody(m=1300, A=2.1)

    def equations(self) -> Equations:
        """Engine to road."""
        yield connect(self.engine.crank, self.clutch.flange_a)
        yield connect(self.clutch.flange_b, self.shaft.flange_a)
        yield connect(self.shaft.flange_b, self.transmission.flange_a)
        yield connect(self.transmission.flange_b, self.output.flange)
        yield from self._to_the_road(self.transmission.flange_b, self.driver.brake)
        yield from self._signals()

    def _signals(self) -> Equations:
        yield from self._on_the_cycle()
        yield from self._cooled(self.engine, self.cooling)
        yield connect(self.body.v, self.control.v)
        yield connect(self.driver.accelerator, self.control.accelerator)
        yield connect(self.output.w, self.control.w_out)
        line = operating_line(self.engine, SHARE)
        yield self.control.w_best.value == line(self.control.power.value)
        yield from self._on_its_line(self.engine, self.control)
        yield connect(self.control.clutch, self.clutch.f_normalized)
        yield from by_overall_ratio(self.control.ratio, self.unit_ratio, self.actuator, self.transmission)

    def initial(self) -> Equations:
        """At rest, with the engine idling."""
        yield self.engine.w == self.engine.w_idle
