"""The common interface of transmissions with a variable unit."""

from __future__ import annotations

from powertrain import Input, signal_input
from powertrain.components.rotational.interfaces import TwoFlanges


class VariableTransmission(TwoFlanges):
    """Partial: a transmission from flange_a to flange_b; a signal sets V of its unit or the overall ratio."""

    ratio: Input = signal_input("1", "Speed ratio V of the variable unit")
