"""Operating points from which motions lead away on both sides: there are others, or nothing stops the motion."""

from __future__ import annotations

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.rotational import BearingFriction, ConstantTorque, Inertia, Torque

OK, SEVERAL, OUTSIDE = 0, 2, 5
SYNCHRONOUS, LARGEST, SLIP = 150.0, 100.0, 0.15
LOADS = np.array([20.0, 40.0, 60.0, 90.0])


class InductionMotor(pt.Component):
    """Kloss' formula, and a load that is the same at any speed."""

    end: BearingFriction | Inertia
    motor: Torque = Torque()
    rotor: Inertia = Inertia(J=0.5)
    load: ConstantTorque = ConstantTorque(tau_constant=0.0)

    def equations(self) -> pt.Equations:
        slip = 1 - self.rotor.w / SYNCHRONOUS
        yield self.motor.tau.value == 2 * LARGEST * slip * SLIP / (slip**2 + SLIP**2)
        yield pt.connect(self.motor.flange, self.rotor.flange_a)
        yield pt.connect(self.rotor.flange_b, self.load.flange, self.end.flange_a)


@pytest.mark.parametrize(("end", "friction"), [(Inertia(J=0.1), 0.0), (BearingFriction(tau_pos=((0.0, 2.0),)), 2.0)])
def test_the_point_beyond_the_breakdown_torque_is_not_the_only_one(
    end: Inertia | BearingFriction, friction: float
) -> None:
    """Newton's method ends on the branch on which the motor runs away or stops; guesses lead to the point at which it runs."""
    plant = pt.compile(InductionMotor(end=end))
    loads = {"load.tau_constant": -LOADS}
    found = pt.steady(plant, loads, outputs="rotor.w")
    running = pt.steady(plant, loads, outputs="rotor.w", guesses={"rotor.w": 145.0}, first=True)
    assert (found.status[:2] == SEVERAL).all()
    assert np.isin(found.status, (OK, SEVERAL)).all()
    torque = (LOADS + friction) / LARGEST
    slip = SLIP * (1 - np.sqrt(1 - torque**2)) / torque
    np.testing.assert_allclose(running["rotor.w"], SYNCHRONOUS * (1 - slip), rtol=1e-8)
    known = found.status.values == OK
    np.testing.assert_allclose(found["rotor.w"].values[known], running["rotor.w"].values[known], rtol=1e-8)


def test_no_point_is_another_where_the_motor_always_returns() -> None:
    """Near its synchronous speed the motor's torque falls with speed."""
    model = InductionMotor(end=BearingFriction(tau_pos=((0.0, 2.0),)))
    found = pt.steady(model, {"load.tau_constant": -LOADS}, outputs="rotor.w", guesses={"rotor.w": 145.0})
    assert (found.status == OK).all()


class Falling(pt.Component):
    """A body in the drag of a fluid, w' = u - w**2, which returns to its speed above zero and leaves the one below."""

    u: pt.Input = pt.signal_input("1", "Input")
    w: pt.Variable = pt.variable("1", "Speed")

    def equations(self) -> pt.Equations:
        yield pt.der(self.w) == self.u.value - self.w**2
        pt.within(self.w, -1.0, 2.0, name="speed", unit="1")


def test_the_first_of_several_points_may_be_outside_the_range_of_the_model() -> None:
    plant, inputs, below = pt.compile(Falling()), {"u": [0.25, 2.25]}, {"w": -3.0}
    found = pt.steady(plant, inputs, outputs="w", guesses=below, first=True)
    assert found.status.values.tolist() == [SEVERAL, OUTSIDE]
    np.testing.assert_allclose(found["w"], [-0.5, np.nan])
    assert (pt.steady(plant, inputs, outputs="w", guesses=below).status == SEVERAL).all()
