"""Trials of vehicles: cycles, consumption, acceleration, maps of whole drivelines."""

from __future__ import annotations

from powertrain.trials.backward import BackwardRun, backward
from powertrain.trials.braking import BrakingTest, braking
from powertrain.trials.charge import (
    ChargeSustaining,
    charge_corrected,
    charge_depleting,
    charge_sustaining,
    electric_share,
)
from powertrain.trials.cycle import drive_cycle
from powertrain.trials.cycle_run import CycleRun
from powertrain.trials.driveline import driveline_map
from powertrain.trials.gear_table import gear_table
from powertrain.trials.management import Management, MethodComparison
from powertrain.trials.management_flywheel import flywheel_management
from powertrain.trials.management_power_split import power_split_management
from powertrain.trials.operating import on_rolling_road
from powertrain.trials.performance import full_accelerator, gradeability, performance, time_between
from powertrain.trials.plausible import notes
from powertrain.trials.shifts import shift_quality, shifts
from powertrain.trials.tractive_effort import tractive_effort
from powertrain.trials.utility import (
    FLEET_FACTOR,
    INDIVIDUAL_FACTOR,
    WLTP_FACTOR,
    UtilityFactor,
    utility_weighted,
)

__all__ = [
    "FLEET_FACTOR",
    "INDIVIDUAL_FACTOR",
    "WLTP_FACTOR",
    "BackwardRun",
    "BrakingTest",
    "ChargeSustaining",
    "CycleRun",
    "Management",
    "MethodComparison",
    "UtilityFactor",
    "backward",
    "braking",
    "charge_corrected",
    "charge_depleting",
    "charge_sustaining",
    "drive_cycle",
    "driveline_map",
    "electric_share",
    "flywheel_management",
    "full_accelerator",
    "gear_table",
    "gradeability",
    "notes",
    "on_rolling_road",
    "performance",
    "power_split_management",
    "shift_quality",
    "shifts",
    "time_between",
    "tractive_effort",
    "utility_weighted",
]
