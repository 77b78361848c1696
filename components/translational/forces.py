"""Forces on a rod, given by signals, by constants or by speed."""

from __future__ import annotations

from typing import ClassVar, TypeAlias

from powertrain import (
    Equations,
    Input,
    Parameter,
    Symbol,
    Variable,
    der,
    parameter,
    signal_input,
    variable,
)
from powertrain.components.characteristics import Regularization, inverse, linear, quadratic, smooth_sign, step
from powertrain.components.translational.interfaces import OneFlangeAndSupport, TwoFlanges

Expression: TypeAlias = "Symbol | float"


class Force(OneFlangeAndSupport):
    """A force on a rod given by a signal; a positive signal accelerates it.

    flange.f = -f,  support.f = f
    """

    boundary: ClassVar[bool] = True
    f: Input = signal_input("N", "Accelerating force on the flange")

    def equations(self) -> Equations:
        """The signal's force."""
        yield from self._against_support()
        yield self.flange.f == -self.f.value


class Force2(TwoFlanges):
    """A force between two rods given by a signal; a positive signal accelerates flange_b and decelerates flange_a.

    flange_a.f = f,  flange_b.f = -f
    """

    boundary: ClassVar[bool] = True
    f: Input = signal_input("N", "Force that drives the flanges apart")

    def equations(self) -> Equations:
        """The signal's force and its reaction."""
        yield self.flange_a.f == self.f.value
        yield self.flange_b.f == -self.f.value


class _ForceOnFlange(OneFlangeAndSupport):
    """Partial: a force on the flange. As in the Modelica Standard Library f is flange.f, negative if it drives."""

    boundary: ClassVar[bool] = True
    f: Variable = variable("N", "Force on the source, flange.f; the rod is driven by -f")

    def _drive(self, force: Expression) -> Equations:
        yield from self._against_support()
        yield self.f == -force
        yield self.flange.f == self.f


class ConstantForce(_ForceOnFlange):
    """The same force at every speed; a negative one is a load during forward motion.

    f = -f_constant
    """

    f_constant: Parameter = parameter("N", "Accelerating force")

    def equations(self) -> Equations:
        """A constant."""
        yield from self._drive(self.f_constant)


class ForceStep(_ForceOnFlange):
    """A force step.

    f = -offsetForce before startTime, -(offsetForce + stepForce) from then on
    """

    stepForce: Parameter = parameter("N", "Height of the step", default=1.0)
    offsetForce: Parameter = parameter("N", "Force before the step", default=0.0)
    startTime: Parameter = parameter("s", "Time of the step", default=0.0)

    def equations(self) -> Equations:
        """A step."""
        yield from self._drive(step(self.stepForce, self.offsetForce, self.startTime))


class _SpeedDependentForce(_ForceOnFlange):
    """Partial: a force that depends on the flange's speed against the support."""

    f_nominal: Parameter = parameter("N", "Force at v_nominal; negative, it is a load while the rod moves forward")
    v_nominal: Parameter = parameter("m/s", "Nominal speed", above=0)
    v: Variable = variable("m/s", "Speed of the flange against the support")
    ForceDirection: bool = True


class LinearSpeedDependentForce(_SpeedDependentForce):
    """A force proportional to speed.

    f = -f_nominal |v/v_nominal| with ForceDirection (the same direction whichever way the rod moves),
    else f = -f_nominal v/v_nominal
    """

    def equations(self) -> Equations:
        """Proportional."""
        yield self.v == der(self.s)
        x = self.v / self.v_nominal
        yield from self._drive(self.f_nominal * linear(x, one_direction=self.ForceDirection))


class QuadraticSpeedDependentForce(_SpeedDependentForce):
    """A force proportional to the square of the speed.

    f = -f_nominal (v/v_nominal)^2 with ForceDirection (the same direction whichever way the rod moves),
    else f = -f_nominal (v/v_nominal) |v/v_nominal|
    """

    def equations(self) -> Equations:
        """Square law."""
        yield self.v == der(self.s)
        x = self.v / self.v_nominal
        yield from self._drive(self.f_nominal * quadratic(x, one_direction=self.ForceDirection))


class InverseSpeedDependentForce(_SpeedDependentForce):
    """A force inversely proportional to speed (constant power).

    f = -f_nominal v_nominal/|v| with ForceDirection (the same direction whichever way the rod moves), held constant below v0
    else f = -f_nominal v_nominal/v,  below v0 f = -f_nominal v/v0

    Below v0 it is as in the Modelica Standard Library 4.0.0; the force jumps at v0 unless v0 = v_nominal.
    """

    v0: Parameter = parameter("m/s", "Speed below which the force is limited", default=0.1, above=0)

    def equations(self) -> Equations:
        """Constant power above v0."""
        yield self.v == der(self.s)
        x = inverse(self.v, self.v_nominal, self.v0, one_direction=self.ForceDirection)
        yield from self._drive(self.f_nominal * x)


class SignForce(_ForceOnFlange):
    """A constant force that changes sign with speed; a negative one brakes in both directions.

    f = -f_nominal sign(v), smoothed around v = 0 by ``reg``:
      "exp": 2/(1 + exp(-v/(0.01 v0))) - 1;  below v0 "sine": sin(pi/2 v/v0);  "linear": v/v0;
      "cosine": sign(v) (1 - cos(pi/2 v/v0))
    """

    f_nominal: Parameter = parameter("N", "Force; negative, it brakes")
    v0: Parameter = parameter("m/s", "Speed below which the sign is smoothed", default=0.1, above=0)
    reg: Regularization = "exp"
    v: Variable = variable("m/s", "Speed of the flange against the support")

    def equations(self) -> Equations:
        """A smoothed sign."""
        yield self.v == der(self.s)
        yield from self._drive(self.f_nominal * smooth_sign(self.v / self.v0, self.reg))
