"""The common part of cars: the driver on a cycle, the gear schedule, and the connection from the transmission to the road."""

from __future__ import annotations

from itertools import pairwise

from powertrain import (
    Component,
    Equations,
    Input,
    ModelError,
    Output,
    ParameterError,
    Symbol,
    connect,
    replace,
    signal_input,
)
from powertrain.components.body import (
    Axle,
    Body,
    CentreDifferential,
    CoastDownBody,
    DrivenAxle,
    LumpedAxle,
    LumpedCentreDifferential,
    PoweredAxle,
    RigidTransferCase,
    RoadProfile,
    RollingAxle,
    Trailer,
    TransferCase,
    VehicleBody,
)
from powertrain.components.control import (
    AlwaysOn,
    Driver,
    EngineSwitch,
    FixedGear,
    GearSchedule,
    OperatingLineControl,
    Pedals,
    Shifting,
    SpeedSchedule,
)
from powertrain.components.control.shift_rule import KickLimits
from powertrain.components.cycles import CycleSpeed, DriveCycle
from powertrain.components.electric import ElectricMachine
from powertrain.components.engines import (
    Accessories,
    AccessoryDrive,
    Engine,
    EngineCooling,
    WarmEngine,
    WillansEngine,
    pull_speeds,
)
from powertrain.components.rotational import Flange
from powertrain.components.transmissions import ManualGearbox, Shiftable
from powertrain.components.wheels import RigidWheel
from powertrain.vehicles.wheels import wheels_of


class Car(Component):
    """Partial: a vehicle on two axles whose driver follows a cycle.

    A ``PoweredAxle`` in ``front`` or ``rear`` is driven: ``LumpedAxle``, or ``DrivenAxle`` with its differential. A ``RollingAxle`` is not.
    ``transfer`` distributes the torque of the transmission between two driven axles. ``trailers`` are pulled at the rear of the body and
    brake with the driver's pedal.
    """

    cycle: CycleSpeed = CycleSpeed(cycle=DriveCycle.named("wltc"))
    driver: Pedals = Driver(k_a=1 / 4)
    transfer: TransferCase = RigidTransferCase()
    front: Axle = LumpedAxle()
    rear: Axle = RollingAxle()
    body: Body = VehicleBody()
    road: RoadProfile = RoadProfile()
    trailers: tuple[Trailer, ...] = ()
    curvature: Input = signal_input("1/m", "Curvature of the path, positive to the left", default=0.0)

    def _to_the_road(self, shaft: Flange, demand: Output, rear: Flange | None = None) -> Equations:
        """``shaft`` turns the driven axles, ``demand`` brakes both; they push the body, which loads them, on the slope of its road.

        A separate shaft ``rear`` turns the rear axle instead of the transfer case.
        The curvature, that of the input plus that of the road, is that of the rear axle's path; the steered front wheels run on larger
        circles. The load that a bend transfers between the wheels of a ``DrivenAxle`` is that of the body's height.
        Errors: ModelError if no axle is driven, if a centre differential has only one axle, or if two axles are rigidly coupled to the
        road; ParameterError if the wheels have a rolling resistance that the road load of the body already includes.
        """
        _check_axles(self, own_rear=rear is not None)
        _check_road_load(self)
        yield connect(shaft, self.transfer.input)
        if isinstance(self.front, PoweredAxle):
            yield connect(self.transfer.front, self.front.pinion)
        if isinstance(self.rear, PoweredAxle):
            yield connect(self.transfer.rear if rear is None else rear, self.rear.pinion)
        if isinstance(self.front, DrivenAxle):
            yield self.front.path.ahead == self.body.wheelbase
        for axle in self.front, self.rear:
            if isinstance(axle, DrivenAxle):
                yield axle.path.h == self.body.h
        yield connect(demand, self.front.brake, self.rear.brake)
        yield connect(self.curvature, self.road.curvature)
        yield connect(self.road.bend, self.front.curvature, self.rear.curvature)
        yield connect(self.front.axle, self.body.front)
        yield connect(self.rear.axle, self.body.rear)
        yield connect(self.body.front_load, self.front.load)
        yield connect(self.body.rear_load, self.rear.load)
        yield connect(self.body.s, self.road.s)
        yield connect(self.road.grade, self.body.grade)
        for trailer in self.trailers:
            yield connect(self.body.rear, trailer.hitch)
            yield connect(self.road.grade, trailer.grade)
            yield connect(self.driver.brake, trailer.brake)

    def _on_the_cycle(self) -> Equations:
        """The driver receives the reference speed, the acceleration ahead, and the vehicle speed."""
        yield connect(self.cycle.v_ref, self.driver.v_ref)
        yield connect(self.cycle.a_ref, self.driver.a_ref)
        yield connect(self.body.v, self.driver.v)

    def _cooled(self, engine: Engine, cooling: EngineCooling) -> Equations:
        """``engine`` heats ``cooling``, whose temperature determines its friction; the airstream of the car cools the radiator."""
        yield connect(engine.heat_port, cooling.engine)
        yield connect(cooling.warmth, engine.warmth)
        yield connect(self.body.v, cooling.v)

    def _on_its_line(self, engine: Engine, control: OperatingLineControl) -> Equations:
        """The control of a variable ratio receives the data of the ``engine`` and sets its throttle."""
        yield connect(engine.speed, control.w)
        yield control.tau_open.value == engine.full_load(engine.w)
        yield control.tau_drag.value == engine.motoring(engine.w)
        yield engine.throttle.value == engine.opening(engine.w, control.throttle.value)


