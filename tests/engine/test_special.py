from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.blocks import Sine
from powertrain.components.cycles import DriveCycle
from powertrain.components.rotational import Clutch, Inertia, SpringDamper, Torque
from powertrain.integration import specialized as special
from powertrain.trials.cycle import on_cycle
from powertrain.vehicles.split_path_car import SplitPathCar


class Shuffle(pt.Component):
    """A clutch that sticks and slips under a torque that swings."""

    drive: Sine = Sine(amplitude=20, f=1.3)
    torque: Torque = Torque()
    first: Inertia = Inertia(J=0.2)
    shaft: SpringDamper = SpringDamper(c=200, d=0.5)
    second: Inertia = Inertia(J=0.3)
    clutch: Clutch = Clutch(fn_max=8, mue_pos=((0.0, 0.6), (20.0, 0.4)), peak=1.1)
    third: Inertia = Inertia(J=0.5)
    press: Sine = Sine(amplitude=0.5, f=0.4, offset=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.y, self.torque.tau)
        yield pt.connect(self.torque.flange, self.first.flange_a)
        yield pt.connect(self.first.flange_b, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.second.flange_a)
        yield pt.connect(self.second.flange_b, self.clutch.flange_a)
        yield pt.connect(self.press.y, self.clutch.f_normalized)
        yield pt.connect(self.clutch.flange_b, self.third.flange_a)


@pytest.mark.parametrize("method", ["dopri5", "rodas5p"])
def test_steps_for_given_modes_are_the_general_ones_to_the_last_bit(
    method: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    options: dict[str, Any] = {"method": method, "points": 100, "rtol": 1e-8}
    general = pt.compile(Shuffle()).simulate(20, **options)
    monkeypatch.setattr(special, "OFTEN", 0)
    own = pt.compile(Shuffle()).simulate(20, **options)
    assert len(general.events) > 10
    assert own.events == general.events
    assert np.array_equal(own.trajectory.dense, general.trajectory.dense)


@pytest.mark.slow
def test_a_car_drives_the_same_with_steps_for_its_modes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two thirds of the instructions fall away; the error estimate and the indicators are the same, too."""
    cycle = DriveCycle("town", ((0, 0), (5, 0), (20, 12), (30, 12), (40, 4), (50, 0)))
    plant = pt.compile(on_cycle(SplitPathCar(), cycle))
    general = plant.simulate(50, rtol=1e-4)
    monkeypatch.setattr(special, "OFTEN", 0)
    own = plant.simulate(50, rtol=1e-4)
    assert len(plant._engine("auto", False).special._built) > 5
    assert own.events == general.events
    assert np.array_equal(own.trajectory.dense, general.trajectory.dense)


def test_only_frequent_modes_get_their_own_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(special, "OFTEN", 1000)
    plant = pt.compile(Shuffle())
    plant.simulate(1)
    engine = plant._engine("auto", False)
    assert not engine.special._built
    for _ in range(3):
        plant.simulate(20)
    assert 0 < len(engine.special._built) < len(engine.special._taken)
