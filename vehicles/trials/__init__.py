"""What vehicles are measured by: cycles, consumption, acceleration, maps of whole drivelines."""

from __future__ import annotations

from powertrain.vehicles.trials.cycle import CycleRun, drive_cycle

__all__ = ["CycleRun", "drive_cycle"]
