"""What cars of one technology have in common: numbers for engine families, gearboxes and habits, none of them a car's own."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from powertrain import Map
from powertrain.components.engines import WillansEngine

from powertrain.vehicles.measured.record import TestCar

RPM = math.pi / 30
NATURAL = ((0.15, 0.80), (0.35, 0.98), (0.65, 1.10), (0.85, 1.08), (1.0, 1.0), (1.12, 0.80))
"""Full load of a naturally aspirated engine: speed over rated speed, torque over torque at rated power."""
CHARGED = ((0.15, 0.55), (0.20, 0.70), (0.32, 1.25), (0.75, 1.25), (1.0, 1.0), (1.12, 0.75))
"""Full load of a turbocharged engine."""


@dataclass(frozen=True)
class EngineFamily:
    """Engines of one kind, in numbers that do not depend on their size.

    fuel power = (tau + V/(4 pi) (p_0 + p_2 (w/400)^2)) w/e + P_heat V: ``e`` indicated efficiency [1]; ``p_0``, ``p_2`` mean effective
    pressure of friction and pumping [Pa]; ``heat`` P_heat [W/m3] to the walls; ``w_rated`` [rad/s] speed of the rated power;
    ``full_load`` rows (w/w_rated, tau/tau_rated); ``inertia`` [kg.m2/m3].
    Source of the form: L. Guzzella, A. Sciarretta, Vehicle Propulsion Systems, 3rd ed., section 3.1.
    """

    e: float
    p_0: float
    heat: float
    p_2: float = 0.6e5
    w_rated: float = 6200 * RPM
    full_load: tuple[tuple[float, float], ...] = NATURAL
    inertia: float = 80.0
    w_idle: float = 720 * RPM

    def engine(self, displacement: float, power: float, friction: float = 1.0) -> WillansEngine:
        """An engine of a displacement [m3] and a rated power [W]; ``friction`` is its friction over that of a warm one."""
        torque, area = power / self.w_rated, displacement / (4 * math.pi)
        speeds, torques = zip(*((x * self.w_rated, y * torque) for x, y in self.full_load), strict=True)
        return WillansEngine(
            e=self.e,
            tau_0=friction * area * self.p_0,
            tau_2=friction * area * self.p_2 / 400**2,
            P_heat=self.heat * displacement,
            curve=Map.curve(speeds, torques, x="w", x_unit="rad/s", unit="N.m", name="full load", outside="clip"),
            J=self.inertia * displacement,
            w_idle=self.w_idle,
            w_limit=1.12 * self.w_rated,
            tau_starter=40e3 * displacement,
        )

    def mean_pressure_torque(self, pressure: float, displacement: float) -> float:
        """Torque [N.m] of a mean effective pressure [Pa]."""
        return pressure * displacement / (4 * math.pi)


@dataclass(frozen=True)
class Gearbox:
    """Gearboxes of one kind: ``efficiency`` of the meshes under load up to the wheels, ``drag`` [N.m] at the input shaft when warm at
    150 rad/s, and when to shift: up where the next gear has ``w_up`` [rad/s], down at ``down`` of the speed of shifting up."""

    efficiency: float
    drag: float
    w_up: float = 0.0
    down: float = 0.82


@dataclass(frozen=True)
class Technology:
    """All numbers with which cars are built. The defaults were fitted once, within their physical range, to the cars of 2022."""

    engines: Mapping[str, EngineFamily]
    gearboxes: Mapping[str, Gearbox]
    spread: Mapping[int, float] = field(default_factory=lambda: {4: 4.0, 5: 4.5, 6: 5.3, 7: 6.5, 8: 7.7, 9: 9.0, 10: 7.4})
    belt_spread: float = 6.5
    accessories: float = 400.0
    electric_accessories: float = 300.0
    rotating: float = 0.015
    schedule: float = 1.0
    bmep: float = 7.0e5
    bmep_charged: float = 9.0e5
    cool_engine: float = 1.10
    cool_gearbox: float = 1.70
    stop_delay: float = 2.5
    start_stop: frozenset[str] = frozenset()

    def family(self, car: TestCar) -> EngineFamily:
        """The engine family of a car, see ``family_name``."""
        return self.engines[family_name(car)]

    def stops(self, car: TestCar) -> bool:
        """Whether the engine stops at rest: automatics of makers that equipped them so in 2022."""
        return car.transmission in ("automatic", "dual clutch", "belt") and maker(car) in self.start_stop

    def pressure(self, car: TestCar) -> float:
        """Mean effective pressure [Pa] up to which the gearbox prefers the lower engine speed."""
        return self.bmep_charged if family_name(car) == "turbocharged" else self.bmep

    def largest_pressure(self, car: TestCar) -> float:
        """Largest mean effective pressure [Pa] of the car's engine."""
        family = self.family(car)
        largest = max(y for _, y in family.full_load)
        return largest * car.power / family.w_rated * 4 * math.pi / car.displacement


FAMILIES = {
    ("mazda", 2.0): "high compression",
    ("mazda", 2.5): "high compression",
    ("toyota", 2.0): "atkinson",
    ("toyota", 2.5): "atkinson",
    ("lexus", 2.0): "atkinson",
    ("lexus", 2.5): "atkinson",
}
CHARGED_FROM = 72e6
"""Rated power over displacement [W/m3] from which an engine is taken to be turbocharged."""


def maker(car: TestCar) -> str:
    """The first word of the name."""
    return car.name.split()[0].lower()


def family_name(car: TestCar) -> str:
    """"atkinson", "turbocharged", "high compression" or "port injected"."""
    if car.transmission == "power split":
        return "atkinson"
    if car.power / car.displacement > CHARGED_FROM:
        return "turbocharged"
    return FAMILIES.get((maker(car), round(car.displacement * 1e3, 1)), "port injected")


def fitted(values: Mapping[str, float]) -> Technology:
    """Technology of the fit's values."""
    v = values
    rated = 5500 * RPM
    return Technology(
        engines={
            "port injected": EngineFamily(v["eNA"], v["p0"], v["Ph"]),
            "high compression": EngineFamily(v["eHC"], v["p0"], v["Ph"]),
            "atkinson": EngineFamily(v["eAT"], v["p0"], v["Ph"]),
            "turbocharged": EngineFamily(v["eTU"], v["p0TU"], v["Ph"], w_rated=rated, full_load=CHARGED),
        },
        gearboxes={
            "manual": Gearbox(v["eff_MT"], v["d_MT"]),
            "automatic": Gearbox(v["eff_AT"], v["d_AT"], v["nAT"] * RPM),
            "dual clutch": Gearbox(v["eff_DCT"], v["d_DCT"], v["nDCT"] * RPM),
            "power split": Gearbox(v.get("eff_PS", 0.975), 0.0),
            "belt": Gearbox(v["eff_CVT"], v["d_CVT"], v["nCVT"] * RPM),
        },
        accessories=v["acc"], electric_accessories=v.get("eacc",300.), stop_delay=v.get("stop_delay", 2.5), schedule=v["nMT"], bmep=v["bmep"], bmep_charged=v["bmepTU"], cool_engine=v["warm"], cool_gearbox=v["tw"],
        start_stop=frozenset({"honda", "toyota", "volkswagen"}),
    )
