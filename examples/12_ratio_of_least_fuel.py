"""The ratio of the split-path CVT over a part of the WLTC for the least fuel, against the line of least fuel that its control follows.

The line gives the speed of the engine at which the power that is demanded takes the least fuel, with up to 85 % of full load. It does not
know that the efficiency of the transmission depends on the ratio, nor that the engine has inertia. Optimal control knows both, and may use
full load. The speed of the car is prescribed, and the torque of the engine follows from it: components are acausal. So the
rate of the ratio is the only input.
"""

from __future__ import annotations

import sys
from typing import Any

import casadi as ca
import matplotlib.pyplot as plt
import numpy as np

import powertrain as pt
from powertrain.components.cycles import DriveCycle
from powertrain.components.engines import WillansEngine, operating_line
from powertrain.components.rotational import IdealGear, Inertia, Speed
from powertrain.components.rotational.interfaces import Flange
from powertrain.components.transmissions import SplitPathTransmission, UnitRatio
from powertrain.vehicles.split_path_car import BASIC_RATIO, LAYOUT, SHARE, TRANSMISSION

START, STOP = 1160.0, 1240.0
RADIUS, FINAL, MASS = 0.3, 4.5, 1300.0
ENGINE = WillansEngine()
SLOWEST = 1.35 * float(ENGINE.w_idle)
RATIOS, FASTEST = (0.3, 2.0), 0.3
"""Limits of the ratio [1] and of its rate [1/s]."""


class FreeTorque(pt.Component):
    """A torque that follows from the motion."""

    boundary = True
    flange: Flange = pt.port(Flange)
    tau: pt.Variable = pt.variable("N.m", "Torque that drives")

    def equations(self) -> pt.Equations:
        """No law: the rest of the model says what it is."""
        yield self.flange.tau == -self.tau


class Drive(pt.Component):
    """Engine, CVT and final drive of a car whose speed is prescribed; road load as a torque at the wheel."""

    rate: pt.Input = pt.signal_input("1/s", "Rate of the ratio")
    v: pt.Input = pt.signal_input("m/s", "Speed of the car")
    ratio: pt.Variable = pt.variable("1", "Output speed over input speed")
    w: pt.Variable = pt.variable("rad/s", "Speed of the engine")
    fuel_rate: pt.Variable = pt.variable("kg/s", "Fuel flow")
    reserve: pt.Variable = pt.variable("N.m", "Torque up to full load")
    engine: FreeTorque = FreeTorque()
    crank: Inertia = Inertia(J=float(ENGINE.J) + 0.02)
    unit_ratio: UnitRatio = UnitRatio(layout=LAYOUT, basic_ratio=BASIC_RATIO)
    transmission: SplitPathTransmission = TRANSMISSION
    final: IdealGear = IdealGear(ratio=FINAL)
    car: Inertia = Inertia(J=MASS * RADIUS**2)
    road: Speed = Speed(exact=True)
    load: FreeTorque = FreeTorque()

    def equations(self) -> pt.Equations:
        """Engine to road; the motion of the road is given, so its torque is left to it."""
        yield pt.der(self.ratio) == self.rate.value
        yield pt.connect(self.engine.flange, self.crank.flange_a)
        yield pt.connect(self.crank.flange_b, self.transmission.flange_a)
        yield self.unit_ratio.r.value == self.ratio
        yield pt.connect(self.unit_ratio.V, self.transmission.ratio)
        yield pt.connect(self.transmission.flange_b, self.final.flange_a)
        yield pt.connect(self.final.flange_b, self.car.flange_a)
        yield pt.connect(self.car.flange_b, self.load.flange, self.road.flange)
        yield self.road.w_ref.value == self.v.value / RADIUS
        yield self.road.flange.tau == 0
        yield self.w == self.crank.w
        yield self.load.tau == -RADIUS * resistance(self.v.value)
        fired = ca.fmax(self.engine.tau + ENGINE.motoring(self.w), 0)
        yield self.fuel_rate == fired * self.w / (ENGINE.e * ENGINE.heating_value)
        yield self.reserve == ENGINE.full_load(self.w) - self.engine.tau


def resistance(v: Any) -> Any:
    """Road load in N."""
    return 0.011 * MASS * 9.81 + 0.6 * 1.2 / 2 * v**2


def on_the_line(times: np.ndarray, speeds: np.ndarray) -> np.ndarray:
    """The ratio at which the engine has the speed of least fuel for the power at the wheel, with an efficiency of 90 %."""
    force = MASS * np.gradient(speeds, times) + resistance(speeds)
    w = np.asarray(operating_line(ENGINE, SHARE)(np.maximum(force * speeds / 0.9, 1e3)), float)
    wanted = np.clip(speeds / RADIUS * FINAL / np.maximum(w, SLOWEST), *RATIOS)
    smoothed = np.convolve(np.pad(wanted, 2, mode="edge"), np.ones(5) / 5, mode="valid")
    return np.asarray(smoothed)


def main(picture: str | None = None) -> pt.Plan:
    """Simulates the line, plans, replays and draws."""
    cycle = DriveCycle.named("wltc")
    inside = (cycle.times >= START) & (cycle.times <= STOP)
    times, speeds = cycle.times[inside] - START, cycle.speeds[inside]
    ratio = on_the_line(times, speeds)
    rates = np.diff(ratio) / np.diff(times)
    plant = pt.compile(Drive())
    inputs = {"v": (times, speeds), "rate": (times.repeat(2)[1:-1], rates.repeat(2))}
    guess = plant.simulate(times[-1], starts={"w": speeds[0] / RADIUS * FINAL / ratio[0]}, inputs=inputs)
    plan = pt.optimal_control(
        plant,
        pt.integral("fuel_rate"),
        guess,
        {"rate": (-FASTEST, FASTEST)},
        limits={"ratio": RATIOS, "w": (SLOWEST, 600.0), "reserve": (0.0, 1e3)},
        ends={"ratio": float(guess["ratio"][-1])},
        smooth=1e-3,
        intervals=80,
    )
    line = pt.gradient(guess, pt.integral("fuel_rate"), "crank.J").value
    print(f"line of least fuel: {1e3 * line:.2f} g\nplan: {plan}\nsaved: {100 * (1 - plan.replayed / line):.2f} %")
    figure, axes = plt.subplots(3, 1, figsize=(7, 6), sharex=True, layout="constrained")
    axes[0].plot(times, 3.6 * speeds, color="black")
    for run, name in ((guess, "line of least fuel"), (plan.result, "plan")):
        axes[1].plot(run.time, run["ratio"], label=name)
        axes[2].plot(run.time, run["w"], label=name)
    for ax, label in zip(axes, ("Speed [km/h]", "Ratio [1]", "Engine [rad/s]"), strict=True):
        ax.set_ylabel(label)
    axes[1].legend(fontsize=8)
    axes[2].set_xlabel("Time [s]")
    if picture:
        figure.savefig(picture)
    return plan


if __name__ == "__main__":
    main(*sys.argv[1:2])
