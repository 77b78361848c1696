"""What the fuel consumption on the WLTC depends on: derivatives with respect to all parameters from one run.

The most important parameters are shown. The modes of the laws change some 250 times: the start clutch slips and sticks, the driving side
of gears changes, the engine idles. The derivatives account for the motion of these events. They take about as long as two or three
runs; finite differences would need two runs for each of more than 70 parameters.
"""

from __future__ import annotations

import sys

import matplotlib.pyplot as plt

import powertrain as pt
from powertrain.vehicles import SplitPathCar

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
