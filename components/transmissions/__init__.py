"""Transmissions put together from differentials, variable units, gears and clutches."""

from __future__ import annotations

from powertrain.components.transmissions.gearbox import ManualGearbox, Shiftable, SingleGear
from powertrain.components.transmissions.hydrodynamic import FluidCoupling, TorqueConverter
from powertrain.components.transmissions.layout import (
    COMBINATIONS,
    TYPES,
    Coupling,
    Layout,
    members,
    overall_ratio,
    relative_ratio,
    unit_ratio,
)
from powertrain.components.transmissions.power_shift import (
    PowerShiftGearbox,
    StartingClutch,
    StartingConverter,
    StartingDevice,
)
from powertrain.components.transmissions.ratio import UnitRatio
from powertrain.components.transmissions.split_path import SplitPathTransmission, SwitchedSplitPathTransmission

__all__ = [
    "COMBINATIONS",
    "TYPES",
    "Coupling",
    "FluidCoupling",
    "Layout",
    "ManualGearbox",
    "PowerShiftGearbox",
    "Shiftable",
    "SingleGear",
    "SplitPathTransmission",
    "StartingClutch",
    "StartingConverter",
    "StartingDevice",
    "SwitchedSplitPathTransmission",
    "TorqueConverter",
    "UnitRatio",
    "members",
    "overall_ratio",
    "relative_ratio",
    "unit_ratio",
]
