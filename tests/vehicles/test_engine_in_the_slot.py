"""Vehicles whose control follows the engine's line of least fuel: that of the engine in the slot, also of a user's own."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from cases import few

import powertrain as pt
from powertrain.components.cycles import DriveCycle
from powertrain.components.engines import Engine, MappedEngine, WillansEngine
from powertrain.trials import CycleRun, drive_cycle
from powertrain.vehicles.power_split_hybrid import PowerSplitHybrid
from powertrain.vehicles.split_path_car import SplitPathCar

TOWN = DriveCycle.named("wltc").part(0, 140)
VEHICLES: tuple[type[pt.Component], ...] = (SplitPathCar, PowerSplitHybrid)
NAMED = {kind.__name__: kind for kind in VEHICLES}


class ConstantEngine(Engine):
    """A user's own: 120 N.m at every speed, 15 N.m of drag, a third of the fuel's power."""

    def equations(self) -> pt.Equations:
        yield from self._run()

    def _motoring(self, w: pt.Symbol) -> pt.Symbol:
        return pt.Symbol(15)

    def _full_load(self, w: pt.Symbol) -> pt.Symbol:
        return pt.Symbol(120)

    def _fuel_power(self, w: pt.Symbol, firing: pt.Symbol) -> pt.Symbol:
        return 3 * firing * w


class Lawless(Engine):
    """It has no full-load torque."""

    def equations(self) -> pt.Equations:
        yield self.crank.tau == 0


ENGINES = [WillansEngine(tau_max=110, P_max=60e3, tau_low=80), MappedEngine.diesel(), ConstantEngine(w_limit=600)]


@lru_cache
def driven(name: str, number: int) -> CycleRun:
    return drive_cycle(pt.replace(NAMED[name](), engine=ENGINES[number]), TOWN)


@pytest.mark.slow
@pytest.mark.parametrize("vehicle", VEHICLES, ids=lambda v: v.__name__)
@pytest.mark.parametrize("number", range(len(ENGINES)), ids=lambda n: type(ENGINES[n]).__name__)
def test_engine_runs_on_its_own_line(vehicle: type[pt.Component], number: int) -> None:
    """The speed asked for is the engine's own of least fuel: no other speed takes less for the same power."""
    run, engine = driven(vehicle.__name__, number), ENGINES[number]
    assert run.message == ""
    assert run.time_outside == 0
    share = 0.85 if vehicle is SplitPathCar else 0.9
    power, w = run.result["control.power"], run.result["control.w_best"]
    grid = np.linspace(115, 600)
    most = float(np.max(grid * share * engine.full_load(grid)))
    asked = np.flatnonzero((power > 3e3) & (power < 0.5 * most))[::40]
    assert asked.size > 5
    for k in asked:
        speeds = np.linspace(1.35 * float(engine.w_idle), float(engine.w_limit - engine.band_limit), 400)
        possible = power[k] / speeds <= share * engine.full_load(speeds)
        least = engine.fuel_flow(speeds, power[k] / speeds)[possible].min()
        assert engine.fuel_flow(w[k], power[k] / w[k]) == pytest.approx(least, rel=0.004)


@pytest.mark.parametrize("number", few([0, 2]), ids=lambda n: type(ENGINES[n]).__name__)
def test_split_path_engine_gives_what_is_asked(number: int) -> None:
    """Power/w where the accelerator is clearly pressed; released, the drag brakes."""
    result, engine = driven("SplitPathCar", number).result, ENGINES[number]
    w, u, pedal = result["engine.w"], result["engine.throttle"], result["control.accelerator"]
    short = result["control.power"] / w - result["engine.tau"]
    pulls = (w > 100) & (u < 1) & (pedal > 0.05)
    assert pulls.sum() > 200
    np.testing.assert_allclose(short[pulls], 0, atol=1e-6)
    released = (w > 100) & (pedal == 0)
    assert released.sum() > 50
    np.testing.assert_allclose(short[released], engine.motoring(w)[released], atol=1e-6)


def test_an_engine_without_laws_is_told() -> None:
    for vehicle in VEHICLES:
        with pytest.raises(pt.ModelError, match=r"engine: Lawless does not define its law _full_load\(w\)"):
            pt.compile(pt.replace(vehicle(), engine=Lawless()))
