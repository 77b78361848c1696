"""A car over the WLTC, forward and backward, and its performance.

The forward calculation is the simulation: a driver follows the cycle, with the limits of clutch and ratio, and every transient burns
fuel. The backward calculation determines at every second the operating point that the road demands, and takes its fuel from a map of the
same car. Both use the same model, so they differ only in the transients. Pass a file name to save the figure of the map.
"""

from __future__ import annotations

import sys

import matplotlib.pyplot as plt
import numpy as np

from powertrain.trials import backward, drive_cycle, driveline_map, performance
from powertrain.trials.driveline_figure import plot_driveline_map
from powertrain.vehicles import SplitPathCar


def main() -> None:
    """The cycle both ways, the audit, the performance, the map."""
    car = SplitPathCar()
    run = drive_cycle(car, "wltc")
    print(run.table.round(3).to_string())
    print(f"\n{run.audit}")
    found = driveline_map(car, np.linspace(1, 38, 38), np.linspace(0, 1, 41), variator="transmission.cvu")
    back = backward(car, "wltc", found)
    print(f"\nBackward {back.fuel:.4f} kg of fuel, forward {run.fuel:.4f} kg: {back.fuel / run.fuel - 1:+.2%}")
    print(f"\n{performance(car).round(2).to_string()}")
    if len(sys.argv) > 1:
        figure, ax = plt.subplots(figsize=(9, 6), layout="constrained")
        plot_driveline_map(found, run, ax=ax)
        ax.set_title("Split-path CVT: efficiency from the tank to the road")
        figure.savefig(sys.argv[1], dpi=120)


if __name__ == "__main__":
    main()
