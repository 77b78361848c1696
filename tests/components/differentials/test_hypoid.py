"""Hypoid gears: efficiency by sliding friction, and by a measured map over speed and torque."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.differentials import HypoidGear


@pytest.mark.parametrize(("beta_1", "beta_2", "mue"), [(0.84, 0.52, 0.05), (0.9, 0.2, 0.1), (0.6, 0.6, 0.08)])
def test_efficiency_is_the_power_of_sliding(beta_1: float, beta_2: float, mue: float) -> None:
    """Normal force F, speed v_n across the teeth: both wheels' forces from their own balances, the loss mue F times the sliding speed."""
    alpha, v_n, F = math.radians(20), 2.0, 1000.0
    gear = HypoidGear(ratio=4.0, beta_1=beta_1, beta_2=beta_2, mue=mue)
    sliding = v_n * (math.tan(beta_1) - math.tan(beta_2))
    pinion = F * (math.cos(alpha) * math.cos(beta_1) + mue * math.sin(beta_1)) * v_n / math.cos(beta_1)
    forward, backward = gear.efficiencies()
    assert forward == pytest.approx(1 - mue * F * sliding / pinion, rel=1e-12)
    driven = F * (math.cos(alpha) * math.cos(beta_1) - mue * math.sin(beta_1)) * v_n / math.cos(beta_1)
    assert backward == pytest.approx(driven / (driven + mue * F * sliding), rel=1e-12)


def test_a_worm_is_the_limit() -> None:
    """With a ring gear of opposite hand (beta_2 = -lead) and beta_1 = 90 degrees - lead the formula is that of a worm."""
    lead, mue, alpha = 0.3, 0.05, math.radians(20)
    rho = math.atan(mue / math.cos(alpha))
    eta = (math.cos(alpha) + mue * math.tan(-lead)) / (math.cos(alpha) + mue * math.tan(math.pi / 2 - lead))
    assert eta == pytest.approx(math.tan(lead) / math.tan(lead + rho), rel=1e-12)


class Axle(pt.Component):
    """A hypoid gear at a given speed of the pinion, with a torque on the ring gear."""

    w: pt.Input = pt.signal_input("rad/s", "Speed of the pinion")
    tau: pt.Input = pt.signal_input("N.m", "Torque on the ring gear")
    gear: HypoidGear = HypoidGear(ratio=4.0)
    turns: rot.Speed = rot.Speed(exact=True)
    load: rot.Torque = rot.Torque()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.w, self.turns.w_ref)
        yield pt.connect(self.tau, self.load.tau)
        yield pt.connect(self.turns.flange, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.load.flange)


def axes(*names: tuple[str, str, list[float]]) -> list[pt.Axis]:
    return [pt.Axis(name, unit, points, outside="clip") for name, unit, points in names]


@pytest.mark.parametrize("load", [-400.0, 400.0])
@pytest.mark.parametrize("mapped", [False, True])
def test_operating_points(load: float, mapped: bool) -> None:
    """Pinion torques over speed and load; with the map they meet its interpolated efficiency."""
    table = [[0.90, 0.95, 0.96], [0.92, 0.97, 0.98]]
    measured = pt.Map(axes(("w", "rad/s", [50.0, 350.0]), ("tau", "N.m", [0.0, 60.0, 200.0])), table, unit="1")
    gear = HypoidGear(ratio=4.0, map_ab=measured, map_ba=measured) if mapped else HypoidGear(ratio=4.0)
    found: Any = pt.steady(Axle(gear=gear), {"w": [100.0, 300.0], "tau": [load]}, outputs=["gear.flange_a.tau"])
    assert (found.status == 0).all(), found.attrs["problems"]
    pinion = found["gear.flange_a.tau"].values.ravel()
    ideal = -load / 4
    forward, backward = gear.efficiencies()
    for w, tau in zip([100.0, 300.0], pinion, strict=True):
        if mapped:
            rows = [np.interp(abs(tau), [0.0, 60.0, 200.0], row) for row in table]
            forward = backward = float(np.interp(w, [50.0, 350.0], rows))
        assert tau == pytest.approx(ideal / forward if load < 0 else ideal * backward, rel=1e-8)


def test_what_cannot_be_is_rejected() -> None:
    with pytest.raises(pt.ParameterError, match=r"beta_1 = 0\.3"):
        HypoidGear(ratio=4.0, beta_1=0.3, beta_2=0.4)
    with pytest.raises(pt.ParameterError, match=r"mue = 0\.8"):
        HypoidGear(ratio=4.0, mue=0.8, beta_1=1.2)
    wrong = pt.Map(axes(("speed", "rad/s", [0.0, 1.0])), [0.9, 0.9], unit="1")
    with pytest.raises(pt.ParameterError, match="cannot depend on speed"):
        pt.compile(HypoidGear(ratio=4.0, map_ab=wrong))
