"""Parts of a vehicle that are connected to nothing."""

from __future__ import annotations

from collections.abc import Iterator

import powertrain as pt
from powertrain.compiler.flatten import flatten
from powertrain.errors import PowertrainError


def strays(vehicle: pt.Component) -> Iterator[str]:
    """A note on every part with flanges of which no port is connected: it neither drives nor loads anything."""
    try:
        flat = flatten(vehicle)
    except PowertrainError:  # the run names it
        return
    connected = {path.rpartition(".")[0] for node in flat.nodes for path, inward in node if not inward}
    alone = {part._path: part for part, _ in flat.open_ports if part._path not in connected}
    for path, part in alone.items():
        yield f"{path} ({type(part).__name__}) is connected to nothing, so it has no influence on the vehicle"
