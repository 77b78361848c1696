"""Bodies of vehicles: mass, drag, slope, axle loads; axles; and the paths of the wheels in a bend."""

from __future__ import annotations

from powertrain.components.body.axle import Axle, DrivenAxle, LumpedAxle, PoweredAxle, RollingAxle
from powertrain.components.body.body import AirStream, Body, Chassis, VehicleBody, Wind
from powertrain.components.body.coast_down import CoastDownBody
from powertrain.components.body.elastic_shaft import ElasticShaft
from powertrain.components.body.path import AxlePath, RoadProfile
from powertrain.components.body.rolling_road import RollingRoad
from powertrain.components.body.trailer import Trailer
from powertrain.components.body.transfer import (
    CentreDifferential,
    LumpedCentreDifferential,
    RigidTransferCase,
    TransferCase,
)

__all__ = [
    "AirStream",
    "Axle",
    "AxlePath",
    "Body",
    "CentreDifferential",
    "Chassis",
    "CoastDownBody",
    "DrivenAxle",
    "ElasticShaft",
    "LumpedAxle",
    "LumpedCentreDifferential",
    "PoweredAxle",
    "RigidTransferCase",
    "RoadProfile",
    "RollingAxle",
    "RollingRoad",
    "Trailer",
    "TransferCase",
    "VehicleBody",
    "Wind",
]
