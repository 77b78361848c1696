"""Steps whose event indicators are given curves, for what locates events."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np

from powertrain.engine.location import Locator
from powertrain.numerics.buffers import CHECKS, INFO

Curve = Callable[[float], float]


class Step:
    """A step whose indicators are functions of its fraction, with the buffers that the locator reads."""

    def __init__(self, curves: Sequence[Curve]) -> None:
        self.curves, self.calls = curves, 0
        places = [*CHECKS, 1.0]
        info = np.zeros(INFO + len(places))
        info[INFO:] = [min(curve(q) for curve in curves) for q in places]
        n = len(curves)
        self.memory: Any = SimpleNamespace(
            above=np.zeros(n), g=np.zeros(n), fraction=np.zeros(1), worst=np.zeros(1), info=info
        )

    def call(self) -> None:
        """As ``powertrain.integration.fused.locate``."""
        self.calls += 1
        memory, q = self.memory, float(self.memory.fraction[0])
        memory.g[:] = [curve(q) for curve in self.curves]
        memory.worst[0] = min(
            (g for g, above in zip(memory.g, memory.above, strict=True) if not above > 0), default=1e300
        )

    def find(self, depth: float = 0.0) -> float | None:
        return Locator(self.call, self.memory).find(depth)


CURVES: dict[str, Curve] = {
    "line": lambda q: 0.37 - q,
    "steep": lambda q: 1e6 * (0.37 - q),
    "shallow": lambda q: 1e-6 * (0.37 - q),
    "late": lambda q: 0.999 - q,
    "curved up": lambda q: np.exp(-8 * q) - 0.1,
    "curved down": lambda q: 0.5 - q**7,
    "flat below": lambda q: max(0.61 - q, -1e-9),
    "flat above": lambda q: min(0.61 - q, 1e-3),
    "clipped at the hysteresis": lambda q: min(10 * (0.61 - q) + (0.61 - q) ** 2, 2e-10),
    "quintic": lambda q: -((q - 0.43) ** 5),
    "root": lambda q: np.copysign(abs(0.43 - q) ** 0.3, 0.43 - q),
    "torque that ends": lambda q: 50.0 * (0.61 - q) ** 2 - 1e-9 if q < 0.61 else -1e-9,
    "jump": lambda q: 1.0 if q < 0.437 else -3.0,
}
DEEP: Sequence[Curve] = [lambda q: 0.15 - q, lambda q: 5.0 * (q - 0.1) ** 2 - 0.06]
"""One that falls, and one that is below zero at the start already, dips, and is above zero again where the other is below -0.05."""
