"""Control of a continuously variable transmission: the engine runs on its line of lowest fuel consumption."""

from __future__ import annotations

import casadi as ca

from powertrain import (
    Component,
    Equations,
    Input,
    Output,
    Parameter,
    parameter,
    signal_input,
    signal_output,
)
from powertrain.components.limited import limited, limited_at

SMALL = 1e-3
"""Smallest torque that an engine counts as having, as a share of that for the power at standstill: beyond its speed limit it has none, and
the throttle is open."""
PRESSED = 0.05
"""Accelerator position at which combustion compensates all of the engine's drag."""


class OperatingLineControl(Component):
    """Sets the engine speed with the lowest fuel consumption for the demanded power, and the torque for this power.

    power = accelerator F_max (max(v, 0) + v_0),  throttle = (power/w + tau_drag pressed)/(tau_open + tau_drag),  ratio = w_out/w_best
    pressed = accelerator/0.05 within 0..1,  clutch = (w - w_open)/(w_closed - w_open)

    The vehicle supplies the data of the engine: ``w_best`` is the speed of least fuel for the output ``power``
    (``operating_line(engine)`` is a map for it), ``tau_open`` the torque with open throttle, ``tau_drag`` the motoring torque without
    fuel. From an accelerator of 5 % on, combustion compensates for all of the drag, and the power is that at the crank; below, the crank
    gives power - tau_drag w (1 - pressed), so that a closing pedal leads continuously from driving to engine braking. With a drag of
    2 kW and 3 kW demanded at 3 %, the crank gives 2.2 kW. A driver who follows a speed presses a little more; the fuel is the same:
    with 1 % instead of 5 % it changes by less than 0.1 % over the WLTC. ``throttle`` is the fraction of the largest combustion
    torque; if that is not proportional to the throttle, ``engine.opening`` gives the throttle for it. With the accelerator released,
    the throttle is closed and the engine brakes. Through v_0 the accelerator demands power at standstill and where the vehicle rolls back.
    The ratio is the speed at the transmission's output over that at its input, held within [ratio_min, ratio_max]. The start clutch closes
    with the engine speed like a centrifugal clutch; if ``clutch`` is not positive, it is open.
    """

    F_max: Parameter = parameter("N", "Tractive force with the accelerator fully pressed", default=6000.0, above=0)
    v_0: Parameter = parameter("m/s", "Equivalent speed for the power demand at standstill", default=4.0, above=0)
    ratio_min: Parameter = parameter("1", "Minimum ratio of the transmission", default=0.5, above=0)
    ratio_max: Parameter = parameter("1", "Maximum ratio of the transmission", default=2.0, above=0)
    w_open: Parameter = parameter("rad/s", "Engine speed below which the clutch is open", default=95.0, above=0)
    w_closed: Parameter = parameter("rad/s", "Engine speed at which the clutch is fully closed", default=160.0, above=0)
    accelerator: Input = signal_input("1", "Accelerator pedal")
    v: Input = signal_input("m/s", "Speed of the vehicle")
    w: Input = signal_input("rad/s", "Speed of the engine")
    w_out: Input = signal_input("rad/s", "Speed at the output of the transmission")
    w_best: Input = signal_input("rad/s", "Engine speed of least fuel for the power")
    tau_open: Input = signal_input("N.m", "Torque of the engine with an open throttle")
    tau_drag: Input = signal_input("N.m", "Motoring torque of the engine", default=0.0)
    power: Output = signal_output("W", "Demanded power")
    throttle: Output = signal_output("1", "Fraction of the maximum combustion torque")
    ratio: Output = signal_output("1", "Demanded ratio of the transmission")
    clutch: Output = signal_output("1", "Pressure of the start clutch")

    def check(self) -> Equations:
        """The range must not be empty, and the clutch closes as the engine gets faster."""
        yield self.ratio_min < self.ratio_max
        yield self.w_open < self.w_closed

    def equations(self) -> Equations:
        """Power demand, and the resulting torque and ratio."""
        yield self.power.value == self.accelerator.value * self.F_max * (ca.fmax(self.v.value, 0) + self.v_0)
        torque, drag = self.power.value / ca.fmax(self.w.value, self.w_open), ca.fmax(self.tau_drag.value, 0)
        pressed = limited(self.accelerator.value / PRESSED)
        least = SMALL * self.F_max * self.v_0 / self.w_open
        yield self.throttle.value == (torque + drag * pressed) / (ca.fmax(self.tau_open.value, least) + drag)
        wanted = self.w_out.value / self.w_best.value
        yield self.ratio.value == limited_at(wanted, self.ratio_min, self.ratio_max)
        yield self.clutch.value == (self.w.value - self.w_open) / (self.w_closed - self.w_open)
