"""Models that are over- or underdetermined, or rigid where they must not be: parts, lines and values are named."""

from __future__ import annotations

import casadi as ca
import pytest
from refusals import refused

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Constant, Sine
from powertrain.components.differentials import PlanetaryGear


class OneShaft(pt.Component):
    """Two speed sources on one shaft."""

    motor: rot.Speed = rot.Speed(exact=True)
    brake: rot.ConstantSpeed = rot.ConstantSpeed(w_fixed=3.0)
    sine: Sine = Sine(f=1.0)
    J1: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.sine.y, self.motor.w_ref)
        yield pt.connect(self.motor.flange, self.J1.flange_a)
        yield pt.connect(self.J1.flange_b, self.brake.flange)


def test_two_speed_sources_on_one_shaft() -> None:
    refused(
        pt.ModelError,
        "over-determined: 2 equations for the 1 unknown",
        "motor: yield from following_speed(self.phi, self.w, self.w_ref.value, self.exact, self.f_crit) (motions.py:",
        "brake: yield self.w == self.w_fixed (motions.py:",
        "remove one of these",
        do=lambda: pt.compile(OneShaft()),
    )


class TwoGears(pt.Component):
    """Two gears side by side."""

    g1: rot.IdealGear = rot.IdealGear(ratio=2.0)
    g2: rot.IdealGear = rot.IdealGear(ratio=3.0)
    J1: rot.Inertia = rot.Inertia(J=1.0)
    J2: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.J1.flange_b, self.g1.flange_a, self.g2.flange_a)
        yield pt.connect(self.g1.flange_b, self.g2.flange_b, self.J2.flange_a)


def test_contradictory_gear_speeds_with_their_values() -> None:
    refused(
        pt.ModelError,
        "contradiction: these equations cannot all hold, except at standstill",
        "g1: yield self.phi_a == self.ratio * self.phi_b",
        "g2: yield self.phi_a == self.ratio * self.phi_b",
        "g1.ratio = 2",
        "g2.ratio = 3",
        do=lambda: pt.compile(TwoGears()),
    )


def test_equal_gears_side_by_side_are_a_rigid_loop() -> None:
    model = pt.replace(TwoGears(), {"g2.ratio": 2.0})
    refused(pt.ModelError, "rigid loop", "g1: yield", "g2: yield", "give it a compliance", do=lambda: pt.compile(model))


class Offset(pt.Component):
    """Two shafts held at different angles and joined."""

    wall: rot.Fixed = rot.Fixed(phi0=0.0)
    other: rot.Fixed = rot.Fixed(phi0=0.5)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.wall.flange, self.other.flange)


def test_two_angles_of_one_shaft() -> None:
    said = refused(
        pt.ModelError,
        "contradiction: these equations cannot all hold",
        "wall: yield self.flange.phi == self.phi0",
        "other: yield self.flange.phi == self.phi0",
        "other.phi0 = 0.5",
        do=lambda: pt.compile(Offset()),
    )
    assert "standstill" not in said


class Loose(pt.Component):
    """A torque source whose signal nobody gives."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    drive: rot.Torque = rot.Torque()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.J1.flange_a)


def test_input_that_is_not_connected() -> None:
    refused(
        pt.ModelError,
        "under-determined: 1 equation missing",
        "not connected: drive.tau",
        do=lambda: pt.compile(Loose()),
    )


class Pressed(pt.Component):
    """A disc between two clutches, which friction alone turns where it has no inertia."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    first: rot.Clutch = rot.Clutch(fn_max=10.0)
    disc: rot.Inertia = rot.Inertia(J=0.0)
    second: rot.Clutch = rot.Clutch(fn_max=10.0)
    J2: rot.Inertia = rot.Inertia(J=1.0)
    press: Constant = Constant(k=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.J1.flange_b, self.first.flange_a)
        yield pt.connect(self.first.flange_b, self.disc.flange_a)
        yield pt.connect(self.disc.flange_b, self.second.flange_a)
        yield pt.connect(self.second.flange_b, self.J2.flange_a)
        yield pt.connect(self.press.y, self.first.f_normalized, self.second.f_normalized)


def test_an_inertia_of_zero_is_named() -> None:
    said = "one of them repeats or contradicts the others; disc.J is 0, which removes it from them: give another value"
    refused(pt.ModelError, said, do=lambda: pt.compile(Pressed()))


class Rattling(pt.Component):
    """Nothing that has inertia lies between a clutch and a backlash, whose damper torque is limited."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    clutch: rot.Clutch = rot.Clutch(fn_max=10.0)
    lash: rot.ElastoBacklash = rot.ElastoBacklash(c=1000.0, d=1.0, b=0.01)
    J2: rot.Inertia = rot.Inertia(J=1.0)
    press: Constant = Constant(k=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.J1.flange_b, self.clutch.flange_a)
        yield pt.connect(self.clutch.flange_b, self.lash.flange_a)
        yield pt.connect(self.lash.flange_b, self.J2.flange_a)
        yield pt.connect(self.press.y, self.clutch.f_normalized)


def test_a_shaft_without_inertia_needs_one() -> None:
    said = "if a shaft without inertia lies between torques that do not depend on its speed, give it an inertia"
    refused(pt.ModelError, "do not determine", "lash", said, do=lambda: pt.compile(Rattling()))


class MissingEquation(pt.Component):
    """Two unknowns, one equation."""

    x: pt.Variable = pt.variable("1", "first")
    y: pt.Variable = pt.variable("1", "second")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.y


def test_missing_equation_names_the_variable() -> None:
    refused(pt.ModelError, "under-determined: 1 equation missing", "y", do=lambda: pt.compile(MissingEquation()))


class TooMany(pt.Component):
    """One unknown, two equations."""

    x: pt.Variable = pt.variable("1", "first")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == -self.x
        yield ca.sin(self.x) == pt.time


def test_equation_too_much_quotes_both() -> None:
    refused(
        pt.ModelError,
        "over-determined: 2 equations for the 1 unknown x",
        "the model: yield pt.der(self.x) == -self.x (test_structure_errors.py:",
        "ca.sin(self.x)",
        do=lambda: pt.compile(TooMany()),
    )


class HeldByAnEquation(pt.Component):
    """A ring whose angle is given, but to which nothing is connected that could take its torque."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    gear: PlanetaryGear = PlanetaryGear(ratio=2.0, eta_ab=0.98, eta_ba=0.98)
    J2: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.J1.flange_b, self.gear.sun)
        yield pt.connect(self.gear.carrier, self.J2.flange_a)
        yield self.gear.ring.phi == 0


