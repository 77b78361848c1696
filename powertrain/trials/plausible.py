"""Values of a vehicle that are possible but likely to be a mistake: another unit, a diameter for a radius, a weak clutch."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

import powertrain as pt
from powertrain.components.body import AxlePath, CoastDownBody, DrivenAxle, LumpedAxle, Trailer
from powertrain.components.body.body import G_N
from powertrain.components.common_units import KWH, RPM
from powertrain.components.control import BlendedBraking, SpeedSchedule
from powertrain.components.rotational import Clutch
from powertrain.components.transmissions import (
    DualClutchGearbox,
    ManualGearbox,
    NeutralIdleConverter,
    PowerShiftGearbox,
    StartingConverter,
    StartingGearbox,
    SynchronisedGearbox,
)
from powertrain.components.wheels import WheelBrake
from powertrain.language.component import children, descendants
from powertrain.trials.anatomy import Anatomy, anatomy, value_at
from powertrain.trials.stray import strays
from powertrain.vehicles.wheels import wheels_of

USUAL: dict[str, tuple[float, float, str]] = {
    "radius": (0.15, 0.6, "it is the radius of the wheel"),
    "m": (200.0, 60e3, "it is the mass in kg"),
    "wheelbase": (1.0, 12.0, "it is the distance of the axles"),
    "h": (0.0, 3.0, "it is the height of the centre of mass"),
    "track": (0.5, 3.0, "it is the distance of the wheels of an axle"),
    "A": (0.4, 12.0, "it is the frontal area"),
    "Cd": (0.1, 1.2, "it is the drag coefficient"),
    "w_idle": (30.0, 200.0, 'it is the idle speed, written in rpm as "800 rpm"'),
    "heating_value": (10e6, 130e6, 'it is the heating value of the fuel, written as "43 MJ/kg"'),
    "fuel_density": (50.0, 1200.0, 'it is the density of the fuel, written as "0.745 kg/l"'),
    "co2_per_fuel": (0.0, 4.0, "it is the mass of carbon dioxide per mass of fuel"),
}
"""Usual values of wheels, axles, bodies and engines of road vehicles, in the unit of the parameter, with its description."""
ROLLING = 0.003, 0.04
"""Usual road load near standstill, relative to the weight: rolling resistance of tyres and drag of bearings and brakes."""
POWER = 5.0, 1000.0
"""Largest power over mass [W/kg]."""
STORED = 0.2
"""Energy [kW.h] of the battery of a vehicle without engine."""
WEAK = 0.1
"""Largest power of a battery over that of the machines it supplies."""
BEYOND = 5.0
"""Last speed or torque of a table of losses over the limit of its machine."""
LOST = 0.001
"""Loss of a machine at its largest torque and power, relative to that power; machines and their inverters lose more."""
CRUISE, TURNS = 100 / 3.6, (900.0, 5500.0)
"""A speed [m/s], and speeds [rpm] that the engine of a car has there in top gear."""
PEAK = 0.9
"""Least usual speed of an engine's limiter over that of its largest power."""
REVS = 1.5
"""Speed of an engine's limiter over that of its largest power; the full-load curve beyond it is extrapolated."""
MACHINE, SHIFT = 3000.0, 40.0
"""Speed of a machine [rad/s], and of a car that shifts up with the accelerator released [m/s]; usual ones are below."""
BEST = 0.2, 0.55
"""Usual efficiency of an engine at its best operating point."""
BRAKING = 3.0
"""Deceleration with the brakes fully pressed [m/s2]; the regulations demand 5."""
BLENDED = 0.75, 1.33
"""Force of the brakes over the one that the control of blended braking assumes."""
GEARBOXES = ManualGearbox, SynchronisedGearbox, DualClutchGearbox, PowerShiftGearbox
SPEEDS = 200


