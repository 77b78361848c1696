"""Assembled vehicles, a page each, built from ``powertrain.components``.

``load`` gives a vehicle by its name or from a parameter file, ``save`` writes one, ``names`` lists what there is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from powertrain.presets.named import load, names, save

__all__ = ["load", "names", "save"]

if __name__ != "powertrain.vehicles":
    raise ImportError(f"import powertrain.vehicles: as {__name__!r} its classes would exist twice")


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'powertrain.vehicles' has no attribute {name!r}")
    from powertrain.presets import named

    return getattr(named, name)
