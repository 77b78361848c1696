"""Drivers, gear schedules and the control of variable ratios."""

from __future__ import annotations

from powertrain.components.control.driver import Driver, LaggingDriver, OpenPedals, SetPedals
from powertrain.components.control.electric_drive import BlendedBraking, ElectricDriveControl
from powertrain.components.control.flywheel import FlywheelCharge, FlywheelDrive
from powertrain.components.control.gear_schedule import FixedGear, GearSchedule, PowerShiftSchedule, Shifting
from powertrain.components.control.hybrid import GensetControl, HybridControl, ParallelControl
from powertrain.components.control.interfaces import Pedals
from powertrain.components.control.operating_line import OperatingLineControl
from powertrain.components.control.power_split import PowerSplitControl
from powertrain.components.control.start_stop import AlwaysOn, EngineSwitch, StartStop

__all__ = [
    "AlwaysOn",
    "BlendedBraking",
    "Driver",
    "ElectricDriveControl",
    "EngineSwitch",
    "FixedGear",
    "FlywheelCharge",
    "FlywheelDrive",
    "GearSchedule",
    "GensetControl",
    "HybridControl",
    "LaggingDriver",
    "OpenPedals",
    "OperatingLineControl",
    "ParallelControl",
    "Pedals",
    "PowerShiftSchedule",
    "PowerSplitControl",
    "SetPedals",
    "Shifting",
    "StartStop",
]
