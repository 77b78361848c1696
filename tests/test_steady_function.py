"""Operating points as functions: against closed forms, ``pt.steady`` at other points, ``pt.steady_gradient``, and in an optimisation."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

import powertrain as pt
from powertrain.components.rotational import Clutch, Inertia, QuadraticSpeedDependentTorque, SpringDamper, Torque
from powertrain.design import SplitPathBench


class Twisted(pt.Component):
    """A rotor that a torque turns, through a clutch and a shaft, against a fan: speeds and twist are implicit."""

    torque: pt.Input = pt.signal_input("N.m", "Torque")
    press: pt.Input = pt.signal_input("1", "Clutch")
    source: Torque = Torque()
    rotor: Inertia = Inertia(J=1)
    clutch: Clutch = Clutch(fn_max=20.0, mue_pos=((0.0, 0.5),))
    shaft: SpringDamper = SpringDamper(c=1e3, d=3)
    other: Inertia = Inertia(J=2)
    fan: QuadraticSpeedDependentTorque = QuadraticSpeedDependentTorque(
        tau_nominal=-5, w_nominal=50, TorqueDirection=False
    )
    drag: QuadraticSpeedDependentTorque = QuadraticSpeedDependentTorque(
        tau_nominal=-1, w_nominal=50, TorqueDirection=False
    )

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque, self.source.tau)
        yield pt.connect(self.source.flange, self.rotor.flange_a, self.drag.flange)
        yield pt.connect(self.rotor.flange_b, self.clutch.flange_a)
        yield pt.connect(self.press, self.clutch.f_normalized)
        yield pt.connect(self.clutch.flange_b, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.other.flange_a)
        yield pt.connect(self.other.flange_b, self.fan.flange)


PLANT = pt.compile(Twisted())
OUTPUTS = ["rotor.w", "other.w", "shaft.phi_rel", "clutch.tau"]
GUESSES = {"rotor.w": 30.0, "other.w": 20.0}
POINT = {"torque": 6.0, "press": 1.0}


def slopes(found: pt.SteadyFunction, v: Any) -> Any:
    """First and second derivatives by v: (y, v) and (v, v) of the first output."""
    V = ca.MX.sym("v", len(found.inputs))
    y = found.function(V, found.p)[0]
    both = ca.Function("both", [V], [ca.jacobian(y, V), ca.hessian(y[0], V)[0]])
    return [np.array(part) for part in both(v)]


def test_a_stuck_clutch_in_closed_form() -> None:
    """T = 6 (w/50)^2 with 5/6 of it through the clutch; the twist is the clutch's torque over c."""
    found = pt.steady_function(PLANT, POINT, OUTPUTS, guesses=GUESSES)
    assert found.modes["clutch.mode"] == 0.0
    for torque in (6.0, 2.0, 9.0):
        y, margin = found.function([torque, 1.0], found.p)
        w = 50 * np.sqrt(torque / 6)
        np.testing.assert_allclose(np.array(y).ravel(), [w, w, -torque * 5 / 6e3, -torque * 5 / 6], rtol=1e-8)
        assert np.array(margin).min() >= -1e-9
        first, second = slopes(found, [torque, 1.0])
        np.testing.assert_allclose(first[:, 0], [w / 2 / torque, w / 2 / torque, -5 / 6e3, -5 / 6], rtol=1e-7)
        np.testing.assert_allclose(first[:, 1], 0.0, atol=1e-9)
        assert second[0, 0] == pytest.approx(-w / 4 / torque**2, rel=1e-6)
    assert float(ca.mmin(found.function([13.0, 1.0], found.p)[1])) < 0  # above 10 N.m the clutch slips


class Fast(pt.Component):
    """A speed in millions."""

    torque: pt.Input = pt.signal_input("N.m", "Torque")
    source: Torque = Torque()
    rotor: Inertia = Inertia(J=1)
    fan: QuadraticSpeedDependentTorque = QuadraticSpeedDependentTorque(
        tau_nominal=-5, w_nominal=5e6, TorqueDirection=False
    )

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque, self.source.tau)
        yield pt.connect(self.source.flange, self.rotor.flange_a)
        yield pt.connect(self.rotor.flange_b, self.fan.flange)


