"""Energy management of two hybrids over a cycle: their own rules, dynamic programming and ECMS.

The plans are made on maps of the vehicle without its driver and control (``pt.bench``), then driven by the complete vehicle, whose store
need not be where the plan had it: the decisions follow from its real state. The cycle is the first part of the UDDS. With a file name as
argument the figure is saved.
"""

from __future__ import annotations

import sys

import matplotlib.pyplot as plt

from powertrain.components.cycles import DriveCycle
from powertrain.trials import Comparison, flywheel_management, power_split_management
from powertrain.vehicles import FlywheelHybrid, PowerSplitHybrid


def main(picture: str | None = None) -> dict[str, Comparison]:
    """Compares, prints and draws."""
    cycle = DriveCycle.named("udds").part(0, 340)
    found = {
        "PowerSplitHybrid": power_split_management(PowerSplitHybrid(), cycle).compare(),
        "FlywheelHybrid": flywheel_management(FlywheelHybrid(), cycle).compare(),
    }
    for vehicle, comparison in found.items():
        print(f"{vehicle} on {cycle.name}\n{comparison}")
    figure, axes = plt.subplots(2, 1, figsize=(8, 6), sharex=True, layout="constrained")
    for ax, (vehicle, store) in zip(
        axes, {"PowerSplitHybrid": "battery.soc", "FlywheelHybrid": "flywheel.w"}.items(), strict=True
    ):
        for method, run in found[vehicle].runs.items():
            ax.plot(run.result.time, run.result[store], label=method)
        ax.set_title(vehicle)
        ax.set_ylabel("state of charge" if store.endswith("soc") else "speed of the flywheel in rad/s")
        ax.legend(fontsize=8)
    axes[-1].set_xlabel("time in s")
    if picture:
        figure.savefig(picture)
    return found


if __name__ == "__main__":
    main(*sys.argv[1:2])
