"""Test stands for split-path transmissions."""

from __future__ import annotations

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.transmissions import SplitPathTransmission


class Stand(pt.Component):
    """Driven at a constant speed, loaded by a torque; the ratio of the variable unit and the torque are inputs."""

    V: pt.Input = pt.signal_input("1", "Ratio of the variable unit")
    torque: pt.Input = pt.signal_input("N.m", "Torque on the output")
    transmission: SplitPathTransmission = SplitPathTransmission()
    drive: rot.ConstantSpeed = rot.ConstantSpeed(w_fixed=100)
    load: rot.Torque = rot.Torque()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.transmission.flange_a)
        yield pt.connect(self.transmission.flange_b, self.load.flange)
        yield pt.connect(self.V, self.transmission.ratio)
        yield pt.connect(self.torque, self.load.tau)


class Bench(pt.Component):
    """Driven through an elastic shaft, with small inertias at input and output; the load is drag and a torque."""

    V: pt.Input = pt.signal_input("1", "Ratio of the variable unit")
    torque: pt.Input = pt.signal_input("N.m", "Torque on the output", default=0.0)
    transmission: pt.Component = SplitPathTransmission()
    drive: rot.ConstantSpeed = rot.ConstantSpeed(w_fixed=100)
    shaft: rot.SpringDamper = rot.SpringDamper(c=1e4, d=20)
    J1: rot.Inertia = rot.Inertia(J=1e-2)
    J3: rot.Inertia = rot.Inertia(J=1e-2)
    load: rot.Torque = rot.Torque()
    drag: rot.Damper = rot.Damper(d=0)
    ground: rot.Fixed = rot.Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.J1.flange_a)
        yield pt.connect(self.J1.flange_b, self.transmission.flange_a)  # type: ignore[attr-defined]
        yield pt.connect(self.transmission.flange_b, self.J3.flange_a)  # type: ignore[attr-defined]
        yield pt.connect(self.J3.flange_b, self.load.flange, self.drag.flange_a)
        yield pt.connect(self.drag.flange_b, self.ground.flange)
        yield pt.connect(self.V, self.transmission.ratio)  # type: ignore[attr-defined]
        yield pt.connect(self.torque, self.load.tau)


class ThreePowers(pt.Component):
    """A differential with two members at given speeds and a torque on the third (a)."""

    differential: pt.Component
    b: rot.ConstantSpeed
    carrier: rot.ConstantSpeed
    a: rot.ConstantTorque

    def equations(self) -> pt.Equations:
        yield pt.connect(self.b.flange, self.differential.b)  # type: ignore[attr-defined]
        yield pt.connect(self.carrier.flange, self.differential.carrier)  # type: ignore[attr-defined]
        yield pt.connect(self.a.flange, self.differential.a)  # type: ignore[attr-defined]
