"""Models for tests, put together from parts and joints."""

from __future__ import annotations

from typing import Any

import powertrain as pt


class Joined(pt.Component):
    """Parts and what is connected: ``joints`` name ports by the index of the part, ("0.flange", "1.flange_a")."""

    parts: tuple[pt.Component, ...]
    joints: tuple[tuple[str, ...], ...]

    def equations(self) -> pt.Equations:
        for joint in self.joints:
            yield pt.connect(*(self._port(name) for name in joint))

    def _port(self, name: str) -> Any:
        index, _, port = name.partition(".")
        return getattr(self.parts[int(index)], port)


def joined(*parts: pt.Component, joints: str) -> Joined:
    """``joints``: "0.flange=1.flange_a=2.flange 1.flange_b=3.flange_a"."""
    return Joined(parts=parts, joints=tuple(tuple(joint.split("=")) for joint in joints.split()))


def run(model: pt.Component, stop: float, starts: dict[str, float] | None = None, **options: Any) -> Any:
    """Simulates tightly; starts by the index of the part: {"0.v": 10} is parts[0].v."""
    named = {f"parts[{name.replace('.', '].', 1)}": value for name, value in (starts or {}).items()}
    return pt.simulate(model, stop, starts=named, **{"rtol": 1e-10, **options})
