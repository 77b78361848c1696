"""Second derivatives of runs against closed forms: a decay, a bouncing ball, a clutch that sticks; other events are refused."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from small_models import STARTS, Ball, Engaging

import powertrain as pt
from powertrain.components.blocks import Constant
from powertrain.components.rotational import Clutch, Damper, Fixed, Inertia


class Decay(pt.Component):
    """w0 exp(-d t/J)."""

    inertia: Inertia = Inertia(J=2.0)
    damper: Damper = Damper(d=0.5)
    ground: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.inertia.flange_b, self.damper.flange_a)
        yield pt.connect(self.damper.flange_b, self.ground.flange)


def test_decay() -> None:
    J, d, w0 = ca.SX.sym("J"), ca.SX.sym("d"), ca.SX.sym("w0")
    exact = ca.Function("exact", [J, d, w0], [ca.hessian(w0 * ca.exp(-d * 3.0 / J), ca.vertcat(J, d, w0))[0]])
    found = pt.hessian(
        Decay(), "inertia.w", ["inertia.J", "damper.d", "inertia.w"], stop=3.0, starts={"inertia.w": 10.0}
    )
    np.testing.assert_allclose(found, np.array(exact(2.0, 0.5, 10.0)), rtol=3e-8, atol=1e-9)
    assert found["units"].sel(wrt="inertia.J", wrt_2="inertia.w").item() == "rad/s/(kg.m2)/(rad/s)"


def test_a_ball_through_two_bounces() -> None:
    """Falls from h, bounces with e v, 2 e v/g later with e^2 v."""
    e, g, h = ca.SX.sym("e"), ca.SX.sym("g"), ca.SX.sym("h")
    v = ca.sqrt(2 * g * h)
    left = 1.5 - v / g - 2 * e * v / g
    exact = ca.Function("exact", [e, g, h], [ca.hessian(e**2 * v * left - g * left**2 / 2, ca.vertcat(e, g, h))[0]])
    found = pt.hessian(Ball(), "h", ["e", "g", "h"], stop=1.5)
    wanted = np.array(exact(0.8, 10.0, 1.0))
    np.testing.assert_allclose(found, wanted, atol=1e-8 * np.abs(wanted).max())


class Joining(pt.Component):
    """Two inertias that a clutch joins."""

    command: Constant = Constant(k=1.0)
    engine: Inertia = Inertia(J=0.2)
    clutch: Clutch = Clutch(fn_max=100.0, mue_pos=((0.0, 0.5),))
    load: Inertia = Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.command.y, self.clutch.f_normalized)
        yield pt.connect(self.engine.flange_b, self.clutch.flange_a)
        yield pt.connect(self.clutch.flange_b, self.load.flange_a)


def test_a_clutch_that_sticks() -> None:
    """The heat until it sticks is J1 J2/(J1 + J2) w0^2/2, whatever the clutch."""
    one, two, w = (ca.SX.sym(n) for n in ("one", "two", "w"))
    exact = ca.Function(
        "exact", [one, two, w], [ca.hessian(one * two / (one + two) * w**2 / 2, ca.vertcat(one, two, w))[0]]
    )
    found = pt.hessian(
        Joining(), pt.integral(lambda m: -m.clutch.tau * m.clutch.w_rel), ["engine.J", "load.J", "engine.w", "clutch.fn_max"],
        stop=1.5, starts={"engine.w": 100.0, "load.w": 0.0},
    )  # fmt: skip
    order = ["engine.J", "load.J", "engine.w", "clutch.fn_max"]
    found, wanted = found.sel(wrt=order, wrt_2=order), np.zeros((4, 4))
    wanted[:3, :3] = np.array(exact(0.2, 1.0, 100.0))
    size = np.array([0.2, 1.0, 100.0, 100.0])
    np.testing.assert_allclose(np.abs(found) * np.outer(size, size), np.abs(wanted) * np.outer(size, size), atol=1e-5)


def test_refusals() -> None:
    with pytest.raises(pt.SimulationError, match=r"with e = 0\.72 the run has other events, from .* at t = .* s on"):
        pt.hessian(Ball(), "h", ["e"], stop=1.65, step=0.1)
    with pytest.raises(pt.ParameterError, match="torque is an input"):
        pt.hessian(Engaging(), "engine.w", ["torque"], stop=0.1, starts=STARTS, inputs={"torque": 1.0, "press": 0.0})
