"""Cars put together at random on roads at random: any differential in any car, on one axle or on both, on dry ground and on ice.

Each either drives on with closed energy, or ends with a message about what such a car cannot do, such as climb on ice.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from differential_kinds import KINDS

import powertrain as pt
from powertrain.components.body import CentreDifferential, DrivenAxle, LumpedAxle, RollingAxle
from powertrain.components.cycles import DriveCycle
from powertrain.components.transmissions import Automatic
from powertrain.components.wheels import MagicFormulaWheel, RigidWheel, SlipWheel, Wheel
from powertrain.trials import drive_cycle
from powertrain.vehicles import (
    AutomaticCar,
    DualClutchCar,
    ElectricCar,
    ElectricFourWheelDriveCar,
    FlywheelHybrid,
    FourWheelDriveCar,
    ManualCar,
    ParallelHybrid,
    PowerSplitHybrid,
    RearDriveCar,
    SeriesHybrid,
    SplitPathCar,
    VariatorCar,
)

CARS: list[Callable[[], Any]] = [
    ManualCar, AutomaticCar, DualClutchCar, VariatorCar, SplitPathCar, ElectricCar, ElectricFourWheelDriveCar, FlywheelHybrid,
    FourWheelDriveCar, RearDriveCar, PowerSplitHybrid, SeriesHybrid, lambda: AutomaticCar.with_gearset(Automatic.eight_speed()),
    *(lambda p=p: ParallelHybrid.at(p) for p in ("P0", "P1", "P2", "P3", "P4")),
]  # fmt: skip
ONE_AXLE = FlywheelHybrid, RearDriveCar, ManualCar, AutomaticCar, SplitPathCar, VariatorCar
"""Cars that drive one axle and have a transfer case that may drive the other as well."""
OPPOSITE = {"front": "rear", "rear": "front"}
CYCLES = "wltc", "udds", "us06", "nedc", "jc08", "wmtc"
ENDS = re.compile(
    r"load of the wheel .* falls below 0 N|it rolled back by|it does not move|its engine is turned backwards"
)


@dataclass(frozen=True)
class Ride:
    """A car, where it drives, the curvature of the bend from 25 s to 40 s [1/m], and the tolerance."""

    car: Any
    cycle: DriveCycle
    curvature: float
    rtol: float

    def inputs(self) -> dict[str, Any]:
        """Straight on for the first 20 s, and out of the bend again."""
        bend = self.curvature
        return {"curvature": ([0.0, 20.0, 25.0, 40.0, 45.0], [0.0, 0.0, bend, bend, 0.0])} if bend else {}


def tyre(random: np.random.Generator, radius: float) -> Wheel:
    """Rigid, linear or magic, on ground from dry to icy."""
    mu = float(random.choice([1.0, 1.0, 0.5, 0.2]))
    kinds: list[Wheel] = [
        RigidWheel(radius=radius, J=1.0),
        SlipWheel(radius=radius, mu=mu, C=float(random.uniform(3e4, 1.5e5))),
        MagicFormulaWheel(radius=radius, mu=mu),
    ]
    return kinds[random.integers(3)]


def driven(random: np.random.Generator, axle: Any) -> DrivenAxle:
    """An axle with the same final drive, any differential, and on the right perhaps other ground."""
    left = tyre(random, float((axle.left if isinstance(axle, DrivenAxle) else axle.wheels).radius))
    differs = not isinstance(left, RigidWheel) and random.random() < 0.4
    right = pt.replace(left, {"mu": float(random.choice([0.1, 0.3, 0.6]))}) if differs else left
    kind = KINDS[str(random.choice(list(KINDS)))]
    return DrivenAxle(final_drive=axle.final_drive, differential=kind, left=left, right=right)


def ride(seed: int) -> Ride:
    """Any car with any axles, 75 s of any cycle from a halt, uphill or downhill, with a bend or without."""
    random = np.random.default_rng(seed)
    car = CARS[random.integers(len(CARS))]()
    parts: dict[str, Any] = {}
    for side in OPPOSITE:
        axle = getattr(car, side)
        if isinstance(axle, (LumpedAxle, DrivenAxle)) and random.random() < 0.85:
            parts[side] = driven(random, axle)
    if type(car) in ONE_AXLE and random.random() < 0.5:
        idle = next(side for side in OPPOSITE if isinstance(getattr(car, side), RollingAxle))
        other = OPPOSITE[idle]
        parts[idle] = driven(random, parts.get(other, getattr(car, other)))
        parts["transfer"] = CentreDifferential(differential=KINDS[str(random.choice(list(KINDS)))])
    whole = DriveCycle.named(str(random.choice(CYCLES)))
    halts = whole.times[(whole.speeds == 0) & (whole.times < whole.times[-1] - 80)]
    begin = float(random.choice(halts))
    cycle = whole.part(begin, begin + 75)
    cycle = replace(cycle, grades=(float(random.choice([0.0, 0.06, -0.06, 0.12])),) * len(cycle.times))
    bend, rtol = float(random.choice([0.0, 0.01, -0.05, 0.1])), float(random.choice([1e-5, 1e-6]))
    return Ride(pt.replace(car, parts), cycle, bend, rtol)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(40))
def test_any_car_drives_on_or_says_why_not(seed: int) -> None:
    asked = ride(seed)
    run = drive_cycle(asked.car, asked.cycle, rtol=asked.rtol, inputs=asked.inputs())
    assert not run.message or ENDS.search(run.message)
    assert run.audit.closure < 10 * asked.rtol
    assert run.audit.violations.empty
    assert np.abs(run.result["body.v"]).max() < 60


@pytest.mark.slow
@pytest.mark.parametrize("seed", [22, 71])
def test_a_reversal_between_two_events(seed: int) -> None:
    """The torque of a lossy mesh reverses and comes back between an event and the next, within a quarter of a step."""
    asked = ride(seed)
    run = drive_cycle(asked.car, asked.cycle, rtol=1e-4, inputs=asked.inputs())
    assert run.audit.violations.empty
