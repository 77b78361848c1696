"""Consumption of vehicles that end a cycle with another charge than they began it with."""

from __future__ import annotations

from powertrain.vehicles.trials.cycle import CycleRun


def charge_corrected(run: CycleRun, *stores: str, path: float = 1.0) -> float:
    """Consumption [l/100 km] if the engine had made up for what the ``stores`` ended with less than they began with.

    ``stores`` are parts, such as "battery" or "flywheel". What they gained counts as work of the engine, at its mean efficiency over
    the cycle times ``path``, the efficiency from its crank into the store: fuel - gained/(path efficiency heating value).
    """
    table = run.audit.components["stored"]
    gained = sum(float(table.loc[store]) for store in stores)
    efficiency = float(run.table["value"]["mean efficiency of the engine"])
    heat = run.parameters.get("engine.heating_value", run.plant.parameters["engine.heating_value"])
    return run.litres_per_100km * (1 - gained / (path * efficiency * heat) / run.fuel)