def notes(vehicle: pt.Component) -> tuple[str, ...]:
    """Likely mistakes in the values of a vehicle; empty if there are none.

    All these values are possible: a value without meaning is rejected when it is given.
    """
    parts = anatomy(vehicle)
    bodies = [(path, value_at(vehicle, path)) for name, path in parts.one if name == "body"]
    paths = [(path, part) for path, part in descendants(vehicle) if isinstance(part, AxlePath)]
    trailers = [(f"{path}.body", value_at(vehicle, path).body) for path in parts.trailers]
    engines = [(path, value_at(vehicle, path)) for path in parts.engines]
    return (
        *_unusual([*wheels_of(vehicle), *paths, *bodies, *trailers, *engines]),
        *_loaded_twice(vehicle),
        *(text for path, body in bodies if isinstance(body, CoastDownBody) for text in _road_load(path, body)),
        *(text for path, body in bodies for text in _power(vehicle, parts, path, body)),
        *(text for path, body in bodies for text in _brakes(vehicle, path, body, [body for _, body in trailers])),
        *(text for path in parts.engines for text in _limiter(vehicle, path)),
        *(text for path in parts.engines for text in _economy(vehicle, path)),
        *_speeds(vehicle, parts),
        *_stored(vehicle, parts),
        *_resistances(vehicle, parts),
        *(text for path in parts.machines for text in _losses(path, value_at(vehicle, path))),
        *_clutches(vehicle, parts),
        *_standing(vehicle, parts),
        *_synchronisers(vehicle, parts),
        *_overall_ratio(vehicle, parts),
        *strays(vehicle),
    )


def _number(part: pt.Component, name: str) -> float | None:
    value = part._values.get(name)
    return float(value) if isinstance(value, (int, float)) else None


def _unusual(parts: list[tuple[str, Any]]) -> Iterator[str]:
    for path, part in parts:
        for name, (low, high, what) in USUAL.items():
            value, spec = _number(part, name), part._fields.get(name)
            if value is not None and isinstance(spec, pt.Parameter) and not low <= value <= high:
                unit = "" if spec.unit == "1" else f" {spec.unit}"
                yield f"{path}.{name} = {value:g}{unit} is unusual ({low:g} to {high:g}{unit}); {what}"


def _loaded_twice(vehicle: pt.Component) -> Iterator[str]:
    """Wheels with a load of their own under a body."""
    for path, wheel in wheels_of(vehicle):
        if load := _number(wheel, "load_nominal"):
            yield f"{path}.load_nominal = {load:g} N adds to the load from the body; it is that of a wheel without a body"


def _road_load(path: str, body: CoastDownBody) -> Iterator[str]:
    m, F_0 = _number(body, "m"), _number(body, "F_0")
    if m and F_0 is not None and not ROLLING[0] <= F_0 / (m * G_N) <= ROLLING[1]:
        yield (
            f"{path}.F_0 = {F_0:g} N is {F_0 / (m * G_N):.2%} of the weight, which is unusual ({ROLLING[0]:.1%} to {ROLLING[1]:.0%}); "
            'the unit is N: coefficients in pounds are written as "26 lbf", "0.25 lbf/mph", "0.0185 lbf/mph2"'
        )


def _power(vehicle: pt.Component, parts: Anatomy, path: str, body: Any) -> Iterator[str]:
    m, most = _number(body, "m"), sum(_most(vehicle, engine)[1] for engine in parts.engines)
    most += sum(_number(value_at(vehicle, machine), "P_max") or 0.0 for machine in parts.machines)
    if m and most and not POWER[0] <= most / m <= POWER[1]:
        movers = " and ".join(parts.prime_movers)
        yield f"{movers}: {most:.4g} W for {path}.m = {m:g} kg is unusual ({POWER[0]:g} to {POWER[1]:g} W/kg); powers are in W"


def _economy(vehicle: pt.Component, path: str) -> Iterator[str]:
    """An engine that takes much more or less fuel than others, such as one with its fuel in another unit."""
    engine = value_at(vehicle, path)
    low, high, heating_value = (_number(engine, name) for name in ("w_idle", "w_limit", "heating_value"))
    if low is None or high is None or heating_value is None:
        return
    w, share = np.linspace(low, high, SPEEDS), np.linspace(0.1, 1, SPEEDS)[:, None]
    specific = float(np.min(engine.bsfc(w, share * engine.full_load(w))))
    if not BEST[0] <= 1 / (specific * heating_value) <= BEST[1]:
        yield (
            f"{path} takes {specific * 3.6e9:.4g} g/kWh at best, an efficiency of {1 / (specific * heating_value):.3g}, which is unusual "
            f"({BEST[0]:g} to {BEST[1]:g}); check the unit of the fuel and {path}.heating_value = {heating_value:g} J/kg"
        )


