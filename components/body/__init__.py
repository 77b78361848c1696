"""Bodies of vehicles: mass, drag, slope, loads of the axles, and the paths of the wheels in a bend."""

from __future__ import annotations

from powertrain.components.body.axle import DrivenAxle
from powertrain.components.body.body import AirStream, Body, Chassis, VehicleBody, Wind
from powertrain.components.body.coast_down import CoastDownBody
from powertrain.components.body.path import AxlePath, RoadProfile
from powertrain.components.body.rolling_road import RollingRoad

__all__ = [
    "AirStream",
    "AxlePath",
    "Body",
    "Chassis",
    "CoastDownBody",
    "DrivenAxle",
    "RoadProfile",
    "RollingRoad",
    "VehicleBody",
    "Wind",
]
