"""Torsional vibration: dual-mass flywheel, centrifugal pendulum absorber, mounts of engine and gearbox."""

from __future__ import annotations

from powertrain.components.vibration.dual_mass_flywheel import DualMassFlywheel
from powertrain.components.vibration.mounts import MountedHousing
from powertrain.components.vibration.pendulum import CentrifugalPendulum
from powertrain.components.vibration.springs import ArcSpring, Coil, StagedSpring

__all__ = [
    "ArcSpring",
    "CentrifugalPendulum",
    "Coil",
    "DualMassFlywheel",
    "MountedHousing",
    "StagedSpring",
]