def _most(vehicle: pt.Component, path: str) -> tuple[float, float]:
    """The largest torque [N.m] and power [W] of an engine up to its limiter."""
    engine = value_at(vehicle, path)
    low, high = _number(engine, "w_idle"), _number(engine, "w_limit")
    if low is None or high is None:
        return 0.0, 0.0
    w = np.linspace(low, high, SPEEDS)
    torque = np.asarray(engine.full_load(w), float)
    return float(torque.max()), float((w * torque).max())


def _limiter(vehicle: pt.Component, path: str) -> Iterator[str]:
    """An engine whose limiter and speed of the largest power do not fit together."""
    engine = value_at(vehicle, path)
    P_max, w_P, w_limit = (_number(engine, name) for name in ("P_max", "w_P", "w_limit"))
    if not (P_max and w_P and w_limit) or engine.curve is not None:
        return
    if w_limit < PEAK * w_P:
        yield (
            f"{path} does not reach {path}.P_max = {P_max:g} W at {path}.w_P = {w_P:g} rad/s: its limiter is at {path}.w_limit = "
            f'{w_limit:g} rad/s; speeds with another unit are written as "5500 rpm"'
        )
    elif w_limit > REVS * w_P:
        yield (
            f"{path} revs up to {path}.w_limit = {w_limit:g} rad/s, {w_limit / w_P:.3g} times the speed of its largest power, {path}.w_P = "
            f"{w_P:g} rad/s; set {path}.w_limit to the speed of its governor"
        )


def _speeds(vehicle: pt.Component, parts: Anatomy) -> Iterator[str]:
    """Speeds of machines and of upshifts that look like numbers in rpm and km/h."""
    for path in parts.machines:
        w_max = _number(value_at(vehicle, path), "w_max")
        if w_max and w_max > MACHINE:
            yield f'{path}.w_max = {w_max:g} rad/s is unusual (up to {MACHINE:g} rad/s); speeds in rpm are written as "15000 rpm"'
    for name, schedule in children(vehicle):
        if isinstance(schedule, SpeedSchedule) and (up := schedule.speeds[-1][0]) > SHIFT:
            yield (
                f"{name}.speeds: the last upshift at {up:g} m/s is unusual (up to {SHIFT:g} m/s); "
                'speeds in km/h are written as "75 km/h"'
            )


def _brakes(vehicle: pt.Component, path: str, body: Any, trailers: Sequence[Any]) -> Iterator[str]:
    """Brakes that are too weak for the mass, such as those of a car on a truck, or not those that the control counts on."""
    m, towed = _number(body, "m"), sum(_number(each, "m") or 0.0 for each in trailers)
    parts = [part for _, part in children(vehicle)]
    force = sum(_brake_force(part) for part in parts if not isinstance(part, Trailer))
    most = force + sum(_brake_force(part) for part in parts if isinstance(part, Trailer))
    if m and 0 < most < BRAKING * (m + towed):
        mass = f"{path}.m = {m:g} kg" + (f" and trailers of {towed:g} kg" if towed else "")
        yield (
            f"the brakes decelerate {mass} with {most / (m + towed):.2g} m/s2 at most, which is little; "
            "this is their tau_max over the radius of the wheels and the mass"
        )
    for name, control in children(vehicle):
        F_brake = _number(control, "F_brake") if isinstance(control, BlendedBraking) else None
        if F_brake and force and not BLENDED[0] <= force / F_brake <= BLENDED[1]:
            yield (
                f"{name}.F_brake = {F_brake:.4g} N, but the brakes give {force:.4g} N with the pedal fully pressed (tau_max over the "
                "radius of the wheels): with regeneration the vehicle would brake differently than without"
            )


