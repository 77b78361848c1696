"""The spatial linkage differential RRSCSRR (Madhavan 1996): motion, masses, friction, forces, design; the component.

``design`` (link lengths, Pareto front), ``figures`` and ``animation`` are modules of their own.
"""

from __future__ import annotations

from powertrain.components.gearless.linkage.body import LinkageBody
from powertrain.components.gearless.linkage.curve import WheelSpeeds, cage_turns, in_bend, wheel_velocities
from powertrain.components.gearless.linkage.differential import LinkageDifferential
from powertrain.components.gearless.linkage.friction import JointFriction
from powertrain.components.gearless.linkage.kinematics import Linkage, Motion, ratio_from_theta
from powertrain.components.gearless.linkage.masses import (
    CORRECTED,
    TABLE_5_1,
    LinkBody,
    LinkMasses,
    cylinder,
    cylinder_mass,
    scaled,
)
from powertrain.components.gearless.linkage.synthesis import Coupling, CouplingStructure, Joint
from powertrain.components.gearless.linkage.synthesis_evaluation import Criteria, Synthesis, synthesize

__all__ = [
    "CORRECTED",
    "TABLE_5_1",
    "Coupling",
    "CouplingStructure",
    "Criteria",
    "Joint",
    "JointFriction",
    "LinkBody",
    "LinkMasses",
    "Linkage",
    "LinkageBody",
    "LinkageDifferential",
    "Motion",
    "Synthesis",
    "WheelSpeeds",
    "cage_turns",
    "cylinder",
    "cylinder_mass",
    "in_bend",
    "ratio_from_theta",
    "scaled",
    "synthesize",
    "wheel_velocities",
]
