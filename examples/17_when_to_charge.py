"""When the engine of a flywheel hybrid should charge, and how much: optimal control against the rules of its control.

A full flywheel loses more than an empty one, so it pays to charge late and quickly. But the flywheel must keep a reserve for the next
acceleration. The speed of the car is prescribed: part of the UDDS, averaged over eight seconds. The ratio of the transmission and its
torques follow from it: components are acausal. A run with the rules gives the sequence of modes: the engine stands, starts, charges, coasts
and stands again. When it starts and stops, and with which throttle it charges, is planned; the flywheel ends as fast as with the rules.
Finally the plan is simulated with the complete model.
"""

from __future__ import annotations

import sys
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

import powertrain as pt
from powertrain.components.control import FlywheelCharge, FlywheelCharging, PlannedCharge
from powertrain.components.cycles import DriveCycle
from powertrain.components.differentials import ChurningLoss, CrownGear
from powertrain.components.engines import Engine
from powertrain.components.rotational import (
    BearingFriction,
    Clutch,
    IdealGear,
    Inertia,
    Speed,
    SpeedSensor,
    Torque,
)
from powertrain.components.transmissions import SplitPathTransmission, UnitRatio
from powertrain.vehicles import FlywheelHybrid

START, STOP, MEAN = 30.0, 112.0, 8.0
"""Part of the cycle, and the time over which its speed is averaged [s]."""
FIRST = 1000.0
"""Speed of the flywheel at the start [rad/s], about that of the car with its rules there."""
CAR = FlywheelHybrid()
RADIUS, ROLLING = 0.3, 0.01
"""Radius of the wheels [m] and their coefficient of rolling resistance."""
MASS, DRAG, INERTIA = 1400.0, 0.3 * 2.1 * 1.2 / 2, 4.0
"""Mass [kg], drag over the square of the speed [kg/m], inertia of the wheels [kg.m2]."""
FULL, RESERVE = (float(w / CAR.step_up.ratio) for w in (CAR.drive.w_full, CAR.drive.w_empty + CAR.drive.w_band))
"""Limits of the flywheel's speed [rad/s]: below the reserve the control of the car limits its acceleration."""


class OnCourse(pt.Component):
    """The driveline of the flywheel hybrid with its output clutch closed, in a car whose speed is prescribed."""

    course: pt.Map | None = None
    v: pt.Variable = pt.variable("m/s", "Speed of the car")
    ratio: pt.Variable = pt.variable("1", "Output speed over input speed of the transmission")
    charge: FlywheelCharging = FlywheelCharge()
    engine: Engine = CAR.engine
    engine_clutch: Clutch = CAR.engine_clutch
    step_up: IdealGear = CAR.step_up
    flywheel: Inertia = CAR.flywheel
    bearing: BearingFriction = CAR.bearing
    air: ChurningLoss = CAR.air
    input: SpeedSensor = SpeedSensor()
    unit_ratio: UnitRatio = CAR.unit_ratio
    transmission: SplitPathTransmission = CAR.transmission
    final: CrownGear = CrownGear(ratio=3.3, eta_ab=0.97, eta_ba=0.97)
    car: Inertia = Inertia(J=MASS * RADIUS**2 + INERTIA)
    road: Speed = Speed(exact=True)
    load: Torque = Torque()

    def equations(self) -> pt.Equations:
        """Engine to road; the motion of the road is given, so its torque is left to it, and the ratio is what this motion needs."""
        yield pt.connect(self.engine.crank, self.engine_clutch.flange_a)
        shaft = self.step_up.flange_a, self.transmission.flange_a, self.input.flange
        yield pt.connect(self.engine_clutch.flange_b, *shaft)
        yield pt.connect(self.step_up.flange_b, self.flywheel.flange_a)
        yield pt.connect(self.flywheel.flange_b, self.bearing.flange_a, self.air.flange)
        yield pt.connect(self.transmission.flange_b, self.final.flange_a)
        yield pt.connect(self.final.flange_b, self.car.flange_a)
        yield pt.connect(self.car.flange_b, self.load.flange, self.road.flange)
        if self.course is not None:
            yield self.v == self.course(pt.time)
        yield self.road.w_ref.value == self.v / RADIUS
        yield self.road.flange.tau == 0
        yield self.load.tau.value == -RADIUS * (ROLLING * MASS * 9.81 + DRAG * self.v**2)
        yield self.unit_ratio.r.value == self.ratio
        yield pt.connect(self.unit_ratio.V, self.transmission.ratio)
        yield self.charge.v.value == self.v
        yield pt.connect(self.input.w, self.charge.w_in)
        yield pt.connect(self.engine.speed, self.charge.w)
        yield pt.connect(self.charge.on, self.engine.on)
        yield pt.connect(self.charge.throttle, self.engine.throttle)
        yield pt.connect(self.charge.clutch, self.engine_clutch.f_normalized)

    def initial(self) -> pt.Equations:
        """The engine stands."""
        yield self.engine.w == 0
        yield self.flywheel.w == FIRST


