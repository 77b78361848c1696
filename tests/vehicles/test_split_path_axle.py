"""The split-path car with a driven axle: every differential and tyre through stops and take-offs, in bends and on unequal ground."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from test_rear_drive import KINDS

import powertrain as pt
from powertrain.components.cycles import DriveCycle
from powertrain.components.wheels import MagicFormulaWheel, SlipWheel, Wheel
from powertrain.vehicles.split_path_car import SplitPathAxleCar
from powertrain.vehicles.trials import CycleRun, drive_cycle

TYRES: dict[str, Wheel] = {"linear": SlipWheel(), "magic": MagicFormulaWheel()}
HALT = (0.0, 0.0), (1.0, 0.0), (6.0, 6.0), (9.0, 6.0), (13.0, 0.0), (16.0, 0.0), (19.0, 3.0), (20.0, 3.0)
"""Seconds and m/s: from rest, to a halt, and on."""


def car(differential: str, tyre: str, **changes: Any) -> SplitPathAxleCar:
    wheel = TYRES[tyre]
    inner = {"axle.differential": KINDS[differential], "axle.left": wheel, "axle.right": wheel}
    return pt.replace(SplitPathAxleCar(), inner, **changes)


def closes(run: CycleRun, share: float) -> None:
    """The energy, to a share of the work at the crank."""
    assert run.message == ""
    work = float(np.trapezoid(np.abs(run.result["engine.power"]), run.result.time))
    assert abs(run.audit.residual) < share * work


@pytest.mark.parametrize("tyre", TYRES)
@pytest.mark.parametrize("differential", KINDS)
def test_starts_and_halts(differential: str, tyre: str) -> None:
    run = drive_cycle(car(differential, tyre), DriveCycle("halt", HALT))
    closes(run, 1e-5)
    assert run.result["body.v"][-1] == pytest.approx(3.0, abs=0.3)
    assert np.abs(run.result["body.v"][(run.result.time > 14.0) & (run.result.time < 15.0)]).max() < 1e-3


def test_a_bend_and_ground_that_differs() -> None:
    """The outer wheel runs ahead by the track over the radius; on ice the bevel passes what the poor side bears, the friction of rest added."""
    plant = pt.compile(car("bevel", "magic"))
    bend = {"curvature": ([0.0, 7.0, 8.0], [0.0, 0.0, 0.05])}
    trajectory = plant.simulate(9.0, inputs=bend, starts={})
    assert pt.energy_audit(trajectory).closure < 1e-5
    split = plant.simulate(9.0, parameters={"axle.left.mu": 0.05})
    assert pt.energy_audit(split).closure < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize("rtol", [1e-4, 1e-5, 1e-6, 1e-8])
@pytest.mark.parametrize("tyre", TYRES)
@pytest.mark.parametrize("differential", KINDS)
def test_a_whole_cycle(differential: str, tyre: str, rtol: float) -> None:
    run = drive_cycle(car(differential, tyre), DriveCycle.named("wltc"), rtol=rtol, compile=True)
    closes(run, max(rtol, 1e-6))
    assert run.time_outside == 0


@pytest.mark.slow
@pytest.mark.parametrize("cycle", ["udds", "hwfet", "nedc"])
@pytest.mark.parametrize(("differential", "tyre"), [("bevel", "magic"), ("linkage", "linear"), ("limited slip", "magic")])
def test_other_cycles(cycle: str, differential: str, tyre: str) -> None:
    run = drive_cycle(car(differential, tyre), DriveCycle.named(cycle), rtol=1e-6, compile=True)
    closes(run, 1e-6)
    assert run.time_outside == 0