def test_a_flange_that_an_equation_holds_is_to_be_connected() -> None:
    refused(
        pt.ModelError,
        "over-determined: gear.ring has a given position but is not connected",
        "such as a Fixed",
        do=lambda: pt.compile(HeldByAnEquation()),
    )


def test_a_flange_that_a_connected_part_holds_is_not_blamed() -> None:
    """The open end of the brake is held, rightly; two sources on one shaft are the fault."""

    class Elsewhere(pt.Component):
        shaft: OneShaft = OneShaft()
        wall: rot.Fixed = rot.Fixed()
        disc: rot.Disc = rot.Disc()

        def equations(self) -> pt.Equations:
            yield pt.connect(self.wall.flange, self.disc.flange_a)

    refused(
        pt.ModelError,
        "over-determined: 2 equations for the 1 unknown",
        "shaft.motor",
        do=lambda: pt.compile(Elsewhere()),
    )


def test_a_motion_that_is_given_at_an_open_flange_is_not_blamed() -> None:
    """The torque that gives this motion is unknown, rightly."""

    class Inverse(pt.Component):
        tau: pt.Variable = pt.variable("N.m", "Torque of the motor")
        motor: rot.Torque = rot.Torque()
        load: rot.Inertia = rot.Inertia(J=1.0)
        shaft: OneShaft = OneShaft()

        def equations(self) -> pt.Equations:
            yield pt.connect(self.motor.flange, self.load.flange_a)
            yield self.motor.tau.value == self.tau
            yield self.load.flange_b.phi == 0

    refused(
        pt.ModelError,
        "over-determined: 2 equations for the 1 unknown",
        "shaft.motor",
        do=lambda: pt.compile(Inverse()),
    )


class OpenClutch(pt.Component):
    """A clutch whose second side is not connected."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    clutch: rot.Clutch = rot.Clutch(fn_max=10.0)
    press: Constant = Constant(k=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.press.y, self.clutch.f_normalized)
        yield pt.connect(self.J1.flange_b, self.clutch.flange_a)


def test_clutch_with_an_open_side() -> None:
    refused(
        pt.ModelError,
        "loose part: clutch: yield friction(",
        "clutch.flange_b (not connected)",
        "connect the open port to something with inertia",
        do=lambda: pt.compile(OpenClutch()),
    )


class OpenPlanetary(pt.Component):
    """A planetary gear with two open shafts."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    gear: rot.IdealPlanetary = rot.IdealPlanetary(ratio=2.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.J1.flange_b, self.gear.carrier)


def test_planetary_with_two_open_shafts() -> None:
    refused(
        pt.ModelError,
        "loose part",
        "gear.ring (not connected)",
        "gear.sun (not connected)",
        do=lambda: pt.compile(OpenPlanetary()),
    )


class InSeries(pt.Component):
    """Two clutches with nothing between."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    J2: rot.Inertia = rot.Inertia(J=1.0)
    c1: rot.Clutch = rot.Clutch(fn_max=10.0)
    c2: rot.Clutch = rot.Clutch(fn_max=20.0)
    press: Constant = Constant(k=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.press.y, self.c1.f_normalized, self.c2.f_normalized)
        yield pt.connect(self.J1.flange_b, self.c1.flange_a)
        yield pt.connect(self.c1.flange_b, self.c2.flange_a)
        yield pt.connect(self.c2.flange_b, self.J2.flange_a)


def test_clutches_in_series_without_inertia_between() -> None:
    refused(
        pt.ModelError, "c1: yield friction(", "c2: yield friction(", "put an inertia", do=lambda: pt.compile(InSeries())
    )


class LooseEnd(pt.Component):
    """A part with one end at a shaft and the other nowhere."""

    part: pt.Component
    shaft: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.shaft.flange_b, self.part.flange_a)  # type: ignore[attr-defined]


@pytest.mark.parametrize("part", [rot.Spring(c=1.0), rot.Damper(d=1.0), rot.SpringDamper(c=1.0, d=1.0)])
def test_open_end_of_a_compliance(part: pt.Component) -> None:
    refused(
        pt.ModelError,
        f"loose end: part.flange_b is not connected, so that part ({type(part).__name__}) transmits nothing",
        do=lambda: pt.compile(LooseEnd(part=part)),
    )


@pytest.mark.parametrize("part", [rot.Inertia(J=1.0), rot.IdealGear(ratio=2.0), rot.PowerSensor()])
def test_open_end_of_what_turns_along(part: pt.Component) -> None:
    assert pt.compile(LooseEnd(part=part)).compiled.states
