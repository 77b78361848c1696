"""A measured car as a vehicle of the library, from what the test-car list and its technology say."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import powertrain as pt
from powertrain.components.body import CoastDownBody, LumpedAxle, RollingAxle
from powertrain.components.body.body import G_N
from powertrain.components.common_units import MPH, RPM
from powertrain.components.control import (
    AlwaysOn,
    Driver,
    ElectricDriveControl,
    EngineSwitch,
    GearSchedule,
    OperatingLineControl,
    PowerShiftSchedule,
    StartStop,
)
from powertrain.components.cvu import CVU, RatioActuator
from powertrain.components.differentials import ChurningLoss, CrownGear
from powertrain.components.electric import AccessoryLoad, ElectricMachine, PolarizedBattery, cells_in_series
from powertrain.components.engines import AccessoryDrive, BufferedAccessories, WillansEngine
from powertrain.components.rotational import Clutch, IdealGear, Inertia, TwoFlanges
from powertrain.components.transmissions import (
    ManualGearbox,
    NeutralIdleConverter,
    PowerShiftGearbox,
    ShiftedGears,
    SingleGear,
    StartingClutch,
    StartingConverter,
    StartingDevice,
    TorqueConverter,
)
from powertrain.components.wheels import RigidWheel, SlipWheel
from powertrain.measured.record import SPREAD, TestCar
from powertrain.measured.technology import BELT_SPREAD, ROTATING, Technology, rated_speed, stops
from powertrain.vehicles.automatic_car import AutomaticCar
from powertrain.vehicles.electric_car import BATTERY, ElectricCar
from powertrain.vehicles.manual_car import ManualCar
from powertrain.vehicles.power_split_hybrid import PowerSplitHybrid
from powertrain.vehicles.variator_car import VariatorCar

RADIUS = 0.32
"""Rolling radius [m]: it cancels, as the list has engine speed over vehicle speed."""
PROGRESSION, PROGRESSION_MANUAL = 1.05, 1.1
"""Factor by which the step between two gears grows from the top gear down: 1.0 to 1.2, H. Naunheimer et al., Automotive Transmissions,
2nd ed., 4.2. Manual gearboxes have few gears and take the middle of that range."""
MANUAL = 15 * MPH, 25 * MPH, 40 * MPH, 45 * MPH, 50 * MPH, 55 * MPH
"""Speeds [m/s] at which a manual gearbox is shifted up, 40 CFR 86.128-79."""
DOWN = 0.82
"""Speed of shifting down over that of shifting up."""
W_OPEN, W_CLOSED = 80.0, 200.0
"""Speeds of the engine [rad/s] from which a start clutch presses, and at which it presses fully."""
LAUNCH = 3200 * RPM - (W_OPEN + W_CLOSED) / 2
"""Rise of these speeds with the accelerator fully pressed: the clutch, which can hold twice the largest torque, then slips at 3,200 rpm."""
CUT = 0.5
"""Part of the torque taken back in an upshift under load: at full load, about what the slowing engine adds."""
MU, STIFFNESS = 1.0, 20.0
"""Grip of a tyre on dry asphalt, and its slip stiffness over the load, H. B. Pacejka, Tire and Vehicle Dynamics, 3rd ed., 4.3."""
FRONT_SHARE = {"F": 0.6, "R": 0.5}
"""Part of the weight on the front axle of a front-wheel and a rear-wheel drive."""
W_DRAG = 150.0
"""Speed [rad/s] at which a gearbox's drag is given."""
SPLIT_POWER, SPLIT_RING = 71.6e3, 10.3
"""Rated power [W] of the Prius's engine, to which its machines are in proportion, and ring speed over vehicle speed [rad/m]: third
generation, ring to wheels 3.267, tyre 0.317 m."""
ELECTRIC_POWER, W_MACHINE = 150e3, 1700.0
"""Rated power [W] to which the electric car's battery belongs, and top speed [rad/s] of its machines."""
W_STALL = 2300 * RPM
"""Speed of the engine under full load against a standing turbine, to which converters are sized."""


def build(car: TestCar, technology: Technology, *, cool: bool = False) -> Any:
    """The vehicle. ``cool``: engine and gearbox have run, but not to their steady temperature, as in the bags of the FTP.

    Road load, test mass, displacement, rated power, number of gears and overall top ratio are the list's, everything else the technology's.
    """
    makers = {
        "electric": _electric,
        "power split": _split,
        "manual": _manual,
        "automatic": _stepped,
        "dual clutch": _stepped,
        "belt": _belt,
    }
    return makers[car.transmission](car, technology, cool)


def _common(car: TestCar, technology: Technology, cool: bool) -> dict[str, Any]:
    return {
        "engine": technology.engine(car, cool=cool),
        "accessories": (BufferedAccessories if stops(car) else AccessoryDrive)(P=technology.accessories),
        "driver": Driver(k_a=car.mass / _force(car), hold=0.3),
        "body": _body(car),
        **_axles(car, IdealGear(ratio=car.axle_ratio)),
    }


