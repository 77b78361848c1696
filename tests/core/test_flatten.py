"""Hierarchy, connections and their two faces, supports, tuples, structural fields, bindings, signals and inputs."""

from __future__ import annotations

import numpy as np
import pytest

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Constant


class Leaf(pt.Component):
    """Two inertias in a row, seen as one shaft."""

    left: rot.Flange = pt.port(rot.Flange)
    right: rot.Flange = pt.port(rot.Flange)
    J: pt.Parameter = pt.parameter("kg.m2", "Each moment of inertia", default=1.0)
    a: rot.Inertia = rot.Inertia(J=9.0)
    b: rot.Inertia = rot.Inertia(J=9.0)

    def equations(self) -> pt.Equations:
        yield self.a.J == self.J
        yield self.b.J == 2 * self.J
        yield pt.connect(self.left, self.a.flange_a)
        yield pt.connect(self.a.flange_b, self.b.flange_a)
        yield pt.connect(self.b.flange_b, self.right)


class Branch(pt.Component):
    """Leaves in a row."""

    left: rot.Flange = pt.port(rot.Flange)
    right: rot.Flange = pt.port(rot.Flange)
    leaves: tuple[Leaf, ...] = (Leaf(), Leaf(J=2.0))

    def equations(self) -> pt.Equations:
        yield pt.connect(self.left, self.leaves[0].left)
        for before, after in zip(self.leaves, self.leaves[1:], strict=False):
            yield pt.connect(before.right, after.left)
        yield pt.connect(self.leaves[-1].right, self.right)


class Tree(pt.Component):
    """Two branches, a drive, and a ring of connect calls that say the same thing piece by piece."""

    first: Branch = Branch()
    second: Branch = Branch(leaves=(Leaf(J=3.0),))
    drive: rot.ConstantTorque = rot.ConstantTorque(tau_constant=12.0)
    brake: rot.ConstantTorque = rot.ConstantTorque(tau_constant=-3.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.first.left)
        yield pt.connect(self.first.right, self.second.left)
        yield pt.connect(self.second.left, self.brake.flange)


def test_hierarchy_bindings_and_nodes_of_several_connections() -> None:
    plant = pt.compile(Tree())
    assert plant.parameters["first.leaves[1].J"] == 2.0
    assert "first.leaves[1].a.J" not in plant.parameters
    result = plant.simulate(1.0)
    total = 3 * 1.0 + 3 * 2.0 + 3 * 3.0
    np.testing.assert_allclose(result["second.leaves[0].b.w"], 9.0 / total * result.time, atol=1e-10)
    np.testing.assert_allclose(result["first.right.tau"], -(12.0 - 9.0 * 9.0 / total), rtol=1e-10)
    np.testing.assert_allclose(
        result["first.right.tau"] + result["second.left.tau"] + result["brake.flange.tau"], 0, atol=1e-10
    )
    np.testing.assert_allclose(result["second.right.tau"], 0.0, atol=1e-15)


def test_bound_parameter_follows_the_whole() -> None:
    result = pt.compile(Tree()).simulate(1.0, parameters={"second.leaves[0].J": 13.0})
    assert result["first.leaves[0].a.w"][-1] == pytest.approx(9.0 / (9.0 + 39.0))


class Housed(pt.Component):
    """A gear whose housing is carried by the support of the whole."""

    flange_a: rot.Flange = pt.port(rot.Flange)
    flange_b: rot.Flange = pt.port(rot.Flange)
    support: rot.Flange = pt.support(rot.Flange)
    gear: rot.IdealGear = rot.IdealGear(ratio=3.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.flange_a, self.gear.flange_a)
        yield pt.connect(self.flange_b, self.gear.flange_b)
        yield pt.connect(self.support, self.gear.support)


class Carried(pt.Component):
    """The housed gear in another one, on a frame that can turn where ``free``."""

    free: bool = False
    inner: Housed = Housed()
    drive: rot.ConstantTorque = rot.ConstantTorque(tau_constant=2.0)
    J1: rot.Inertia = rot.Inertia(J=1.0)
    J2: rot.Inertia = rot.Inertia(J=18.0)
    frame: rot.Inertia = rot.Inertia(J=5.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.J1.flange_a)
        yield pt.connect(self.J1.flange_b, self.inner.flange_a)
        yield pt.connect(self.inner.flange_b, self.J2.flange_a)
        if self.free:
            yield pt.connect(self.inner.support, self.frame.flange_a)


def test_support_is_ground_through_two_levels() -> None:
    result = pt.simulate(Carried(), 1.0)
    np.testing.assert_allclose(result["J1.w"], 2.0 / (1.0 + 18.0 / 9.0) * result.time, atol=1e-10)
    np.testing.assert_allclose(result["frame.w"], 0.0, atol=1e-15)


