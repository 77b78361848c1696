"""The components of drivelines, named as in the Modelica Standard Library where it has them.

``from powertrain.components import Clutch`` imports a component from its family on first access. Names that several families have, such as
``Brake``, are imported from the family: ``from powertrain.components.rotational import Brake``.
"""

from __future__ import annotations

from typing import Any

if __name__ != "powertrain.components":
    raise ImportError(f"write  import powertrain.components: as {__name__!r} its classes would exist a second time")


_BOTH = """
    AccSensor Accelerate Brake Compliant CompliantWithRelativeStates ConstantSpeed Damper Detent Fixed Flange Lossy
    Move MultiSensor OneFlangeAndSupport Position PowerSensor RelAccSensor RelSpeedSensor Speed SpeedSensor
    Spring SpringDamper TwoFlanges TwoFlangesAndSupport
"""
"""Names of both rotational and translational components."""


def __getattr__(name: str) -> Any:
    from powertrain.lazy import attribute

    if name in _BOTH.split():
        raise ImportError(
            f"{name} is rotational or translational: from powertrain.components.rotational import {name}, "
            f"or from powertrain.components.translational import {name}"
        )
    return attribute(__name__, __file__, name)


def __dir__() -> list[str]:
    from powertrain.lazy import listed

    return [*globals(), *listed(__file__)]
