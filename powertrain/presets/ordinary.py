"""Ordinary names of parts, and the components that model them: those whose classes are called otherwise."""

from __future__ import annotations

ORDINARY: dict[str, tuple[str, ...]] = {
    "air resistance, drag": ("AirDrag", "VehicleBody"),
    "automatic gearbox, automatic transmission": ("Automatic", "PowerShiftGearbox"),
    "backlash, lash, play": ("ElastoBacklash", "ElastoBacklash2", "ElastoGap"),
    "bearing": ("BearingFriction",),
    "bevel gear, ring and pinion": ("CrownGear", "HypoidGear"),
    "center differential, transfer case": ("CentreDifferential", "RigidTransferCase"),
    "CV joint, homokinetic joint": ("ConstantVelocityJoint",),
    "CVT, variator, belt variator, toroidal drive": ("CVU", "VBelt", "TractionDrive", "SplitPathTransmission"),
    "disc brake, disk brake, friction brake": ("WheelBrake", "Brake"),
    "dual-clutch transmission, DCT, DSG": ("DualClutchGearbox",),
    "electric motor, motor, generator, traction motor": ("ElectricMachine",),
    "end stop, hard stop": ("ElastoGap", "MassWithStopAndFriction"),
    "engine, combustion engine": ("WillansEngine", "MappedEngine", "PistonEngine"),
    "final drive, axle drive, gear pair, gear stage, reduction gear": ("CrownGear", "IdealGear", "LossyGear", "Gear"),
    "flywheel, rotor": ("Inertia", "DualMassFlywheel"),
    "overrunning clutch, sprag": ("Freewheel", "OneWayClutch"),
    "manual transmission, sequential gearbox, dog box": ("ManualGearbox", "SynchronisedGearbox", "SingleGear"),
    "half shaft, drive shaft, propeller shaft, torsion bar": ("ElasticShaft", "SpringDamper"),
    "Hooke's joint, Cardan joint, U-joint": ("UniversalJoint", "DoubleUniversalJoint"),
    "hydrostatic transmission, hydraulic pump, hydraulic motor": ("HydrostaticUnit",),
    "inverter, power electronics": ("ElectricMachine", "DCDCConverter"),
    "locking differential, Torsen, LSD": ("LimitedSlipDifferential", "CircularCamDifferential"),
    "locked differential, spool, limited slip": ("LimitedSlipDifferential",),
    "lock-up clutch": ("StartingConverter", "TorqueConverter"),
    "multi-plate clutch, multi-disc clutch": ("WetClutch", "HydraulicClutch"),
    "neutral idle control, idle neutral control": ("NeutralIdleConverter",),
    "open differential, differential": ("BevelDifferential",),
    "planetary gear set, epicyclic gear, power split": ("PlanetaryGear", "PlanetTrain", "IdealPlanetary"),
    "road, gradient, hill": ("RoadProfile",),
    "shock absorber, dashpot": ("Damper", "SpringDamper"),
    "supercapacitor, ultracapacitor": ("Capacitor",),
    "synchronizer, synchromesh": ("Synchroniser", "SynchronisedGearbox"),
    "torsional damper, vibration absorber": ("SpringDamper", "CentrifugalPendulum", "DualMassFlywheel"),
    "tyre, tire, wheel": ("RigidWheel", "SlipWheel", "MagicFormulaWheel"),
    "car body, chassis mass": ("VehicleBody", "CoastDownBody", "Vehicle"),
}
"""Names, separated by commas, in British and American English, and the classes."""


def ordinary(name: str) -> tuple[str, ...]:
    """The classes that model what has this ordinary name; case, spaces, hyphens and apostrophes do not matter. Empty if there is none."""
    wanted = _bare(name)
    return next((kinds for names, kinds in ORDINARY.items() if wanted in map(_bare, names.split(", "))), ())


def _bare(name: str) -> str:
    return "".join(letter for letter in name.lower() if letter.isalnum())