class ShiftedCar(Car):
    """Partial: a car with a ``mover``, its engine or electric machine, that drives a gearbox whose gears a schedule changes."""

    schedule: Shifting = GearSchedule()
    gearbox: Shiftable = ManualGearbox()

    @property
    def mover(self) -> Engine | ElectricMachine:
        """The engine or machine that drives the gearbox."""
        raise NotImplementedError

    def pull_speeds(self) -> tuple[list[float], list[float]]:
        """For each upshift, the speed of the mover from which the next gear pulls harder, before and after the shift [rad/s].

        Empty for a gearbox that does not state its ratios.
        """
        ratios = replace(self.gearbox).gear_ratios
        before = pull_speeds(self.mover, ratios)
        return list(before), [w * other / one for w, (one, other) in zip(before, pairwise(ratios), strict=True)]

    def kick_limits(self, schedule: SpeedSchedule, gear: Symbol) -> KickLimits:
        """The speeds of the mover [rad/s] for shifts of the schedule from a gear with a pressed accelerator."""
        return schedule.kick_limits(gear, *self.pull_speeds())

    def check(self) -> Equations:
        """The gearbox has the gear of a ``FixedGear``."""
        if isinstance(self.schedule, FixedGear):
            yield self.schedule.gear <= self.gearbox.gear_count
            yield self.gearbox.has_reverse or self.schedule.gear >= 1

    def _shifted(self) -> Equations:
        """The schedule sees the drive and operates the lever."""
        _check_gears(self)
        if isinstance(self.schedule, SpeedSchedule):
            yield from self.schedule.supplied(self.kick_limits(self.schedule, self.schedule.gear))
            yield connect(self.driver.brake, self.schedule.brake)
            yield connect(self.road.grade, self.schedule.grade)
        yield connect(self.body.v, self.schedule.v)
        yield connect(self.driver.accelerator, self.schedule.accelerator)
        yield connect(self.mover.speed, self.schedule.w)
        yield connect(self.schedule.lever, self.gearbox.lever)


