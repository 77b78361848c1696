"""The circular-arc cam differential (Provatidis 2023): geometry, forces, contact, locking, and the acausal component."""

from __future__ import annotations

from powertrain.components.gearless.circular_cam.contact import RollerContact, track_contacts
from powertrain.components.gearless.circular_cam.design import TABLE_1, TORQUE, CircularCams
from powertrain.components.gearless.circular_cam.differential import CircularCamDifferential, RollerMasses
from powertrain.components.gearless.circular_cam.disk import FrictionDisk, Wear, friction_diameter
from powertrain.components.gearless.circular_cam.forces import Forces, forces, forces_at
from powertrain.components.gearless.circular_cam.locking import (
    Locking,
    all_phase_limit,
    bias_ratio,
    critical_angle,
    latent_efficiency,
    locking,
    locking_map,
    optimal_outer_angle,
    similar,
    single_track_limit,
    with_friction,
)
from powertrain.components.gearless.circular_cam.locking_law import Sharing
from powertrain.components.gearless.circular_cam.track import Track

__all__ = [
    "TABLE_1",
    "TORQUE",
    "CircularCamDifferential",
    "CircularCams",
    "Forces",
    "FrictionDisk",
    "Locking",
    "RollerContact",
    "RollerMasses",
    "Sharing",
    "Track",
    "Wear",
    "all_phase_limit",
    "bias_ratio",
    "critical_angle",
    "forces",
    "forces_at",
    "friction_diameter",
    "latent_efficiency",
    "locking",
    "locking_map",
    "optimal_outer_angle",
    "similar",
    "single_track_limit",
    "track_contacts",
    "with_friction",
]
