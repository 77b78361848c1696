"""The wheels of a vehicle."""

from __future__ import annotations

from collections.abc import Iterator

from powertrain import Component
from powertrain.components.wheels import Wheel
from powertrain.language.component import children


def wheels_of(part: Component, path: str = "") -> Iterator[tuple[str, Wheel]]:
    """All wheels in a part with their paths, which start with that of the part."""
    for name, child in children(part):
        here = f"{path}.{name}".lstrip(".")
        if isinstance(child, Wheel):
            yield here, child
        yield from wheels_of(child, here)