def test_the_accuracy_of_unknowns_is_relative_to_their_size() -> None:
    """Newton's method would never end if it were absolute."""
    found = pt.steady_function(Fast(), {"torque": 5.0}, ["rotor.w"], guesses={"rotor.w": 4e6})
    assert float(found.function([6.0], found.p)[0]) == pytest.approx(5e6 * np.sqrt(1.2), rel=1e-9)


def test_a_slipping_clutch_and_parameters() -> None:
    """With a tenth of the force the clutch passes 1 N.m: (w/50)^2 is 1/5 behind it, and T - 1 before it."""
    found = pt.steady_function(PLANT, {"torque": 4.0, "press": 0.1}, OUTPUTS, guesses=GUESSES)
    assert found.modes["clutch.mode"] == -1.0
    y = np.array(found.function([4.5, 0.12], found.p)[0]).ravel()
    np.testing.assert_allclose(y[:2], 50 * np.sqrt([3.3, 1.2 / 5]), rtol=1e-8)
    P = ca.MX.sym("p", len(found.p))
    slope = ca.Function("slope", [P], [ca.jacobian(found.function([4.0, 0.1], P)[0][0], P)])
    by_p = dict(zip(found.parameters, np.array(slope(found.p)).ravel(), strict=True))
    # rotor.w = w_n sqrt(T - k F)/sqrt(tau_n) for the drag with tau_n = 1
    assert by_p["drag.w_nominal"] == pytest.approx(np.sqrt(3.0), rel=1e-7)
    assert by_p["clutch.fn_max"] == pytest.approx(-50 / 2 / np.sqrt(3.0) * 0.5 * 0.1, rel=1e-7)
    assert by_p["shaft.c"] == pytest.approx(0.0, abs=1e-12)


def test_a_bench_like_its_gradient() -> None:
    """Explicit operating points of a split-path transmission."""
    plant, at = pt.compile(SplitPathBench()), {"r": 0.4, "load": 10.0, "transmission.differential.ratio": -1.7}
    found = pt.steady_function(plant, at, ["V", "efficiency", "K"])
    exact = pt.steady_gradient(plant, at, list(at), outputs=["V", "efficiency", "K"])
    np.testing.assert_allclose(np.array(found.function(found.v, found.p)[0]).ravel(), [exact[n] for n in found.outputs])
    wanted = [[exact[f"d({y})/d({x})"].item() for x in at] for y in found.outputs]
    np.testing.assert_allclose(slopes(found, found.v)[0], wanted, rtol=1e-9, atol=1e-12)


def test_in_opti() -> None:
    """The torque for a speed of 40 rad/s, and the least torque for a power of 100 W at the fan."""
    found = pt.steady_function(PLANT, POINT, ["other.w", lambda m: -m.fan.tau * m.other.w], guesses=GUESSES)
    opti = ca.Opti()
    torque = opti.variable()
    y = found.function(ca.vertcat(torque, 1.0), found.p)[0]
    opti.subject_to(y[0] == 40.0)
    opti.set_initial(torque, 6.0)
    opti.solver("ipopt", {"print_time": False}, {"print_level": 0, "sb": "yes"})
    assert opti.solve().value(torque) == pytest.approx(6 * 0.8**2, rel=1e-6)


def test_bad_input() -> None:
    several: Any
    for several in [1.0, 2.0], [1, [2]], np.ones(2):
        with pytest.raises(pt.ParameterError, match="give the values of one operating point"):
            pt.steady_function(PLANT, {"torque": several, "press": 1.0}, OUTPUTS)
    with pytest.raises(pt.ParameterError, match="an angle that only rotates"):
        pt.steady_function(PLANT, POINT, ["rotor.phi"], guesses=GUESSES)
    at = {"r": 1.0, "load": -10.0, "transmission.differential.ratio": -1.7}  # a gear at rest under load
    with pytest.raises(pt.ParameterError, match="is not unique or does not exist"):
        pt.steady_function(SplitPathBench(), at, ["efficiency"])
