"""Transmissions built from differentials, variable units, gears and clutches."""

from __future__ import annotations

from powertrain.components.transmissions.automatic import Automatic
from powertrain.components.transmissions.clutch_to_clutch import ClutchToClutch
from powertrain.components.transmissions.dual_clutch import ClutchedGear, DualClutchGearbox, StartingGearbox
from powertrain.components.transmissions.electric_transmission import ElectricTransmission
from powertrain.components.transmissions.gear_scheme import GearScheme
from powertrain.components.transmissions.gearbox import ManualGearbox, Shiftable, SingleGear
from powertrain.components.transmissions.gearsets import (
    CR_CR_FOUR,
    CR_CR_FREEWHEELS,
    EIGHT_SPEED,
    LEPELLETIER_SIX,
    NINE_SPEED,
    RAVIGNEAUX_FOUR,
    SEVEN_SPEED,
    SIMPSON_FREEWHEEL,
    SIMPSON_THREE,
    TEN_SPEED,
)
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
from powertrain.components.transmissions.lumped_gear import LumpedGear
from powertrain.components.transmissions.network import HOUSING, Joint, Lever, Network, joints
from powertrain.components.transmissions.network_flow import Flow, UnitLoss, flow
from powertrain.components.transmissions.network_transmission import NetworkGears, NetworkTransmission
from powertrain.components.transmissions.planetary_levers import double_planetary, planetary, ravigneaux
from powertrain.components.transmissions.power_shift import (
    NeutralIdleConverter,
    PowerShiftGearbox,
    ShiftedGears,
    StartingClutch,
    StartingConverter,
    StartingDevice,
)
from powertrain.components.transmissions.range_transmission import RangeTransmission
from powertrain.components.transmissions.ratio import NetworkRatio, OverallRatio, RatioOfUnit, UnitRatio
from powertrain.components.transmissions.shift_table import SchemeGear, ShiftElement
from powertrain.components.transmissions.split_path import SplitPathTransmission, SwitchedSplitPathTransmission
from powertrain.components.transmissions.synchronised import SynchronisedGearbox

__all__ = [
    "COMBINATIONS",
    "CR_CR_FOUR",
    "CR_CR_FREEWHEELS",
    "EIGHT_SPEED",
    "HOUSING",
    "LEPELLETIER_SIX",
    "NINE_SPEED",
    "RAVIGNEAUX_FOUR",
    "SEVEN_SPEED",
    "SIMPSON_FREEWHEEL",
    "SIMPSON_THREE",
    "TEN_SPEED",
    "TYPES",
    "Automatic",
    "ClutchToClutch",
    "ClutchedGear",
    "Coupling",
    "DualClutchGearbox",
    "ElectricTransmission",
    "Flow",
    "FluidCoupling",
    "GearScheme",
    "Joint",
    "Layout",
    "Lever",
    "LumpedGear",
    "ManualGearbox",
    "Network",
    "NetworkGears",
    "NetworkRatio",
    "NetworkTransmission",
    "NeutralIdleConverter",
    "OverallRatio",
    "PowerShiftGearbox",
    "RangeTransmission",
    "RatioOfUnit",
    "SchemeGear",
    "ShiftElement",
    "Shiftable",
    "ShiftedGears",
    "SingleGear",
    "SplitPathTransmission",
    "StartingClutch",
    "StartingConverter",
    "StartingDevice",
    "StartingGearbox",
    "SwitchedSplitPathTransmission",
    "SynchronisedGearbox",
    "TorqueConverter",
    "UnitLoss",
    "UnitRatio",
    "VariableTransmission",
    "double_planetary",
    "flow",
    "joints",
    "members",
    "overall_ratio",
    "planetary",
    "ravigneaux",
    "relative_ratio",
    "unit_ratio",
]
