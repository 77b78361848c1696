"""What is wrong in a component's text is quoted with its line."""

from __future__ import annotations

import casadi as ca
import pytest
from refusals import refused

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components import translational as trans
from powertrain.components.blocks import Constant


class Same(pt.Component):
    """x == x."""

    J1: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield self.J1.w == self.J1.w


class Numbers(pt.Component):
    """An equation between numbers."""

    J1: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield 1.0 == 2.0


class NoEquation(pt.Component):
    """An expression instead of an equation."""

    J1: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield self.J1.w


class PythonIf(pt.Component):
    """A Python if on a symbol."""

    J1: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        if self.J1.w > 0:
            yield self.J1.flange_a.tau == 1


class Unconnected(pt.Component):
    """Two inertias, one of whose connections is not yielded."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    J2: rot.Inertia = rot.Inertia(J=1.0)
    J3: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.J1.flange_b, self.J2.flange_a)
        pt.connect(self.J2.flange_b, self.J3.flange_a)


class NeverYielded(pt.Component):
    """Equations without any yield."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    J2: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:  # type: ignore[return]
        pt.connect(self.J1.flange_b, self.J2.flange_a)


class Dropped(pt.Component):
    """A start without yield beside one with it."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    J2: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield from ()

    def initial(self) -> pt.Equations:
        self.J1.w == 5.0  # noqa: B015
        yield self.J2.w == 2.0


class DroppedCondition(pt.Component):
    """A condition without yield beside one with it."""

    low: pt.Parameter = pt.parameter("1", "Lower limit", default=3.0)
    high: pt.Parameter = pt.parameter("1", "Upper limit", default=2.0)

    def equations(self) -> pt.Equations:
        yield from ()

    def check(self) -> pt.Equations:
        yield self.low > 0.0
        self.low < self.high  # noqa: B015


class MixedSum(pt.Component):
    """A speed in m/s and one in km/h are added."""

    v: pt.Parameter = pt.parameter("m/s", "Speed", default=10.0)
    wind: pt.Parameter = pt.parameter("km/h", "Wind speed", default=36.0)
    air: pt.Variable = pt.variable("m/s", "Speed of the air")

    def equations(self) -> pt.Equations:
        yield self.air == 2.0 + (ca.fabs(self.v) - self.wind)


class ManyPaths(pt.Component):
    """A sum in which a speed occurs 2**40 times."""

    v: pt.Parameter = pt.parameter("m/s", "Speed", default=10.0)
    wind: pt.Parameter = pt.parameter("km/h", "Wind speed", default=36.0)
    air: pt.Variable = pt.variable("m/s", "Speed of the air")

    def equations(self) -> pt.Equations:
        speed = ca.fabs(self.v)
        for k in range(40):
            speed = speed + ca.fmin(speed, float(k))
        yield self.air == speed - self.wind


class Kilowatts(pt.Component):
    """A power in W is equated to a map in kW."""

    power: pt.Map = pt.Map.curve([0.0, 1.0], [0.0, 50.0], x="time", x_unit="s", unit="kW")
    P: pt.Variable = pt.variable("W", "Power")

    def equations(self) -> pt.Equations:
        yield self.power(pt.time) == self.P


class NoPart(pt.Component):
    """A component that is made in the equations."""

    J1: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.J1.flange_b, rot.Inertia(J=2.0).flange_a)


class MixedPorts(pt.Component):
    """A shaft joined to a mass."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    mass: trans.Mass = trans.Mass(m=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.J1.flange_b, self.mass.flange_a)


class OnePort(pt.Component):
    """connect with one port."""

    J1: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.J1.flange_b)


class SamePort(pt.Component):
    """connect with one port twice."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    J2: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.J1.flange_b, self.J1.flange_b)


class OtherUnit(pt.Component):
    """A torque as the reference of a speed."""

    torque: pt.Input = pt.signal_input("N.m", "Torque")
    source: rot.Speed = rot.Speed()
    J1: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque, self.source.w_ref)
        yield pt.connect(self.source.flange, self.J1.flange_a)


class Rotations(pt.Component):
    """A start in revolutions per minute."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    n: pt.Parameter = pt.parameter("rpm", "Speed", default=3000.0)

    def equations(self) -> pt.Equations:
        yield from ()

    def initial(self) -> pt.Equations:
        yield self.J1.w == self.n


class TextOfAnAngle(pt.Component):
    """An equation with a text."""

    J1: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield self.J1.phi == "1 rad"


