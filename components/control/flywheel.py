"""Control of a car with a flywheel: the transmission ratio controls the motion, and the engine only charges the flywheel."""

from __future__ import annotations

import casadi as ca

from powertrain import (
    Component,
    Discrete,
    Equations,
    Input,
    Output,
    Parameter,
    Symbol,
    discrete,
    parameter,
    reinit,
    signal_input,
    signal_output,
    switch,
    when,
)
from powertrain.components.control.interfaces import Switching
from powertrain.components.limited import limited

OPEN = 0.05
"""The part of ``band`` in which the clutch is still open, so that it does not open and close under the round-off of a speed at rest."""
SLOW = 1.0
"""Speed [rad/s] of the transmission's input below which ratios are computed as at this speed."""


class FlywheelDrive(Component):
    """Accelerates and brakes with the ratio of a transmission whose input is a flywheel.

    ratio = (w_out + lead (charge accelerator - brake))/w_in within [ratio_min, ratio_max]
    charge = (w_in - w_empty)/w_band within -1..1
    engaged = ((w_before/w_in - ratio_min)/band - 0.05)/0.95 within 0..1,  room = (w_full - w_in)/w_band within 0..1
    clutch = (engaged + launch accelerator) (1 - (1 - recovery) brake/b_open within 0..1)
    friction = brake - recovery engaged room min(brake, share)

    In the denominators w_in is at least 1 rad/s, for a flywheel at rest.
    An actuator with the time constant T changes the ratio at the rate lead u/(T w_in): the pedals command an acceleration lead/T of the
    output, which takes energy from the flywheel or returns it. Nothing is taken from an empty flywheel. At the lowest ratio the clutch
    slips depending on the accelerator; during braking it opens there. The friction brakes supply the demand beyond ``share`` of the
    pedal, and all of it if the clutch is open or the flywheel is full. With recovery = 0 they do all the braking, with the clutch open.
    """

    lead: Parameter = parameter(
        "rad/s", "Change of the output speed demand with the pedal fully pressed", default=8.4, above=0
    )
    ratio_min: Parameter = parameter("1", "Minimum ratio", default=0.15, above=0)
    ratio_max: Parameter = parameter("1", "Maximum ratio", default=2.0, above=0)
    band: Parameter = parameter("1", "Ratio above the minimum at which the clutch is closed", default=0.05, above=0)
    launch: Parameter = parameter(
        "1", "Pressure of the slipping clutch with the accelerator fully pressed", default=0.6, min=0
    )
    w_full: Parameter = parameter("rad/s", "Input speed at which the flywheel is full", default=560.0, above=0)
    w_empty: Parameter = parameter("rad/s", "Input speed at which the flywheel is empty", default=240.0, above=0)
    w_band: Parameter = parameter(
        "rad/s", "Speed range in which charging and discharging fade out", default=40.0, above=0
    )
    share: Parameter = parameter(
        "1", "Fraction of the brake pedal travel for regenerative braking", default=0.6, min=0, max=1
    )
    recovery: Parameter = parameter("1", "1: with regenerative braking, 0: without", default=1.0, min=0, max=1)
    b_open: Parameter = parameter(
        "1", "Brake pedal position that opens the clutch without regenerative braking", default=0.05, above=0
    )
    accelerator: Input = signal_input("1", "Accelerator pedal")
    brake: Input = signal_input("1", "Brake pedal")
    w_in: Input = signal_input("rad/s", "Speed at the input of the transmission")
    w_before: Input = signal_input("rad/s", "Speed at its output, before the clutch")
    w_out: Input = signal_input("rad/s", "Speed behind the clutch")
    ratio: Output = signal_output("1", "Demanded ratio")
    clutch: Output = signal_output("1", "Pressure of the clutch")
    friction: Output = signal_output("1", "Demand on the friction brakes")

    def check(self) -> Equations:
        """The ranges must not be empty."""
        yield self.ratio_min < self.ratio_max
        yield self.w_empty < self.w_full

    def equations(self) -> Equations:
        """Ratio, clutch, brakes."""
        u, b = self.accelerator.value, self.brake.value
        charge = limited((self.w_in.value - self.w_empty) / self.w_band, -1)
        w_in = ca.fmax(self.w_in.value, SLOW)
        wanted = (self.w_out.value + self.lead * (charge * u - b)) / w_in
        yield self.ratio.value == limited(wanted, self.ratio_min, self.ratio_max)
        above = (self.w_before.value / w_in - self.ratio_min) / self.band
        engaged = limited((above - OPEN) / (1 - OPEN))
        open_ = (1 - self.recovery) * limited(b / self.b_open)
        yield self.clutch.value == (engaged + self.launch * u) * (1 - open_)
        room = limited((self.w_full - self.w_in.value) / self.w_band)
        yield self.friction.value == b - self.recovery * engaged * room * ca.fmin(b, self.share)


