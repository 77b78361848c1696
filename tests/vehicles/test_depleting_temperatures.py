"""Cycles of a charge-depleting test follow one another: what has warmed up stays warm."""

from __future__ import annotations

from typing import Any

import pytest

from powertrain.components.cycles import DriveCycle
from powertrain.components.electric import PassivelyCooledBattery
from powertrain.components.engines import CoolantCircuit
from powertrain.trials import CycleRun, charge, charge_depleting, drive_cycle
from powertrain.vehicles.parallel_hybrid import ParallelHybrid

ONCE = ((0, 0), (1, 0), (8, 12), (20, 12), (26, 0), (40, 0))
TWICE = (*ONCE, *((t + 40, v) for t, v in ONCE[1:]))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:charge_depleting")
def test_two_cycles_are_one_of_twice_the_length(monkeypatch: pytest.MonkeyPatch) -> None:
    """The battery, 3 kJ/K from -10 degC, warms by 2.7 K in a cycle. The engine stands and cools from 60 degC, its ``starts`` value."""
    cold = PassivelyCooledBattery(C=3e3, G=0.0, T_air=263.15)
    car = ParallelHybrid.plug_in(cooling=CoolantCircuit(T_air=263.15), battery_cooling=cold)
    warm, runs = {"cooling.engine.T": "60 degC"}, list[CycleRun]()

    def recorded(*given: Any, **options: Any) -> CycleRun:
        runs.append(drive_cycle(*given, **options))
        return runs[-1]

    monkeypatch.setattr(charge, "drive_cycle", recorded)
    charge_depleting(car, DriveCycle("once", ONCE), soc=0.6, most=2, starts=warm)
    both = drive_cycle(car, DriveCycle("twice", TWICE), starts={"battery.soc": 0.6} | warm).result
    assert both["battery_cooling.T"][-1] - both["battery_cooling.T"][0] > 5
    for name in ("battery_cooling.T", "cooling.T"):
        found = [run.result[name][k] for run in runs for k in (0, -1)]
        assert found == pytest.approx([both.at(float(t), name) for t in (0, 40, 40, 80)], abs=0.02)
