"""Operation of the pedals."""

from __future__ import annotations

from powertrain import Component, Input, Output, signal_input, signal_output

SOON = 1e-3
"""Time [s] before which no control switches, so conditions that hold from the start also cause an event."""


class Pedals(Component):
    """Partial: accelerator and brake pedal, with the desired speed, the acceleration ahead and the vehicle speed as inputs."""

    v_ref: Input = signal_input("m/s", "Reference speed", default=0.0)
    a_ref: Input = signal_input("m/s2", "Acceleration ahead", default=0.0)
    v: Input = signal_input("m/s", "Speed of the vehicle", default=0.0)
    accelerator: Output = signal_output("1", "Accelerator pedal, 0 to 1")
    brake: Output = signal_output("1", "Brake pedal, 0 to 1")
