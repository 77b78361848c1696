"""Derivatives of runs against tight differences: resets, random drivelines, cars."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from drivelines import random_plant
from runs_by_formula import TIGHT
from small_models import CoupledClutches, Relay

import powertrain as pt


def difference(
    plant: pt.Plant[Any], number: Callable[[Any], float], stop: float, name: str, h: float, **options: Any
) -> float:
    """Richardson's extrapolation of central differences."""
    value = plant.parameters[name]
    at = {
        k: number(plant.simulate(stop, parameters={name: value + k * h}, **TIGHT, **options))
        for k in (1, -1, 0.5, -0.5)
    }
    return (4 * (at[0.5] - at[-0.5]) / h - (at[1] - at[-1]) / (2 * h)) / 3


def test_resets_of_states_and_discretes() -> None:
    plant = pt.compile(Relay())
    result = plant.simulate(6.0, **TIGHT)
    assert len(result.events) > 4
    found = pt.gradient(result, pt.integral("level") + pt.final("level"))
    for name in found:
        ends = pt.gradient(result, "level", name)[name]
        assert ends == pytest.approx(difference(plant, lambda r: float(r["level"][-1]), 6.0, name, 1e-4), rel=1e-6), (
            name
        )
    whole = pt.gradient(result, pt.integral("level"), "inflow")["inflow"]
    grid = np.linspace(0, 6, 200_001)
    plus, minus = (plant.simulate(6.0, parameters={"inflow": 1 + d}, times=grid, rtol=1e-10) for d in (1e-4, -1e-4))
    area = [float(np.trapezoid(r["level"], r.time)) for r in (plus, minus)]
    assert whole == pytest.approx((area[0] - area[1]) / 2e-4, rel=1e-4)


@pytest.mark.slow
def test_coupled_clutches() -> None:
    """All parameters but those on the edge of a law: clutches pressed with exactly nothing, a sine that begins at the start."""
    plant = pt.compile(CoupledClutches())
    result = plant.simulate(1.5, **TIGHT)
    found = pt.gradient(result, "J1.w")
    edge = {"step1.offset", "step2.offset", "sin1.startTime", "sin2.startTime"}
    loose = pt.gradient(plant.simulate(1.5), "J1.w")
    for name in sorted(set(found) - edge):
        slopes = [difference(plant, lambda r: float(r["J1.w"][-1]), 1.5, name, h) for h in (1e-3, 1e-5)]
        assert min(abs(found[name] - slope) for slope in slopes) < 3e-7 + 1e-6 * abs(found[name]), name
        assert loose[name] == pytest.approx(found[name], rel=1e-5, abs=1e-6), name


def checked(seed: int, monkeypatch: pytest.MonkeyPatch) -> int:
    """The number of derivatives of one random driveline that were compared."""
    try:
        plant, rng = random_plant(seed)
        result = plant.simulate(1.0, **TIGHT)
    except pt.PowertrainError:
        return 0
    events = [(e.name, e.new) for e in result.events]
    if len(events) < 2:
        return 0
    signal = rng.choice([s for s in plant.compiled.states if not s.endswith("phi")] or plant.compiled.states)
    names = [
        n
        for n, v in plant.parameters.items()
        if v and not n.endswith("peak") and "Table" not in n and "tau_pos" not in n
    ]
    names = rng.sample(names, min(5, len(names)))
    try:
        found = pt.gradient(result, signal, names)
    except pt.SimulationError:
        return 0
    with monkeypatch.context() as patched:
        patched.setattr("powertrain.variational.gradients._FEW", 0)
        back = pt.gradient(result, signal, names)
    np.testing.assert_allclose(back.array, found.array, rtol=1e-8, atol=1e-9 * np.abs(found.array).max(initial=1e-3))
    count = 0
    for name in names:
        value = plant.parameters[name]
        errors = [_error(plant, signal, name, h * abs(value), found[name], events) for h in (1e-4, 1e-5, 1e-6)]
        least = min((e for e in errors if e is not None), default=None)
        if least is not None:
            assert least < 1e-6, (seed, signal, name, found[name], least)
            count += 1
    return count


def _error(plant: Any, signal: str, name: str, h: float, slope: float, events: list[tuple[str, float]]) -> float | None:
    """The error relative to the signal's change with a change of the parameter by its own size; None where events differ."""
    value, ends = plant.parameters[name], []
    for k in (1, -1, 0.5, -0.5):
        try:
            run = plant.simulate(1.0, parameters={name: value + k * h}, **TIGHT)
        except pt.PowertrainError:
            return None
        if [(e.name, e.new) for e in run.events] != events:
            return None
        ends.append(float(run[signal][-1]))
    rough, fine = (ends[0] - ends[1]) / (2 * h), (ends[2] - ends[3]) / h
    exact = (4 * fine - rough) / 3
    return float(abs(slope - exact) * abs(value) / (1e-3 + abs(ends[0]) + abs(exact * value)))


