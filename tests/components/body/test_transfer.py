"""The lumped centre differential shares the torque as the differential it stands for, without friction."""

from __future__ import annotations

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.body import CentreDifferential, LumpedCentreDifferential, TransferCase
from powertrain.components.differentials import (
    BevelDifferential,
    Differential,
    DoublePinionPlanetaryGear,
    LimitedSlipDifferential,
    PlanetaryGear,
)
from powertrain.components.gearless.circular_cam import CircularCamDifferential
from powertrain.components.rotational import ConstantTorque, Damper, Fixed, Inertia


class Planetary(Differential):
    """The front axle at the sun, the rear axle at the ring."""

    gear: PlanetaryGear = PlanetaryGear(ratio=1.5)

    @property
    def share(self) -> pt.Symbol:
        return 1 / (1 + self.gear.ratio)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.crown, self.gear.carrier)
        yield pt.connect(self.left, self.gear.sun)
        yield pt.connect(self.right, self.gear.ring)


class DoublePinion(Differential):
    """Driven at the ring; the front axle at the sun, the rear axle at the carrier: w_ring = w_sun/ratio + (1 - 1/ratio) w_carrier."""

    gear: DoublePinionPlanetaryGear = DoublePinionPlanetaryGear(ratio=2.5)

    @property
    def share(self) -> pt.Symbol:
        return 1 / self.gear.ratio

    def equations(self) -> pt.Equations:
        yield pt.connect(self.crown, self.gear.ring)
        yield pt.connect(self.left, self.gear.sun)
        yield pt.connect(self.right, self.gear.carrier)


class Unsaid(Differential):
    """Says nothing of its share."""

    def equations(self) -> pt.Equations:
        yield pt.connect(self.crown, self.left, self.right)


class Pulled(pt.Component):
    """A torque drives two axles against dampers of different size."""

    case: TransferCase
    drive: ConstantTorque = ConstantTorque(tau_constant=300)
    engine: Inertia = Inertia(J=0.1)
    front: Inertia = Inertia(J=1.0)
    rear: Inertia = Inertia(J=1.0)
    front_load: Damper = Damper(d=1.0)
    rear_load: Damper = Damper(d=2.5)
    ground: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.engine.flange_a)
        yield pt.connect(self.engine.flange_b, self.case.input)
        yield pt.connect(self.case.front, self.front.flange_a)
        yield pt.connect(self.case.rear, self.rear.flange_a)
        yield pt.connect(self.front.flange_b, self.front_load.flange_a)
        yield pt.connect(self.rear.flange_b, self.rear_load.flange_a)
        yield pt.connect(self.front_load.flange_b, self.rear_load.flange_b, self.ground.flange)


SPEEDS = ["engine.w", "front.w", "rear.w"]
OPEN = {"bevel": BevelDifferential(), "planetary": Planetary(), "double pinion": DoublePinion()}


@pytest.mark.parametrize("name", OPEN)
def test_the_lumped_case_turns_where_the_open_one_settles(name: str) -> None:
    case = CentreDifferential(differential=OPEN[name])
    full = pt.simulate(Pulled(case=case), 40.0, rtol=1e-8)
    lumped = pt.simulate(Pulled(case=case.lumped()), 40.0, rtol=1e-8)
    share = {"bevel": 0.5, "planetary": 0.4, "double pinion": 0.4}[name]
    expected = [share * 300.0, (1 - share) * 300.0 / 2.5]
    for result in full, lumped:
        assert [result[n][-1] for n in SPEEDS[1:]] == pytest.approx(expected, rel=1e-6)
        assert result["engine.w"][-1] == pytest.approx(np.dot([share, 1 - share], expected), rel=1e-6)


def test_the_start_of_an_unequal_differential_turns_with_its_axles() -> None:
    model = Pulled(case=CentreDifferential(differential=Planetary()))
    start = pt.simulate(model, 0.01, starts={"front.w": 10.0, "rear.w": 20.0})
    assert start["engine.w"][0] == pytest.approx(0.4 * 10.0 + 0.6 * 20.0)


def test_friction_does_not_change_the_shares_of_a_lumped_case() -> None:
    for differential in LimitedSlipDifferential(preload=100.0), CircularCamDifferential(mu=0.2):
        assert CentreDifferential(differential=differential).lumped() == LumpedCentreDifferential(share=0.5)


def test_a_differential_without_a_share_is_refused_in_words() -> None:
    with pytest.raises(pt.ModelError, match=r"Unsaid does not define share, .* 1/\(1 \+ ratio\) for a planetary gear"):
        CentreDifferential(differential=Unsaid()).lumped()
