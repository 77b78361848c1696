"""Where power goes: branches from vertex to vertex, paths from source to destination."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Branch:
    """Power (W) from one vertex (a component, or a connection of several) to another, through the named ports."""

    source: str
    target: str
    power: float
    ports: tuple[str, ...]


@dataclass(frozen=True)
class Way:
    """A power path from a source to its ``end`` (delivered, loss or stored), or a loop (``end``: loop); power in W."""

    power: float
    through: tuple[str, ...]
    end: str

    def __str__(self) -> str:
        return f"{self.power:.6g} W: {' → '.join(self.through)} ({self.end})"
