"""The upshift of an automatic gearbox with the least heat, for a limited torque in the drive shaft: two clutches, three phases.

One clutch hands over to the other: first it holds while the other one takes over the torque, then both slip while the engine slows down,
then the other one sticks. The initial guess is one simulated shift with that sequence. The instants of its two events are free; the
pressures and the torque of the engine are planned, then simulated with the complete model.
"""

from __future__ import annotations

import sys
from typing import Any

import matplotlib.pyplot as plt

import powertrain as pt
from powertrain.components.rotational import Clutch, IdealGear, Inertia, SpringDamper, Torque

FIRST, SECOND = 3.0, 1.8
SPEED, LOAD = 300.0, 150.0
"""Of the engine before the shift [rad/s], and resistance at the wheels [N.m]."""
STOP = 1.5
LOW, HIGH, TWIST = 120.0, 360.0, 0.5
"""Limits of the torque in the shaft [N.m] and of the rate of its twist [rad/s], which is the jerk of the car."""


class Gearbox(pt.Component):
    """Engine, two clutches with a gear each, a soft shaft, the car as an inertia."""

    torque: pt.Input = pt.signal_input("N.m", "Torque of the engine")
    press_1: pt.Input = pt.signal_input("1", "Command of the clutch of the first gear")
    press_2: pt.Input = pt.signal_input("1", "Command of the clutch of the second gear")
    resistance: pt.Input = pt.signal_input("N.m", "Torque against the wheels")
    source: Torque = Torque()
    engine: Inertia = Inertia(J=0.2)
    clutch_1: Clutch = Clutch(fn_max=300.0, mue_pos=((0.0, 1.0),))
    clutch_2: Clutch = Clutch(fn_max=300.0, mue_pos=((0.0, 1.0),))
    gear_1: IdealGear = IdealGear(ratio=FIRST)
    gear_2: IdealGear = IdealGear(ratio=SECOND)
    output: Inertia = Inertia(J=0.1)
    shaft: SpringDamper = SpringDamper(c=6000.0, d=60.0)
    car: Inertia = Inertia(J=100.0)
    brake: Torque = Torque()

    def equations(self) -> pt.Equations:
        """From the engine to the car on two ways."""
        yield pt.connect(self.torque, self.source.tau)
        yield pt.connect(self.press_1, self.clutch_1.f_normalized)
        yield pt.connect(self.press_2, self.clutch_2.f_normalized)
        yield pt.connect(self.source.flange, self.engine.flange_a)
        yield pt.connect(self.engine.flange_b, self.clutch_1.flange_a, self.clutch_2.flange_a)
        yield pt.connect(self.clutch_1.flange_b, self.gear_1.flange_a)
        yield pt.connect(self.clutch_2.flange_b, self.gear_2.flange_a)
        yield pt.connect(self.gear_1.flange_b, self.gear_2.flange_b, self.output.flange_a)
        yield pt.connect(self.output.flange_b, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.car.flange_a)
        yield pt.connect(self.car.flange_b, self.brake.flange)
        yield self.brake.tau.value == -self.resistance.value


def heat(m: Any) -> Any:
    """Slip power of both clutches in W."""
    return m.clutch_1.tau * m.clutch_1.w_rel + m.clutch_2.tau * m.clutch_2.w_rel


def main(picture: str | None = None) -> pt.Plan:
    """Plans, replays and draws."""
    plant = pt.compile(Gearbox())
    inputs: dict[str, Any] = {
        "torque": 100.0,
        "press_1": ([0.0, 0.2, 0.4], [0.6, 0.6, 0.02]),
        "press_2": ([0.0, 0.2, 0.4, 0.8, 1.0], [0.02, 0.02, 0.5, 0.6, 0.9]),
        "resistance": LOAD,
    }
    at_rest = {"engine.w": SPEED, "output.w": SPEED / FIRST, "car.w": SPEED / FIRST, "shaft.phi_rel": -0.045}
    guess = plant.simulate(STOP, starts=at_rest, inputs=inputs)
    plan = pt.optimal_control(
        plant,
        pt.integral(heat),
        guess,
        {"press_1": (0.02, 1.0), "press_2": (0.02, 1.0), "torque": (0.0, 150.0)},
        limits={"shaft.tau": (-HIGH, -LOW), "shaft.w_rel": (-TWIST, TWIST)},
        ends={"car.w": float(guess["car.w"][-1]), "shaft.w_rel": 0.0},
        smooth=0.1,
        intervals=30,
    )
    lost = pt.gradient(guess, pt.integral(heat), "engine.J").value
    print(f"guess: {lost:.0f} J\nplan: {plan}")
    figure, axes = plt.subplots(3, 1, figsize=(7, 6), sharex=True, layout="constrained")
    for run, style in ((guess, "--"), (plan.result, "-")):
        name = "plan" if style == "-" else "guess"
        axes[0].plot(run.time, run["engine.w"], style, color="tab:blue", label=name)
        axes[1].plot(run.time, -run["shaft.tau"], style, color="tab:green")
        axes[2].plot(run.time, run["press_1"], style, color="tab:orange", label=f"first gear, {name}")
        axes[2].plot(run.time, run["press_2"], style, color="tab:red", label=f"second gear, {name}")
    for ax, label in zip(axes, ("Engine [rad/s]", "Shaft torque [N.m]", "Clutch commands [1]"), strict=True):
        ax.set_ylabel(label)
    axes[0].legend(fontsize=8)
    axes[2].legend(fontsize=8)
    axes[2].set_xlabel("Time [s]")
    if picture:
        figure.savefig(picture)
    return plan


if __name__ == "__main__":
    main(*sys.argv[1:2])
