"""Steady operating points of turning shafts: which angles are left out, and twists that remain."""

from __future__ import annotations

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.rotational import (
    Clutch,
    ConstantTorque,
    Damper,
    Fixed,
    IdealGear,
    Inertia,
    QuadraticSpeedDependentTorque,
    SpringDamper,
    Torque,
)

OK = 0


class ShaftLine(pt.Component):
    """An engine, a reversing reduction gear, a stiff shaft and a propeller."""

    engine: ConstantTorque = ConstantTorque(tau_constant=21e3)
    J1: Inertia = Inertia(J=160.0)
    gear: IdealGear = IdealGear(ratio=-3.71)
    shaft: SpringDamper = SpringDamper(c=1e8, d=1e3)
    J2: Inertia = Inertia(J=8800.0)
    propeller: QuadraticSpeedDependentTorque = QuadraticSpeedDependentTorque(
        tau_nominal=-1e5, w_nominal=14.0, TorqueDirection=False
    )

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.flange, self.J1.flange_a)
        yield pt.connect(self.J1.flange_b, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.J2.flange_a)
        yield pt.connect(self.J2.flange_b, self.propeller.flange)


def test_the_twist_of_a_stiff_shaft_is_steady() -> None:
    """Angles turn together at the ratio of the gear: their slopes of 1e8 N.m/rad cancel except for round-off."""
    tau = np.array([5e3, 21e3])
    found = pt.steady(ShaftLine(), {"engine.tau_constant": tau}, outputs=["shaft.tau", "shaft.phi_rel", "J2.w"])
    assert found["shaft.tau"].values == pytest.approx(3.71 * tau, rel=1e-9)
    assert found["shaft.phi_rel"].values == pytest.approx(3.71e-8 * tau, rel=1e-9)
    assert found["J2.w"].values == pytest.approx(-14.0 * np.sqrt(3.71 * tau / 1e5), rel=1e-9)
    with pytest.raises(pt.ParameterError, match=r"J2\.phi depends on an angle that only rotates"):
        pt.steady(ShaftLine(), {"engine.tau_constant": tau}, outputs=["J2.phi"])


class Twisted(pt.Component):
    """A spring between two of three inertias that turn together: two angles merely turn."""

    tau: pt.Input = pt.signal_input("N.m", "Driving torque")
    torque: Torque = Torque()
    J1: Inertia = Inertia(J=0.5)
    shaft: SpringDamper = SpringDamper(c=1e3, d=2.0)
    J2: Inertia = Inertia(J=0.3)
    clutch: Clutch = Clutch(fn_max=30.0, mue_pos=((0.0, 1.0),))
    J3: Inertia = Inertia(J=0.2)
    drag: Damper = Damper(d=0.3)
    ground: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.tau, self.torque.tau)
        yield pt.connect(self.torque.flange, self.J1.flange_a)
        yield pt.connect(self.J1.flange_b, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.J2.flange_a)
        yield pt.connect(self.J2.flange_b, self.clutch.flange_a)
        yield self.clutch.f_normalized.value == 1.0
        yield pt.connect(self.clutch.flange_b, self.J3.flange_a)
        yield pt.connect(self.J3.flange_b, self.drag.flange_a)
        yield pt.connect(self.drag.flange_b, self.ground.flange)


class TwoLines(pt.Component):
    """Two equal lines that have nothing to do with each other: a torque drives a damper through a spring."""

    drives: tuple[ConstantTorque, ...] = (ConstantTorque(tau_constant=10),) * 2
    shafts: tuple[Inertia, ...] = (Inertia(J=1),) * 4
    springs: tuple[SpringDamper, ...] = (SpringDamper(c=100, d=1),) * 2
    dampers: tuple[Damper, ...] = (Damper(d=2),) * 2
    ground: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        for k in range(2):
            yield pt.connect(self.drives[k].flange, self.shafts[2 * k].flange_a)
            yield pt.connect(self.shafts[2 * k].flange_b, self.springs[k].flange_a)
            yield pt.connect(self.springs[k].flange_b, self.shafts[2 * k + 1].flange_a)
            yield pt.connect(self.shafts[2 * k + 1].flange_b, self.dampers[k].flange_a)
            yield pt.connect(self.dampers[k].flange_b, self.ground.flange)


