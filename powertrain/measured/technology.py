"""What cars of one technology have in common: data of engine families, gearboxes and control, none of a single car."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import Any

from powertrain import Map
from powertrain.components.common_units import RPM
from powertrain.components.engines import WillansEngine
from powertrain.measured.record import TestCar

BAR = 1e5
NATURAL = ((0.15, 0.80), (0.35, 0.98), (0.65, 1.10), (0.85, 1.08), (1.0, 1.0), (1.12, 0.80))
CHARGED = ((0.15, 0.55), (0.20, 0.70), (0.32, 1.25), (0.75, 1.25), (1.0, 1.0), (1.12, 0.75))
"""Full load of naturally aspirated and of turbocharged engines: speed over rated speed, torque over torque at the rated power."""
BELT_SPREAD = 6.5
ROTATING = 0.015
"""What turns with the wheels of an axle, as a part of the test mass: 40 CFR 1066.310, 1.5 %."""
W_IDLE = 720 * RPM
P_2 = 0.6 * BAR
"""Rise of friction and pumping at 400 rad/s, L. Guzzella, A. Sciarretta, Vehicle Propulsion Systems, 3rd ed., section 3.1."""
INERTIA = 80.0
"""Moment of inertia of an engine with its flywheel over displacement [kg.m2/m3]."""
CHARGED_FROM = 72e6
"""Rated power over displacement [W/m3] from which an engine is taken to be turbocharged."""
CHARGED_AT = 85e6
"""Rated power over displacement [W/m3] at which ``p_0_turbo`` is the friction: bearings, rings and valve train are sized for the load."""
RATED_PRESSURE = 11.4 * BAR
"""Mean effective pressure at the rated power of engines of high output without a turbocharger, 120 P/(V n) with n in rpm: Mazda's 2.0 l
(135 kW at 7,000 rpm) has 11.6 bar, Toyota's 2.0 l (126 kW at 6,600 rpm) 11.5 bar, Mazda's 2.5 l (139 kW at 6,000 rpm) 11.2 bar.
"""
FAMILIES = {
    ("Mazda", 2.0): "high compression",
    ("Mazda", 2.5): "high compression",
    ("Toyota", 2.0): "late closing",
    ("Toyota", 2.5): "late closing",
    ("Lexus", 2.0): "late closing",
    ("Lexus", 2.5): "late closing",
}
"""Engines of model year 2022 by maker and displacement [l]: compression ratio 13 (Skyactiv-G); and with late closing of the intake
valves and cooled exhaust gas recirculation beside it (Dynamic Force). All others that breathe naturally are of the older kind, 10 to 11."""
STOPPING = frozenset(
    "Acura Alfa Audi Bmw Buick Cadillac Chevrolet Ford Gmc Honda Jaguar Jeep Land Lincoln Mercedes-Benz Mini Porsche Subaru Toyota "
    "Volkswagen Volvo".split()
)
"""Makers most of whose automatics of model year 2022 stop the engine at rest."""


def shared(value: float, mean: float, sd: float, unit: str, doc: str) -> Any:
    """A number that cars share: fitted value, and what was known of it before, as mean and standard deviation."""
    return field(default=value, metadata={"mean": mean, "sd": sd, "unit": unit, "doc": doc})


@dataclass(frozen=True)
class Technology:
    """The numbers with which every car is built, in the unit of their ``metadata``; ``mean`` and ``sd`` are what the literature says.

    An engine's fuel power is (tau + V/(4 pi) (p_0 + p_2 (w/400)^2)) w/e + heat V.
    """

    e_port: float = shared(
        0.4219, 0.425, 0.015, "1", "indicated efficiency, port injection, compression ratio 10 to 11"
    )
    e_high: float = shared(0.44, 0.445, 0.015, "1", "indicated efficiency, direct injection, compression ratio 13")
    e_late: float = shared(0.4629, 0.455, 0.015, "1", "indicated efficiency, late closing, cooled recirculation")
    e_turbo: float = shared(0.4347, 0.43, 0.015, "1", "indicated efficiency, turbocharged, direct injection")
    p_0: float = shared(0.6198, 0.75, 0.12, "bar", "friction and pumping, naturally aspirated")
    p_0_turbo: float = shared(
        1.071, 0.90, 0.15, "bar", "friction and pumping, turbocharged, 85 kW/l; in proportion to kW/l"
    )
    heat: float = shared(1.807, 2.0, 0.4, "kW/l", "heat to the walls while the engine fires")
    accessories: float = shared(
        416.1, 400.0, 80.0, "W", "alternator and pumps at the crank; 3/4 of it on a hybrid's bus"
    )
    eta_manual: float = shared(0.9629, 0.965, 0.01, "1", "efficiency under load, manual gearbox and final drive")
    eta_dual: float = shared(0.9658, 0.965, 0.01, "1", "efficiency under load, dual-clutch gearbox and final drive")
    eta_automatic: float = shared(
        0.9677, 0.965, 0.01, "1", "efficiency under load, planetary automatic and final drive"
    )
    eta_belt: float = shared(0.9343, 0.93, 0.02, "1", "efficiency under load, belt variator and final drive")
    eta_split: float = shared(
        0.9721, 0.975, 0.01, "1", "efficiency under load, from the ring of a power split to the wheels"
    )
    drag_manual: float = shared(1.028, 1.0, 0.5, "N.m", "drag at the input at 150 rad/s, manual gearbox")
    drag_dual: float = shared(2.745, 2.5, 1.0, "N.m", "drag at the input at 150 rad/s, dual-clutch gearbox")
    drag_automatic: float = shared(2.515, 3.0, 1.5, "N.m", "drag at the input at 150 rad/s, automatic with its pump")
    drag_belt: float = shared(2.744, 3.0, 1.5, "N.m", "drag at the input at 150 rad/s, variator with its pump")
    cool_gearbox: float = shared(1.666, 1.6, 0.3, "1", "drag in the bags of the FTP over that of warm oil")
    cool_engine: float = shared(
        1.117, 1.10, 0.05, "1", "friction of the engine in the bags of the FTP over that of a warm one"
    )
    stop_delay: float = shared(
        5.382, 4.5, 2.3, "s", "standstill after which the engine stops, all inhibitions included"
    )
    pressure: float = shared(7.043, 7.0, 0.7, "bar", "mean effective pressure up to which a low speed is preferred")
    pressure_turbo: float = shared(8.972, 9.0, 1.0, "bar", "the same, turbocharged")
    schedule: float = shared(
        0.9468, 1.0, 0.08, "1", "speeds of shifting a manual gearbox over those of 40 CFR 86.128-79"
    )
    n_stepped: float = shared(1343, 1300.0, 120.0, "rpm", "engine speed after shifting up, automatic and dual clutch")
    n_belt: float = shared(1263, 1250.0, 120.0, "rpm", "least engine speed with a belt variator")

    def engine(self, car: TestCar, *, cool: bool = False) -> WillansEngine:
        """The engine of a car."""
        charged, rated = is_charged(car), rated_speed(car)
        friction = self.cool_engine if cool else 1.0
        specific = car.power / car.displacement / CHARGED_AT
        rows = [(x * rated, y * car.power / rated) for x, y in (CHARGED if charged else NATURAL)]
        speeds, torques = zip(*rows, strict=True)
        return WillansEngine.of_displacement(
            car.displacement,
            P_max=car.power,
            p_0=friction * BAR * (self.p_0_turbo * specific if charged else self.p_0),
            p_2=friction * P_2,
            e={
                "port injected": self.e_port,
                "high compression": self.e_high,
                "late closing": self.e_late,
                "turbocharged": self.e_turbo,
            }[family(car)],
            P_heat=self.heat * 1e6 * car.displacement,
            curve=Map.curve(speeds, torques, x="w", x_unit="rad/s", unit="N.m", name="full load", outside="clip"),
            J=INERTIA * car.displacement,
            w_idle=W_IDLE,
            w_limit=1.12 * rated,
            tau_starter=40e3 * car.displacement,
        )

    def gearbox(self, car: TestCar, *, cool: bool = False) -> tuple[float, float]:
        """Efficiency under load, and drag [N.m] at the input at 150 rad/s."""
        eta, drag = {
            "manual": (self.eta_manual, self.drag_manual),
            "dual clutch": (self.eta_dual, self.drag_dual),
            "automatic": (self.eta_automatic, self.drag_automatic),
            "belt": (self.eta_belt, self.drag_belt),
            "power split": (self.eta_split, 0.0),
            "electric": (self.eta_split, 0.0),
        }[car.transmission]
        return eta, drag * (self.cool_gearbox if cool else 1.0)

    def preferred(self, car: TestCar) -> float:
        """The part of the largest torque up to which the gearbox prefers a low engine speed."""
        rows = CHARGED if is_charged(car) else NATURAL
        largest = max(y for _, y in rows) * car.power / rated_speed(car) * 4 * math.pi / car.displacement
        return (self.pressure_turbo if is_charged(car) else self.pressure) * BAR / largest


def priors() -> dict[str, tuple[float, float]]:
    """Mean and standard deviation of every shared number before the fit."""
    return {f.name: (f.metadata["mean"], f.metadata["sd"]) for f in fields(Technology)}


def is_charged(car: TestCar) -> bool:
    """Whether the engine is turbocharged; taken from its specific power where that is not known."""
    return car.power > CHARGED_FROM * car.displacement if car.turbocharged is None else car.turbocharged


def rated_speed(car: TestCar) -> float:
    """Speed [rad/s] of the rated power P = p V w/(4 pi): the pressure p is limited by the filling, so more power per litre needs speed."""
    if is_charged(car):
        return 5500 * RPM
    return max(6200 * RPM, 4 * math.pi * car.power / (RATED_PRESSURE * car.displacement))


def family(car: TestCar) -> str:
    """One of the families: late closing, turbocharged, high compression, port injected."""
    if car.transmission == "power split":
        return "late closing"
    if is_charged(car):
        return "turbocharged"
    return FAMILIES.get((_maker(car), round(car.displacement * 1e3, 1)), "port injected")


def _maker(car: TestCar) -> str:
    return car.name.split()[0].title()


def stops(car: TestCar) -> bool:
    """Whether the engine stops at rest on the test; taken from the maker where that is not known.

    That of a manual car does not: it idles in gear with the clutch open (40 CFR 86.128-79), and its start-stop waits for neutral.
    """
    can = car.transmission in ("automatic", "dual clutch", "belt")
    return can and (_maker(car) in STOPPING if car.start_stop is None else car.start_stop)
