"""Energy management of a flywheel hybrid over a cycle: its own rules, dynamic programming and ECMS.

The plans are made on maps of the vehicle without its driver and control (``pt.bench``), then driven by the complete vehicle, whose store
need not be where the plan had it: the decisions follow from its actual state. The cycle is the first part of the UDDS. The how-to page
"Manage the energy of a hybrid" does the same with a power-split hybrid. Pass a file name to save the figure.
"""

from __future__ import annotations

import sys

import matplotlib.pyplot as plt

from powertrain.components.cycles import DriveCycle
from powertrain.trials import MethodComparison, flywheel_management
from powertrain.vehicles import FlywheelHybrid


def main(picture: str | None = None) -> MethodComparison:
    """Compares, prints and draws."""
    cycle = DriveCycle.named("udds").part(0, 340)
    comparison = flywheel_management(FlywheelHybrid(), cycle, throttles=(0.7, 1.0)).compare()
    print(f"FlywheelHybrid on {cycle.name}\n{comparison}")
    figure, axes = plt.subplots(2, 1, figsize=(8, 6), sharex=True, layout="constrained")
    for method, run in comparison.runs.items():
        axes[0].plot(run.result.time, run.result["flywheel.w"], label=method)
        axes[1].plot(run.result.time, run.result["engine.w"], linewidth=0.9)
    axes[0].set_ylabel("Speed of the flywheel [rad/s]")
    axes[0].legend(fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1), ncols=3)
    axes[1].set_ylabel("Speed of the engine [rad/s]")
    axes[1].set_xlabel("Time [s]")
    if picture:
        figure.savefig(picture)
    return comparison


if __name__ == "__main__":
    main(*sys.argv[1:2])
