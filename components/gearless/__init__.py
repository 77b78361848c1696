"""Gearless differentials: circular-arc cam, spherical cam and spatial linkage."""

from __future__ import annotations

__all__ = ["circular_cam", "linkage", "spherical_cam"]