@pytest.mark.parametrize("line", [0, 1])
def test_which_angles_are_left_out_does_not_depend_on_the_grid(line: int) -> None:
    """Both ends of a line turn alike; which of them is left out was a matter of round-off, so the map was refused."""
    found = pt.steady(TwoLines(), {f"springs[{line}].c": [80.0, 120.0]}, outputs=["shafts[*].w", "springs[*].phi_rel"])
    assert found.status.values.tolist() == [0, 0]
    np.testing.assert_allclose([found[f"shafts[{k}].w"].values for k in range(4)], 5.0, rtol=1e-12)
    np.testing.assert_allclose(found[f"springs[{line}].phi_rel"], [-10 / 80, -10 / 120], rtol=1e-12)
    np.testing.assert_allclose(found[f"springs[{1 - line}].phi_rel"], -0.1, rtol=1e-12)


def test_several_angles_that_turn_together() -> None:
    found = pt.steady(Twisted(), {"tau": [-9.0, 6.0]}, outputs=["J1.w", "J2.w", "J3.w", "shaft.phi_rel"])
    assert (found.status == OK).all()
    for name in ("J1.w", "J2.w", "J3.w"):
        np.testing.assert_allclose(found[name], [-30.0, 20.0], rtol=1e-9)
    np.testing.assert_allclose(found["shaft.phi_rel"], [9e-3, -6e-3], rtol=1e-9)


class Geared(pt.Component):
    """A spring of 5 N.m/rad behind a gear; its twist is a state, or the difference of two."""

    declared: bool = False
    r: pt.Parameter = pt.parameter("1", "Ratio", default=2.0)
    d: pt.Parameter = pt.parameter("N.m.s/rad", "Damping of the slow side", default=2.0)
    tau: pt.Input = pt.signal_input("N.m", "Torque on the fast side", default=1.0)
    phi: pt.Variable = pt.variable("rad", "Fast angle")
    w: pt.Variable = pt.variable("rad/s", "Fast speed")
    psi: pt.Variable = pt.variable("rad", "Slow angle")
    u: pt.Variable = pt.variable("rad/s", "Slow speed")
    twist: pt.Variable = pt.variable("rad", "Twist", prefer=True)

    def equations(self) -> pt.Equations:
        yield pt.der(self.phi) == self.w
        yield pt.der(self.psi) == self.u
        if self.declared:
            yield pt.der(self.twist) == self.w - self.r * self.u
        else:
            yield self.twist == self.phi - self.r * self.psi
        yield pt.der(self.w) == self.tau.value - 5 * self.twist
        yield pt.der(self.u) == 5 * self.r * self.twist - self.d * self.u


@pytest.mark.parametrize("axis", ["d", "tau"])
def test_angles_that_turn_together_by_the_ratio_of_a_gear(axis: str) -> None:
    """u = r tau/d and w = r u."""
    found = pt.steady(Geared(), {axis: [1.0, 4.0]}, outputs=["w", "u"])
    u = np.array([2.0, 0.5]) if axis == "d" else np.array([1.0, 4.0])
    np.testing.assert_allclose([found.u, found.w], [u, 2 * u], rtol=1e-9)


def test_angles_that_turn_together_by_another_ratio_at_every_point() -> None:
    """Their twist is the same kind of state at every point."""
    found = pt.steady(Geared(declared=True), {"r": [1.0, 3.0]}, outputs=["w", "u"])
    np.testing.assert_allclose([found.u, found.w], [[0.5, 1.5], [0.5, 4.5]], rtol=1e-9)
    with pytest.raises(pt.ParameterError, match="turn together by ratios that change along the grid"):
        pt.steady(Geared(), {"r": [1.0, 3.0]}, outputs=["w"])


class InTurn(pt.Component):
    """Every condition depends on what the one before gives, and on x."""

    x: pt.Input = pt.signal_input("1", "Level")
    a: pt.Variable = pt.variable("1", "First")
    b: pt.Variable = pt.variable("1", "Second")
    c: pt.Variable = pt.variable("1", "Third")

    def equations(self) -> pt.Equations:
        yield self.a == pt.switch(self.x.value > 0, 1.0, -1.0)
        yield self.b == pt.switch(self.a > self.x.value, 5.0, 6.0)
        yield self.c == pt.switch(self.b + self.x.value > 5.5, 2.0, 3.0)


def test_conditions_that_depend_on_each_other_in_turn() -> None:
    x = np.array([-3.0, -0.6, -0.4, 0.2, 0.7, 2.0])
    found = pt.steady(InTurn(), {"x": x})
    a = np.where(x > 0, 1, -1)
    b = np.where(a > x, 5, 6)
    np.testing.assert_array_equal([found.a, found.b, found.c], [a, b, np.where(b + x > 5.5, 2, 3)])
