"""What vehicles are measured by: cycles, consumption, acceleration, maps of whole drivelines."""

from __future__ import annotations

from powertrain.trials.backward import BackwardRun, backward
from powertrain.trials.charge import charge_corrected
from powertrain.trials.cycle import CycleRun, drive_cycle
from powertrain.trials.driveline import driveline_map
from powertrain.trials.management import Comparison, Management
from powertrain.trials.management_flywheel import flywheel_management
from powertrain.trials.management_power_split import power_split_management
from powertrain.trials.operating import on_rolling_road
from powertrain.trials.performance import full_accelerator, gradeability, performance, time_between

__all__ = [
    "BackwardRun",
    "Comparison",
    "CycleRun",
    "Management",
    "backward",
    "charge_corrected",
    "drive_cycle",
    "driveline_map",
    "flywheel_management",
    "full_accelerator",
    "gradeability",
    "on_rolling_road",
    "performance",
    "power_split_management",
    "time_between",
]
