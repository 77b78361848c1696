"""Every car on every axle: through a stop and a second start, front, rear and all wheels driven, in bends."""

from __future__ import annotations

from itertools import cycle
from typing import Any

import numpy as np
import pytest
from differential_kinds import KINDS

import powertrain as pt
from powertrain.components.body import (
    Axle,
    CentreDifferential,
    DrivenAxle,
    LumpedAxle,
    RollingAxle,
)
from powertrain.components.control import OpenPedals
from powertrain.components.cycles import DriveCycle
from powertrain.components.gearless.circular_cam import CircularCamDifferential
from powertrain.components.transmissions import Automatic
from powertrain.trials import CycleRun, drive_cycle, driveline_map
from powertrain.vehicles.automatic_car import AutomaticCar
from powertrain.vehicles.dual_clutch_car import DualClutchCar
from powertrain.vehicles.electric_car import ElectricCar
from powertrain.vehicles.flywheel_hybrid import FlywheelHybrid
from powertrain.vehicles.manual_car import ManualCar
from powertrain.vehicles.parallel_hybrid import ParallelHybrid
from powertrain.vehicles.power_split_hybrid import PowerSplitHybrid
from powertrain.vehicles.series_hybrid import SeriesHybrid
from powertrain.vehicles.split_path_car import SplitPathCar
from powertrain.vehicles.variator_car import VariatorCar

CARS: dict[str, Any] = {
    "manual": ManualCar(),
    "automatic": AutomaticCar(),
    "variator": VariatorCar(),
    "electric": ElectricCar(),
    "flywheel": FlywheelHybrid(),
    "power split": PowerSplitHybrid(),
    "split path": SplitPathCar(),
    "dual clutch": DualClutchCar(),
    "gearset": AutomaticCar.with_gearset(Automatic.simpson_three_speed()),
    "parallel": ParallelHybrid(),
    "series": SeriesHybrid(),
}
HALT = DriveCycle("halt", ((0.0, 0.0), (1.0, 0.0), (5.0, 5.0), (7.0, 5.0), (11.0, 0.0), (14.0, 0.0), (17.0, 3.0)))
"""From rest, to a halt, and on."""


def axle(car: Any, differential: str) -> DrivenAxle:
    """A driven axle with the final drive of the car's own."""
    return DrivenAxle(final_drive=car.front.final_drive, differential=KINDS[differential])


def follows(run: CycleRun) -> None:
    """It closes its energy, keeps within the band, and stands where it shall."""
    assert run.message == ""
    assert not run.audit.hidden
    kinetic = run.plant.parameters["body.m"] * HALT.top_speed**2 / 2
    assert abs(run.audit.residual) < 1e-5 * kinetic
    assert run.time_outside == 0
    standing = (run.result.time > 12.5) & (run.result.time < 12.9)
    assert np.abs(run.speed[standing]).max() < 2e-2


@pytest.mark.slow
@pytest.mark.parametrize(("name", "differential"), list(zip(CARS, cycle(["bevel", "cam"]), strict=False)))
def test_starts_and_halts(name: str, differential: str) -> None:
    car = CARS[name]
    follows(drive_cycle(pt.replace(car, front=axle(car, differential)), HALT))


DRIVES: dict[str, dict[str, Any]] = {
    "rear": {"front": RollingAxle(), "rear": DrivenAxle()},
    "rear, lumped": {"front": RollingAxle(), "rear": LumpedAxle()},
    "all": {"transfer": CentreDifferential(), "front": DrivenAxle(), "rear": DrivenAxle()},
    "all, lumped": {"transfer": CentreDifferential(), "front": LumpedAxle(), "rear": LumpedAxle()},
    "all, locking centre": {
        "transfer": CentreDifferential(differential=CircularCamDifferential(mu=0.2)),
        "front": LumpedAxle(),
        "rear": DrivenAxle(),
    },
    "all, without centre": {"front": DrivenAxle(), "rear": DrivenAxle()},
}


