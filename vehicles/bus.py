"""The power on a vehicle's bus that is available to a machine, as an input of its control."""

from __future__ import annotations

from powertrain import Equations, Symbol
from powertrain.components.control import BlendedBraking, PowerSplit
from powertrain.components.electric import ElectricMachine


def known_machine(control: BlendedBraking | PowerSplit, machine: ElectricMachine, left: Symbol) -> Equations:
    """Tell the control the machine's largest torque and losses; ``left`` is the power [W] that it may draw, including losses."""
    idle = machine.loss_at(Symbol(0.0))
    most = machine.limit(machine.w, machine.bus.v)
    yield control.limit.value == most
    yield control.added_loss.value == machine.loss_at(most) - idle
    yield control.discharge_power.value == left - idle
