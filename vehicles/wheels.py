"""The wheels of a vehicle."""

from __future__ import annotations

from collections.abc import Iterator

from powertrain import Component
from powertrain.components.wheels import Wheel
from powertrain.language.component import descendants


def wheels_of(part: Component) -> Iterator[tuple[str, Wheel]]:
    """All wheels in a part with their paths."""
    return ((path, inner) for path, inner in descendants(part) if isinstance(inner, Wheel))