class NoValue(pt.Component):
    """An equation with a port in place of its value."""

    source: rot.Torque = rot.Torque()
    J1: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.source.flange, self.J1.flange_a)
        yield self.source.tau == 1.0


class Returned(pt.Component):
    """An equation that is returned."""

    J1: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        return self.J1.w == 1.0  # type: ignore[return-value]


class Celsius(pt.Component):
    """A temperature in degC set equal to one in K."""

    T: pt.Variable = pt.variable("K", "Temperature")
    shown: pt.Variable = pt.variable("degC", "Temperature")

    def equations(self) -> pt.Equations:
        yield 300 + pt.time == self.T
        yield self.shown == self.T


class Branches(pt.Component):
    """A switch between a speed in rad/s and one in rpm."""

    w: pt.Variable = pt.variable("rad/s", "Speed")
    n: pt.Variable = pt.variable("rpm", "Speed")
    chosen: pt.Variable = pt.variable("rad/s", "Speed")

    def equations(self) -> pt.Equations:
        yield self.w == pt.time
        yield self.n == self.w * 30 / ca.pi
        yield self.chosen == pt.switch(pt.time > 1, self.w, self.n)


class NoPort(pt.Component):
    """connect with a component."""

    J1: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.J1.flange_b, self.J1)  # type: ignore[arg-type]


class NoSignal(pt.Component):
    """connect with a block in place of its output."""

    torque: rot.Torque = rot.Torque()
    source: Constant = Constant(k=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.source, self.torque.tau)  # type: ignore[arg-type]


class Potential(pt.Component):
    """connect with a variable of a port."""

    torque: rot.Torque = rot.Torque()
    J1: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque.flange, self.J1.flange_a.phi)  # type: ignore[arg-type]


class TwoOutputs(pt.Component):
    """Two outputs joined."""

    a: Constant = Constant(k=1.0)
    b: Constant = Constant(k=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.a.y, self.b.y)


class Partial(pt.Component):
    """A partial as a part."""

    shaft: rot.TwoFlanges = rot.TwoFlanges()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.shaft.flange_a, self.shaft.flange_b)


class Scales(pt.Component):
    """The same temperature in K and degC, and the warmer of two."""

    T: pt.Variable = pt.variable("K", "Temperature")
    shown: pt.Variable = pt.variable("degC", "Temperature")
    warmer: pt.Variable = pt.variable("K", "Temperature")

    def equations(self) -> pt.Equations:
        yield 300 + pt.time == self.T
        yield self.shown == self.T - 273.15
        yield self.warmer == pt.switch(self.T > 300.5, self.T, 300.5)


def test_temperatures_of_two_scales_differ_by_a_constant() -> None:
    result = pt.simulate(Scales(), 1.0)
    assert result["shown"][-1] == pytest.approx(27.85)
    assert result["warmer"][[0, -1]] == pytest.approx([300.5, 301.0])