@pytest.mark.slow
@pytest.mark.parametrize("driven", DRIVES)
def test_which_axle_is_driven(driven: str) -> None:
    run = drive_cycle(ManualCar(**DRIVES[driven]), HALT)
    follows(run)
    pushed = (run.result.time > 2.0) & (run.result.time < 5.0)
    pinions = {end: f"{end}.pinion.tau" for end in ("front", "rear") if f"{end}.pinion.tau" in run.result}
    for end in ("front", "rear"):
        if driven.startswith(("all", end)):
            assert run.result[pinions[end]][pushed].mean() > 5
        else:
            assert end not in pinions


@pytest.mark.slow
def test_lumped_and_whole_axle_agree_on_a_straight_road() -> None:
    """The same motion but for the slip of the tyres and the inertia of the cage."""
    car = ManualCar()
    lumped, whole = (drive_cycle(c, HALT) for c in (car, pt.replace(car, front=axle(car, "bevel"))))
    assert lumped.distance == pytest.approx(whole.distance, rel=2e-3)
    assert lumped.fuel == pytest.approx(whole.fuel, rel=1e-2)


@pytest.mark.slow
def test_in_a_bend_the_centre_differential_works() -> None:
    """The front axle's circle is larger than the rear axle's: root(1 + (k l)^2)."""
    plant = pt.compile(pt.replace(ManualCar(**DRIVES["all"]), {"cycle.cycle": HALT}))
    run = plant.simulate(7.0, inputs={"curvature": ([0.0, 4.0, 6.0], [0.0, 0.0, 0.15])})
    assert pt.energy_audit(run).closure < 1e-6
    front, rear = ((run[f"{end}.left.w"] + run[f"{end}.right.w"])[-1] for end in ("front", "rear"))
    assert front / rear == pytest.approx(np.hypot(1, 0.15 * 2.7), rel=0.01)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"front": RollingAxle()}, "ManualCar drives no axle: front = RollingAxle and rear = RollingAxle"),
        ({"transfer": CentreDifferential()}, "only front is a driven axle"),
    ],
)
def test_axles_that_do_not_fit_are_refused(given: dict[str, Any], said: str) -> None:
    with pytest.raises(pt.ModelError, match=said):
        pt.compile(ManualCar(**given))


class Beam(Axle):
    """An axle of one's own, which says nothing about slip."""

    wheels: RollingAxle = RollingAxle()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.wheels.axle, self.axle)
        yield pt.connect(self.load, self.wheels.load)


def test_a_map_names_an_axle_that_it_cannot_lump() -> None:
    with pytest.raises(pt.ModelError, match=r"Beam does not define lumped\(\)"):
        driveline_map(ManualCar(rear=Beam()), [10.0], [0.5])


def test_wheels_that_cannot_turn_apart_need_a_centre_differential() -> None:
    with pytest.raises(pt.ModelError, match="rear = LumpedAxle have rigid wheels on a RigidTransferCase"):
        pt.compile(ManualCar(front=LumpedAxle(), rear=LumpedAxle()))


@pytest.mark.slow
@pytest.mark.parametrize("name", CARS)
def test_open_pedals(name: str) -> None:
    """Off with the accelerator, then the brake: every car moves, stops, and closes its energy."""
    plant = pt.compile(pt.replace(CARS[name], driver=OpenPedals()))
    assert {"driver.accelerator_pedal", "driver.brake_pedal", "curvature"} == set(plant.compiled.inputs)
    pedals = {
        "driver.accelerator_pedal": ([0.0, 1.0, 5.0, 5.5], [0.0, 0.4, 0.4, 0.0]),
        "driver.brake_pedal": ([0.0, 6.0, 7.0], [0.0, 0.0, 0.4]),
    }
    result = plant.simulate(12.0, inputs=pedals)
    assert result["body.v"].max() > 1.0
    assert abs(result["body.v"][-1]) < 1e-2
    assert pt.energy_audit(result).closure < 1e-5
