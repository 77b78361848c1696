"""Seven parameters of a clutch rig from noisy measurements, 20 times, and how often the true values lie within the standard errors.

Speeds on both sides of a clutch and the torque of a shaft are "measured" in a simulated engagement, 400 samples each, with noise. The
clutch slips and sticks in every trial run, each time at a different instant.
"""

from __future__ import annotations

import sys
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

import powertrain as pt
from powertrain.components.rotational import Clutch, Inertia, SpringDamper, Torque

STARTS = {"motor.w": 100.0, "load.w": 0.0}
INPUTS: dict[str, Any] = {
    "torque": ([0.0, 1.0, 1.0, 2.0], [40.0, 40.0, 5.0, 30.0]),
    "press": ([0.0, 0.5, 1.5], [0.0, 0.5, 0.6]),
}
TRUE = {"motor.J": 0.2, "clutch.fn_max": 200.0, "shaft.c": 500.0, "shaft.d": 5.0, "load.J": 1.0, **STARTS}
FIRST = {"motor.J": 0.26, "clutch.fn_max": 160.0, "shaft.c": 600.0, "shaft.d": 3.0, "load.J": 0.8}
SIGMA = {"motor.w": 0.5, "load.w": 0.5, "shaft.tau": 2.0}
TIMES = np.linspace(0.0, 2.0, 400)
DRAWS = 20


class Rig(pt.Component):
    """Motor, clutch, soft shaft, load."""

    torque: pt.Input = pt.signal_input("N.m", "Torque of the motor")
    press: pt.Input = pt.signal_input("1", "Command of the clutch")
    source: Torque = Torque()
    motor: Inertia = Inertia(J=0.2)
    clutch: Clutch = Clutch(fn_max=200.0)
    disc: Inertia = Inertia(J=0.01)
    shaft: SpringDamper = SpringDamper(c=500.0, d=5.0)
    load: Inertia = Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        """From the motor to the load."""
        yield pt.connect(self.torque, self.source.tau)
        yield pt.connect(self.press, self.clutch.f_normalized)
        yield pt.connect(self.source.flange, self.motor.flange_a)
        yield pt.connect(self.motor.flange_b, self.clutch.flange_a)
        yield pt.connect(self.clutch.flange_b, self.disc.flange_a)
        yield pt.connect(self.disc.flange_b, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.load.flange_a)


def main(picture: str | None = None) -> float:
    """Fits every draw; gives the share of unknowns within two standard errors."""
    plant = pt.compile(Rig())
    run = plant.simulate(2.0, starts=STARTS, inputs=INPUTS, rtol=1e-9)
    exact, rng = run.at(TIMES, list(SIGMA)), np.random.default_rng(1)
    deviations, found = [], None
    for _ in range(DRAWS):
        values = {n: exact[n] + s * rng.standard_normal(len(TIMES)) for n, s in SIGMA.items()}
        data = pt.Experiment(TIMES, values, SIGMA, starts=STARTS, inputs=INPUTS)
        found = pt.fit(plant, data, list(TRUE), first=FIRST)
        deviations.append([(found.values[n] - TRUE[n]) / found.errors[n] for n in TRUE])
    print(found)
    shares = np.abs(deviations)
    print(
        f"{DRAWS} draws: {100 * (shares < 2).mean():.0f} % of the values within 2 standard errors, all within {shares.max():.1f}"
    )
    fig, ax = plt.subplots(figsize=(7, 3.5))
    ax.axvspan(-2, 2, color="0.9")
    for k, row in enumerate(np.transpose(deviations)):
        ax.plot(row, np.full(len(row), k), "|", markersize=14)
    ax.set(yticks=range(len(TRUE)), yticklabels=list(TRUE), xlabel="deviation from the truth in standard errors")
    fig.tight_layout()
    if picture:
        fig.savefig(picture)
    return float((shares < 2).mean())


if __name__ == "__main__":
    main(*sys.argv[1:2])
