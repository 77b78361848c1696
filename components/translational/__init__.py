"""One-dimensional translational mechanics: masses, springs, friction, stops, resistances, sources and sensors."""

from __future__ import annotations

from powertrain.components.translational.adaptors import ForceToPositionAdaptor, PositionToForceAdaptor
from powertrain.components.translational.brake import Brake, SupportFriction
from powertrain.components.translational.detent import Detent
from powertrain.components.translational.eddy_current import EddyCurrentForce
from powertrain.components.translational.elasto_gap import ElastoGap
from powertrain.components.translational.fixed import Fixed
from powertrain.components.translational.forces import (
    ConstantForce,
    Force,
    Force2,
    ForceStep,
    InverseSpeedDependentForce,
    LinearSpeedDependentForce,
    QuadraticSpeedDependentForce,
    SignForce,
)
from powertrain.components.translational.friction_table import stribeck_table
from powertrain.components.translational.interfaces import (
    Compliant,
    CompliantWithRelativeStates,
    Flange,
    Lossy,
    OneFlangeAndSupport,
    Rigid,
    TwoFlanges,
    TwoFlangesAndSupport,
)
from powertrain.components.translational.mass import Mass, Rod
from powertrain.components.translational.motions import Accelerate, ConstantSpeed, Move, Position, Speed
from powertrain.components.translational.rolling_resistance import AirDrag, RollingResistance
from powertrain.components.translational.sensors import (
    AccSensor,
    ForceSensor,
    MultiSensor,
    PositionSensor,
    PowerSensor,
    RelAccSensor,
    RelPositionSensor,
    RelSpeedSensor,
    SpeedSensor,
)
from powertrain.components.translational.shift_actuator import ShiftActuator
from powertrain.components.translational.spring import Damper, Spring, SpringDamper
from powertrain.components.translational.stop import MassWithStopAndFriction

__all__ = [
    "AccSensor",
    "Accelerate",
    "AirDrag",
    "Brake",
    "Compliant",
    "CompliantWithRelativeStates",
    "ConstantForce",
    "ConstantSpeed",
    "Damper",
    "Detent",
    "EddyCurrentForce",
    "ElastoGap",
    "Fixed",
    "Flange",
    "Force",
    "Force2",
    "ForceSensor",
    "ForceStep",
    "ForceToPositionAdaptor",
    "InverseSpeedDependentForce",
    "LinearSpeedDependentForce",
    "Lossy",
    "Mass",
    "MassWithStopAndFriction",
    "Move",
    "MultiSensor",
    "OneFlangeAndSupport",
    "Position",
    "PositionSensor",
    "PositionToForceAdaptor",
    "PowerSensor",
    "QuadraticSpeedDependentForce",
    "RelAccSensor",
    "RelPositionSensor",
    "RelSpeedSensor",
    "Rigid",
    "Rod",
    "RollingResistance",
    "ShiftActuator",
    "SignForce",
    "Speed",
    "SpeedSensor",
    "Spring",
    "SpringDamper",
    "SupportFriction",
    "TwoFlanges",
    "TwoFlangesAndSupport",
    "stribeck_table",
]
