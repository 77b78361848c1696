"""Consumption of vehicles that end a cycle with another charge than they began it with."""

from __future__ import annotations

import math

from powertrain.vehicles.trials.cycle import CycleRun


def stores_of(run: CycleRun) -> tuple[str, ...]:
    """The parts of a vehicle that carry energy from one drive to the next: what its class names in ``stores``, else its batteries."""
    return run.anatomy.stores


def charge_corrected(run: CycleRun, *stores: str, path: float = 1.0) -> float:
    """Consumption [l/100 km] if the engine had made up for what the ``stores`` ended with less than they began with.

    ``stores`` are parts, such as "battery" or "flywheel"; without them those of ``stores_of``. What they gained counts as work of the
    engine, at its marginal efficiency over the cycle times ``path``, the efficiency from its crank into the store:
      fuel - gained/(path marginal efficiency heating value)
    The engine runs anyway: more work from it takes no more of its friction, and costs less than the mean. nan where the engine did not
    run, or the vehicle stood.
    """
    table = run.audit.components["stored"]
    gained = sum(float(table.loc[store]) for store in stores or stores_of(run))
    if not run.fuel > 0:
        return math.nan
    return run.litres_per_100km * (1 - gained / (path * run.marginal_efficiency) / run.heat)
