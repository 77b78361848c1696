"""Control of a continuously variable transmission: the engine on its line of least fuel."""

from __future__ import annotations

import casadi as ca

from powertrain import (
    Component,
    Equations,
    Input,
    Map,
    Output,
    Parameter,
    Variable,
    parameter,
    signal_input,
    signal_output,
    switch,
    variable,
)

LINE = Map.curve([0.0, 5e4], [110.0, 450.0], x="power", x_unit="W", outside="clip", unit="rad/s", name="operating line")


class OperatingLineControl(Component):
    """Gives the engine the speed at which it makes the demanded power with the least fuel, and the torque that is left to make.

    power = accelerator F_max (v + v_0),  w_ref = line(power),  throttle = power/(w tau_max),  ratio = w_out/w_ref
    clutch = (w - w_open)/(w_closed - w_open)

    ``line`` is a map from power [W] to engine speed [rad/s]. v_0 is what makes an accelerator ask for power at standstill. The ratio is
    the speed at the transmission's output over that at its input, held within [ratio_min, ratio_max]. The start clutch closes with
    the engine's speed as a centrifugal one does: where it is not positive, it is open.
    """

    line: Map = LINE
    F_max: Parameter = parameter("N", "Tractive force that a full accelerator asks for", default=6000.0, above=0)
    v_0: Parameter = parameter("m/s", "Speed for which power is asked at standstill", default=4.0, above=0)
    tau_max: Parameter = parameter("N.m", "Torque of the engine with an open throttle", default=150.0, above=0)
    ratio_min: Parameter = parameter("1", "Least ratio of the transmission", default=0.5, above=0)
    ratio_max: Parameter = parameter("1", "Greatest ratio of the transmission", default=2.0, above=0)
    w_open: Parameter = parameter("rad/s", "Speed of the engine below which the clutch is open", default=95.0, above=0)
    w_closed: Parameter = parameter(
        "rad/s", "Speed of the engine at which the clutch presses fully", default=160.0, above=0
    )
    accelerator: Input = signal_input("1", "Accelerator pedal")
    v: Input = signal_input("m/s", "Speed of the vehicle")
    w: Input = signal_input("rad/s", "Speed of the engine")
    w_out: Input = signal_input("rad/s", "Speed at the output of the transmission")
    throttle: Output = signal_output("1", "Throttle of the engine")
    ratio: Output = signal_output("1", "Demanded ratio of the transmission")
    clutch: Output = signal_output("1", "Pressure of the start clutch")
    power: Variable = variable("W", "Demanded power")
    w_ref: Variable = variable("rad/s", "Wanted speed of the engine")

    def equations(self) -> Equations:
        """Power first, then speed, then what torque and ratio follow."""
        yield self.power == self.accelerator.value * self.F_max * (self.v.value + self.v_0)
        yield self.w_ref == self.line(self.power)
        yield self.throttle.value == self.power / (self.tau_max * ca.fmax(self.w.value, self.w_open))
        wanted = self.w_out.value / self.w_ref
        low = switch(wanted < self.ratio_min, self.ratio_min, wanted, continuous=True)
        yield self.ratio.value == switch(wanted > self.ratio_max, self.ratio_max, low, continuous=True)
        yield self.clutch.value == (self.w.value - self.w_open) / (self.w_closed - self.w_open)
