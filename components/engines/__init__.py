"""Combustion engines: torque from a map or a Willans line, with their fuel."""

from __future__ import annotations

from powertrain.components.engines.accessories import AccessoryDrive
from powertrain.components.engines.interfaces import Engine
from powertrain.components.engines.mapped import MappedEngine
from powertrain.components.engines.operation import (
    FuelLine,
    best_fuel_line,
    operating_line,
    sparse_fuel_line,
    throttle_table,
)
from powertrain.components.engines.willans import WillansEngine

__all__ = [
    "AccessoryDrive",
    "Engine",
    "FuelLine",
    "MappedEngine",
    "WillansEngine",
    "best_fuel_line",
    "operating_line",
    "sparse_fuel_line",
    "throttle_table",
]
