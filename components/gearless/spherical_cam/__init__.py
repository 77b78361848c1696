"""The spherical cam differential (Chaudhary, Angeles & Morozov 2014): profile, pressure angles, efficiency, design, and the component."""

from __future__ import annotations

from powertrain.components.gearless.spherical_cam.body import CamBody
from powertrain.components.gearless.spherical_cam.checks import clearance
from powertrain.components.gearless.spherical_cam.cycle import NO_FRICTION, CamFriction, Cycle
from powertrain.components.gearless.spherical_cam.design import Choice, pressure_angle_range, search, table_2
from powertrain.components.gearless.spherical_cam.differential import CamMasses, SphericalCamDifferential
from powertrain.components.gearless.spherical_cam.final_drive import STANDARD_RATIOS, PlanetaryFinalDrive
from powertrain.components.gearless.spherical_cam.profile import CamGeometry, SphericalCam
from powertrain.components.gearless.spherical_cam.rollers import Sharing

__all__ = [
    "NO_FRICTION",
    "STANDARD_RATIOS",
    "CamBody",
    "CamFriction",
    "CamGeometry",
    "CamMasses",
    "Choice",
    "Cycle",
    "PlanetaryFinalDrive",
    "Sharing",
    "SphericalCam",
    "SphericalCamDifferential",
    "clearance",
    "pressure_angle_range",
    "search",
    "table_2",
]
