"""The synchronised gearbox: shifts take the time that cones and inertias need, and fail where the clutch is closed."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from cases import few

import powertrain as pt
from powertrain.components.blocks import TimeTable
from powertrain.components.cycles import DriveCycle
from powertrain.components.differentials import ChurningLoss
from powertrain.components.rotational import Inertia, Synchroniser
from powertrain.components.translational import ShiftActuator
from powertrain.components.transmissions import SynchronisedGearbox
from powertrain.vehicles.manual_car import ManualCar

J, W_OUT, FORCE = 0.01, 80.0, 800.0
CONE = 0.1 * 0.035 / math.sin(math.radians(6.5)) * FORCE
"""Torque of one cone [N.m]."""


def box(J_in: float = J) -> SynchronisedGearbox:
    made = SynchronisedGearbox.of_ratios(3.0, 2.0, 1.25, synchroniser=Synchroniser(), rail=ShiftActuator(f_max=FORCE))
    return pt.replace(made, input=Inertia(J=J_in), output=Inertia(J=1e3), churning=ChurningLoss())


class Shifted(pt.Component):
    """A gearbox without clutch whose output is a heavy shaft."""

    lever: TimeTable
    gearbox: SynchronisedGearbox = box()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.lever.y, self.gearbox.lever)


def run(gearbox: SynchronisedGearbox, levers: tuple[tuple[float, float], ...], stop: float, w: float) -> Any:
    starts = {"gearbox.input.w": w, "gearbox.output.w": W_OUT}
    return pt.simulate(Shifted(lever=TimeTable(table=levers), gearbox=gearbox), stop, starts=starts, rtol=1e-8)


@pytest.mark.parametrize(("gear", "ratio"), few([(1, 3.0), (2, 2.0), (3, 1.25)]))
def test_a_gear_takes_the_time_of_its_cone(gear: int, ratio: float) -> None:
    """From neutral with the input at rest: J r^2 w_out/T between contact and passage, whichever side of its rail it is on."""
    result = run(box(), ((0.0, gear - 0.5), (0.01, gear - 0.5), (0.01, float(gear))), 0.6, 0.0)
    name = f"gearbox.synchronisers[{gear - 1}]"
    contact, passed = (
        next(e.time for e in result.events if e.name == f"{name}.stop" and e.new == new) for new in (1, 0)
    )
    assert passed - contact == pytest.approx(J * ratio**2 * W_OUT / CONE, rel=2e-4)  # 1000 kg.m2 give way a little
    inside = [result[f"gearbox.synchronisers[{k}].inside"][-1] for k in range(3)]
    assert inside == [float(k == gear - 1) for k in range(3)]
    assert result["gearbox.input.w"][-1] == pytest.approx(ratio * W_OUT, rel=1e-4)
    assert pt.energy_audit(result).closure < 1e-6


def test_an_upshift_and_neutral() -> None:
    """From gear 1 to gear 2 along one rail, then to neutral, where the input keeps its speed."""
    levers = ((0.0, 1.0), (0.1, 1.0), (0.35, 2.0), (0.6, 2.0), (0.7, 2.5))
    result = run(box(), levers, 1.0, 3.0 * W_OUT)
    one, two = ([result.at([t], f"gearbox.synchronisers[{k}].inside")[0] for t in (0.09, 0.55, 0.95)] for k in (0, 1))
    assert one == [1, 0, 0]
    assert two == [0, 1, 0]
    assert result.at([0.55], "gearbox.input.w")[0] == pytest.approx(2 * W_OUT, rel=1e-3)
    np.testing.assert_allclose(result.at([0.8, 1.0], "gearbox.input.w"), result["gearbox.input.w"][-1], rtol=1e-9)


def test_a_closed_clutch_keeps_the_gear_out() -> None:
    """With an engine of 0.3 kg.m2 at the input the cone needs J r^2 dw/T = 2 s; after 0.5 s the sleeve is still at the ring."""
    result = run(box(0.3), ((0.0, 1.5), (0.01, 1.5), (0.01, 2.0)), 0.5, 120.0)
    assert 0.3 * 2**2 * (W_OUT - 60) / CONE > 0.9
    assert result["gearbox.synchronisers[1].inside"][-1] == 0
    assert result["gearbox.synchronisers[1].x"][-1] == pytest.approx(2e-3, abs=1e-9)


def test_what_cannot_be_is_rejected() -> None:
    with pytest.raises(pt.ParameterError, match="6 gears have 6 synchronisers on 2 rails"):
        pt.compile(SynchronisedGearbox(rails=(ShiftActuator(),) * 2))
    with pytest.raises(pt.ParameterError, match="direction"):
        SynchronisedGearbox(synchronisers=(Synchroniser(),) * 6)


@pytest.mark.slow
def test_a_car_shifts_with_it() -> None:
    """First and second gear of the WLTC: the dogs of the second engage within the time of the lever."""
    car = pt.replace(ManualCar(gearbox=SynchronisedGearbox()), {"cycle.cycle": DriveCycle.named("wltc").part(0, 25)})
    result = pt.simulate(car, 25.0, rtol=1e-6)
    began = result["schedule.began"][-1]
    engaged = next(e.time for e in result.events if e.name == "gearbox.synchronisers[1].dogs in")
    assert began + 0.15 < engaged < began + 0.4
    assert result["gearbox.synchronisers[1].inside"][-1] == 1
    assert pt.energy_audit(result).closure < 1e-6
