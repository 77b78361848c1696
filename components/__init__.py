"""The components of drivelines, with the names of the Modelica Standard Library where it has them."""

from __future__ import annotations

__all__: list[str] = []

if __name__ != "powertrain.components":
    raise ImportError(f"import powertrain.components: as {__name__!r} its classes would exist twice")
