"""A body whose road load is a measured polynomial."""

from __future__ import annotations

import math

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.blocks import Constant
from powertrain.components.body import CoastDownBody, DrivenAxle
from powertrain.components.wheels import RigidWheel
from powertrain.vehicles.electric_car import ElectricCar

M, F_0, F_2 = 1200.0, 120.0, 0.4


class Coasting(pt.Component):
    body: CoastDownBody = CoastDownBody(m=M, F_0=F_0, F_1=0, F_2=F_2)
    grade: Constant = Constant(k=0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.grade.y, self.body.grade)


def test_coasts_down_and_stands() -> None:
    """m dv/dt = -(F_0 + F_2 v^2): v = root(F_0/F_2) tan(atan(v_0 root(F_2/F_0)) - t root(F_0 F_2)/m)."""
    v_0, unit = 30.0, math.sqrt(F_0 / F_2)
    start, rate = math.atan(v_0 / unit), math.sqrt(F_0 * F_2) / M
    result = pt.simulate(Coasting(), 1.5 * start / rate, points=301, starts={"body.v": v_0})
    expected = unit * np.tan(np.maximum(start - rate * result.time, 0))
    np.testing.assert_allclose(result["body.v"], expected, atol=2e-5)
    assert result["body.v"][-1] == 0
    audit = pt.energy_audit(result)
    assert audit.components["lost"][""] == pytest.approx(M * v_0**2 / 2, rel=1e-6)


def test_slope_holds_up_to_the_load_at_rest_and_drives_backward_alike() -> None:
    """Standing on a slope below F_0; rolling back beyond it, to the speed at which the load balances the weight."""
    slope = 0.9 * F_0 / (M * 9.80665)
    assert pt.simulate(pt.replace(Coasting(), {"grade.k": slope}), 20.0)["body.v"][-1] == 0
    steep = 0.05
    weight = M * 9.80665 * steep / math.sqrt(1 + steep**2)
    result = pt.simulate(pt.replace(Coasting(), {"grade.k": steep}), 1200.0)
    assert result["body.v"][-1] == pytest.approx(-math.sqrt((weight - F_0) / F_2), rel=1e-6)


def test_linear_part_may_be_negative_but_not_the_load() -> None:
    body = CoastDownBody(m=1474.2, F_0=139.808, F_1=-1.4368, F_2=0.42736)  # a Civic of the test-car list
    assert float(body.F_1) < 0
    with pytest.raises(pt.ParameterError, match="F_1"):
        CoastDownBody(F_0=100, F_1=-20, F_2=0.5)


def test_rolling_resistance_counts_once() -> None:
    """The coefficients hold that of the tyres: wheels that have one are refused by their paths, in every kind of axle."""
    car = pt.replace(ElectricCar(), {"body": CoastDownBody(), "rear.wheels.Cr": 0})
    with pytest.raises(pt.ParameterError, match=r"CoastDownBody, .* twice with front.wheels.Cr = 0.01: set it to 0"):
        pt.compile(car)
    driven = pt.replace(car, {"front": DrivenAxle(), "front.left.Cr": 0, "front.right": RigidWheel(Cr=0, Cr_2=2e-6)})
    with pytest.raises(pt.ParameterError, match=r"twice with front.right.Cr_2 = 2e-06: set it to 0"):
        pt.compile(driven)
    pt.compile(pt.replace(car, {"front.wheels.Cr": 0}))
