"""Operation of the pedals."""

from __future__ import annotations

from powertrain import (
    Component,
    Discrete,
    Equations,
    Input,
    Output,
    Symbol,
    discrete,
    signal_input,
    signal_output,
    time,
)

SOON = 1e-3
"""Time [s] after the start before which no control switches, so conditions that hold from the start also cause an event."""
LONG = 100.0
"""Time [s] that has passed at the start since the last shift, start or stop."""


class Switching(Component):
    """Partial: a control that switches, in a run that may start at any time."""

    entered: Discrete = discrete("s", "Time at which the run started", start=0.0)

    def initial(self) -> Equations:
        """The start."""
        yield self.entered == time

    def _begun(self) -> Symbol:
        """Whether it may switch."""
        return time > self.entered + SOON


class Pedals(Component):
    """Partial: accelerator and brake pedal, with the desired speed, the acceleration ahead and the vehicle speed as inputs."""

    v_ref: Input = signal_input("m/s", "Reference speed", default=0.0)
    a_ref: Input = signal_input("m/s2", "Acceleration ahead", default=0.0)
    v: Input = signal_input("m/s", "Speed of the vehicle", default=0.0)
    accelerator: Output = signal_output("1", "Accelerator pedal, 0 to 1")
    brake: Output = signal_output("1", "Brake pedal, 0 to 1")