def test_random_drivelines(monkeypatch: pytest.MonkeyPatch) -> None:
    assert sum(checked(seed, monkeypatch) for seed in range(1, 5)) >= 3


@pytest.mark.slow
def test_many_random_drivelines(monkeypatch: pytest.MonkeyPatch) -> None:
    assert sum(checked(seed, monkeypatch) for seed in range(5, 110)) >= 108


@pytest.mark.slow
def test_fuel_of_the_car_on_a_driven_axle() -> None:
    """Left and right wheels brake and stop together; a change of one wheel by itself separates them."""
    from powertrain.components.body import DrivenAxle
    from powertrain.components.differentials import BevelDifferential
    from powertrain.vehicles.split_path_car import SplitPathCar

    plant = pt.compile(SplitPathCar(front=DrivenAxle(differential=BevelDifferential(eta=0.97))))
    options: dict[str, Any] = {"rtol": 1e-9, "points": 1}
    found = pt.gradient(plant.simulate(102.0, **options), "engine.fuel")
    h = 1e-4
    for name in ("body.m", "front.left.radius", "front.right_brake.tau_max"):
        value = plant.parameters[name]
        ends = [
            plant.simulate(102.0, parameters={name: value * k}, **options)["engine.fuel"][-1] for k in (1 + h, 1 - h)
        ]
        scatter = 1e-8 * found.value / (h * abs(value))
        assert found[name] == pytest.approx((ends[0] - ends[1]) / (2 * h * value), rel=1e-4, abs=scatter), name
        mirrored = name.replace("left", "LEFT").replace("right", "left").replace("LEFT", "right")
        assert found[mirrored] == pytest.approx(found[name], rel=1e-6), name


@pytest.mark.slow
def test_fuel_of_the_split_path_car() -> None:
    """The first 200 s of the WLTC against differences.

    The fuel of a run scatters by its tolerance, so the difference over +-h scatters by rtol/h relative to a parameter with elasticity 1,
    and for the inertia of the engine, with 0.0011, by 1e-3 at h = 1e-3. Measured: 7e-5 there, and 4e-7 for the mass of the body, with
    0.53. Smaller steps scatter more: 3e-3 for the engine at h = 1e-5, at which all errors fall with 1/h as noise does.
    """
    from powertrain.vehicles.split_path_car import SplitPathCar

    plant, rtol, h = pt.compile(SplitPathCar()), 1e-9, 1e-3
    options: dict[str, Any] = {"rtol": rtol, "atol": 1e-11, "points": 1}
    found = pt.gradient(plant.simulate(200.0, **options), "engine.fuel")
    for name in (
        "body.m",
        "body.A",
        "front.final_drive.ratio",
        "transmission.cvu.eta_ab",
        "front.wheels.J",
        "engine.J",
    ):
        value = plant.parameters[name]
        ends = [
            plant.simulate(200.0, parameters={name: value * k}, **options)["engine.fuel"][-1] for k in (1 + h, 1 - h)
        ]
        scatter = rtol * found.value / (h * abs(value))
        assert found[name] == pytest.approx((ends[0] - ends[1]) / (2 * h * value), rel=5e-6, abs=scatter), name


@pytest.mark.slow
@pytest.mark.parametrize(("name", "stop"), [("AutomaticCar", 107.0), ("ParallelHybrid", 110.0)])
def test_fuel_through_shifts(name: str, stop: float) -> None:
    """Shifts that the time since a reset carries out, one of which stops the engine of the hybrid, against differences."""
    from powertrain import vehicles
    from powertrain.components.cycles import DriveCycle
    from powertrain.trials.cycle import on_cycle

    plant = pt.compile(on_cycle(getattr(vehicles, name)(), DriveCycle.named("udds").part(0, 126)))
    options: dict[str, Any] = {"rtol": 1e-9, "points": 1}
    found = pt.gradient(plant.simulate(stop, **options), "engine.fuel", ["body.m", "front.final_drive.ratio"])
    for parameter, h in (("body.m", 1e-4), ("front.final_drive.ratio", 1e-4)):
        value = plant.parameters[parameter]
        ends = [
            plant.simulate(stop, parameters={parameter: value * k}, **options)["engine.fuel"][-1]
            for k in (1 + h, 1 - h)
        ]
        assert found[parameter] == pytest.approx((ends[0] - ends[1]) / (2 * h * value), rel=1e-3), parameter