def _brake_force(axle: pt.Component) -> float:
    """The force of the brakes of an axle [N] with the pedal fully pressed."""
    torque = sum(_number(part, "tau_max") or 0.0 for _, part in descendants(axle) if isinstance(part, WheelBrake))
    radius = next((_number(wheel, "radius") for _, wheel in wheels_of(axle)), None)
    return torque / radius if radius else 0.0


def _stored(vehicle: pt.Component, parts: Anatomy) -> Iterator[str]:
    for path in parts.batteries if not parts.engines else ():
        energy = value_at(vehicle, path).full_energy() / KWH
        if energy < STORED:
            yield f'{path} holds {1e3 * energy:.3g} W.h when full, little for a vehicle; {path}.Q is in A.s: write "60 A.h"'


def _resistances(vehicle: pt.Component, parts: Anatomy) -> Iterator[str]:
    """Batteries whose largest power, that at half the voltage, is far below that of their machines."""
    machines = sum(_number(value_at(vehicle, path), "P_max") or 0.0 for path in parts.machines)
    for path in parts.batteries:
        battery = value_at(vehicle, path)
        R = _number(battery, "R")
        if R and (most := float(battery.ocv.values.max()) ** 2 / (4 * R)) < WEAK * machines:
            yield (
                f"{path} gives {most:.3g} W at most with {path}.R = {R:g} Ohm, little for machines of {machines:.4g} W; a resistance in "
                'milliohms is written as "60 mOhm"'
            )


def _losses(path: str, machine: Any) -> Iterator[str]:
    """Tables of losses in other units."""
    yield from list(_far_table(path, machine)) or _small_loss(path, machine)


def _far_table(path: str, machine: Any) -> Iterator[str]:
    """A table of losses far beyond the limits of its machine, of which a corner alone would be used."""
    axes = machine.loss_map.axes if machine.loss_map is not None else ()
    for axis, limit in zip(axes, ("w_max", "tau_max"), strict=False):
        most = _number(machine, limit)
        if most and axis.high > BEYOND * most:
            yield (
                f"{path}.loss_map reaches {axis.high:.4g} {axis.unit}, far beyond {path}.{limit} = {most:.4g} {axis.unit}; "
                f"check the unit of its {axis.name}"
            )


def _small_loss(path: str, machine: Any) -> Iterator[str]:
    """A table of losses in kilowatts: next to nothing is lost at the largest torque and power."""
    P_max, tau_max, table = _number(machine, "P_max"), _number(machine, "tau_max"), machine.loss_map
    if not (P_max and tau_max) or table is None or table.unit != "W" or len(table.axes) != 2:
        return
    w, tau = (
        float(np.clip(x, axis.low, axis.high)) for x, axis in zip((P_max / tau_max, tau_max), table.axes, strict=True)
    )
    loss = float(table(w, tau))
    if loss < LOST * P_max:
        yield (
            f"{path}.loss_map gives {loss:.3g} W at {w:.4g} rad/s and {tau:.4g} N.m, less than {LOST:.1%} of {path}.P_max = {P_max:.4g} W; "
            "losses are in W: the column of a file in kilowatts is headed loss [kW]"
        )


def _clutches(vehicle: pt.Component, parts: Anatomy) -> Iterator[str]:
    """Clutches between the engine and the gears that slip at full load although they are fully pressed."""
    if len(parts.engines) != 1:
        return
    torque = _most(vehicle, parts.engines[0])[0]
    inside = [
        (f"{name}.", part)
        for name, part in children(vehicle)
        if isinstance(part, StartingGearbox | NeutralIdleConverter)
    ]
    for prefix, whole in [("", vehicle), *inside]:
        raised = whole.converter.converter.table[0][2] if isinstance(whole, NeutralIdleConverter) else 1.0
        times = f", which the converter multiplies by {raised:g} at stall" if raised != 1 else ""
        for name, part in children(whole):
            if isinstance(part, StartingConverter) and (lock := _number(part.converter, "tau_max")) and lock < torque:
                yield (
                    f"the lock-up clutch of {prefix}{name}.converter slips at full load: it holds {lock:.4g} N.m, "
                    f"{parts.engines[0]} gives up to {torque:.4g} N.m; TorqueConverter.of_stall(w, tau) makes a converter for an engine"
                )
            if type(part) is not Clutch:
                continue
            fn_max, cgeo, peak = (_number(part, field) for field in ("fn_max", "cgeo", "peak"))
            if fn_max and cgeo and peak and (holds := peak * fn_max * cgeo * part.mue_pos[0][1]) < raised * torque:
                yield (
                    f"{prefix}{name} slips at full load: it holds {holds:.4g} N.m, {parts.engines[0]} gives up to {torque:.4g} N.m{times}; "
                    f"{prefix}{name}.fn_max = {fn_max * raised * torque / holds:.4g} N would hold them"
                )