class GearedCar(ShiftedCar):
    """Partial: a car with one engine; a schedule shifts the gearbox and operates throttle and clutch. The engine idles at the start.

    ``cooling`` is ``WarmEngine()``, or ``CoolantCircuit()`` for a cold start.
    """

    start_stop: EngineSwitch = AlwaysOn()
    engine: Engine = WillansEngine()
    accessories: Accessories = AccessoryDrive()
    cooling: EngineCooling = WarmEngine()

    @property
    def mover(self) -> Engine:
        """The engine."""
        return self.engine

    def _by_schedule(self, clutch: Input) -> Equations:
        """The schedule operates lever, throttle and ``clutch``; ``start_stop`` decides whether the engine runs."""
        yield from self._on_the_cycle()
        yield from self._shifted()
        yield connect(self.body.v, self.start_stop.v)
        yield connect(self.driver.accelerator, self.start_stop.accelerator)
        yield connect(self.schedule.throttle, self.engine.throttle)
        yield connect(self.schedule.clutch, clutch)
        yield connect(self.start_stop.on, self.engine.on)
        yield from self._cooled(self.engine, self.cooling)

    def initial(self) -> Equations:
        """At rest, with the engine idling and the first gear engaged."""
        yield self.engine.w == self.engine.w_idle


def _check_axles(car: Car, *, own_rear: bool) -> None:
    slots = {"front": car.front, "rear": car.rear}
    said = " and ".join(f"{name} = {type(axle).__name__}" for name, axle in slots.items())
    driven = [name for name, axle in slots.items() if isinstance(axle, PoweredAxle)]
    name = type(car).__name__
    if not driven:
        raise ModelError(f"{name} drives no axle: {said}; give one of them a LumpedAxle or a DrivenAxle")
    if isinstance(car.transfer, CentreDifferential | LumpedCentreDifferential) and len(driven) < len(slots):
        raise ModelError(
            f"{name}.transfer is a centre differential, but only {driven[0]} is a driven axle: the other side would spin; "
            "give both axles a LumpedAxle or a DrivenAxle, or leave transfer as it is"
        )
    if own_rear:
        _check_own_shafts(car, driven, said)
        return
    rigid = [axle for axle in slots.values() if isinstance(axle, LumpedAxle) and isinstance(axle.wheels, RigidWheel)]
    if isinstance(car.transfer, RigidTransferCase) and len(rigid) == len(slots):
        raise ModelError(
            f"{name}: {said} have rigid wheels on a RigidTransferCase; road and transfer case both fix the speed ratio of the axles, so "
            "how they share the torque is not determined. Give transfer a CentreDifferential, or wheels that slip: a DrivenAxle, or "
            "wheels=SlipWheel()"
        )


def _check_own_shafts(car: Car, driven: list[str], said: str) -> None:
    if driven != ["front", "rear"] or not isinstance(car.transfer, RigidTransferCase):
        raise ModelError(
            f"{type(car).__name__} drives each axle from a shaft of its own: {said}, transfer = {type(car.transfer).__name__}; "
            "give both axles a LumpedAxle or a DrivenAxle, and leave transfer as it is"
        )


def _check_road_load(car: Car) -> None:
    axles = {"front": car.front, "rear": car.rear} if isinstance(car.body, CoastDownBody) else {}
    twice = [
        f"{axle}.{path}.{n} = {wheel._values[n]:g}"
        for axle, part in axles.items()
        for path, wheel in wheels_of(part)
        for n in ("Cr", "Cr_2")
        if wheel._values[n]
    ]
    if twice:
        raise ParameterError(
            f"{type(car).__name__}.body is a CoastDownBody, whose coefficients hold the rolling resistance of the tyres; it would count "
            f"twice with {' and '.join(twice)}: set {'it' if len(twice) == 1 else 'them'} to 0"
        )


def _check_gears(car: ShiftedCar) -> None:
    """ModelError if the numbers of gears in a car's schedule and gearbox differ."""
    schedule, gearbox = car.schedule, car.gearbox
    if isinstance(schedule, SpeedSchedule) and len(schedule.speeds) + 1 != gearbox.gear_count:
        raise ModelError(
            f"{type(car).__name__}.schedule has {len(schedule.speeds)} rows of shift speeds, for {len(schedule.speeds) + 1} gears, "
            f"but gearbox ({type(gearbox).__name__}) has {gearbox.gear_count}; give schedule.speeds a row for every "
            f"shift, or let {type(schedule).__name__}.for_gears(ratios, final_drive) compute them"
        )
