"""The split-path car with a driven axle: every differential and tyre through stops and take-offs, in bends and on unequal ground."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from cases import few
from differential_kinds import KINDS

import powertrain as pt
from powertrain.components.body import DrivenAxle
from powertrain.components.cycles import DriveCycle
from powertrain.components.differentials import CrownGear
from powertrain.components.wheels import MagicFormulaWheel, SlipWheel, Wheel
from powertrain.trials import CycleRun, drive_cycle
from powertrain.vehicles.split_path_car import SplitPathCar

TYRES: dict[str, Wheel] = {"linear": SlipWheel(), "magic": MagicFormulaWheel()}
HALT = (0.0, 0.0), (1.0, 0.0), (6.0, 6.0), (9.0, 6.0), (13.0, 0.0), (16.0, 0.0), (19.0, 3.0), (20.0, 3.0)
"""Seconds and m/s: from rest, to a halt, and on."""


def car(differential: str, tyre: str, **changes: Any) -> SplitPathCar:
    wheel = TYRES[tyre]
    ring = CrownGear(ratio=4.5, eta_ab=0.97, eta_ba=0.97)
    axle = DrivenAxle(final_drive=ring, differential=KINDS[differential], left=wheel, right=wheel)
    return SplitPathCar(front=axle, **changes)


def closes(run: CycleRun, share: float) -> None:
    """The energy, to a share of the work at the crank."""
    assert run.message == ""
    work = float(np.trapezoid(np.abs(run.result["engine.power"]), run.result.time))
    assert abs(run.audit.residual) < share * work


@pytest.mark.slow
@pytest.mark.parametrize("v", few([0.8, 2.0, 3.0]))
def test_no_shuffle_while_creeping(v: float) -> None:
    """Where the engine is heavy on the half shafts the driver does not keep their vibration up."""
    creep = DriveCycle("creep", ((0.0, 0.0), (1.0, 0.0), (1.0 + 2 * v, v), (20.0, v)))
    run = drive_cycle(car("bevel", "linear"), creep, rtol=1e-5)
    torque = run.result.at(np.linspace(15.0, 20.0, 1001), "front.left_shaft.tau")
    assert np.ptp(torque) < 5.0  # N.m; some 700 with a foot without lag


@pytest.mark.parametrize("tyre", few(TYRES))
@pytest.mark.parametrize("differential", few(KINDS))
def test_starts_and_halts(differential: str, tyre: str) -> None:
    run = drive_cycle(car(differential, tyre), DriveCycle("halt", HALT))
    closes(run, 1e-5)
    assert run.result["body.v"][-1] == pytest.approx(3.0, abs=0.3)
    assert np.abs(run.result["body.v"][(run.result.time > 14.0) & (run.result.time < 15.0)]).max() < 1e-3


@pytest.mark.slow
def test_a_synchronous_point_on_a_slope() -> None:
    """The unit passes V = 1, where its differential turns as a block, uphill on a road with a table of grades."""
    ride = replace(DriveCycle.named("udds").part(129, 204), grades=(0.06,) * 76)
    run = drive_cycle(SplitPathCar(), ride)
    closes(run, 1e-5)
    V = run.result["actuator.ratio"][run.result.time > 40.0]
    assert V.min() < 1.0 < V.max()
    assert run.result["rear.wheels.fn"].min() > 4000.0


@pytest.mark.slow
def test_a_bend_and_ground_that_differs() -> None:
    """In a bend to the left the right wheel runs ahead by the track times the curvature; on ice the left wheel slips."""
    halt = pt.replace(car("bevel", "magic"), {"cycle.cycle": DriveCycle("halt", HALT)})
    plant = pt.compile(halt)
    bend = plant.simulate(9.0, inputs={"curvature": ([0.0, 7.0, 8.0], [0.0, 0.0, 0.05])})
    assert pt.energy_audit(bend).closure < 1e-5
    ahead = (bend["front.right.w"][-1] - bend["front.left.w"][-1]) / bend["body.v"][-1]
    assert ahead == pytest.approx(0.05 * 1.5 / 0.3, rel=0.02)
    ice = plant.simulate(9.0, parameters={"front.left.mu": 0.05})
    assert pt.energy_audit(ice).closure < 1e-5
    assert ice["front.left.v_slip"].max() > 10 * ice["front.right.v_slip"].max()


WHOLE = [
    ("bevel", "linear", 1e-6), ("limited slip", "linear", 1e-6), ("linkage", "linear", 1e-6),
    ("bevel", "magic", 1e-4), ("limited slip", "magic", 1e-4), ("cam", "magic", 1e-4), ("spherical cam", "magic", 1e-4),
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("differential", "tyre", "rtol"), WHOLE)
def test_a_whole_cycle(differential: str, tyre: str, rtol: float) -> None:
    run = drive_cycle(car(differential, tyre), DriveCycle.named("wltc"), rtol=rtol)
    closes(run, 1e-6 if rtol < 1e-5 else 1e-5)
    assert run.time_outside == 0


class OnBends(pt.Component):
    """A car on a road whose curvature is a table over its length."""

    bends: pt.Map
    car: SplitPathCar

    def equations(self) -> pt.Equations:
        yield self.car.curvature.value == self.bends(self.car.body.s.value)


def winding_road() -> pt.Map:
    """Bends every 150 m in turns, whose side force is some 0.3 to 0.7 of the load at the speeds of the WLTC."""
    s = np.arange(0.0, 24000.0, 20.0)
    sharp = np.interp(s, [3000, 3300, 7700, 8000, 14900, 15300], [0.03, 0.008, 0.008, 0.004, 0.004, 0.002])
    return pt.Map.curve(
        s, sharp * np.sin(2 * np.pi * s / 300.0), x="s", x_unit="m", unit="1/m", outside="clip", method="smooth"
    )


@pytest.mark.slow
@pytest.mark.parametrize(("differential", "grip"), [("bevel", 1.0), ("locking cam", 0.4)])
def test_a_cycle_on_a_winding_road(differential: str, grip: float) -> None:
    """Curvature over distance, and the left wheel on dry or on wet ground, where an open differential would let it spin."""
    model = OnBends(bends=winding_road(), car=car(differential, "magic"))
    run = drive_cycle(model, DriveCycle.named("wltc"), rtol=1e-4, parameters={"car.front.left.mu": grip})
    assert run.message == ""
    work = float(np.trapezoid(np.abs(run.result["car.engine.power"]), run.result.time))
    assert abs(run.audit.residual) < 1e-5 * work
    assert run.time_outside == 0
    apart = np.abs(run.result["car.front.left.w"] - run.result["car.front.right.w"])
    bend = np.abs(run.result["car.curvature"] * run.result["car.body.v"]) * 1.5 / 0.3
    assert np.median(np.abs(apart - bend)[bend > 0.5]) < 0.1 / grip  # rad/s
    assert apart.max() < 100.0
