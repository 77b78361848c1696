"""Combustion engines: torque from a map or a Willans line, with their fuel, or stroke by stroke from the pressure in their cylinders."""

from __future__ import annotations

from powertrain.components.engines.accessories import (
    Accessories,
    AccessoryDrive,
    AccessoryPump,
    Alternator,
    BufferedAccessories,
)
from powertrain.components.engines.cooling import CoolantCircuit, EngineCooling, WarmEngine
from powertrain.components.engines.cylinder import Cylinder
from powertrain.components.engines.interfaces import Engine
from powertrain.components.engines.mapped import MappedEngine
from powertrain.components.engines.operation import (
    FuelLine,
    best_fuel_line,
    operating_line,
    pull_speeds,
    sparse_fuel_line,
    throttle_table,
)
from powertrain.components.engines.piston import Crankshaft, PistonEngine
from powertrain.components.engines.starter import Starter
from powertrain.components.engines.tablefiles import read_fuel_map, read_torque_map
from powertrain.components.engines.willans import WillansEngine

__all__ = [
    "Accessories",
    "AccessoryDrive",
    "AccessoryPump",
    "Alternator",
    "BufferedAccessories",
    "CoolantCircuit",
    "Crankshaft",
    "Cylinder",
    "Engine",
    "EngineCooling",
    "FuelLine",
    "MappedEngine",
    "PistonEngine",
    "Starter",
    "WarmEngine",
    "WillansEngine",
    "best_fuel_line",
    "operating_line",
    "pull_speeds",
    "read_fuel_map",
    "read_torque_map",
    "sparse_fuel_line",
    "throttle_table",
]
