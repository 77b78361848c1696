"""A spring in series with a slider."""

from __future__ import annotations

import math

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.blocks import Sine
from powertrain.components.rotational import Fixed, Inertia, JenkinsElement, Position, Spring

C, T, X, W = 1000.0, 5.0, 0.02, 3.0


class Twisted(pt.Component):
    """Twisted by a sine of amplitude X."""

    angle: Sine = Sine(amplitude=X, f=W / (2 * math.pi))
    grip: Position = Position(exact=True)
    element: JenkinsElement = JenkinsElement(c=C, tau_max=T)
    wall: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.angle.y, self.grip.phi_ref)
        yield pt.connect(self.wall.flange, self.element.flange_a)
        yield pt.connect(self.element.flange_b, self.grip.flange)


class Struck(pt.Component):
    """An inertia of 1 kg.m2 with 1 rad/s on a Jenkins element, and on a spring beside it."""

    body: Inertia = Inertia(J=1)
    element: JenkinsElement = JenkinsElement(c=C, tau_max=T)
    beside: Spring = Spring(c=0)
    wall: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.wall.flange, self.element.flange_a, self.beside.flange_a)
        yield pt.connect(self.element.flange_b, self.beside.flange_b, self.body.flange_a)

    def initial(self) -> pt.Equations:
        yield self.body.w == 1


def test_the_loop_is_the_play_operator_and_loses_its_area() -> None:
    """tau is c times the twist less a slider that the twist pushes at a distance of T/c; a cycle loses 4 T (X - T/c).

    The first quarter loses T (X - T/c).
    """
    run = pt.simulate(Twisted(), 3.25 * 2 * math.pi / W, points=6001, rtol=1e-9)
    twist, slider, expected = X * np.sin(W * run.time), 0.0, []
    for angle in twist:
        slider = min(max(slider, angle - T / C), angle + T / C)
        expected.append(C * (angle - slider))
    np.testing.assert_allclose(run["element.tau"], expected, atol=1e-6)
    audit = pt.energy_audit(run)
    assert audit.components["lost"]["element"] == pytest.approx((1 + 3 * 4) * T * (X - T / C), rel=1e-7)
    assert audit.closure < 1e-7


def test_it_stops_losing_when_the_energy_left_does_not_make_it_slip() -> None:
    """What is left is T^2/(2 c), a vibration of amplitude T/c at root(c/J)."""
    run = pt.simulate(Struck(), 2.0, points=4001, rtol=1e-9)
    late = run.time > 1.0
    assert run["body.w"][late].max() == pytest.approx(T / C * math.sqrt(C), rel=1e-5)
    assert pt.energy_audit(run).components["lost"]["element"] == pytest.approx(0.5 - T**2 / (2 * C), rel=1e-6)


def test_linear_models_have_its_stiffness_while_it_sticks() -> None:
    both = pt.replace(Struck(), {"beside.c": 500.0})
    run = pt.simulate(both, 0.02)
    for time, stiffness in ((0.002, 1500.0), (0.02, 500.0)):
        found = pt.eigenmodes(both, at=(run, time))
        assert float(found["frequency"][0]) == pytest.approx(math.sqrt(stiffness) / (2 * math.pi), rel=1e-9)


def test_without_friction_it_transmits_nothing() -> None:
    run = pt.simulate(pt.replace(Struck(), {"element.tau_max": 0.0}), 1.0)
    assert run["body.w"][-1] == pytest.approx(1, rel=1e-8)


def test_a_start_beyond_the_limit_is_rejected_and_a_run_goes_on_from_a_slipping_one() -> None:
    plant = pt.compile(Struck())
    with pytest.raises(
        pt.InitializationError, match=r"torque of the spring \(element.* 9 N\.m; allowed is -5 to 5 N\.m"
    ):
        plant.simulate(0.1, starts={"element.tau_c": 9.0})
    first = plant.simulate(0.02)
    again = plant.simulate(0.1, starts={name: first[name][-1] for name in ("element.tau_c", "body.w", "body.phi")})
    assert again["body.w"][-1] == pytest.approx(plant.simulate(0.12)["body.w"][-1], abs=1e-6)
