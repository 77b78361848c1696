"""Rigid joints, constraints and differentiated inputs against hand derivations."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
from core_models import Cam, Crank, Joined, row

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components import translational as trans
from powertrain.components.blocks import Constant, Sine

TIGHT: dict[str, Any] = {"rtol": 1e-9}


def test_inertias_joined_rigidly_move_as_one() -> None:
    model = row(rot.ConstantTorque(tau_constant=6.0), *(rot.Inertia(J=J) for J in (1.0, 2.0, 3.0)))
    plant = pt.compile(model)
    assert len(plant.compiled.states) == 2
    result = plant.simulate(2.0)
    np.testing.assert_allclose(result["parts[3].w"], result.time, atol=1e-9)
    np.testing.assert_allclose(result["parts[2].flange_a.tau"], 5.0, rtol=1e-9)


def test_inertias_joined_by_a_gear() -> None:
    """(J1 + J2/i^2) a1 = T."""
    model = row(rot.ConstantTorque(tau_constant=3.0), rot.Inertia(J=1.0), rot.IdealGear(ratio=-2.0), rot.Inertia(J=8.0))
    result = pt.simulate(model, 1.0)
    np.testing.assert_allclose(result["parts[1].w"], 3.0 / (1.0 + 8.0 / 4.0) * result.time, atol=1e-9)
    np.testing.assert_allclose(result["parts[3].phi"], result["parts[1].phi"] / -2.0, atol=1e-12)


@pytest.mark.parametrize("ratio", [0.5, 2.0])
def test_planetary_joins_three_inertias(ratio: float) -> None:
    J, torque = {"sun": 1.0, "ring": 2.0, "carrier": 3.0}, 4.0
    names = list(J)
    model = Joined(
        parts=(
            rot.IdealPlanetary(ratio=ratio),
            *(rot.Inertia(J=v) for v in J.values()),
            rot.ConstantTorque(tau_constant=torque),
        ),
        joints=(("0.sun", "1.flange_a", "4.flange"), ("0.ring", "2.flange_a"), ("0.carrier", "3.flange_a")),
    )
    plant = pt.compile(model)
    assert len(plant.compiled.states) == 4
    result = plant.simulate(1.0)
    share = {"sun": 1.0, "ring": ratio, "carrier": -(1 + ratio)}
    matrix = np.zeros((4, 4))
    for k, name in enumerate(names):
        matrix[k, k], matrix[k, 3] = J[name], share[name]
    matrix[3, :3] = [share[name] for name in names]
    a = np.linalg.solve(matrix, [torque, 0, 0, 0])
    for k in range(3):
        np.testing.assert_allclose(result[f"parts[{k + 1}].w"], a[k] * result.time, atol=1e-9)


def test_rolling_wheel_joins_rotation_and_translation() -> None:
    """(J/r + m r) a_translation = T."""
    model = Joined(
        parts=(
            rot.ConstantTorque(tau_constant=5.0),
            rot.Inertia(J=2.0),
            rot.IdealRollingWheel(radius=0.5),
            trans.Mass(m=10.0),
        ),
        joints=(("0.flange", "1.flange_a"), ("1.flange_b", "2.flangeR"), ("2.flangeT", "3.flange_a")),
    )
    result = pt.simulate(model, 1.0)
    np.testing.assert_allclose(result["parts[3].v"], 5.0 / (2.0 / 0.5 + 10.0 * 0.5) * result.time, atol=1e-9)


def test_masses_joined_by_a_rod() -> None:
    model = row(trans.ConstantForce(f_constant=6.0), trans.Mass(m=1.0), trans.Rod(L=0.7), trans.Mass(m=2.0))
    result = pt.simulate(model, 1.0)
    np.testing.assert_allclose(result["parts[3].v"], 2.0 * result.time, atol=1e-9)
    gap = result["parts[3].s"] - result["parts[1].s"]
    np.testing.assert_allclose(gap, gap[0], atol=1e-12)


def test_speed_source_drives_an_inertia() -> None:
    """The input is differentiated: tau = J der(w_ref)."""
    model = row(rot.Speed(exact=True), rot.Inertia(J=2.0), Sine(f=0.5, amplitude=3.0), joints=(("2.y", "0.w_ref"),))
    result = pt.simulate(model, 2.0, **TIGHT)
    np.testing.assert_allclose(
        result["parts[1].flange_a.tau"], 2.0 * 3.0 * np.pi * np.cos(np.pi * result.time), atol=1e-9
    )


def test_inverse_dynamics_asks_the_torque_of_a_position() -> None:
    """An elastic load: J1 and J2 with spring c; phi1 = sin t asks tau = J1 der2(phi1) + c (phi1 - phi2)."""
    c, J1, J2 = 50.0, 1.0, 2.0
    model = row(
        rot.Position(exact=True), rot.Inertia(J=J1), rot.Spring(c=c), rot.Inertia(J=J2),
        Sine(f=1 / (2 * np.pi)), joints=(("4.y", "0.phi_ref"),),
    )  # fmt: skip
    result = pt.simulate(model, 3.0, starts={"parts[3].w": 0.0, "parts[3].phi": 0.0}, **TIGHT)
    t, omega = result.time, np.sqrt(c / J2)
    phi2 = (np.sin(t) - np.sin(omega * t) / omega) / (1 - 1 / omega**2)
    np.testing.assert_allclose(result["parts[3].phi"], phi2, atol=1e-7)
    np.testing.assert_allclose(result["parts[1].flange_a.tau"], -J1 * np.sin(t) + c * (np.sin(t) - phi2), atol=1e-5)


def test_massless_node_between_springs() -> None:
    c1, c2, J = 100.0, 300.0, 2.0
    model = row(rot.Fixed(), rot.Spring(c=c1), rot.Spring(c=c2), rot.Inertia(J=J))
    result = pt.simulate(model, 1.0, starts={"parts[3].phi": 0.1}, **TIGHT)
    omega = np.sqrt(c1 * c2 / (c1 + c2) / J)
    np.testing.assert_allclose(result["parts[3].phi"], 0.1 * np.cos(omega * result.time), atol=1e-8)
    np.testing.assert_allclose(result["parts[1].tau"], result["parts[2].tau"], atol=1e-9)


def test_massless_node_between_spring_and_damper() -> None:
    """A Maxwell element held at one end: T = c x = d (w - der(x)), J der(w) = -T."""
    c, d, J = 40.0, 5.0, 1.0
    model = row(rot.Fixed(), rot.Spring(c=c), rot.Damper(d=d), rot.Inertia(J=J))
    result = pt.simulate(model, 2.0, starts={"parts[3].w": 2.0, "parts[1].phi_rel": 0.0}, **TIGHT)
    from scipy.linalg import expm

    matrix = np.array([[0.0, -c / J], [1.0, -c / d]])
    expected = np.array([expm(matrix * t) @ [2.0, 0.0] for t in result.time[::50]])
    np.testing.assert_allclose(result["parts[3].w"][::50], expected[:, 0], atol=1e-7)


def test_nonlinear_constraint_keeps_the_energy() -> None:
    """(J1 + J2 f'^2) w^2 is constant, f' = 1 + e cos(phi)."""
    model = row(rot.Inertia(J=1.0), Cam(e=0.3), rot.Inertia(J=2.0))
    plant = pt.compile(model)
    assert len(plant.compiled.states) == 2
    result = plant.simulate(3.0, starts={"parts[0].w": 4.0, "parts[0].phi": 0.0}, **TIGHT)
    phi, w = result["parts[0].phi"], result["parts[0].w"]
    effective = 1.0 + 2.0 * (1 + 0.3 * np.cos(phi)) ** 2
    np.testing.assert_allclose(effective * w**2, effective[0] * 16.0, rtol=1e-7)
    np.testing.assert_allclose(result["parts[2].phi"], phi + 0.3 * np.sin(phi), atol=1e-9)


@pytest.mark.parametrize("implicit", [False, True])
def test_slider_crank_keeps_the_energy(implicit: bool) -> None:
    """J w^2/2 + m (ds/dphi w)^2/2 is constant, with the derivative of s by finite differences."""
    r, rod, m, J = 0.1, 0.3, 1.0, 0.1
    model = row(rot.Inertia(J=J), Crank(implicit=implicit))
    result = pt.simulate(model, 1.0, starts={"parts[0].w": 10.0, "parts[0].phi": 0.5}, rtol=1e-8)
    phi, w = result["parts[0].phi"], result["parts[0].w"]

    def s(angle: Any) -> Any:
        return r * np.cos(angle) + np.sqrt(rod**2 - (r * np.sin(angle)) ** 2)

    np.testing.assert_allclose(result["parts[1].s"], s(phi), atol=1e-7)
    slope = (s(phi + 1e-6) - s(phi - 1e-6)) / 2e-6
    energy = J * w**2 / 2 + m * (slope * w) ** 2 / 2
    np.testing.assert_allclose(energy, energy[0], rtol=2e-6)
    assert phi[-1] > 2 * np.pi


class ScotchYoke(pt.Component):
    """s = r sin(phi): a crank of 0.1 kg.m2 and a slider of 1 kg, whose position has a start."""

    phi: pt.Variable = pt.variable("rad", "Angle")
    s: pt.Variable = pt.variable("m", "Position of the slider", start=0.0)
    F: pt.Variable = pt.variable("N", "Force on the slider")

    def equations(self) -> pt.Equations:
        yield self.s == 0.5 * ca.sin(self.phi)
        yield pt.der(pt.der(self.s)) == self.F
        yield 0.1 * pt.der(pt.der(self.phi)) == -self.F * 0.5 * ca.cos(self.phi)

    def initial(self) -> pt.Equations:
        yield pt.der(self.phi) == 10.0


def test_the_slider_of_a_yoke_is_no_state() -> None:
    """At its ends the speed of the slider does not tell that of the crank; (0.1 + 0.25 cos^2 phi) w^2 is constant through them."""
    plant = pt.compile(ScotchYoke())
    assert set(plant.compiled.states) == {"phi", "der(phi)"}
    result = plant.simulate(2.0, **TIGHT)
    phi = result["phi"]
    assert phi[-1] > 4 * np.pi
    t, angle = result.time, np.linspace(0.0, phi[-1], 20001)
    time = np.sqrt((0.1 + 0.25 * np.cos(angle) ** 2) / 35.0)
    passed = np.concatenate([[0.0], np.cumsum((time[1:] + time[:-1]) / 2 * np.diff(angle))])
    np.testing.assert_allclose(np.interp(t, passed, angle), phi, atol=1e-5)


def test_constant_input_has_no_derivative() -> None:
    model = row(rot.Speed(exact=True), rot.Inertia(J=2.0), Constant(k=3.0), joints=(("2.y", "0.w_ref"),))
    np.testing.assert_allclose(pt.simulate(model, 1.0)["parts[1].flange_a.tau"], 0.0, atol=1e-12)


class Twice(pt.Component):
    """Two planetaries side by side: with one ratio the second says nothing new, with two the three shafts turn as one."""

    one: rot.IdealPlanetary = rot.IdealPlanetary(ratio=2.0)
    two: rot.IdealPlanetary = rot.IdealPlanetary(ratio=2.0)
    sun: rot.Inertia = rot.Inertia(J=1.0)
    ring: rot.Inertia = rot.Inertia(J=1.0)
    carrier: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.one.sun, self.two.sun, self.sun.flange_a)
        yield pt.connect(self.one.ring, self.two.ring, self.ring.flange_a)
        yield pt.connect(self.one.carrier, self.two.carrier, self.carrier.flange_a)


def test_constraints_that_repeat_each_other_are_all_quoted() -> None:
    with pytest.raises(pt.ModelError, match=r"repeat or contradict(.|\n)*\n  one: (.|\n)*\n  two: "):
        pt.compile(Twice())
    assert len(pt.compile(pt.replace(Twice(), {"two.ratio": 3.0})).compiled.states) == 2


class FourConstraints(pt.Component):
    """Six speeds v and the torques of four constraints C v = 0, the third of which is half of the first plus the second."""

    a: pt.Variable = pt.variable("rad/s", "speed")
    b: pt.Variable = pt.variable("rad/s", "speed")
    c: pt.Variable = pt.variable("rad/s", "speed")
    d: pt.Variable = pt.variable("rad/s", "speed")
    e: pt.Variable = pt.variable("rad/s", "speed")
    f: pt.Variable = pt.variable("rad/s", "speed")
    t1: pt.Variable = pt.variable("N.m", "torque")
    t2: pt.Variable = pt.variable("N.m", "torque")
    t3: pt.Variable = pt.variable("N.m", "torque")
    t4: pt.Variable = pt.variable("N.m", "torque")

    def equations(self) -> pt.Equations:
        yield self.a + self.b + self.c == 0
        yield self.a + 2 * self.b + self.d == 0
        yield 1.5 * self.a + 2.5 * self.b + 0.5 * self.c + self.d == 0
        yield self.c + self.e + self.f == 0
        yield pt.der(self.a) == 1 - self.t1 - self.t2 - 1.5 * self.t3
        yield pt.der(self.b) == 1 - self.t1 - 2 * self.t2 - 2.5 * self.t3
        yield pt.der(self.c) == 1 - self.t1 - 0.5 * self.t3 - self.t4
        yield pt.der(self.d) == 1 - self.t2 - self.t3
        yield pt.der(self.e) == 1 - self.t4
        yield pt.der(self.f) == 2 - self.t4


def test_a_constraint_that_others_do_not_repeat_is_not_quoted() -> None:
    with pytest.raises(pt.ModelError, match="repeat or contradict") as caught:
        pt.compile(FourConstraints())
    said = str(caught.value)
    assert [text in said for text in ("b + self.c ==", "b + self.d ==", "c + self.d ==", "f ==")] == [True] * 3 + [
        False
    ]


class Sum(pt.Component):
    """The derivative of a sum of two variables that time gives: all three equations have to be differentiated."""

    x: pt.Variable = pt.variable("1", "Sum")
    y: pt.Variable = pt.variable("1", "First")
    z: pt.Variable = pt.variable("1", "Second")
    w: pt.Variable = pt.variable("1/s", "Rate of the sum")
    s: pt.Variable = pt.variable("1", "A state", start=0.0)

    def equations(self) -> pt.Equations:
        yield self.w == pt.der(self.x)
        yield self.x * self.y == self.z + 2
        yield self.y + 0.1 * self.z == 2 + ca.sin(pt.time)
        yield self.z - 0.3 * self.y == ca.cos(pt.time)
        yield pt.der(self.s) == self.w


def test_equations_of_several_variables_are_differentiated_together() -> None:
    """The integral of the rate is the change of the sum."""
    result = pt.simulate(Sum(), 3.0, **TIGHT)
    t = result.time
    y = (2 + np.sin(t) - 0.1 * np.cos(t)) / 1.03
    x = (np.cos(t) + 0.3 * y + 2) / y
    np.testing.assert_allclose(result["x"], x, atol=1e-9)
    np.testing.assert_allclose(result["s"], x - x[0], atol=1e-7)


N = 7


class Integrators(pt.Component):
    """x0 = sin(2 t), every other x is the rate of the one before and its square, with the equations in any order."""

    order: tuple[int, ...]

    def equations(self) -> pt.Equations:
        x = [getattr(self, f"x{k}") for k in range(N + 1)]
        said = [x[0] == ca.sin(2 * pt.time), *(x[k + 1] == pt.der(x[k]) + x[k] ** 2 for k in range(N))]
        for k in self.order:
            yield said[k]


Chain = type("Chain", (Integrators,), {f"x{k}": pt.variable("1", "Link") for k in range(N + 1)} | {
    "__annotations__": {f"x{k}": pt.Variable for k in range(N + 1)}
})  # fmt: skip


@pytest.mark.parametrize("seed", range(5))
def test_a_chain_is_differentiated_as_often_as_it_is_long(seed: int) -> None:
    """x_k+1 = der(x_k) + x_k^2 from a given x_0: no states, the last is known by symbolic differentiation."""
    order = tuple(np.random.default_rng(seed).permutation(N + 1).tolist())
    model: Any = Chain(order=order)
    result = pt.simulate(model, 1.0, times=[0.3, 0.8])
    t = ca.SX.sym("t")
    x = ca.sin(2 * t)
    for _ in range(N):
        x = ca.jacobian(x, t) + x**2
    assert not result.compiled.states
    expected = ca.Function("x", [t], [x])
    np.testing.assert_allclose(result[f"x{N}"], [float(expected(at)) for at in (0.3, 0.8)], rtol=1e-9)
