"""Assembled vehicles, a page each, and design programs, built from ``powertrain.components`` and the analyses."""

from __future__ import annotations

__all__: list[str] = []

if __name__ != "powertrain.vehicles":
    raise ImportError(f"import powertrain.vehicles: as {__name__!r} its classes would exist twice")
