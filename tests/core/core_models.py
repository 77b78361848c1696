"""Models for tests of the core."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import casadi as ca

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Constant, Sine, Step


class Joined(pt.Component):
    """Parts and the pairs of ports that are joined: "0.flange_b" is the flange_b of parts[0]."""

    parts: tuple[pt.Component, ...]
    joints: tuple[tuple[str, ...], ...] = ()

    def equations(self) -> pt.Equations:
        for joint in self.joints:
            yield pt.connect(*map(self._port, joint))

    def _port(self, name: str) -> Any:
        index, _, port = name.partition(".")
        return getattr(self.parts[int(index)], port)


def row(*parts: pt.Component, joints: tuple[tuple[str, ...], ...] = ()) -> Joined:
    """The parts one after the other, flange_b (or flange) to flange_a (or flange)."""

    def flange(i: int, name: str) -> str:
        return f"{i}.{name if name in parts[i]._fields else 'flange'}"

    shafts = [i for i, part in enumerate(parts) if {"flange", "flange_a"} & set(part._fields)]
    pairs = tuple((flange(i, "flange_b"), flange(k, "flange_a")) for i, k in pairwise(shafts))
    return Joined(parts=parts, joints=pairs + joints)


class Cam(rot.TwoFlanges):
    """phi_b = phi_a + e sin(phi_a), without loss."""

    e: pt.Parameter = pt.parameter("rad", "Unevenness", default=0.3)

    def equations(self) -> pt.Equations:
        phi = self.flange_a.phi
        yield self.flange_b.phi == phi + self.e * ca.sin(phi)
        yield self.flange_a.tau + (1 + self.e * ca.cos(phi)) * self.flange_b.tau == 0


class Crank(pt.Component):
    """A slider-crank with a piston of mass m; ``implicit``: the rod's angle is an unknown of two equations."""

    implicit: bool = False
    flange: rot.Flange = pt.port(rot.Flange)
    r: pt.Parameter = pt.parameter("m", "Crank", default=0.1)
    rod: pt.Parameter = pt.parameter("m", "Rod", default=0.3)
    m: pt.Parameter = pt.parameter("kg", "Piston", default=1.0)
    s: pt.Variable = pt.variable("m", "Position of the piston")
    v: pt.Variable = pt.variable("m/s", "Speed of the piston")
    f: pt.Variable = pt.variable("N", "Force on the piston")
    beta: pt.Variable = pt.variable("rad", "Angle of the rod", guess=0.1)

    def equations(self) -> pt.Equations:
        phi = self.flange.phi
        yield self.v == pt.der(self.s)
        yield self.m * pt.der(self.v) == self.f
        yield self.r * ca.sin(phi) == self.rod * ca.sin(self.beta)
        if self.implicit:
            yield self.s == self.r * ca.cos(phi) + self.rod * ca.cos(self.beta)
            slope = -self.r * ca.sin(phi) - self.rod * ca.sin(self.beta) * self.r * ca.cos(phi) / (
                self.rod * ca.cos(self.beta)
            )
        else:
            root = ca.sqrt(self.rod**2 - (self.r * ca.sin(phi)) ** 2)
            yield self.s == self.r * ca.cos(phi) + root
            slope = -self.r * ca.sin(phi) - self.r**2 * ca.sin(phi) * ca.cos(phi) / root
        yield self.flange.tau == slope * self.f


class ThreeClutches(pt.Component):
    """Four inertias and three clutches in series."""

    sine: Sine = Sine(amplitude=10.0, f=5.0)
    torque: rot.Torque = rot.Torque()
    J1: rot.Inertia = rot.Inertia(J=1.0)
    clutch1: rot.Clutch = rot.Clutch(fn_max=20.0, peak=1.1)
    J2: rot.Inertia = rot.Inertia(J=1.0)
    clutch2: rot.Clutch = rot.Clutch(fn_max=20.0, peak=1.1)
    J3: rot.Inertia = rot.Inertia(J=1.0)
    clutch3: rot.Clutch = rot.Clutch(fn_max=20.0, peak=1.1)
    J4: rot.Inertia = rot.Inertia(J=1.0)
    first: Constant = Constant(k=1.0)
    second: Step = Step(startTime=0.4)
    third: Step = Step(startTime=0.9)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.sine.y, self.torque.tau)
        yield pt.connect(self.torque.flange, self.J1.flange_a)
        yield pt.connect(self.J1.flange_b, self.clutch1.flange_a)
        yield pt.connect(self.clutch1.flange_b, self.J2.flange_a)
        yield pt.connect(self.J2.flange_b, self.clutch2.flange_a)
        yield pt.connect(self.clutch2.flange_b, self.J3.flange_a)
        yield pt.connect(self.J3.flange_b, self.clutch3.flange_a)
        yield pt.connect(self.clutch3.flange_b, self.J4.flange_a)
        yield pt.connect(self.first.y, self.clutch1.f_normalized)
        yield pt.connect(self.second.y, self.clutch2.f_normalized)
        yield pt.connect(self.third.y, self.clutch3.f_normalized)

    def initial(self) -> pt.Equations:
        yield self.J1.w == 10