def _standing(vehicle: pt.Component, parts: Anatomy) -> Iterator[str]:
    """A clutch that the control presses while the engine idles, so that it drags while the vehicle stands."""
    converters = StartingConverter | NeutralIdleConverter
    if len(parts.engines) != 1 or any(isinstance(part, converters) for _, part in children(vehicle)):
        return
    idle = _number(value_at(vehicle, parts.engines[0]), "w_idle")
    for name, part in children(vehicle):
        w_open = _number(part, "w_open")
        if idle and w_open and w_open < idle:
            yield (
                f"{name}.w_open = {w_open:g} rad/s is below the idle speed {parts.engines[0]}.w_idle = {idle:g} rad/s: the clutch drags "
                f"while the vehicle stands; give {name} a w_open above it, and a w_closed above that"
            )


def _synchronisers(vehicle: pt.Component, parts: Anatomy) -> Iterator[str]:
    """The first synchroniser whose dogs slide at full load."""
    gearbox = dict(children(vehicle)).get("gearbox")
    if len(parts.engines) != 1 or not isinstance(gearbox, ManualGearbox | DualClutchGearbox):
        return
    torque = _most(vehicle, parts.engines[0])[0]
    for k, (gear, dogs) in enumerate(zip(gearbox.gears, gearbox.synchronisers, strict=False)):  # compile counts them
        ratio, fn_max, cgeo, peak = _number(gear, "ratio"), *(_number(dogs, n) for n in ("fn_max", "cgeo", "peak"))
        if not (ratio and fn_max and cgeo and peak):
            continue
        holds, needed = peak * fn_max * cgeo * dogs.mue_pos[0][1], torque * abs(ratio)
        if holds < needed:
            where = f"gearbox.synchronisers[{k}]"
            yield (
                f"{where} slides at full load: its dogs hold {holds:.4g} N.m, {parts.engines[0]} gives up to {needed:.4g} N.m "
                f"in gear {k + 1}; {where}.fn_max = {fn_max * needed / holds:.4g} N would hold them"
            )
            return


def _overall_ratio(vehicle: pt.Component, parts: Anatomy) -> Iterator[str]:
    """The speed of the engine in top gear: the ratios of gearbox and axle, and the radius of the wheels, fit together."""
    places = dict(children(vehicle))
    gearbox, axles = (
        places.get("gearbox"),
        [(n, a) for n, a in places.items() if isinstance(a, LumpedAxle | DrivenAxle)],
    )
    if len(parts.engines) != 1 or not isinstance(gearbox, GEARBOXES) or not axles:
        return
    name, axle = axles[0]
    top = gearbox.ratios[-1] if isinstance(gearbox, PowerShiftGearbox) else _number(gearbox.gears[-1], "ratio")
    drive, radius = _number(axle.final_drive, "ratio"), _number(next(wheels_of(axle))[1], "radius")
    if not (top and drive and radius):
        return
    turns = CRUISE / radius * top * drive / RPM
    if not TURNS[0] <= turns <= TURNS[1]:
        yield (
            f"in top gear at {CRUISE * 3.6:.0f} km/h {parts.engines[0]} turns at {turns:.0f} rpm, unusual ({TURNS[0]:.0f} to "
            f"{TURNS[1]:.0f} rpm): the ratio of the gear is {top:g}, of {name}.final_drive {drive:g}, the radius of its wheels {radius:g} m"
        )