def averaged(cycle: DriveCycle) -> pt.Map:
    """The speed of the part of a cycle over time, twice differentiable."""
    edges = np.arange(START - MEAN, STOP + 2 * MEAN, MEAN)
    steps = np.diff(cycle.times) * (cycle.speeds[1:] + cycle.speeds[:-1]) / 2
    path = np.interp(edges, cycle.times, np.concatenate([[0.0], np.cumsum(steps)]))
    times = (edges[1:] + edges[:-1]) / 2
    return pt.Map.curve(times, np.diff(path) / MEAN, x="time", x_unit="s", unit="m/s", name="course", method="smooth")


def main(picture: str | None = None) -> tuple[pt.Plan, float]:
    """Simulates the rules, plans, replays and draws; the plan, and the fuel with the rules [kg]."""
    vehicle = OnCourse(course=averaged(DriveCycle.named("udds")))
    rules = pt.compile(vehicle).simulate(STOP, start=START)
    plant = pt.compile(pt.replace(vehicle, charge=PlannedCharge()))
    inputs: dict[str, Any] = {"charge.engine_on": (rules.time, rules["charge.charging"]), "charge.engine_throttle": 0.9}
    plan = pt.optimal_control(
        plant,
        pt.integral("engine.fuel_rate"),
        plant.simulate(STOP, start=START, inputs=inputs),
        {"charge.engine_on": (0.0, 1.0), "charge.engine_throttle": (0.3, 1.0)},
        limits={"flywheel.w": (RESERVE, FULL), "ratio": (0.15, 2.0)},
        ends={"flywheel.w": float(rules["flywheel.w"][-1])},
        smooth=1e-3,
        intervals=[40, 12, 10, 6, 40],
    )
    fuel = float(rules["engine.fuel"][-1])
    print(f"rules: {1e3 * fuel:.2f} g\nplan: {plan}\nsaved: {100 * (1 - plan.replayed / fuel):.2f} %")
    figure, axes = plt.subplots(3, 1, figsize=(7, 6), sharex=True, layout="constrained")
    axes[0].plot(rules.time, 3.6 * rules["v"], color="black")
    for run, name in ((rules, "rules"), (plan.result, "plan")):
        axes[1].plot(run.time, run["flywheel.w"], label=name)
        axes[2].plot(run.time, run["engine.w"], label=name)
    axes[1].axhline(RESERVE, color="black", linewidth=0.8)
    for ax, label in zip(axes, ("Speed [km/h]", "Flywheel [rad/s]", "Engine [rad/s]"), strict=True):
        ax.set_ylabel(label)
    axes[1].legend(fontsize=8)
    axes[2].set_xlabel("Time [s]")
    if picture:
        figure.savefig(picture)
    return plan, fuel


if __name__ == "__main__":
    main(*sys.argv[1:2])