def _axles(car: TestCar, final_drive: TwoFlanges) -> dict[str, Any]:
    """The driven axle, with the inertia of all that turns with the wheels, and the other; rolling resistance is part of the road load.

    Four driven wheels are one axle, which carries the whole weight.
    """
    load = car.mass * G_N * (1 - _front_share(car) if car.drive == "R" else _front_share(car))
    tyres = SlipWheel(J=ROTATING * car.mass * RADIUS**2, radius=RADIUS, Cr=0, mu=MU, C=STIFFNESS * load)
    driven = LumpedAxle(final_drive=final_drive, wheels=tyres)
    rolling = RollingAxle(wheels=RigidWheel(J=0, radius=RADIUS, Cr=0))
    return {"front": rolling, "rear": driven} if car.drive == "R" else {"front": driven, "rear": rolling}


def _front_share(car: TestCar) -> float:
    return FRONT_SHARE.get(car.drive, 1.0)


def _body(car: TestCar) -> CoastDownBody:
    F_0, F_1, F_2 = car.road_load
    body = CoastDownBody(m=car.mass, F_0=F_0, F_1=F_1, F_2=F_2, front_share=_front_share(car))
    return body if car.drive in FRONT_SHARE else pt.replace(body, h=0.0)


def _force(car: TestCar) -> float:
    """The force [N] that a full accelerator gives at 12 m/s, about."""
    return 0.6 * car.power / 12.0


def _switch(car: TestCar, technology: Technology) -> EngineSwitch:
    return StartStop(delay=technology.stop_delay) if stops(car) else AlwaysOn()


def _drag(car: TestCar, technology: Technology, cool: bool) -> ChurningLoss:
    return ChurningLoss(d=technology.gearbox(car, cool=cool)[1] / W_DRAG)


def ratios(car: TestCar) -> tuple[float, ...]:
    """Ratios of the gears, first gear first: geometric with progressive steps, by number and spread, down from the list's top gear."""
    top, n, growth = car.w_per_v * RADIUS / car.axle_ratio, car.gears, progression(car)
    steps = n - 1
    step = (SPREAD[n] / growth ** (steps * (steps - 1) / 2)) ** (1 / steps)
    return tuple(top * step**k * growth ** (k * (k - 1) / 2) for k in range(steps, -1, -1))


def progression(car: TestCar) -> float:
    """Factor by which its gear steps grow."""
    return PROGRESSION_MANUAL if car.transmission == "manual" else PROGRESSION


def _clutch(engine: WillansEngine) -> Clutch:
    return Clutch(fn_max=2 * _most(engine), mue_pos=((0.0, 1.0),))


def _most(engine: WillansEngine) -> float:
    assert engine.curve is not None
    return float(engine.curve.values.max())


def _converter(engine: WillansEngine) -> StartingDevice:
    """The default converter, whose K factor is scaled so that full load stalls it at ``W_STALL``, with a clutch that opens at rest."""
    at_stall, most = float(engine.full_load(W_STALL)), _most(engine)
    converter = StartingConverter(converter=TorqueConverter.of_stall(W_STALL, at_stall, tau_max=1.5 * most))
    return NeutralIdleConverter(converter=converter, clutch=Clutch(fn_max=3 * most, mue_pos=((0.0, 1.0),)))


def _manual(car: TestCar, technology: Technology, cool: bool) -> ManualCar:
    parts, gears = _common(car, technology, cool), ratios(car)
    ups = [v * technology.schedule for v in MANUAL[: len(gears) - 1]]
    rows, rated = tuple((up, DOWN * up) for up in ups), rated_speed(car)
    full = min(rated * RADIUS / (i * car.axle_ratio) / up for i, up in zip(gears, ups, strict=False))
    box = ManualGearbox.of_ratios(*gears)
    eta = technology.gearbox(car)[0]
    parts |= _axles(car, CrownGear(ratio=car.axle_ratio, eta_ab=eta, eta_ba=eta))
    schedule = GearSchedule(
        speeds=rows,
        eager=max(full - 1, 0.3),
        relaxed=0.6,
        kick=0.95,
        launch=LAUNCH,
        w_open=W_OPEN,
        w_closed=W_CLOSED,
    )
    return ManualCar(
        schedule=schedule,
        clutch=_clutch(parts["engine"]),
        gearbox=pt.replace(box, churning=_drag(car, technology, cool)),
        start_stop=_switch(car, technology),
        **parts,
    )


def _stepped(car: TestCar, technology: Technology, cool: bool) -> AutomaticCar:
    parts, gears = _common(car, technology, cool), ratios(car)
    low, eta = technology.n_stepped * RPM, technology.gearbox(car)[0]
    ups = [low * RADIUS / (i * car.axle_ratio) for i in gears[1:]]
    rows, rated = tuple((up, DOWN * up) for up in ups), rated_speed(car)
    full = min(rated / (low * i / j) for i, j in pairwise(gears))
    relaxed = min(technology.preferred(car), 0.9)
    schedule = PowerShiftSchedule(
        speeds=rows,
        eager=full - 1,
        relaxed=relaxed,
        kick=0.9,
        dwell=1.0,
        launch=LAUNCH,
        cut=CUT,
        w_open=W_OPEN,
        w_closed=W_CLOSED,
    )
    unit = ShiftedGears(eta_ab=eta, eta_ba=eta)
    engine = parts["engine"]
    start = StartingClutch(clutch=_clutch(engine)) if car.transmission == "dual clutch" else _converter(engine)
    return AutomaticCar(
        schedule=schedule,
        start=start,
        gearbox=PowerShiftGearbox(ratios=gears, unit=unit, churning=_drag(car, technology, cool)),
        start_stop=_switch(car, technology),
        **parts,
    )


