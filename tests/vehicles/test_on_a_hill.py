"""An automatic car that rolls back on a hill in drive as its brakes are released."""

from __future__ import annotations

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.body import RoadProfile
from powertrain.components.control import OpenPedals
from powertrain.components.transmissions import Automatic
from powertrain.vehicles.automatic_car import AutomaticCar


def rolled_back(grade: float, released: tuple[float, float], stop: float) -> pt.Result[AutomaticCar]:
    """The engine idles in first gear; the brake pedal goes from half to zero between two times."""
    road = RoadProfile(profile=pt.Map.constant(grade, x="s", x_unit="m", name="grade"))
    car = AutomaticCar.with_gearset(Automatic.eight_speed(), driver=OpenPedals(), road=road)
    brake = [0.0, *released, stop], [0.5, 0.5, 0.0, 0.0]
    return pt.simulate(car, stop, inputs={"driver.brake_pedal": brake}, rtol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("grade", [0.25])
def test_a_gradual_release_ends_in_the_same_motion_as_a_sudden_one(grade: float) -> None:
    """While the brakes ease, meshes, tyres and brakes reach their limits one after the other, and two planetary sets carry nothing.

    The same motion: the speed of the turbine at which the torque of the converter balances the weight.
    """
    gradual, sudden = rolled_back(grade, (1.0, 1.5), 9.0), rolled_back(grade, (1.0, 1.001), 9.0)
    assert np.max(gradual["body.v"][gradual.time > 2.0]) < 0
    assert gradual["body.v"][-1] == pytest.approx(sudden["body.v"][-1], rel=2e-3)
    assert pt.energy_audit(gradual).closure < 1e-6