@pytest.mark.parametrize(
    ("model", "said"),
    [
        (Same, ["yield self.J1.w == self.J1.w (test_text_errors.py:", "both sides are the same"]),
        (Numbers, ["yield 1.0 == 2.0", "plain value False"]),
        (NoEquation, ["yield self.J1.w (test_text_errors.py:", "is not an equation", "a == b"]),
        (
            PythonIf,
            [
                "if self.J1.w > 0:",
                "Python if/and/or/not, max or min cannot decide on a symbol",
                "switch(condition, a, b)",
                "casadi.logic_and",
            ],
        ),
        (
            Unconnected,
            ["pt.connect(self.J2.flange_b, self.J3.flange_a) (test_text_errors.py:", "no effect without yield"],
        ),
        (Dropped, ["self.J1.w == 5.0", "(test_text_errors.py:", "no effect without yield; write  yield a == b"]),
        (DroppedCondition, ["self.low < self.high", "(test_text_errors.py:", "no effect without yield"]),
        (MixedSum, ["yield self.air ==", "its terms are in m/s and km/h; nothing is converted"]),
        (ManyPaths, ["its terms are in m/s and km/h"]),
        (
            Kilowatts,
            ["yield self.power(pt.time) ==", "the left side is in kW, the right side in W; nothing is converted"],
        ),
        (NoPart, ["rot.Inertia(J=2.0).flange_a", "not a part of the model; declare the component as a field"]),
        (NeverYielded, ["the model: connect(...) has no effect without yield; write  yield connect(...)"]),
        (
            MixedPorts,
            [
                "connect(self.J1.flange_b, self.mass.flange_a)",
                "ports of the same class",
                "J1.flange_b (",
                "mass.flange_a (",
            ],
        ),
        (OnePort, ["connect(self.J1.flange_b)", "at least two ports"]),
        (SamePort, ["connect(self.J1.flange_b, self.J1.flange_b)", "joins J1.flange_b to itself"]),
        (OtherUnit, ["connect(self.torque, self.source.w_ref)", "torque [N.m] and source.w_ref [rad/s]"]),
        (Rotations, ["yield self.J1.w == self.n", "in rad/s, the right side in rpm; nothing is converted"]),
        (Celsius, ["yield self.shown == self.T", "in degC, the right side in K; nothing is converted"]),
        (Branches, ["yield self.chosen ==", "its terms are in rad/s and rpm; nothing is converted"]),
        (TextOfAnAngle, ['yield self.J1.phi == "1 rad"', "plain value False", "a string is not a symbol"]),
        (NoValue, ["yield self.source.tau == 1.0", "plain value False", "is written signal.value"]),
        (Returned, ["the equations of Returned are", "J1.w==1", "an equation is written  yield a == b"]),
        (NoPort, ["connect() joins ports, but J1 is a component; its ports are J1.flange_a, J1.flange_b"]),
        (NoSignal, ["connect() joins ports, but source is a component; its ports are source.y"]),
        (Potential, ["connect() joins ports, but J1.flange_a.phi is a variable"]),
        (TwoOutputs, ["two outputs are connected", "a.y", "b.y"]),
        (Partial, ["shaft: TwoFlanges is a partial class", "use one of its subclasses"]),
    ],
)
def test_wrong_text(model: type[pt.Component], said: list[str]) -> None:
    refused(pt.ModelError, *said, do=lambda: pt.compile(model()))


def test_conditions_that_are_not_yielded() -> None:
    def define() -> None:
        class Returned(pt.Component):
            low: pt.Parameter = pt.parameter("1", "Lower limit", default=3.0)

            def equations(self) -> pt.Equations:
                yield from ()

            def check(self) -> pt.Equations:
                return self.low < 2.0  # type: ignore[return-value]

        Returned()

    refused(pt.ModelError, "Returned: the conditions of check() are", "yield self.d_in < self.d_out", do=define)


def test_fields_are_given_by_name() -> None:
    with pytest.raises(TypeError, match=r"Inertia takes its fields by name: Inertia\(J=...\)"):
        rot.Inertia(0.1)  # type: ignore[call-arg]


def test_a_field_without_annotation_is_rejected_with_the_class() -> None:
    fields = {"c": pt.parameter("N.m/rad", "Stiffness")}
    refused(
        pt.ModelError,
        "Bar.c has no annotation",
        "c: Parameter = ...",
        do=lambda: type("Bar", (rot.TwoFlanges,), fields),
    )


def test_flanges_of_both_kinds_say_which_is_which() -> None:
    said = refused(pt.ModelError, do=lambda: pt.compile(MixedPorts()))
    assert "rotational" in said
    assert "translational" in said


def test_class_that_overrides_equations() -> None:
    def define() -> None:
        class Odd(rot.Inertia):
            def equations(self) -> pt.Equations:
                yield self.w == 0

    refused(pt.ModelError, "Odd.equations", "Inertia", "use the component as a part instead", do=define)


def test_der_outside_equations() -> None:
    refused(pt.ModelError, "inside equations()", do=lambda: pt.der(pt.time))


@pytest.mark.parametrize("name", ["equations", "initial", "check", "loss", "energy", "boundary"])
def test_field_named_like_what_every_component_has(name: str) -> None:
    refused(
        pt.ModelError,
        f"Part.{name}: a field cannot have this name",
        do=lambda: type("Part", (pt.Component,), {"__annotations__": {name: "Any"}, name: pt.variable("W", "Loss")}),
    )


def test_declared_parameter_in_the_class_body() -> None:
    def define() -> None:
        class Whole(pt.Component):
            J: pt.Parameter = pt.parameter("kg.m2", "Inertia of the shaft", default=2.0)
            shaft: rot.Inertia = rot.Inertia(J=J)  # type: ignore[arg-type]

    refused(
        pt.ParameterError,
        "Inertia.J is given a declared parameter (Inertia of the shaft)",
        "yield self.part.J == self.J",
        do=define,
    )
