"""The clutch engagement with the least heat, for limited torque and jerk: optimal control through slip and stick.

The clutch command and the engine torque bring a car from rest to a given speed in two seconds. The initial guess is one simulated
engagement, whose sequence of modes is kept: the clutch slips, then it sticks. The instant of sticking is free. Finally the plan is
simulated with the complete model.

The jerk of the car is that of the torque in its shaft, J_load der(a) = c w_rel + d der(w_rel). Its first part is limited: where the clutch
sticks, the acceleration of the disc jumps, and with it the torque of the damper.
"""

from __future__ import annotations

import sys
from typing import Any

import matplotlib.pyplot as plt

import powertrain as pt
from powertrain.components.rotational import Clutch, Inertia, SpringDamper, Torque

STARTS = {"engine.w": 100.0, "disc.w": 0.0, "load.w": 0.0, "load.phi": 0.0, "shaft.phi_rel": 0.0}
TORQUE = 80.0
"""The limit of the shaft's torque in N.m."""
JERK = 250.0
"""The limit of the load's jerk in rad/s3."""


class Launch(pt.Component):
    """Engine, clutch, soft shaft, car as an inertia."""

    torque: pt.Input = pt.signal_input("N.m", "Torque of the engine")
    press: pt.Input = pt.signal_input("1", "Command of the clutch")
    source: Torque = Torque()
    engine: Inertia = Inertia(J=0.2)
    clutch: Clutch = Clutch(fn_max=200.0, mue_pos=((0.0, 1.0),))
    disc: Inertia = Inertia(J=0.02)
    shaft: SpringDamper = SpringDamper(c=800.0, d=8.0)
    load: Inertia = Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        """From the engine to the car."""
        yield pt.connect(self.torque, self.source.tau)
        yield pt.connect(self.press, self.clutch.f_normalized)
        yield pt.connect(self.source.flange, self.engine.flange_a)
        yield pt.connect(self.engine.flange_b, self.clutch.flange_a)
        yield pt.connect(self.clutch.flange_b, self.disc.flange_a)
        yield pt.connect(self.disc.flange_b, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.load.flange_a)


def heat(m: Any) -> Any:
    """Slip power of the clutch in W."""
    return m.clutch.tau * m.clutch.w_rel


def jerk(m: Any) -> Any:
    """Jerk of the load in rad/s3, as the spring of the shaft gives it."""
    return m.shaft.c * m.shaft.w_rel / m.load.J


def main(picture: str | None = None) -> pt.Plan:
    """Plans, replays and draws."""
    plant = pt.compile(Launch())
    guess = plant.simulate(2.0, starts=STARTS, inputs={"torque": 20.0, "press": ([0, 1], [0.1, 0.6])})
    plan = pt.optimal_control(
        plant,
        pt.integral(heat),
        guess,
        {"press": (0.02, 1.0), "torque": (0.0, 60.0)},
        ends={"load.w": 80.0, "shaft.w_rel": 0.0},
        limits={"shaft.tau": (-TORQUE, 10.0), jerk: (-JERK, JERK)},
        smooth=0.1,
        intervals=40,
    )
    print(f"guess: {pt.gradient(guess, pt.integral(heat), 'engine.J').value:.0f} J, to {guess['load.w'][-1]:.0f} rad/s")
    print(f"plan to 80 rad/s: {plan}")
    fig, axes = plt.subplots(3, 1, figsize=(7, 7), sharex=True)
    for run, style in ((guess, "--"), (plan.result, "-")):
        for name, color in (("engine.w", "tab:blue"), ("load.w", "tab:orange")):
            axes[0].plot(
                run.time, run[name], style, color=color, label=f"{name}, {'plan' if style == '-' else 'guess'}"
            )
        axes[1].plot(run.time, -run["shaft.tau"], style, color="tab:green")
        axes[2].plot(run.time, run["press"], style, color="tab:red")
    axes[1].axhline(TORQUE, color="black", linewidth=0.8)
    axes[0].legend(fontsize=8)
    for ax, label in zip(axes, ("Speed [rad/s]", "Shaft torque [N.m]", "Clutch command [1]"), strict=True):
        ax.set_ylabel(label)
    axes[2].set_xlabel("Time [s]")
    fig.tight_layout()
    if picture:
        fig.savefig(picture)
    return plan


if __name__ == "__main__":
    main(*sys.argv[1:2])
