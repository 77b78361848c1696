"""Belts and chains: pulleys with limited grip, elastic spans that become slack, chain drives with their polygon effect."""

from __future__ import annotations

from powertrain.components.belts.belt import BeltDrive, BeltSpan, Pulley
from powertrain.components.belts.chain import ChainDrive

__all__ = ["BeltDrive", "BeltSpan", "ChainDrive", "Pulley"]
