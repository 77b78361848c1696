"""What vehicles are measured by: cycles, consumption, acceleration, maps of whole drivelines."""

from __future__ import annotations

from powertrain.trials.backward import BackwardRun, backward
from powertrain.trials.charge import charge_corrected
from powertrain.trials.cycle import CycleRun, drive_cycle
from powertrain.trials.driveline import driveline_map
from powertrain.trials.operating import on_rolling_road
from powertrain.trials.performance import full_accelerator, gradeability, performance, time_between

__all__ = [
    "BackwardRun",
    "CycleRun",
    "backward",
    "charge_corrected",
    "drive_cycle",
    "driveline_map",
    "full_accelerator",
    "gradeability",
    "on_rolling_road",
    "performance",
    "time_between",
]
