"""Which parameters scatter a clutch engagement, and the best compromises between its heat and its roughness.

Sobol' indices from many runs are compared with the shares from one exact gradient, a Pareto front from gradients with one from an
evolutionary algorithm.
"""

from __future__ import annotations

import sys

import matplotlib.pyplot as plt
import numpy as np

import powertrain as pt
from powertrain.components.blocks import Ramp
from powertrain.components.rotational import Clutch, ConstantTorque, IdealGear, Inertia, SpringDamper

RESULTS = {
    "heat": pt.integral(lambda m: m.clutch.tau * m.clutch.w_rel),
    "roughness": 1e3 * pt.integral(lambda m: m.shaft.w_rel**2),
}
RANGES = {
    "engine.tau_constant": (100.0, 140.0),
    "pedal.duration": (0.5, 1.1),
    "clutch.fn_max": (450.0, 550.0),
    "shaft.c": (7000.0, 9000.0),
    "shaft.d": (50.0, 150.0),
}
BOUNDS = {"pedal.duration": (0.4, 1.5), "engine.tau_constant": (80.0, 140.0)}
STOP = 2.5


class MovingOff(pt.Component):
    """Engine, clutch, gear, soft shaft, car."""

    engine: ConstantTorque = ConstantTorque(tau_constant=120)
    flywheel: Inertia = Inertia(J=0.15)
    pedal: Ramp = Ramp(height=1, duration=0.8)
    clutch: Clutch = Clutch(fn_max=500)
    disc: Inertia = Inertia(J=0.01)
    gear: IdealGear = IdealGear(ratio=12)
    shaft: SpringDamper = SpringDamper(c=8000, d=100)
    car: Inertia = Inertia(J=117)

    def equations(self) -> pt.Equations:
        """From the engine to the car."""
        yield pt.connect(self.engine.flange, self.flywheel.flange_a)
        yield pt.connect(self.flywheel.flange_b, self.clutch.flange_a)
        yield pt.connect(self.pedal.y, self.clutch.f_normalized)
        yield pt.connect(self.clutch.flange_b, self.disc.flange_a)
        yield pt.connect(self.disc.flange_b, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.car.flange_a)

    def initial(self) -> pt.Equations:
        """The car at rest."""
        yield self.flywheel.w == 160
        yield self.disc.w == 0


def main(picture: str | None = None) -> float:
    """Prints and draws both; gives the largest difference between Sobol' first-order indices and shares by the gradient."""
    plant = pt.compile(MovingOff())
    shares = pt.sensitivity_indices(plant, RESULTS, RANGES, 128, stop=STOP)
    print(shares[["first", "total", "linear"]].to_dataframe().round(2))
    front = pt.pareto_front(plant, RESULTS, BOUNDS, points=6, stop=STOP)
    evolved = pt.pareto_front(plant, RESULTS, BOUNDS, method="nsga2", points=16, generations=12, stop=STOP)
    print(front.round(2).to_string(index=False))
    print(f"{front.attrs['runs']} runs by gradients, {evolved.attrs['runs']} by NSGA-II")
    figure, axes = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    places = np.arange(len(RANGES))
    for k, name in enumerate(("first", "total", "linear")):
        axes[0].barh(places + 0.25 * (k - 1), shares[name].sel(result="roughness"), 0.22, label=name)
    axes[0].set_yticks(places, list(RANGES))
    axes[0].set(xlabel="share of the variance of the roughness")
    axes[1].plot(evolved["heat"] / 1e3, evolved["roughness"], ".", label="NSGA-II")
    axes[1].plot(front["heat"] / 1e3, front["roughness"], "o-", fillstyle="none", label="gradients")
    axes[1].set(xlabel="heat [kJ]", ylabel="roughness [1e-3 rad²/s]")
    for ax in axes:
        ax.legend()
    if picture:
        figure.savefig(picture)
    return float(abs(shares["first"] - shares["linear"]).max())


if __name__ == "__main__":
    main(*sys.argv[1:2])
