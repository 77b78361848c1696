"""Derivatives of runs against the runs: CoupledClutches for all parameters, two cars over the WLTC; and a car that is stepped."""

from __future__ import annotations

from typing import Any

import numpy as np

import powertrain as pt
from benchmarks import driven_axle
from benchmarks.coupled_clutches import STOP, CoupledClutches
from benchmarks.timing import Row, at_most, measure
from powertrain.vehicles.split_path_car import SplitPathCar

NAME = "gradient"
GOAL = 3.5
"""Runs of a car that its gradient may take."""


def run(rounds: int = 5, cycle: float = 1800.0) -> list[Row]:
    """All rows of this benchmark."""
    return [*clutches(rounds), *car(rounds, cycle), fuel("car on a driven axle", driven_axle.car(), rounds, cycle)]


def clutches(rounds: int) -> list[Row]:
    """Cost in runs, and the error of the run at 1e-6 against one at 1e-12."""
    plant = pt.compile(CoupledClutches())
    few = ["J1.J", "sin1.amplitude", "clutch1.fn_max", "step2.startTime", "clutch3.fn_max"]
    result = plant.simulate(STOP, points=1)
    found = measure(
        {
            "run": lambda: plant.simulate(STOP, points=1)["J1.w"],
            "all": lambda: pt.gradient(result, "J1.w"),
            "few": lambda: pt.gradient(result, "J1.w", few),
        },
        4 * rounds,
    )
    exact = pt.gradient(plant.simulate(STOP, points=1, rtol=1e-12), "J1.w")
    error = np.abs(pt.gradient(result, "J1.w").array - exact.array).max() / np.abs(exact.array).max()
    return [
        at_most(NAME, f"CoupledClutches, {len(exact)} parameters, in runs", found.ratio("all", "run"), 6.0),
        at_most(NAME, f"CoupledClutches, {len(few)} parameters, in runs", found.ratio("few", "run"), 5.0),
        Row(
            NAME,
            "CoupledClutches at 1e-6, largest error over largest derivative",
            f"{error:.2g}",
            "<= 1e-06",
            error <= 1e-6,
        ),
    ]


def car(rounds: int, cycle: float) -> list[Row]:
    """Fuel of the split-path car, and the car stepped by 10 ms."""
    plant = pt.compile(SplitPathCar())
    short: dict[str, Any] = {"points": 1, "max_step": 0.01}

    def stepped() -> float:
        run = plant.start(record=False)
        while run.time < 9.9999:
            run.step(0.01)
        return run["engine.fuel"]

    found = measure(
        {
            "stepped": stepped,
            "short": lambda: plant.simulate(10.0, **short)["engine.fuel"],
        },
        rounds,
    )
    return [
        fuel("SplitPathCar", SplitPathCar(), rounds, cycle),
        at_most(
            NAME,
            "`plant.start` in steps of 10 ms against one run with such steps",
            found.ratio("stepped", "short"),
            3.0,
        ),
    ]


def fuel(said: str, model: pt.Component, rounds: int, cycle: float) -> Row:
    """Fuel with respect to all parameters."""
    plant = pt.compile(model)
    result = plant.simulate(cycle, points=1)
    count, events = len(plant.parameters), len(result.trajectory.instants)
    what = f"{said}, {cycle:g} s of the WLTC, {count} parameters, {events} events, in runs"
    try:
        pt.gradient(result, "engine.fuel")
    except pt.SimulationError as error:
        return Row(NAME, what, f"no derivative: {error}", f"<= {GOAL:g} x", False)
    found = measure(
        {
            "run": lambda: plant.simulate(cycle, points=1)["engine.fuel"],
            "gradient": lambda: pt.gradient(result, "engine.fuel"),
        },
        rounds,
    )
    return at_most(NAME, what, found.ratio("gradient", "run"), GOAL)
