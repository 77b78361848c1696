"""Small models that several tests share, such as a clutch engagement, a bouncing ball and a relay with resets."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path

import powertrain as pt
from powertrain.components.rotational import Clutch, ConstantTorque, Damper, Fixed, Inertia, SpringDamper, Torque
from powertrain.components.rotational.interfaces import OneFlangeAndSupport
from powertrain.components.translational import Mass

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks.coupled_clutches import CoupledClutches

STARTS = {"engine.w": 100.0, "load.w": 0.0, "load.phi": 0.0, "shaft.phi_rel": 0.0}
"""Of ``Engaging``."""


class Engaging(pt.Component):
    """A driven inertia, a clutch and a load behind a soft shaft; torque and clutch command are inputs."""

    torque: pt.Input = pt.signal_input("N.m", "Torque of the engine")
    press: pt.Input = pt.signal_input("1", "Command of the clutch")
    source: Torque = Torque()
    engine: Inertia = Inertia(J=0.2)
    clutch: Clutch = Clutch(fn_max=200.0, mue_pos=((0.0, 1.0),))
    shaft: SpringDamper = SpringDamper(c=500.0, d=5.0)
    load: Inertia = Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque, self.source.tau)
        yield pt.connect(self.press, self.clutch.f_normalized)
        yield pt.connect(self.source.flange, self.engine.flange_a)
        yield pt.connect(self.engine.flange_b, self.clutch.flange_a)
        yield pt.connect(self.clutch.flange_b, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.load.flange_a)


class Ball(pt.Component):
    """Thrown up from the ground, it bounces: after k bounces it has the speed e^k v, all in closed form."""

    e: pt.Parameter = pt.parameter("1", "Restitution", default=0.8)
    g: pt.Parameter = pt.parameter("m/s2", "Gravity", default=10.0)
    h: pt.Variable = pt.variable("m", "Height", start=1.0)
    v: pt.Variable = pt.variable("m/s", "Speed", start=0.0)
    f: pt.Variable = pt.variable("N", "Force")

    def equations(self) -> pt.Equations:
        yield pt.der(self.h) == self.v
        yield pt.der(self.v) == self.f - self.g
        yield pt.unilateral(self.h, self.f, restitution=self.e)


class Relay(pt.Component):
    """A tank that fills until ``high`` and empties until ``low``; the level is reset by ``spill`` at each filling."""

    inflow: pt.Parameter = pt.parameter("1/s", "Rate of filling", default=1.0)
    leak: pt.Parameter = pt.parameter("1/s", "Rate of leaking", default=0.3)
    high: pt.Parameter = pt.parameter("1", "Upper level", default=1.0)
    low: pt.Parameter = pt.parameter("1", "Lower level", default=0.5)
    spill: pt.Parameter = pt.parameter("1", "Share of the level kept at the change", default=0.9)
    level: pt.Variable = pt.variable("1", "Level", start=0.2)
    filling: pt.Discrete = pt.discrete("1", "Whether it is filled", start=1.0)
    since: pt.Discrete = pt.discrete("s", "Last change", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.level) == self.filling * self.inflow - self.leak * self.level + 0.1 * self.since
        yield pt.when(
            self.level > self.high,
            pt.reinit(self.filling, 0), pt.reinit(self.since, pt.time), pt.reinit(self.level, self.spill * self.level),
        )  # fmt: skip
        yield pt.when(self.level < self.low, pt.reinit(self.filling, 1), pt.reinit(self.since, 0.5 * pt.time))


class Gate(pt.Component):
    """A load that coasts at ``v`` and, where ``condition`` becomes true, loses half of its speed; and a wheel with phi = t^2/2."""

    condition: Callable[[Gate], pt.Symbol]
    phi: pt.Parameter = pt.parameter("rad", "Angle to pass", default=0.5)
    v: pt.Parameter = pt.parameter("m/s", "Speed of the load at the start", default=1.0)
    torque: ConstantTorque = ConstantTorque(tau_constant=1.0)
    wheel: Inertia = Inertia(J=1.0)
    load: Mass = Mass(m=1.0)
    passed: pt.Discrete = pt.discrete("1", "How often", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque.flange, self.wheel.flange_a)
        reset = pt.reinit(self.load.v, self.load.v / 2), pt.reinit(self.passed, self.passed + 1)
        yield pt.when(self.condition(self), *reset, name="gate")

    def initial(self) -> pt.Equations:
        yield self.load.v == self.v
        yield self.load.s == 0
        yield self.wheel.phi == 0
        yield self.wheel.w == 0


__all__ = ["STARTS", "Ball", "CoupledClutches", "Engaging", "Gate", "Relay"]


class Belt(pt.Component):
    """1 kg on a belt whose speed is given; the friction is 2 N."""

    u: pt.Input = pt.signal_input("m/s", "speed of the belt")
    v: pt.Variable = pt.variable("m/s", "speed", start=0.0)
    f: pt.Variable = pt.variable("N", "friction force")

    def equations(self) -> pt.Equations:
        yield pt.der(self.v) == self.f
        yield pt.friction(self.u.value - self.v, self.f, -2.0, 2.0, name="belt")


class Overrunning(pt.Component):
    """1 kg on a belt that may only push it forward; 0.1 N hold it back."""

    u: pt.Input = pt.signal_input("m/s", "speed of the belt")
    v: pt.Variable = pt.variable("m/s", "speed", start=0.0)
    f: pt.Variable = pt.variable("N", "force of the belt")

    def equations(self) -> pt.Equations:
        yield pt.der(self.v) == self.f - 0.1
        yield pt.friction(self.v - self.u.value, -self.f, -math.inf, 0.0, name="belt")


class Body(pt.Component):
    """Partial: 1 kg above a floor, on which it lies at the start."""

    start: pt.Parameter = pt.parameter("m", "height at the start", default=0.0)
    x: pt.Variable = pt.variable("m", "height")
    v: pt.Variable = pt.variable("m/s", "speed", start=0.0)
    f: pt.Variable = pt.variable("N", "force of the floor")

    def falling(self, floor: pt.Symbol | float = 0.0) -> pt.Equations:
        yield pt.der(self.x) == self.v
        yield pt.der(self.v) == self.f - 10.0
        yield pt.unilateral(self.x - floor, self.f, name="floor")

    def initial(self) -> pt.Equations:
        yield self.x == self.start


class Floor(Body):
    """The height of the floor is given."""

    h: pt.Input = pt.signal_input("m", "height of the floor")

    def equations(self) -> pt.Equations:
        yield from self.falling(self.h.value)


class Decay(pt.Component):
    """J der(w) = u - d w: w(t) = u/d + (w0 - u/d) exp(-d t/J) for a constant u."""

    torque: pt.Input = pt.signal_input("N.m", "Torque")
    source: Torque = Torque()
    inertia: Inertia = Inertia(J=2.0)
    damper: Damper = Damper(d=0.5)
    ground: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque, self.source.tau)
        yield pt.connect(self.source.flange, self.inertia.flange_a)
        yield pt.connect(self.inertia.flange_b, self.damper.flange_a)
        yield pt.connect(self.damper.flange_b, self.ground.flange)


class Motor(OneFlangeAndSupport):
    """A torque that is linear in the speed."""

    torque: pt.Parameter = pt.parameter("N.m", "Torque at rest")
    slope: pt.Parameter = pt.parameter("N.m.s/rad", "Rise of the torque with speed")
    w: pt.Variable = pt.variable("rad/s", "Speed")

    def equations(self) -> pt.Equations:
        yield from self._against_support()
        yield self.w == pt.der(self.flange.phi)
        yield self.flange.tau == -(self.torque + self.slope * self.w)
