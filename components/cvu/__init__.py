"""Continuously variable units (CVU) with a common interface: two flanges, and the speed ratio as a signal."""

from __future__ import annotations

from powertrain.components.cvu.actuator import Actuator, IdealActuator, RatioActuator
from powertrain.components.cvu.electric import ElectricVariator
from powertrain.components.cvu.electric_pair import ElectricPair
from powertrain.components.cvu.friction_drives import TractionDrive, VBelt
from powertrain.components.cvu.hydrostatic import HydrostaticUnit
from powertrain.components.cvu.interfaces import VariableUnit
from powertrain.components.cvu.limits import ActuatedUnit, LimitedUnit, TorqueLimiter
from powertrain.components.cvu.unit import CVU

__all__ = [
    "CVU",
    "ActuatedUnit",
    "Actuator",
    "ElectricPair",
    "ElectricVariator",
    "HydrostaticUnit",
    "IdealActuator",
    "LimitedUnit",
    "RatioActuator",
    "TorqueLimiter",
    "TractionDrive",
    "VBelt",
    "VariableUnit",
]
