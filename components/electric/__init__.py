"""Electric machines, batteries and the direct-current bus between them."""

from __future__ import annotations

from powertrain.components.electric.battery import Battery, PolarizedBattery, cells_in_series
from powertrain.components.electric.capacitor import Capacitor
from powertrain.components.electric.cooling import (
    BatteryCooling,
    ConditionedBattery,
    ConditionedMachine,
    Cooling,
    LiquidCooledMachine,
    MachineCooling,
    PassivelyCooledBattery,
)
from powertrain.components.electric.interfaces import DCTerminal, VoltageSource
from powertrain.components.electric.loads import AccessoryLoad, DCDCConverter
from powertrain.components.electric.machine import ElectricMachine

__all__ = [
    "AccessoryLoad",
    "Battery",
    "BatteryCooling",
    "Capacitor",
    "ConditionedBattery",
    "ConditionedMachine",
    "Cooling",
    "DCDCConverter",
    "DCTerminal",
    "ElectricMachine",
    "LiquidCooledMachine",
    "MachineCooling",
    "PassivelyCooledBattery",
    "PolarizedBattery",
    "VoltageSource",
    "cells_in_series",
]
