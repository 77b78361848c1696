"""Modes on the way to those of an instant that leave an equation without solution do not end the search."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.cycles import DriveCycle
from powertrain.components.electric import PassivelyCooledBattery
from powertrain.trials import drive_cycle
from powertrain.vehicles import ParallelHybrid


class MovingLoad(pt.Component):
    """100 V behind 1 Ohm supply at most 2.5 kW. At 1 s a lever begins to move, in 0.5 s from a load of 1 kW to one of 6 kW.

    At 1.1 s the load falls to 1 kW for good. The lever is where it moves to once its way is over, and that is known only after the reset.
    """

    v: pt.Variable = pt.variable("V", "Voltage", guess=100.0)
    P: pt.Variable = pt.variable("W", "Power")
    lever: pt.Variable = pt.variable("1", "Position")
    goal: pt.Discrete = pt.discrete("1", "Position to which it moves", start=0.0)
    began: pt.Discrete = pt.discrete("s", "Time at which it began to move", start=-100.0)

    def equations(self) -> pt.Equations:
        way = pt.switch(pt.time - self.began > 0.5, 1.0, (pt.time - self.began) / 0.5)
        yield pt.when(pt.time > 1.0, pt.reinit(self.goal, 1), pt.reinit(self.began, pt.time))
        yield self.lever == self.goal * way
        yield 1e3 + 5e3 * self.lever * pt.schedule([0.0, 1.1, 1.1, 2.0], [1.0, 1.0, 0.0, 0.0]) == self.P
        yield self.v * (100.0 - self.v) == self.P


def test_a_load_that_the_last_modes_would_not_allow() -> None:
    """v = 50 V + sqrt(2500 V2 - P Ohm); with the lever at its goal at 1 s there would be no voltage."""
    result = pt.simulate(MovingLoad(), 2.0, points=201)
    t = result.time
    lever = np.clip((t - 1.0) / 0.5, 0.0, 1.0)
    apart = np.abs(t - 1.1) > 1e-6
    P = 1e3 + 5e3 * lever * (t < 1.1)
    np.testing.assert_allclose(result["lever"], lever, atol=1e-9)
    np.testing.assert_allclose(result["v"][apart], 50 + np.sqrt(2500 - P[apart]), rtol=1e-8)


@pytest.mark.slow
def test_a_hybrid_with_a_cold_battery_shifts() -> None:
    """At -10 degC, in the instant of a shift under full load, its battery cannot give what the modes of the last gear would ask for."""
    car = ParallelHybrid(battery_cooling=PassivelyCooledBattery(T_air=263.15))
    run = drive_cycle(car, DriveCycle("hard", ((0, 0), (1, 0), (20, 33), (22, 33))), starts={"battery.soc": 0.6})
    assert not run.message
    result = run.result
    assert np.max(-result["battery.bus.v"] * result["battery.i"] / result["battery.discharge_power"]) < 1.02
    assert result["schedule.gear"].max() >= 3


@pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler")
def test_the_exported_program_does_the_same(tmp_path: Path) -> None:
    plant = pt.compile(MovingLoad())
    found, wanted = plant.export_c(tmp_path).simulate(2.0, points=21), plant.simulate(2.0, points=21)
    np.testing.assert_allclose(found["v"], wanted["v"], rtol=1e-9)


class Overload(pt.Component):
    """The same supply; at 1 s its load jumps from 1 kW to 6 kW for good."""

    v: pt.Variable = pt.variable("V", "Voltage", guess=100.0)
    x: pt.Variable = pt.variable("V.s", "Integral of the voltage", start=0.0)
    P: pt.Discrete = pt.discrete("W", "Power", start=1e3)

    def equations(self) -> pt.Equations:
        yield pt.when(pt.time > 1.0, pt.reinit(self.P, 6e3))
        yield self.v * (100.0 - self.v) == self.P
        yield pt.der(self.x) == self.v


def test_modes_that_no_others_follow_must_have_a_solution() -> None:
    """What is missing at best is 6 kW - 2.5 kW."""
    with pytest.raises(pt.SimulationError, match=r"^at t = 1 s these equations have no solution") as caught:
        pt.simulate(Overload(), 2.0)
    assert "left minus right is -3500" in str(caught.value)
    assert caught.value.result is not None
    assert caught.value.result["v"][-1] == pytest.approx(50 + np.sqrt(2500 - 1e3), rel=1e-8)  # as it was before