class FlywheelCharging(Component):
    """Partial: an engine that charges a flywheel through a clutch."""

    slip: Parameter = parameter("1", "Slip at which the clutch begins to close", default=0.1, above=0)
    w: Input = signal_input("rad/s", "Speed of the engine")
    w_in: Input = signal_input("rad/s", "Speed of the shaft to be charged")
    v: Input = signal_input("m/s", "Speed of the vehicle")
    on: Output = signal_output("1", "1: the engine runs, 0: it is stopped")
    throttle: Output = signal_output("1", "Throttle of the engine")
    clutch: Output = signal_output("1", "Pressure of the engine's clutch")

    def _give(self, charging: Symbol, throttle: Symbol) -> Equations:
        yield self.on.value == charging
        yield self.throttle.value == charging * throttle
        ahead = self.w.value / ca.fmax(self.w_in.value, SLOW) - 1
        yield self.clutch.value == charging * limited((ahead + self.slip) / self.slip)


class FlywheelCharge(FlywheelCharging, Switching):
    """Runs the engine at an efficient throttle position while the flywheel is slow, and stops it while the flywheel is fast.

    on = 1 from where w_in < w_rest - slope |v|,  on = 0 from where w_in > w_rest - slope |v| + hysteresis
    throttle = on u_charge,  clutch = on (w/w_in - 1 + slip)/slip within 0..1,  w_in here at least 1 rad/s

    A fast car holds energy that the flywheel will recover, hence ``slope``. The clutch closes as the engine approaches the speed of the
    flywheel shaft.
    """

    w_rest: Parameter = parameter(
        "rad/s", "Flywheel speed below which it is charged at standstill", default=320.0, above=0
    )
    slope: Parameter = parameter("rad/m", "Reduction of w_rest per unit of vehicle speed", default=0.5, min=0)
    hysteresis: Parameter = parameter("rad/s", "Rise of the input speed during charging", default=100.0, above=0)
    u_charge: Parameter = parameter("1", "Throttle while charging", default=0.9, above=0, max=1)
    charging: Discrete = discrete("1", "1: charging, 0: not charging", start=0.0)

    def equations(self) -> Equations:
        """A switch with hysteresis."""
        low = self.w_rest - self.slope * ca.fabs(self.v.value)
        w_in = self.w_in.value
        yield when(ca.logic_and(w_in < low, self._begun()), reinit(self.charging, 1))
        yield when(w_in > low + self.hysteresis, reinit(self.charging, 0))
        yield from self._give(self.charging, self.u_charge)


class PlannedCharge(FlywheelCharging):
    """Runs the engine as commanded from outside, by a plan over time or a supervisor.

    on = 1 where engine_on > 0.5,  throttle = on engine_throttle,  clutch as of ``FlywheelCharge``

    Both are inputs of the model: ``inputs={"charge.engine_on": (times, values), "charge.engine_throttle": (times, values)}``.
    """

    engine_on: Input = signal_input("1", "1: the engine runs, 0: it is stopped", default=0.0, outside=True)
    engine_throttle: Input = signal_input("1", "Throttle while it runs", default=0.9, outside=True)

    def equations(self) -> Equations:
        """As planned."""
        yield from self._give(switch(self.engine_on.value > 0.5, 1.0, 0.0), self.engine_throttle.value)
