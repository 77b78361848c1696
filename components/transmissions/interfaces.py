"""What transmissions with a variable unit have in common."""

from __future__ import annotations

from powertrain import Input, signal_input
from powertrain.components.rotational.interfaces import TwoFlanges


class VariableTransmission(TwoFlanges):
    """Partial: a transmission from flange_a to flange_b whose overall ratio a signal sets, as V of its unit or itself."""

    ratio: Input = signal_input("1", "Speed ratio V of the variable unit")
