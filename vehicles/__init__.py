"""Complete vehicles, one file each, built from ``powertrain.components``: ``from powertrain.vehicles import ManualCar``.

``load`` returns a vehicle by its name or from a parameter file, ``save`` writes one, ``names`` lists them.
"""

from __future__ import annotations

from typing import Any

if __name__ != "powertrain.vehicles":
    raise ImportError(f"write  import powertrain.vehicles: as {__name__!r} its classes would exist a second time")


def __getattr__(name: str) -> Any:
    from powertrain.lazy import attribute

    return attribute(__name__, __file__, name)


def __dir__() -> list[str]:
    from powertrain.lazy import listed

    return [*globals(), *listed(__file__)]
