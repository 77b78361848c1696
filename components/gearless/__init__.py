"""Gearless differentials: circular-arc cam, spherical cam and spatial linkage; the loads of their parts in a run."""

from __future__ import annotations

from powertrain.components.gearless.loads import Loads, contact_of, reactions_of, shaking_of

__all__ = ["Loads", "circular_cam", "contact_of", "linkage", "reactions_of", "shaking_of", "spherical_cam"]