def _belt(car: TestCar, technology: Technology, cool: bool) -> VariatorCar:
    parts, eta = _common(car, technology, cool), technology.gearbox(car)[0]
    high = car.axle_ratio / (car.w_per_v * RADIUS)
    low = high / BELT_SPREAD
    share = min(technology.preferred(car), 0.95)
    force = _force(car)
    return VariatorCar(
        share=share,
        w_least=technology.n_belt * RPM,
        control=OperatingLineControl(F_max=force, ratio_min=low, ratio_max=high, w_open=W_OPEN, w_closed=W_CLOSED),
        actuator=RatioActuator(T=0.2, rate=1.0, ratio_min=low, ratio_max=high, ratio_start=low),
        unit=CVU(eta_ab=eta, eta_ba=eta),
        churning=_drag(car, technology, cool),
        start=_converter(parts["engine"]),
        start_stop=_switch(car, technology),
        shaft=Inertia(J=0.03),
        **parts,
    )


def _split(car: TestCar, technology: Technology, cool: bool) -> PowerSplitHybrid:
    """The layout of the Prius, its machines and battery in proportion to the engine's power."""
    parts = _common(car, technology, cool)
    parts.pop("accessories")
    size, whole = car.power / SPLIT_POWER, PowerSplitHybrid()
    ring = SPLIT_RING * RADIUS
    eta = technology.gearbox(car)[0]
    return pt.replace(
        whole,
        {
            **{name: parts[name] for name in ("driver", "body")},
            "engine": pt.replace(parts["engine"], tau_starter=0.0),
            "machine_1": _machine(45e3 * size, 60 * size, 1250.0, geared=False),
            "machine_2": _machine(53e3 * size, 163 * 3.1 * size, 560.0, geared=True),
            "battery": _parallel(PolarizedBattery(R=0.2, Q=3.6 * 3600 * 1.6, ocv=cells_in_series(56)), size),
            "accessories": AccessoryLoad(P=0.75 * technology.accessories),
            **_axles(car, CrownGear(ratio=ring, eta_ab=eta, eta_ba=eta)),
            "control.tau_full": 163 * 3.1 * size,
        },
    )


def _electric(car: TestCar, technology: Technology, cool: bool) -> ElectricCar:
    """One machine of the rated power, and the battery in proportion to it.

    The drag of the gears counts in the road load, as they
    turn when the car coasts; so ``cool`` makes no difference.
    """
    eta = technology.gearbox(car)[0]
    size, ratio = car.power / ELECTRIC_POWER, car.w_per_v * RADIUS
    return ElectricCar(
        driver=Driver(k_a=car.mass / _force(car), hold=0.3),
        control=ElectricDriveControl(F_brake=4500 / RADIUS, F_most=0.3 * car.mass * G_N),
        body=_body(car),
        **_axles(car, CrownGear(ratio=1.0, eta_ab=eta, eta_ba=eta)),
        machine=_machine(car.power, car.power / (0.35 * W_MACHINE), W_MACHINE, geared=True),
        battery=_parallel(BATTERY, size),
        gearbox=SingleGear(gear=IdealGear(ratio=ratio), churning=ChurningLoss()),
        accessories=AccessoryLoad(P=0.75 * technology.accessories),
    )


def _parallel(battery: PolarizedBattery, size: float) -> PolarizedBattery:
    """The battery with ``size`` times as many cells in parallel."""
    more = {name: size * float(getattr(battery, name)) for name in ("Q", "i_discharge", "i_charge")}
    return pt.replace(battery, {**more, "R": float(battery.R) / size})


def _machine(power: float, torque: float, w_max: float, *, geared: bool) -> ElectricMachine:
    """A permanent-magnet machine with its inverter, by rated power [W], largest torque [N.m] and top speed [rad/s].

    The inverter and its cooling take 100 W and 0.07 % of the rated power. Of this it loses 6 % in its copper at full torque and, at top
    speed, 1 % in its iron and 0.5 % by windage. If the machine is permanently ``geared`` to the wheels, the last two are part of the
    road load, as it turns with them when the vehicle coasts.
    """
    return ElectricMachine(
        P_max=power,
        tau_max=torque,
        w_max=w_max,
        J=0.03,
        P_0=100 + 0.0007 * power,
        copper=0.06 * power / torque**2,
        iron=0.0 if geared else 0.01 * power / w_max,
        windage=0.0 if geared else 0.005 * power / w_max**2,
    )
