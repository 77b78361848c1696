from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.blocks import Sine
from powertrain.components.rotational import Clutch, Inertia, SpringDamper, Torque
from powertrain.integration import specialized as special


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
def test_steps_for_given_modes_are_the_general_ones(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same arithmetic in another order, and the same events; steps whose error is round-off may differ in size."""
    options: dict[str, Any] = {"method": method, "points": 100, "rtol": 1e-8, "atol": 1e-10}
    general = pt.compile(Shuffle()).simulate(20, **options)
    monkeypatch.setattr(special, "OFTEN", 0)
    plant = pt.compile(Shuffle())
    own = plant.simulate(20, **options)
    assert len(own.events) == len(general.events) > 10
    assert own["clutch.mode"] == pytest.approx(general["clutch.mode"])
    assert np.abs(own["third.w"] - general["third.w"]).max() < 1e-8


def test_only_frequent_modes_get_their_own_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(special, "OFTEN", 300)
    plant = pt.compile(Shuffle())
    plant.simulate(1)
    engine = plant._engine("auto", False)
    assert not engine.special._built
    for _ in range(3):
        plant.simulate(20)
    assert 0 < len(engine.special._built) < len(engine.special._taken)
