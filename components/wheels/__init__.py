"""Wheels and tyres: rigid rolling, slip with relaxation, Magic Formula; and wheel brakes."""

from __future__ import annotations

from powertrain.components.wheels.brake import WheelBrake
from powertrain.components.wheels.interfaces import Wheel
from powertrain.components.wheels.magic_formula import MagicFormulaWheel
from powertrain.components.wheels.rigid import RigidWheel
from powertrain.components.wheels.slip import SlippingWheel, SlipWheel
from powertrain.components.wheels.tyre_size import rolling_radius

__all__ = ["MagicFormulaWheel", "RigidWheel", "SlipWheel", "SlippingWheel", "Wheel", "WheelBrake", "rolling_radius"]
