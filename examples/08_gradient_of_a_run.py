"""What the fuel of a car on the WLTC depends on: the derivatives for all parameters from one run, and the ten that matter most.

The run has some 300 events: the start clutch slips and sticks, gears change the side that drives, the engine idles. The derivatives
contain how these events move. They cost about three runs; differences would cost two for each of 73 parameters.
"""

from __future__ import annotations

import sys

import matplotlib.pyplot as plt

import powertrain as pt
from powertrain.vehicles.split_path_car import SplitPathCar

STOP = 600.0
MOST = 12


def main(picture: str | None = None) -> pt.Gradient:
    """Simulates the first third of the cycle and draws the elasticities."""
    plant = pt.compile(SplitPathCar())
    result = plant.simulate(STOP)
    fuel = pt.gradient(result, "engine.fuel")
    print(f"{len(result.events)} changes of modes in {STOP:g} s")
    print("\n".join(str(fuel).splitlines()[: MOST + 2]))
    chosen = fuel.to_dataframe().elasticity.sort_values(key=abs).tail(MOST)
    fig, ax = plt.subplots(figsize=(7, 4))
    ax.barh(list(chosen.index), list(chosen), color=["tab:red" if e > 0 else "tab:green" for e in chosen])
    ax.axvline(0.0, color="black", linewidth=0.8)
    ax.set(xlabel="change of the fuel in % for 1 % of the parameter", title="SplitPathCar, WLTC to 600 s")
    fig.tight_layout()
    if picture:
        fig.savefig(picture)
    return fuel


if __name__ == "__main__":
    main(*sys.argv[1:2])
