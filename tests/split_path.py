"""A split-path transmission of a differential and a variator, and its closed form (Yu & Beachley 1986)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

import powertrain as pt
from powertrain.components.rotational import ConstantSpeed, Torque
from powertrain.components.rotational.interfaces import Flange, TwoFlanges

LAYOUTS = {1: "bha", 2: "hba", 3: "bah", 4: "abh", 5: "hab", 6: "ahb"}
"""Which member of the differential stands at 1 (input), 2 (variator) and 3 (output), by the paper's numbers."""


class Differential(pt.Component):
    """One mesh between a and b on a carrier h: w_a - w_h = R_o (w_b - w_h), with the efficiency eta of the fixed carrier."""

    a: Flange = pt.port(Flange)
    b: Flange = pt.port(Flange)
    h: Flange = pt.port(Flange)
    R_o: pt.Parameter = pt.parameter("1", "Basic speed ratio", default=-1.7)
    eta: pt.Parameter = pt.parameter("1", "Efficiency with the carrier fixed", default=0.95)
    tau_loss: pt.Variable = pt.variable("N.m", "Torque lost in the mesh, at a")
    w_rel: pt.Variable = pt.variable("rad/s", "Speed of a against the carrier")

    def equations(self) -> pt.Equations:
        yield self.a.phi - self.h.phi == self.R_o * (self.b.phi - self.h.phi)
        yield self.w_rel == pt.der(self.a.phi) - pt.der(self.h.phi)
        yield self.a.tau + self.b.tau + self.h.tau == 0
        yield self.b.tau == -self.R_o * (self.a.tau - self.tau_loss)
        tau, first, second = self.a.tau, (1 - self.eta) * self.a.tau, (1 - 1 / self.eta) * self.a.tau
        upper = pt.switch(tau >= 0, first, second, continuous=True)
        lower = pt.switch(tau >= 0, second, first, continuous=True)
        yield pt.friction(self.w_rel, self.tau_loss, lower, upper)

    def loss(self) -> pt.Symbol:
        """Torque lost times relative speed."""
        return self.tau_loss * self.w_rel


class Variator(TwoFlanges):
    """w_b = V w_a, with the same efficiency in both directions of power."""

    V: pt.Input = pt.signal_input("1", "Speed of flange_b over speed of flange_a", default=None)
    eta: pt.Parameter = pt.parameter("1", "Efficiency", default=0.9)
    tau_loss: pt.Variable = pt.variable("N.m", "Torque lost, at flange_b")
    w: pt.Variable = pt.variable("rad/s", "Speed of flange_b")

    def equations(self) -> pt.Equations:
        yield pt.der(self.flange_b.phi) == self.V.value * pt.der(self.flange_a.phi)
        yield self.w == pt.der(self.flange_b.phi)
        yield self.flange_a.tau == -self.V.value * (self.flange_b.tau - self.tau_loss)
        tau, first, second = self.flange_b.tau, (1 - self.eta) * self.flange_b.tau, (1 - 1 / self.eta) * self.flange_b.tau
        upper = pt.switch(tau >= 0, first, second, continuous=True)
        lower = pt.switch(tau >= 0, second, first, continuous=True)
        yield pt.friction(self.w, self.tau_loss, lower, upper)

    def loss(self) -> pt.Symbol:
        """Torque lost times speed."""
        return self.tau_loss * self.w


class SplitPath(pt.Component):
    """Driven at a constant speed at 1 and loaded by a torque at 3; the variator lies between 1 and 2."""

    layout: int = 1
    V: pt.Input = pt.signal_input("1", "Ratio of the variator")
    load: pt.Input = pt.signal_input("N.m", "Accelerating torque on the output")
    r: pt.Variable = pt.variable("1", "Speed of the output over speed of the input")
    efficiency: pt.Variable = pt.variable("1", "Output power over input power")
    K: pt.Variable = pt.variable("1", "Power into the variator over input power, negative from 2 to 1")
    drive: ConstantSpeed = ConstantSpeed(w_fixed=100.0)
    differential: Differential = Differential()
    variator: Variator = Variator()
    torque: Torque = Torque()

    def equations(self) -> pt.Equations:
        one, two, three = (getattr(self.differential, member) for member in LAYOUTS[self.layout])
        yield pt.connect(self.drive.flange, self.variator.flange_a, one)
        yield pt.connect(self.variator.flange_b, two)
        yield pt.connect(self.torque.flange, three)
        yield pt.connect(self.V, self.variator.V)
        yield pt.connect(self.load, self.torque.tau)
        yield self.r * pt.der(one.phi) == pt.der(three.phi)
        power = -self.drive.flange.power()
        yield self.efficiency * power == self.torque.flange.power()
        at_2 = self.variator.flange_b.power()
        yield self.K * power == pt.switch(at_2 <= 0, self.variator.flange_a.power(), -at_2)
