"""Drive cycles: the speed that a vehicle has to follow."""

from __future__ import annotations

from powertrain.components.cycles.cycle import CYCLES, DriveCycle
from powertrain.components.cycles.reference import CycleSpeed

__all__ = ["CYCLES", "CycleSpeed", "DriveCycle"]
