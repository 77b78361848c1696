"""One-dimensional rotational mechanics: shafts, springs, friction, clutches, gears, sources and sensors.

Names, signs and laws are those of Modelica.Mechanics.Rotational 4.0.0. ``Gear`` (constant efficiency) and ``Freewheel`` are additions;
if an equation differs, the class says so. Dry friction is set-valued (Otter, Elmqvist and Mattsson: Hybrid Modeling in Modelica
based on the Synchronous Data Flow Principle, CACSD 1999): stuck parts are exactly at rest against each other.
"""

from __future__ import annotations

from powertrain.components.rotational.adaptors import AngleToTorqueAdaptor, TorqueToAngleAdaptor
from powertrain.components.rotational.backlash import ElastoBacklash, ElastoBacklash2
from powertrain.components.rotational.band_brake import BandBrake
from powertrain.components.rotational.bearing_friction import BearingFriction
from powertrain.components.rotational.brake import Brake
from powertrain.components.rotational.clutch import Clutch, OneWayClutch
from powertrain.components.rotational.cone import ConeBrake, ConeClutch
from powertrain.components.rotational.detent import Detent
from powertrain.components.rotational.disc import Disc
from powertrain.components.rotational.dog_clutch import DogClutch, ElasticDogClutch
from powertrain.components.rotational.drum_brake import DrumBrake
from powertrain.components.rotational.eddy_current import EddyCurrentTorque
from powertrain.components.rotational.fixed import Fixed
from powertrain.components.rotational.flexible_shaft import FlexibleShaft, ShaftElement
from powertrain.components.rotational.freewheel import Freewheel
from powertrain.components.rotational.gear import Gear, LossyGear
from powertrain.components.rotational.gearbox import Gearbox
from powertrain.components.rotational.hydraulic_clutch import ClutchPiston, HydraulicClutch
from powertrain.components.rotational.ideal_gear import IdealGear, IdealPlanetary
from powertrain.components.rotational.inertia import Inertia
from powertrain.components.rotational.interfaces import (
    Compliant,
    CompliantWithRelativeStates,
    Flange,
    Lossy,
    OneFlangeAndSupport,
    TwoFlanges,
    TwoFlangesAndSupport,
)
from powertrain.components.rotational.jenkins import JenkinsElement
from powertrain.components.rotational.motions import Accelerate, ConstantSpeed, Move, Position, Speed
from powertrain.components.rotational.reducer import CycloidalDrive, HarmonicDrive
from powertrain.components.rotational.retarder import Retarder
from powertrain.components.rotational.rolling import IdealGearR2T, IdealRollingWheel
from powertrain.components.rotational.sensors import (
    AccSensor,
    AngleSensor,
    MultiSensor,
    PowerSensor,
    RelAccSensor,
    RelAngleSensor,
    RelSpeedSensor,
    SpeedSensor,
    TorqueSensor,
)
from powertrain.components.rotational.spring import Damper, Spring, SpringDamper
from powertrain.components.rotational.stiffening_spring import StiffeningSpring
from powertrain.components.rotational.synchroniser import Synchroniser
from powertrain.components.rotational.thread import RackAndPinion, Screw, WormGear
from powertrain.components.rotational.torques import (
    ConstantTorque,
    InverseSpeedDependentTorque,
    LinearSpeedDependentTorque,
    QuadraticSpeedDependentTorque,
    SignTorque,
    Torque,
    Torque2,
    TorqueStep,
)
from powertrain.components.rotational.universal_joint import (
    ConstantVelocityJoint,
    DoubleUniversalJoint,
    UniversalJoint,
)
from powertrain.components.rotational.wet_clutch import PAPER_LINING, PlateDrag, WetClutch

__all__ = [
    "PAPER_LINING",
    "AccSensor",
    "Accelerate",
    "AngleSensor",
    "AngleToTorqueAdaptor",
    "BandBrake",
    "BearingFriction",
    "Brake",
    "Clutch",
    "ClutchPiston",
    "Compliant",
    "CompliantWithRelativeStates",
    "ConeBrake",
    "ConeClutch",
    "ConstantSpeed",
    "ConstantTorque",
    "ConstantVelocityJoint",
    "CycloidalDrive",
    "Damper",
    "Detent",
    "Disc",
    "DogClutch",
    "DoubleUniversalJoint",
    "DrumBrake",
    "EddyCurrentTorque",
    "ElasticDogClutch",
    "ElastoBacklash",
    "ElastoBacklash2",
    "Fixed",
    "Flange",
    "FlexibleShaft",
    "Freewheel",
    "Gear",
    "Gearbox",
    "HarmonicDrive",
    "HydraulicClutch",
    "IdealGear",
    "IdealGearR2T",
    "IdealPlanetary",
    "IdealRollingWheel",
    "Inertia",
    "InverseSpeedDependentTorque",
    "JenkinsElement",
    "LinearSpeedDependentTorque",
    "Lossy",
    "LossyGear",
    "Move",
    "MultiSensor",
    "OneFlangeAndSupport",
    "OneWayClutch",
    "PlateDrag",
    "Position",
    "PowerSensor",
    "QuadraticSpeedDependentTorque",
    "RackAndPinion",
    "RelAccSensor",
    "RelAngleSensor",
    "RelSpeedSensor",
    "Retarder",
    "Screw",
    "ShaftElement",
    "SignTorque",
    "Speed",
    "SpeedSensor",
    "Spring",
    "SpringDamper",
    "StiffeningSpring",
    "Synchroniser",
    "Torque",
    "Torque2",
    "TorqueSensor",
    "TorqueStep",
    "TorqueToAngleAdaptor",
    "TwoFlanges",
    "TwoFlangesAndSupport",
    "UniversalJoint",
    "WetClutch",
    "WormGear",
]
