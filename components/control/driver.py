"""A driver who follows a speed, pedals at fixed positions, and pedals that are inputs of the model."""

from __future__ import annotations

import casadi as ca

from powertrain import Equations, Input, Parameter, Symbol, Variable, der, parameter, signal_input, switch, variable
from powertrain.components.control.interfaces import Pedals
from powertrain.components.limited import limited, limited_at

STILL, STEADY = 0.05, 0.05
"""A cycle counts as standing still below this speed [m/s] and this acceleration [m/s2]."""

BEYOND = 0.1
"""Demand beyond the stop of a pedal at which the integral stops completely."""


class SpeedFollower(Pedals):
    """Partial: a proportional-integral speed controller with feedforward of the acceleration ahead, between the stops of two pedals.

    u = k_a a_ref + k_p (v_ref - v) + x,  der(x) = k_i (v_ref - v) share,  held = the foot's demand within [-1, 1]
    v < v_ref: share = (1.1 - u)/0.1 within 0..1;  v > v_ref: share = (1.1 + u)/0.1 within 0..1
    accelerator = max(pedal, 0),  brake = max(-pedal, 0),  pedal = held, but min(-|held|, -hold) while v_ref and a_ref are below 0.05

    While a pedal is at its stop, the integral x is held (anti-windup by conditional integration), so that the driver releases the pedal
    just before the speed is reached. k_a is the pedal position that the vehicle needs for 1 m/s2, about its mass divided by the largest
    force. When the cycle is at standstill, the driver presses the brake, and harder if the vehicle rolls forward or backward; so on
    slopes above hold times the force of all brakes over the weight it first rolls. ``v_ref`` and ``a_ref`` are outputs of
    ``CycleSpeed``.
    """

    k_p: Parameter = parameter("s/m", "Pedal position per speed error", default=0.5, min=0)
    k_i: Parameter = parameter("1/m", "Rate of the pedal position per speed error", default=0.1, min=0)
    k_a: Parameter = parameter("s2/m", "Pedal position per acceleration", default=0.3, min=0)
    hold: Parameter = parameter("1", "Brake pedal position at standstill", default=0.1, min=0, max=1)
    error: Variable = variable("m/s", "Speed error, reference minus actual")
    u: Variable = variable("1", "Demand before the stops of the pedals")
    x: Variable = variable("1", "Integral part of the demand")

    def _demand(self) -> Equations:
        yield self.error == self.v_ref.value - self.v.value
        yield self.u == self.k_a * self.a_ref.value + self.k_p * self.error + self.x
        slow, fast = ca.fmax(self.error, 0), ca.fmin(self.error, 0)
        room = [limited((1 + BEYOND + sign * self.u) / BEYOND) for sign in (-1, 1)]
        yield der(self.x) == self.k_i * (slow * room[0] + fast * room[1])

    def _press(self, foot: Symbol) -> Equations:
        held = limited_at(foot, -1.0, 1.0)
        standing = ca.logic_and(self.v_ref.value < STILL, self.a_ref.value < STEADY)
        pedal = switch(standing, ca.fmin(-ca.fabs(held), -self.hold), held)
        driving = pedal > 0
        yield self.accelerator.value == switch(driving, pedal, 0.0, continuous=True)
        yield self.brake.value == switch(driving, 0.0, -pedal, continuous=True)


class Driver(SpeedFollower):
    """Follows a speed with the pedals; the foot follows the demand at once.

    The equations are those of ``SpeedFollower`` with the demand u at the pedals.
    """

    def equations(self) -> Equations:
        """A controller with two limits."""
        yield from self._demand()
        yield from self._press(self.u)


class LaggingDriver(SpeedFollower):
    """Follows a speed with a foot that lags behind, as a human one does: T der(foot) = u - foot, with foot at the pedals.

    Without this lag the driver would sustain the shuffle of a car on its half shafts (2 to 8 Hz).
    Source of the order of T: D. T. McRuer, H. R. Jex, A review of quasi-linear pilot models, IEEE Trans. Human Factors in Electronics
    HFE-8 (1967) 231: neuromuscular lag and delay of 0.1 to 0.3 s.
    """

    T: Parameter = parameter("s", "Lag of the foot", default=0.2, above=0)
    foot: Variable = variable("1", "Demand that has reached the foot", start=0.0)

    def equations(self) -> Equations:
        """A controller, a lag and two limits."""
        yield from self._demand()
        yield self.T * der(self.foot) == self.u - self.foot
        yield from self._press(self.foot)


class SetPedals(Pedals):
    """Pedals at fixed positions, for measurements on a rolling road."""

    accelerator_set: Parameter = parameter("1", "Accelerator pedal", default=0.0, min=0, max=1)
    brake_set: Parameter = parameter("1", "Brake pedal", default=0.0, min=0, max=1)

    def equations(self) -> Equations:
        """The set positions."""
        yield self.accelerator.value == self.accelerator_set
        yield self.brake.value == self.brake_set


class OpenPedals(Pedals):
    """Pedals that are inputs of the model: ``inputs={"driver.accelerator_pedal": ([0, 1, 10], [0, 0.3, 0.3])}``.

    A pedal below 0 counts as 0, one above 1 as 1.
    """

    accelerator_pedal: Input = signal_input("1", "Accelerator pedal, 0 to 1", default=0.0, outside=True)
    brake_pedal: Input = signal_input("1", "Brake pedal, 0 to 1", default=0.0, outside=True)

    def equations(self) -> Equations:
        """The inputs, within 0 and 1."""
        yield self.accelerator.value == limited(self.accelerator_pedal.value)
        yield self.brake.value == limited(self.brake_pedal.value)
