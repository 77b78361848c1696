"""Parameters that the whole gives, and what must hold between parameters: for every set of values, wherever it comes from."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.belts import BeltDrive, Pulley
from powertrain.components.differentials import Differential
from powertrain.components.gearless.circular_cam import CircularCamDifferential
from powertrain.components.gearless.linkage import LinkageDifferential
from powertrain.components.rotational import IdealGear, IdealGearR2T, IdealPlanetary, Inertia, LossyGear, Torque
from powertrain.components.vibration import ArcSpring, Coil


class Bound(pt.Component):
    """A shaft whose inertia is given in terms of k, by way of another one."""

    a: Inertia = Inertia(J=1.0)
    b: Inertia = Inertia(J=1.0)
    source: Torque = Torque()
    k: pt.Parameter = pt.parameter("kg.m2", "Inertia", default=2.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.source.flange, self.a.flange_a)
        yield pt.connect(self.a.flange_b, self.b.flange_a)
        yield self.source.tau.value == 1
        yield self.b.J == self.a.J / 2
        yield self.k == self.a.J


def test_bound_parameters_follow() -> None:
    plant = pt.compile(Bound())
    assert list(plant.parameters) == ["k"]
    assert plant.simulate(1.0)["a.w"][-1] == pytest.approx(1 / 3, rel=1e-6)
    assert plant.simulate(1.0, parameters={"k": 4.0})["a.w"][-1] == pytest.approx(1 / 6, rel=1e-6)


def test_a_value_that_the_whole_replaces_is_refused() -> None:
    """The friction of a pulley is that of its belt drive; the inertias of ``Bound`` have no default and must be given."""
    drive = BeltDrive(pulley_a=Pulley(mue=0.3, m=0.05), mue=0.4)  # m as the default
    with pytest.raises(
        pt.ParameterError, match=r"pulley_a\.mue = 0\.3 would have no effect, because the model sets this parameter"
    ):
        pt.compile(drive)
    shaft = ArcSpring(coils=(Coil(), Coil(c=100.0)))
    with pytest.raises(
        pt.ParameterError, match=r"coils\[1\]\.c = 100 N\.m/rad would have no effect.*\n.*yield coil\.c == self\.c"
    ):
        pt.compile(shaft)


class Twins(pt.Component):
    """Two parts that share a parameter; the deeper one keeps it."""

    near: Inertia = Inertia(J=1.0)
    far: Bound = Bound(k=3.0)

    def equations(self) -> pt.Equations:
        yield self.near.J == self.far.k  # noqa: SIM300


def test_between_parts_the_left_one_follows() -> None:
    """Whichever lies deeper: what is set is what stands on the left."""
    plant = pt.compile(Twins())
    assert list(plant.parameters) == ["far.k"]
    assert plant.parameters["far.k"] == 3.0


@pytest.mark.parametrize(
    "run",
    [
        lambda: pt.compile(Bound(k=-1.0)),
        lambda: pt.simulate(Bound(k=-1.0), 1.0),
        lambda: pt.compile(Bound()).simulate(1.0, parameters={"k": -1.0}),
        lambda: pt.compile(Bound()).initialize(parameters={"k": -1.0}),
        lambda: pt.linearize(Bound(), inputs=["k"], outputs=["a.w"], parameters={"k": -1.0}),
        lambda: pt.sweep(Bound(), [{"parameters": {"k": k}} for k in (1.0, -1.0)], stop=1.0),
        lambda: pt.steady(pt.compile(Bound()), {"k": [1.0, -1.0]}),
    ],
    ids=["compile", "simulate", "run", "start", "linear model", "sweep", "map"],
)
def test_range_of_a_bound_parameter(run: Callable[[], Any]) -> None:
    with pytest.raises(
        pt.ParameterError,
        match=r"(?s)[ab]\.J = -(1|0\.5) kg\.m2 is outside its range.*yield self\..*\(test_binding",
    ):
        run()


class Circle(pt.Component):
    """Two inertias that give each other's value."""

    a: Inertia = Inertia(J=1.0)
    b: Inertia = Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.a.flange_b, self.b.flange_a)
        yield self.b.J == self.a.J + 1
        yield self.a.J == self.b.J - 1


def test_circle_is_named() -> None:
    with pytest.raises(
        pt.ModelError,
        match=r"(?s)circular definition of parameters: ([ab]\.J) by [ab]\.J by \1;.*self\.b\.J == .*test_binding.py",
    ) as caught:
        pt.compile(Circle())
    assert "self.a.J == self.b.J - 1" in str(caught.value)


class Twice(pt.Component):
    """An inertia with two values."""

    a: Inertia = Inertia(J=1.0)
    k: pt.Parameter = pt.parameter("kg.m2", "Inertia", default=2.0)

    def equations(self) -> pt.Equations:
        yield self.k == self.a.J
        yield 2 * self.k == self.a.J


def test_two_values() -> None:
    with pytest.raises(pt.ModelError, match=r"(?s)a\.J is set twice.*self\.k == .*2 \* self\.k == "):
        pt.compile(Twice())


class SetsHeld(pt.Component):
    """An equation for a discrete variable."""

    n: pt.Discrete = pt.discrete("1", "Held")
    x: pt.Variable = pt.variable("1", "Held, too")

    def equations(self) -> pt.Equations:
        yield self.x == self.n
        yield self.n == 3


def test_discrete_variable_is_no_parameter() -> None:
    with pytest.raises(pt.ModelError, match="only parameters may appear here"):
        pt.compile(SetsHeld())


