"""Contacts that stay closed while their gap is a nonlinear function of the states."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

import powertrain as pt


class Cam(pt.Component):
    """A cam of 0.1 kg.m2 lifts a follower by 0.05 cos(phi); on this lies a rider, and a wheel sticks to the cam by friction."""

    phi: pt.Variable = pt.variable("rad", "angle of the cam", start=0.0)
    w: pt.Variable = pt.variable("rad/s", "speed of the cam", start=20.0)
    spin: pt.Variable = pt.variable("rad/s", "speed of the wheel", start=20.0)
    y: pt.Variable = pt.variable("m", "height of the follower", start=0.05)
    v: pt.Variable = pt.variable("m/s", "its speed", start=0.0)
    r: pt.Variable = pt.variable("m", "height of the rider", start=0.05)
    u: pt.Variable = pt.variable("m/s", "its speed", start=0.0)
    f: pt.Variable = pt.variable("N", "force of the cam")
    load: pt.Variable = pt.variable("N", "force of the follower")
    grip: pt.Variable = pt.variable("N.m", "friction torque")
    gap: pt.Variable = pt.variable("m", "gap of the cam")

    def equations(self) -> pt.Equations:
        yield pt.der(self.phi) == self.w
        yield 0.1 * pt.der(self.w) == 0.05 * ca.sin(self.phi) * self.f + self.grip
        yield 0.02 * pt.der(self.spin) == -self.grip
        yield pt.der(self.y) == self.v
        yield pt.der(self.v) == self.f - self.load - 200.0
        yield pt.der(self.r) == self.u
        yield 0.5 * pt.der(self.u) == self.load - 100.0
        yield self.gap == self.y - 0.05 * ca.cos(self.phi)
        yield pt.unilateral(self.gap, self.f, name="cam")
        yield pt.unilateral(self.r - self.y, self.load, name="rider")
        yield pt.friction(self.spin - self.w, self.grip, -5.0, 5.0, name="wheel")


def energy(result: pt.Result[Any]) -> Any:
    kinetic = 0.1 * result["w"] ** 2 + 0.02 * result["spin"] ** 2 + result["v"] ** 2 + 0.5 * result["u"] ** 2
    return kinetic / 2 + 200.0 * result["y"] + 100.0 * result["r"]


@pytest.mark.parametrize("rtol", [1e-3, 1e-6])
@pytest.mark.parametrize("method", ["dopri5", "rodas5p", "sparse"])
def test_closed_contacts_stay_closed(method: str, rtol: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """30 s, some 100 turns. With errors of the integration alone the cam lost its follower by 2 cm at 1e-3, and 3 um at 1e-6."""
    if method == "sparse":
        monkeypatch.setattr("powertrain.engine.prepared._LARGE", 0)
    result = pt.simulate(Cam(), 30.0, rtol=rtol, method="rodas5p" if method == "sparse" else method)
    assert not result.events
    steps = result.trajectory.times
    phi, w, spin, y, v, r = (result.at(steps, name) for name in ("phi", "w", "spin", "y", "v", "r"))
    for held in (y - 0.05 * np.cos(phi), v + 0.05 * np.sin(phi) * w, r - y, spin - w):
        np.testing.assert_allclose(held, 0.0, atol=1e-9)
    passed = 2 * 0.1 * 300.0 * result["phi"][-1] / (2 * np.pi)  # J, up and down by 0.1 m in each turn
    assert np.ptp(energy(result)) < rtol * passed
