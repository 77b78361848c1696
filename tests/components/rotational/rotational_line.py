"""A driveline for tests: parts in a row, and signals wired to their inputs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import powertrain as pt


class Line(pt.Component):
    """Joins each part's right flange (``flange_b``, or ``flange``) to the next one's left flange (``flange_a``, or ``flange``).

    ``wires``: (index of the signal, index of the part, name of the part's input).
    """

    parts: tuple[pt.Component, ...]
    signals: tuple[pt.Component, ...] = ()
    wires: tuple[tuple[int, int, str], ...] = ()

    def equations(self) -> pt.Equations:
        for left, right in zip(self.parts, self.parts[1:], strict=False):
            yield pt.connect(_flange(left, "flange_b"), _flange(right, "flange_a"))
        sinks: dict[int, list[Any]] = {}
        for source, sink, name in self.wires:
            sinks.setdefault(source, []).append(getattr(self.parts[sink], name))
        for source, inputs in sinks.items():
            yield pt.connect(getattr(self.signals[source], "y"), *inputs)  # noqa: B009


def _flange(part: pt.Component, name: str) -> Any:
    return getattr(part, name if hasattr(type(part), name) or name in part._fields else "flange")


def run(model: pt.Component, stop: float, starts: Mapping[str, float] | None = None, **options: Any) -> Any:
    """Simulates tightly; starts are named by the index of the part: {"0.w": 10} is parts[0].w."""
    named = {(f"parts[{k}".replace(".", "].", 1) if k[0].isdigit() else k): v for k, v in (starts or {}).items()}
    return pt.simulate(model, stop, starts=named, **{"rtol": 1e-9, **options})