class Ring(pt.Component):
    """A ring that is open inside."""

    outer: pt.Parameter = pt.parameter("m", "Outer diameter", default=0.2, above=0)
    inner: pt.Parameter = pt.parameter("m", "Inner diameter", default=0.1, min=0)
    parts: int = 1
    extra: pt.Parameter = pt.parameter("m2", "Area of a lug", default=0.0)
    area: pt.Variable = pt.variable("m2", "Area")

    def check(self) -> pt.Equations:
        yield self.parts > 0
        yield self.inner < self.outer  # the hole lies inside

    def equations(self) -> pt.Equations:
        yield self.area == math.pi / 4 * (self.outer**2 - self.inner**2) + self.extra


class Rings(pt.Component):
    """A ring whose hole is half of a length."""

    ring: Ring = Ring()
    length: pt.Parameter = pt.parameter("m", "Length", default=0.2)

    def equations(self) -> pt.Equations:
        yield self.ring.inner == self.length / 2


@pytest.mark.parametrize(
    "run",
    [
        lambda: Ring(inner=0.3),
        lambda: pt.replace(Ring(), outer=0.05),
        lambda: pt.compile(Ring()).simulate(1.0, parameters={"inner": 0.3}),
        lambda: pt.compile(Rings()).simulate(1.0, parameters={"length": 0.6}),
        lambda: pt.compile(Rings()).simulate(1.0, parameters={"ring.outer": 0.05}),
        lambda: pt.steady(pt.compile(Ring()), {"inner": [0.05, 0.15], "outer": [0.1, 0.2]}),
    ],
    ids=["made", "replaced", "run", "bound", "part", "map"],
)
def test_condition_between_parameters(run: Callable[[], Any]) -> None:
    with pytest.raises(
        pt.ParameterError,
        match=r"(?s)self\.inner < self\.outer  # the hole lies inside.*does not hold with .* = 0\.\d+ m",
    ):
        run()


def test_condition_names_the_values() -> None:
    with pytest.raises(
        pt.ParameterError, match=r"Ring: yield self\.inner.*\n  this does not hold with outer = 0\.2 m, inner = 0\.3 m"
    ):
        Ring(inner=0.3)
    with pytest.raises(pt.ParameterError, match=r"ring: yield.*\n.*with length = 0\.2 m, ring\.outer = 0\.05 m"):
        pt.compile(Rings()).simulate(1.0, parameters={"ring.outer": 0.05})


def test_condition_on_a_plain_field() -> None:
    with pytest.raises(pt.ParameterError, match=r"yield self\.parts > 0"):
        Ring(parts=0)


def test_map_where_all_sets_go_together() -> None:
    found = pt.steady(pt.compile(Ring()), {"inner": [0.05, 0.08], "outer": [0.1, 0.2]}, outputs=["area"])
    assert not found["status"].any()


def test_map_whose_axis_goes_with_the_other_parameters_where_its_default_does_not() -> None:
    plant, small = pt.compile(Ring()), [0.01, 0.02]
    found = pt.steady(plant, {"inner": small}, parameters={"outer": 0.05}, outputs=["area"])
    np.testing.assert_allclose(found["area"], math.pi / 4 * (0.05**2 - np.square(small)))
    for grid in {"inner": [0.01, 0.06]}, {"extra": [1.0]}:
        with pytest.raises(pt.ParameterError, match=r"self\.inner < self\.outer"):
            pt.steady(plant, grid, parameters={"outer": 0.05}, outputs=["area"])


class NoCondition(pt.Component):
    """A check that yields no comparison."""

    k: pt.Parameter = pt.parameter("1", "A number", default=2.0)

    def check(self) -> pt.Equations:
        yield self.k + 1

    def equations(self) -> pt.Equations:
        yield from ()


def test_check_yields_comparisons() -> None:
    with pytest.raises(pt.ModelError, match=r"yield self\.k \+ 1 .*comparisons of parameters"):
        NoCondition()


class Guarded(pt.Component):
    """``within`` about parameters alone."""

    k: pt.Parameter = pt.parameter("m", "A length", default=2.0)
    x: pt.Variable = pt.variable("m", "A length")

    def equations(self) -> pt.Equations:
        pt.within(self.k, 0, 2 * self.k - 1, name="length", unit="m")
        yield self.x == self.k


def test_within_of_parameters_is_looked_at_before_a_run() -> None:
    plant = pt.compile(Guarded())
    with pytest.raises(
        pt.ParameterError, match=r"(?s)within\(self\.k.*length = 0\.5 m is outside \[0, 0\] m with k = 0\.5 m"
    ):
        plant.parameter_vector({"k": 0.5})


class Bench(pt.Component):
    """A differential between three inertias."""

    part: Differential
    crown: Inertia = Inertia(J=1.0)
    left: Inertia = Inertia(J=1.0)
    right: Inertia = Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.crown.flange_b, self.part.crown)
        yield pt.connect(self.part.left, self.left.flange_a)
        yield pt.connect(self.part.right, self.right.flange_a)


@pytest.mark.parametrize(
    ("part", "values"),
    [
        (CircularCamDifferential(), {"D_in": 0.2}),
        (CircularCamDifferential(), {"d_in": 0.095}),
        (LinkageDifferential(), {"a": 0.12}),
        (LinkageDifferential(), {"offset": -0.03}),
    ],
)
def test_lengths_of_the_librarys_differentials(part: Differential, values: Mapping[str, float]) -> None:
    plant = pt.compile(Bench(part=part))
    with pytest.raises(pt.ParameterError, match="does not hold with"):
        plant.simulate(1.0, parameters={f"part.{name}": value for name, value in values.items()})


@pytest.mark.parametrize("make", [LossyGear, IdealGear, IdealPlanetary, IdealGearR2T])
def test_ratio_of_nothing(make: Callable[..., pt.Component]) -> None:
    with pytest.raises(pt.ParameterError, match=r"ratio = 0 .*is outside its range"):
        make(ratio=0.0)
