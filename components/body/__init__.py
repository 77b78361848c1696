"""Bodies of vehicles: mass, drag, slope, loads of the axles, and the paths of the wheels in a bend."""

from __future__ import annotations

from powertrain.components.body.body import AirStream, Chassis, VehicleBody, Wind

__all__ = ["AirStream", "Chassis", "VehicleBody", "Wind"]
