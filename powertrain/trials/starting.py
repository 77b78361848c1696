"""Initial values of a run of a vehicle."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import powertrain as pt
from powertrain.initialization.conditions import start_values
from powertrain.trials.anatomy import anatomy


def checked_starts(plant: pt.Plant[Any], given: Mapping[str, Any] | None, what: str = "starts") -> dict[str, float]:
    """Initial values by name as numbers; ``what`` names them in errors.

    Errors: ParameterError for unknown names, for values that are not numbers, and for a state of charge of 0 or outside of 0 to 1.
    """
    found = start_values(plant.compiled, given, what)
    for battery in anatomy(plant.model).batteries:
        soc = found.get(f"{battery}.soc", 1.0)
        if soc == 0:
            least = plant.parameters[f"{battery}.soc_min"]
            raise pt.ParameterError(
                f"{what}: {battery}.soc = 0: an empty battery cannot supply the accessories; start above {battery}.soc_min = {least:g}"
            )
        if not 0 < soc <= 1:
            percent = f"; write {soc / 100:g} for {soc:g} %" if 5 <= soc <= 100 else ""
            raise pt.ParameterError(
                f"{what}: {battery}.soc = {soc:g} is outside its range, 0 (empty) to 1 (full){percent}"
            )
    return found


def empty(result: pt.Result[Any], battery: str) -> str:
    """A sentence on a battery that begins without charge to give; else nothing."""
    soc, least = float(result[f"{battery}.soc"][0]), result.parameters[f"{battery}.soc_min"]
    if soc > least:
        return ""
    return f"{battery} delivers nothing: its state of charge of {soc:g} at the start is not above {battery}.soc_min = {least:g}"
