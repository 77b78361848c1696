"""Bodies of vehicles: mass, drag, slope, loads of the axles, and the paths of the wheels in a bend."""

from __future__ import annotations

from powertrain.components.body.body import AirStream, Chassis, VehicleBody, Wind
from powertrain.components.body.path import AxlePath, RoadProfile

__all__ = ["AirStream", "AxlePath", "Chassis", "RoadProfile", "VehicleBody", "Wind"]
