"""Numbers that are possible and still likely to be mistakes are told; those of the library's vehicles are not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import powertrain as pt
from powertrain.cli.app import main
from powertrain.components.body import Axle, CoastDownBody, RollingAxle
from powertrain.components.engines import MappedEngine
from powertrain.components.rotational import Clutch
from powertrain.components.translational import Mass
from powertrain.components.transmissions import NeutralIdleConverter
from powertrain.components.wheels import WheelBrake
from powertrain.trials import notes
from powertrain.vehicles import AutomaticCar, DualClutchCar, ElectricCar, ManualCar, ParallelHybrid, RearDriveCar

POUNDS = {
    "body": CoastDownBody(m=1500, F_0=26.0, F_1=0.25, F_2=0.0185),  # lbf, lbf/mph, lbf/mph2 without their units
    "front.wheels.Cr": 0,
    "rear.wheels.Cr": 0,
}


class Twice(Axle):
    """Two axles with the brakes of a truck in one slot."""

    first: Axle = RollingAxle(brakes=WheelBrake(tau_max=8000))
    second: Axle = RollingAxle(brakes=WheelBrake(tau_max=8000))


def losses(tau: float, w: float, kW: float = 1.0) -> pt.Map:
    axes = pt.Axis("speed", "rad/s", (0.0, w)), pt.Axis("torque", "N.m", (-tau, tau))
    return pt.Map(axes, np.array([[100.0, 100.0], [900.0, 900.0]]) / kW, "W", "loss")


def burning(share: float) -> MappedEngine:
    """An engine that takes so many times the fuel of the packaged one; its tables end at 1,000 rpm and 100 N.m."""
    engine = MappedEngine.gasoline()
    speeds, torques = np.linspace(105, 700, 8), np.linspace(5, 100, 8)
    axes = pt.Axis("speed", "rad/s", speeds, "error"), pt.Axis("torque", "N.m", torques, "error")
    values = share * 1e3 * engine.fuel_flow(speeds[:, None], torques)
    return pt.replace(engine, fuel_map=pt.Map(axes, values, "g/s", "fuel"))


@pytest.mark.parametrize("name", pt.vehicles.names())
def test_nothing_is_said_of_the_vehicles_of_the_library(name: str) -> None:
    assert notes(pt.vehicles.load(name)) == ()


@pytest.mark.parametrize(
    ("car", "changes", "said"),
    [
        (ManualCar(), {"front.wheels.radius": 0.64}, ["front.wheels.radius = 0.64 m is unusual (0.15 to 0.6 m)"]),
        (
            ManualCar(),
            {"front.wheels.load_nominal": 4e3},
            ["front.wheels.load_nominal = 4000 N adds to the load from the"],
        ),
        (ManualCar(), {"body.wheelbase": 2700}, ["body.wheelbase = 2700 m is unusual (1 to 12 m)"]),
        (ManualCar(), {"body.h": 550}, ["body.h = 550 m is unusual (0 to 3 m)"]),
        (RearDriveCar(), {"rear.path.track": 1500}, ["rear.path.track = 1500 m is unusual (0.5 to 3 m)"]),
        (ManualCar(), {"body.Cd": 30}, ["body.Cd = 30 is unusual"]),
        (ManualCar(), {"body.m": 1.5}, ["body.m = 1.5 kg is unusual", "engine: 8.2e+04 W for body.m = 1.5 kg"]),
        (ManualCar(), POUNDS, ["body.F_0 = 26 N is 0.18% of the weight"]),
        (ElectricCar(), {"machine.P_max": 150}, ["machine: 150 W for body.m = 1700 kg is unusual"]),
        (ElectricCar(), {"machine.w_max": 15000}, ["machine.w_max = 15000 rad/s is unusual (up to 3000 rad/s)"]),
        (
            ManualCar(),
            {"schedule.speeds": ((15, 9), (29, 21), (43, 34), (59, 46), (75, 63))},  # km/h without the unit
            ["schedule.speeds: the last upshift at 75 m/s is unusual (up to 40 m/s)"],
        ),
        (ElectricCar(), {"battery.Q": 60}, ["battery holds 5.96 W.h when full"]),
        (
            ElectricCar(),
            {"battery.R": 60},
            ["battery gives 661 W at most with battery.R = 60 Ohm"],
        ),  # (96 x 4.15 V)^2/240 Ohm
        (ElectricCar(), {"battery.R": "60 mOhm"}, []),
        (
            ElectricCar(),
            {"machine.loss_map": losses(250e3, 1300)},
            ["machine.loss_map reaches 2.5e+05 N.m, far beyond"],
        ),
        (
            ElectricCar(),
            {"machine.loss_map": losses(320, 12000)},
            ["machine.loss_map reaches 1.2e+04 rad/s, far beyond"],
        ),
        (ElectricCar(), {"machine.loss_map": losses(320, 1300)}, []),
        (
            ElectricCar(),
            {"machine.loss_map": losses(320, 1300, kW=1e3)},  # in kW by mistake
            ["machine.loss_map gives 0.398 W at 483.9 rad/s and 310 N.m, less than 0.1% of machine.P_max = 1.5e+05 W"],
        ),
        (
            ManualCar(),
            {"engine": MappedEngine.diesel()},
            ["clutch slips at full load: it holds 300 N.m, engine gives up to 318.4 N.m; clutch.fn_max = 318.4 N"],
        ),
        (
            DualClutchCar(),
            {"gearbox.odd_clutch": Clutch(fn_max=140, mue_pos=((0.0, 1.0),))},
            ["gearbox.odd_clutch slips at full load: it holds 140 N.m"],
        ),
        (
            AutomaticCar(),
            {"start.converter.tau_max": 140},
            ["the lock-up clutch of start.converter slips at full load: it holds 140 N.m, engine gives up to 150 N.m"],
        ),
        (
            AutomaticCar(start=NeutralIdleConverter()),
            {"start.clutch.fn_max": 200},
            [
                "start.clutch slips at full load: it holds 200 N.m, engine gives up to 150 N.m, which the converter multiplies by 2 at "
                "stall; start.clutch.fn_max = 300 N"
            ],
        ),
        (
            ManualCar(),
            {"engine.w_P": 5500},  # rpm without its unit
            [
                "engine does not reach engine.P_max = 82000 W at engine.w_P = 5500 rad/s: its limiter is at engine.w_limit = 680 rad/s"
            ],
        ),
        (
            ManualCar(),
            {"engine.w_limit": "9000 rpm"},
            [
                "engine revs up to engine.w_limit = 942.478 rad/s, 1.57 times the speed of its largest power, engine.w_P = 600 rad/s"
            ],
        ),
        (
            ManualCar(),
            {"body.m": 12000},  # the brakes of a car on a truck
            ["the brakes decelerate body.m = 12000 kg with 1.2 m/s2 at most"],
        ),
        (
            ManualCar(),
            {"body.m": 12000, "rear": Twice()},  # (3000 + 2 x 8000) N.m/0.3 m
            [],
        ),
        (
            ElectricCar(),
            {"front.brakes.tau_max": 9000},  # (9000 + 1500) N.m/0.3 m
            ["control.F_brake = 1.5e+04 N, but the brakes give 3.5e+04 N"],
        ),
        (
            ManualCar(),
            {"gearbox.synchronisers[0].fn_max": 190},
            ["gearbox.synchronisers[0] slides at full load: its dogs hold 512.4 N.m"],
        ),
        (
            ManualCar(),
            {"front.final_drive.ratio": 41},
            ["in top gear at 100 km/h engine turns at 24651 rpm, unusual"],
        ),
        (
            ManualCar(),
            {"front.final_drive.ratio": 0.25},
            [
                "turns at 150 rpm",
            ],
        ),
        (
            ManualCar(),
            {"engine": burning(3.6)},  # kg/h under the heading g/s
            [
                "engine takes 930.7 g/kWh at best, an efficiency of 0.09, which is unusual (0.2 to 0.55); check the unit of the fuel"
            ],
        ),
        (ManualCar(), {"engine": burning(1.0)}, []),
        (
            ManualCar(),
            {"engine.w_idle": 250},  # a speed under load
            [
                "engine.w_idle = 250 rad/s is unusual (30 to 200 rad/s)",
                "schedule.w_open = 95 rad/s is below the idle",
            ],
        ),
        (
            ManualCar(),
            {"engine.w_idle": "1500 rpm"},
            ["schedule.w_open = 95 rad/s is below the idle speed engine.w_idle"],
        ),
        (ManualCar(), {"engine.heating_value": 43}, ["engine.heating_value = 43 J/kg is unusual"]),
        (ManualCar(), {"engine.fuel_density": 0.745}, ["engine.fuel_density = 0.745 kg/m3 is unusual"]),
        (ManualCar(), {"engine.co2_per_fuel": 3170}, ["engine.co2_per_fuel = 3170 kg/kg is unusual"]),
        (ParallelHybrid(), {"battery.Q": 60}, []),  # it also has an engine
    ],
)
def test_what_looks_like_a_mistake(car: pt.Component, changes: dict[str, Any], said: list[str]) -> None:
    found = notes(pt.replace(car, changes))
    assert len(found) == len(said)
    for text, part in zip(found, said, strict=True):
        assert part in text


@pytest.mark.slow
def test_the_command_line_says_so_before_it_simulates() -> None:
    args = ["run", "ManualCar", "--cycle", "udds", "--span", "0:21", "--set", "front.wheels.radius=0.64"]
    result = CliRunner().invoke(main, args)
    assert result.exit_code == 0
    assert "Note: front.wheels.radius = 0.64 m is unusual" in result.stderr
    assert "Note" not in result.stdout


class Ballasted(ManualCar):
    """A car with a mass that nobody connected."""

    ballast: Mass = Mass(m=300)


def test_a_part_that_is_connected_to_nothing() -> None:
    assert notes(Ballasted()) == ("ballast (Mass) is connected to nothing, so it has no influence on the vehicle",)
