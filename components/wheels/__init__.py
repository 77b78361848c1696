"""Wheels and tyres: rigid rolling, slip with relaxation, Magic Formula."""

from __future__ import annotations

from powertrain.components.wheels.interfaces import Wheel
from powertrain.components.wheels.rigid import RigidWheel

__all__ = ["RigidWheel", "Wheel"]
