"""Transmissions built from differentials, variable units, gears and clutches."""

from __future__ import annotations

from powertrain.components.transmissions.gearbox import ManualGearbox, Shiftable, SingleGear
from powertrain.components.transmissions.hydrodynamic import FluidCoupling, TorqueConverter
from powertrain.components.transmissions.interfaces import VariableTransmission
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
from powertrain.components.transmissions.network import HOUSING, Joint, Lever, Network, joints
from powertrain.components.transmissions.network_flow import Flow, UnitLoss, flow
from powertrain.components.transmissions.network_transmission import NetworkGears, NetworkTransmission
from powertrain.components.transmissions.power_shift import (
    PowerShiftGearbox,
    StartingClutch,
    StartingConverter,
    StartingDevice,
)
from powertrain.components.transmissions.range_transmission import RangeTransmission
from powertrain.components.transmissions.ratio import NetworkRatio, OverallRatio, RatioOfUnit, UnitRatio
from powertrain.components.transmissions.split_path import SplitPathTransmission, SwitchedSplitPathTransmission

__all__ = [
    "COMBINATIONS",
    "HOUSING",
    "TYPES",
    "Coupling",
    "Flow",
    "FluidCoupling",
    "Joint",
    "Layout",
    "Lever",
    "ManualGearbox",
    "Network",
    "NetworkGears",
    "NetworkRatio",
    "NetworkTransmission",
    "OverallRatio",
    "PowerShiftGearbox",
    "RangeTransmission",
    "RatioOfUnit",
    "Shiftable",
    "SingleGear",
    "SplitPathTransmission",
    "StartingClutch",
    "StartingConverter",
    "StartingDevice",
    "SwitchedSplitPathTransmission",
    "TorqueConverter",
    "UnitLoss",
    "UnitRatio",
    "VariableTransmission",
    "flow",
    "joints",
    "members",
    "overall_ratio",
    "relative_ratio",
    "unit_ratio",
]
