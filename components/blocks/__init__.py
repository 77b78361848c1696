"""Signals: sources over time, arithmetic, tables, limits and controllers between outputs and inputs.

Names and equations are those of Modelica.Blocks 4.0.0 where it has them.
"""

from __future__ import annotations

from powertrain.components.blocks.basic import (
    Add,
    Constant,
    Cosine,
    Exponentials,
    ExpSine,
    Feedback,
    FirstOrder,
    Gain,
    Integrator,
    Product,
    Pulse,
    Ramp,
    SecondOrder,
    Sine,
    Step,
    TimeTable,
    Trapezoid,
)
from powertrain.components.blocks.controllers import LimPID, SampledPI
from powertrain.components.blocks.linear import StateSpace, TransferFunction
from powertrain.components.blocks.motion import KinematicPTP
from powertrain.components.blocks.sampled import DiscreteTransferFunction, ZeroOrderHold
from powertrain.components.blocks.shaping import (
    AllPass,
    DeadZone,
    Delay,
    Hysteresis,
    Limiter,
    Quantizer,
    SlewRateLimiter,
    VariableLimiter,
)
from powertrain.components.blocks.tables import CombiTable1D, CombiTable2D

__all__ = [
    "Add",
    "AllPass",
    "CombiTable1D",
    "CombiTable2D",
    "Constant",
    "Cosine",
    "DeadZone",
    "Delay",
    "DiscreteTransferFunction",
    "ExpSine",
    "Exponentials",
    "Feedback",
    "FirstOrder",
    "Gain",
    "Hysteresis",
    "Integrator",
    "KinematicPTP",
    "LimPID",
    "Limiter",
    "Product",
    "Pulse",
    "Quantizer",
    "Ramp",
    "SampledPI",
    "SecondOrder",
    "Sine",
    "SlewRateLimiter",
    "StateSpace",
    "Step",
    "TimeTable",
    "TransferFunction",
    "Trapezoid",
    "VariableLimiter",
    "ZeroOrderHold",
]