def test_support_is_carried_through_two_levels() -> None:
    """Momentum: the drive stands on ground, so all momenta grow by its torque; w1 - w0 = 3 (w2 - w0)."""
    result = pt.simulate(Carried(free=True), 1.0)
    matrix = np.array([[1.0, 0.0, 0.0, 1.0], [0.0, 18.0, 0.0, -3.0], [0.0, 0.0, 5.0, 2.0], [1.0, -3.0, 2.0, 0.0]])
    a = np.linalg.solve(matrix, [2.0, 0.0, 0.0, 0.0])[:3]
    for name, value in zip(("J1.w", "J2.w", "frame.w"), a, strict=True):
        np.testing.assert_allclose(result[name], value * result.time, atol=1e-9)


class Fed(pt.Component):
    """A shaft with a signal of its own and one from outside."""

    command: pt.Input = pt.signal_input("N.m", "Torque of the first source")
    torque: rot.Torque = rot.Torque()
    other: rot.Torque = rot.Torque()
    one: Constant = Constant(k=1.0)
    J1: rot.Inertia = rot.Inertia(J=2.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.command, self.torque.tau)
        yield pt.connect(self.one.y, self.other.tau)
        yield pt.connect(self.torque.flange, self.other.flange, self.J1.flange_a)


def test_inputs_of_the_model() -> None:
    plant = pt.compile(Fed())
    assert list(plant.compiled.inputs) == ["command"]
    assert plant.simulate(1.0)["J1.w"][-1] == pytest.approx(0.5)
    assert plant.simulate(1.0, inputs={"command": 3.0})["J1.w"][-1] == pytest.approx(2.0)
    ramp = plant.simulate(1.0, inputs={"command": ([0.0, 0.5, 0.5, 1.0], [0.0, 2.0, 4.0, 4.0])})
    assert ramp["J1.w"][-1] == pytest.approx((1.0 + 0.5 + 2.0) / 2)
    assert plant.simulate(1.0)["J1.w"][-1] == pytest.approx(0.5)


class Knob(pt.Component):
    """A part with an input of the whole model."""

    turned: pt.Input = pt.signal_input("1", "Knob", default=0.5, outside=True)
    x: pt.Variable = pt.variable("1", "Integral of it", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.turned.value


class Knobs(pt.Component):
    free: Knob = Knob()
    joined: Knob = Knob()
    given: Knob = Knob()
    one: Constant = Constant(k=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.one.y, self.joined.turned)
        yield self.given.turned.value == 2.0


def test_inputs_from_outside_in_a_part() -> None:
    """Where nothing is connected and no equation of the whole gives it, the signal is an input of the model."""
    plant = pt.compile(Knobs())
    assert list(plant.compiled.inputs) == ["free.turned"]
    ends = [
        [plant.simulate(1.0, inputs=inputs)[f"{name}.x"][-1] for name in ("free", "joined", "given")]
        for inputs in ({}, {"free.turned": 3.0})
    ]
    np.testing.assert_allclose(ends, [[0.5, 1.0, 2.0], [3.0, 1.0, 2.0]])
    with pytest.raises(pt.ParameterError, match=r"no input joined\.turned"):
        plant.simulate(1.0, inputs={"joined.turned": 3.0})


def test_one_value_in_two_places() -> None:
    shaft = rot.Inertia(J=2.0)

    class Pair(pt.Component):
        shafts: tuple[rot.Inertia, ...] = (shaft, shaft)

        def equations(self) -> pt.Equations:
            yield from ()

    result = pt.simulate(Pair(), 1.0, starts={"shafts[0].w": 1.0, "shafts[1].w": 2.0})
    assert (result["shafts[0].phi"][-1], result["shafts[1].phi"][-1]) == (pytest.approx(1.0), pytest.approx(2.0))


class Switched(pt.Component):
    on: pt.Input = pt.signal_input("1", "On", default=1.0)
    x: pt.Variable = pt.variable("1", "How long it was on", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.on.value


class Switching(pt.Component):
    part: Switched = Switched()
    constant: Switched = Switched()
    usual: Switched = Switched()

    def equations(self) -> pt.Equations:
        yield self.part.on.value == pt.schedule([0, 1, 1, 2], [1, 1, 0, 0])
        yield self.constant.on.value == 0.25


def test_equation_of_the_whole_takes_the_place_of_a_default() -> None:
    result = pt.simulate(Switching(), 2.0)
    assert [result[f"{part}.x"][-1] for part in ("part", "constant", "usual")] == pytest.approx([1.0, 0.5, 2.0])
