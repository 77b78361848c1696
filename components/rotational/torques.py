"""Torques on a shaft, given by signals, by constants or by speed."""

from __future__ import annotations

from typing import ClassVar

from powertrain import (
    Equations,
    Input,
    Parameter,
    Variable,
    der,
    parameter,
    signal_input,
    variable,
)
from powertrain.components.characteristics import Regularization, inverse, linear, quadratic, smooth_sign, step
from powertrain.components.rotational.interfaces import OneFlangeAndSupport, TwoFlanges


class Torque(OneFlangeAndSupport):
    """A torque on a shaft given by a signal; a positive signal accelerates it.

    flange.tau = -tau,  support.tau = tau
    """

    boundary: ClassVar[bool] = True
    tau: Input = signal_input("N.m", "Accelerating torque on the flange")

    def equations(self) -> Equations:
        """The signal's torque."""
        yield from self._against_support()
        yield self.flange.tau == -self.tau.value


class Torque2(TwoFlanges):
    """A torque between two shafts given by a signal; a positive signal accelerates flange_b and decelerates flange_a.

    flange_a.tau = tau,  flange_b.tau = -tau
    """

    boundary: ClassVar[bool] = True
    tau: Input = signal_input("N.m", "Torque that drives the flanges apart")

    def equations(self) -> Equations:
        """The signal's torque and its reaction."""
        yield self.flange_a.tau == self.tau.value
        yield self.flange_b.tau == -self.tau.value


class _TorqueOnFlange(OneFlangeAndSupport):
    """Partial: a torque that accelerates the flange."""

    boundary: ClassVar[bool] = True
    tau: Variable = variable("N.m", "Accelerating torque on the flange, -flange.tau")

    def _act(self) -> Equations:
        yield from self._against_support()
        yield self.flange.tau == -self.tau


class ConstantTorque(_TorqueOnFlange):
    """The same torque at every speed; a negative one is a load during forward rotation.

    flange.tau = -tau_constant
    """

    tau_constant: Parameter = parameter("N.m", "Accelerating torque")

    def equations(self) -> Equations:
        """A constant."""
        yield from self._act()
        yield self.tau == self.tau_constant


class TorqueStep(_TorqueOnFlange):
    """A torque step.

    flange.tau = -offsetTorque before startTime, -(offsetTorque + stepTorque) from then on
    """

    stepTorque: Parameter = parameter("N.m", "Height of the step", default=1.0)
    offsetTorque: Parameter = parameter("N.m", "Torque before the step", default=0.0)
    startTime: Parameter = parameter("s", "Time of the step", default=0.0)

    def equations(self) -> Equations:
        """A step."""
        yield from self._act()
        yield self.tau == step(self.stepTorque, self.offsetTorque, self.startTime)


class _SpeedDependentTorque(_TorqueOnFlange):
    """Partial: a torque that depends on the flange's speed against the support."""

    tau_nominal: Parameter = parameter(
        "N.m", "Torque at w_nominal; negative, it is a load while the shaft turns forward"
    )
    w_nominal: Parameter = parameter("rad/s", "Nominal speed", above=0)
    w: Variable = variable("rad/s", "Speed of the flange against the support")
    TorqueDirection: bool = True

    def _depend(self) -> Equations:
        yield from self._act()
        yield self.w == der(self.phi)


class LinearSpeedDependentTorque(_SpeedDependentTorque):
    """A torque proportional to speed.

    tau = tau_nominal |w/w_nominal| with TorqueDirection (the same direction whichever way the shaft turns),
    else tau = tau_nominal w/w_nominal
    """

    def equations(self) -> Equations:
        """Proportional."""
        yield from self._depend()
        x = self.w / self.w_nominal
        yield self.tau == self.tau_nominal * linear(x, one_direction=self.TorqueDirection)


class QuadraticSpeedDependentTorque(_SpeedDependentTorque):
    """A torque proportional to the square of the speed.

    tau = tau_nominal (w/w_nominal)^2 with TorqueDirection (the same direction whichever way the shaft turns),
    else tau = tau_nominal (w/w_nominal) |w/w_nominal|
    """

    def equations(self) -> Equations:
        """Square law."""
        yield from self._depend()
        x = self.w / self.w_nominal
        yield self.tau == self.tau_nominal * quadratic(x, one_direction=self.TorqueDirection)


class InverseSpeedDependentTorque(_SpeedDependentTorque):
    """A torque inversely proportional to speed (constant power).

    tau = tau_nominal w_nominal/|w| with TorqueDirection (the same direction whichever way the shaft turns), held constant below w0
    else tau = tau_nominal w_nominal/w,  below w0 tau = tau_nominal w/w0

    Below w0 it is as in the Modelica Standard Library 4.0.0; the torque jumps at w0 unless w0 = w_nominal.
    """

    w0: Parameter = parameter("rad/s", "Speed below which the torque is limited", default=0.1, above=0)

    def equations(self) -> Equations:
        """Constant power above w0."""
        yield from self._depend()
        x = inverse(self.w, self.w_nominal, self.w0, one_direction=self.TorqueDirection)
        yield self.tau == self.tau_nominal * x


class SignTorque(_TorqueOnFlange):
    """A constant torque that changes sign with speed; a negative one brakes in both directions.

    tau = tau_nominal sign(w), smoothed around w = 0 by ``reg``:
      "exp": 2/(1 + exp(-w/(0.01 w0))) - 1;  below w0 "sine": sin(pi/2 w/w0);  "linear": w/w0;
      "cosine": sign(w) (1 - cos(pi/2 w/w0))
    """

    tau_nominal: Parameter = parameter("N.m", "Torque; negative, it brakes")
    w0: Parameter = parameter("rad/s", "Speed below which the sign is smoothed", default=0.1, above=0)
    reg: Regularization = "exp"
    w: Variable = variable("rad/s", "Speed of the flange against the support")

    def equations(self) -> Equations:
        """A smoothed sign."""
        yield from self._act()
        yield self.w == der(self.phi)
        yield self.tau == self.tau_nominal * smooth_sign(self.w / self.w0, self.reg)
