"""A motion that a smooth resistance lets die away, through a lossy gear whose limits shrink with its load: it comes to rest once."""

from __future__ import annotations

import pytest

import powertrain as pt
from powertrain.components.rotational import Gear, Inertia, SignTorque, WormGear


class DyingAway(pt.Component):
    """A flywheel is braked by 3 N.m, below 1 mrad/s in proportion to the speed; a gear takes a second one along."""

    brake: SignTorque = SignTorque(tau_nominal=-3.0)
    flywheel: Inertia = Inertia(J=0.5)
    gear: Gear | WormGear = Gear(ratio=2.0, efficiency=0.9)
    driven: Inertia = Inertia(J=0.5)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.brake.flange, self.flywheel.flange_a)
        yield pt.connect(self.flywheel.flange_b, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.driven.flange_a)

    def initial(self) -> pt.Equations:
        yield self.flywheel.w == 1.0


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize("gear", [Gear(ratio=2.0, efficiency=0.9), WormGear(ratio=10.0, lead=0.3, mue=0.08)])
def test_a_motion_that_dies_away_comes_to_rest_once(gear: Gear | WormGear, rtol: float) -> None:
    """It falls for ever; where an error of the integration throws it to the other side of zero, by less than its hysteresis, it rests."""
    result = pt.simulate(DyingAway(gear=gear), 1.0, rtol=rtol)
    assert [(event.name, event.new) for event in result.events] in ([], [("gear.mode", 0.0)])
    assert result.statistics["steps"] < 300
    assert abs(result["flywheel.w"][-1]) < 1e-10
