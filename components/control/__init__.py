"""Drivers, gear schedules and the control of variable ratios."""

from __future__ import annotations

from powertrain.components.control.driver import Driver, SetPedals
from powertrain.components.control.interfaces import Pedals
from powertrain.components.control.operating_line import OperatingLineControl

__all__ = ["Driver", "OperatingLineControl", "Pedals", "SetPedals"]
