"""What transmissions with a variable unit have in common."""

from __future__ import annotations

from powertrain import Input, signal_input
from powertrain.components.cvu.interfaces import VariableUnit
from powertrain.components.cvu.unit import CVU
from powertrain.components.rotational.interfaces import TwoFlanges


class VariableTransmission(TwoFlanges):
    """Partial: a transmission from flange_a to flange_b whose overall ratio the ratio V of a variable unit sets."""

    ratio: Input = signal_input("1", "Speed ratio V of the variable unit")
    cvu: VariableUnit = CVU(eta_ab=0.9, eta_ba=0.9)
