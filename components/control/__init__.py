"""Drivers, gear schedules and the control of variable ratios."""

from __future__ import annotations

from powertrain.components.control.driver import Driver, LaggingDriver, OpenPedals, SetPedals
from powertrain.components.control.electric_drive import BlendedBraking, ElectricDriveControl
from powertrain.components.control.flywheel import FlywheelCharge, FlywheelCharging, FlywheelDrive, PlannedCharge
from powertrain.components.control.gear_schedule import (
    FixedGear,
    GearSchedule,
    PowerShiftSchedule,
    Shifting,
    SpeedSchedule,
)
from powertrain.components.control.hybrid import GensetControl, HybridControl, HybridSupervisor, ParallelControl
from powertrain.components.control.interfaces import Pedals
from powertrain.components.control.operating_line import OperatingLineControl
from powertrain.components.control.power_split import PlannedPowerSplit, PowerSplit, PowerSplitControl
from powertrain.components.control.start_stop import AlwaysOn, EngineSwitch, StartStop

__all__ = [
    "AlwaysOn",
    "BlendedBraking",
    "Driver",
    "ElectricDriveControl",
    "EngineSwitch",
    "FixedGear",
    "FlywheelCharge",
    "FlywheelCharging",
    "FlywheelDrive",
    "GearSchedule",
    "GensetControl",
    "HybridControl",
    "HybridSupervisor",
    "LaggingDriver",
    "OpenPedals",
    "OperatingLineControl",
    "ParallelControl",
    "Pedals",
    "PlannedCharge",
    "PlannedPowerSplit",
    "PowerShiftSchedule",
    "PowerSplit",
    "PowerSplitControl",
    "SetPedals",
    "Shifting",
    "SpeedSchedule",
    "StartStop",
]
