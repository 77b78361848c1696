"""Consumption of vehicles that end a cycle with another charge than they began it with."""

from __future__ import annotations

import math

from powertrain.trials.cycle import CycleRun


def stores_of(run: CycleRun) -> tuple[str, ...]:
    """The components of a vehicle that carry energy from one drive to the next: those in ``stores`` of its class, else its batteries."""
    return run.anatomy.stores


def charge_corrected(run: CycleRun, *stores: str, path: float = 1.0) -> float:
    """Consumption [l/100 km] corrected to equal charge of the ``stores`` (charge-sustaining correction).

    ``stores`` are components, such as "battery" or "flywheel"; by default those of ``stores_of``. The energy they gained counts as work of
    the engine, at its marginal efficiency over the cycle times ``path``, the efficiency from its crank into the store:
      fuel - gained/(path marginal efficiency heating value)
    Because the engine runs anyway, additional work does not increase its friction and costs less than the mean. nan if the engine did not
    run or the vehicle did not move.
    """
    table = run.audit.components["stored"]
    gained = sum(float(table.loc[store]) for store in stores or stores_of(run))
    if not run.fuel > 0:
        return math.nan
    return run.litres_per_100km * (1 - gained / (path * run.marginal_efficiency) / run.heat)
