"""Torsional vibration of a driveline with a four-cylinder engine, with and without a centrifugal pendulum on the flywheel.

A Campbell diagram shows which modes the second order of the engine meets, the forced response how strongly, and the order map of a
simulated run-up what the complete nonlinear model does. The pendulum is tuned exactly to the second order: in the linear model the
flywheel then does not vibrate at all.
"""

from __future__ import annotations

import sys
from typing import Any

import casadi as ca
import matplotlib.pyplot as plt
import numpy as np

import powertrain as pt
from powertrain.components.rotational import Inertia, SpringDamper
from powertrain.components.rotational.interfaces import Flange

AMPLITUDE = 120.0
"""Of the torque of the second order [N.m]."""
SPEEDS = np.linspace(80.0, 400.0, 81)
ENGINE, FLYWHEEL = "engine.w", "flywheel.w"


class Engine(pt.Component):
    """A crankshaft with a mean torque and one of the second order."""

    J: pt.Parameter = pt.parameter("kg.m2", "Inertia", default=0.08)
    mean: pt.Parameter = pt.parameter("N.m", "Mean torque", default=150.0)
    amplitude: pt.Parameter = pt.parameter("N.m", "Amplitude of the second order", default=AMPLITUDE)
    flange: Flange = Flange()
    w: pt.Variable = pt.variable("rad/s", "Speed", start=SPEEDS[0])
    tau: pt.Variable = pt.variable("N.m", "Torque of the gas")

    boundary = True

    def equations(self) -> pt.Equations:
        """J der(w) is the torque of the gas less that of the shaft."""
        yield self.w == pt.der(self.flange.phi)
        yield self.tau == self.mean + self.amplitude * ca.cos(2.0 * self.flange.phi)
        yield self.J * pt.der(self.w) == self.tau + self.flange.tau

    def energy(self) -> Any:
        """Of the crankshaft."""
        return self.J * self.w**2 / 2


class Pendulum(pt.Component):
    """A centrifugal pendulum: a mass m on the length r about a point at the radius R of the flywheel."""

    m: pt.Parameter = pt.parameter("kg", "Mass", default=1.2)
    R: pt.Parameter = pt.parameter("m", "Radius of the point of suspension", default=0.12)
    r: pt.Parameter = pt.parameter("m", "Length", default=0.03)
    flange: Flange = Flange()
    w: pt.Variable = pt.variable("rad/s", "Speed of the flywheel", start=SPEEDS[0])
    psi: pt.Variable = pt.variable("rad", "Angle of the pendulum", start=0.0)
    v: pt.Variable = pt.variable("rad/s", "Its speed relative to the flywheel", start=0.0)

    def equations(self) -> pt.Equations:
        """Lagrange's equations for the angle of the flywheel and that of the pendulum."""
        along = self.R * self.r * ca.cos(self.psi)
        spin = self.m * ((self.R**2 + 2 * along) * self.w + self.r**2 * (self.w + self.v) + along * self.v)
        yield self.w == pt.der(self.flange.phi)
        yield self.v == pt.der(self.psi)
        yield self.flange.tau == pt.der(spin)
        pull = self.R * (pt.der(self.w) * ca.cos(self.psi) + self.w**2 * ca.sin(self.psi))
        yield self.r * (pt.der(self.w) + pt.der(self.v)) + pull == 0

    def energy(self) -> Any:
        """m/2 times the square of its speed."""
        both, along = self.w + self.v, self.R * self.r * ca.cos(self.psi)
        return self.m / 2 * ((self.R * self.w) ** 2 + (self.r * both) ** 2 + 2 * along * self.w * both)


class Plain(pt.Component):
    """Engine, clutch damper, gearbox and drive shafts down to the car, all at the speed of the engine."""

    engine: Engine = Engine()
    damper: SpringDamper = SpringDamper(c=1500.0, d=1.5)
    flywheel: Inertia = Inertia(J=0.06)
    input_shaft: SpringDamper = SpringDamper(c=9000.0, d=3.0)
    gearbox: Inertia = Inertia(J=0.03)
    drive_shafts: SpringDamper = SpringDamper(c=900.0, d=2.0)
    car: Inertia = Inertia(J=6.0)

    def equations(self) -> pt.Equations:
        """From the engine to the car."""
        yield pt.connect(self.engine.flange, self.damper.flange_a)
        yield pt.connect(self.damper.flange_b, self.flywheel.flange_a)
        yield pt.connect(self.flywheel.flange_b, self.input_shaft.flange_a)
        yield pt.connect(self.input_shaft.flange_b, self.gearbox.flange_a)
        yield pt.connect(self.gearbox.flange_b, self.drive_shafts.flange_a)
        yield pt.connect(self.drive_shafts.flange_b, self.car.flange_a)


class WithPendulum(pt.Component):
    """The same with a pendulum on the flywheel."""

    plain: Plain = Plain()
    pendulum: Pendulum = Pendulum()

    def equations(self) -> pt.Equations:
        """On the flywheel."""
        yield pt.connect(self.plain.flywheel.flange_a, self.pendulum.flange)


def turning(plant: pt.Plant[Any], speed: float) -> dict[str, float]:
    """The operating point at which everything turns at one speed."""
    return {name: speed for name in plant.compiled.states if name.endswith(".w")}


def main(picture: str | None = None) -> float:
    """Draws the four diagrams; gives the ratio of the flywheel's vibration with and without pendulum at 200 rad/s."""
    figure, axes = plt.subplots(2, 2, figsize=(10, 7), layout="constrained")
    quiet: dict[str, float] = {}
    for model, prefix, row in ((Plain(), "", 0), (WithPendulum(), "plain.", 1)):
        name, plant = ("without pendulum", "with pendulum")[row], pt.compile(model)
        engine, flywheel = prefix + ENGINE, prefix + FLYWHEEL
        silent = {f"{prefix}engine.amplitude": 0.0, f"{prefix}engine.mean": 0.0}

        def point(speed: float, plant: pt.Plant[Any] = plant) -> dict[str, float]:
            return turning(plant, speed)

        diagram = pt.campbell(plant, {engine: SPEEDS}, [engine, flywheel], at=point, parameters=silent)
        ax = axes[0, row]
        ax.plot(SPEEDS, diagram["frequency"].values, "-")
        ax.plot(SPEEDS, SPEEDS / np.pi, "--", color="0.4", label="second order")
        ax.set(title=name, ylim=(0, 140), xlabel="speed [rad/s]", ylabel="frequency [Hz]")
        print(name, pt.critical_speeds(diagram, [2.0]).round(3).to_string(index=False), sep="\n")
        excitation = {f"{prefix}engine.flange.tau": {2.0: AMPLITUDE}}
        forced = pt.order_response(plant, {engine: SPEEDS}, excitation, [flywheel], at=point, parameters=silent)
        linear = np.abs(forced.values[:, 0, 0])
        run = plant.simulate(13.0, starts=turning(plant, SPEEDS[0]), rtol=1e-7)
        levels = pt.order_map(run, flywheel, engine, orders=4).sel(order=2.0)
        ax = axes[1, row]
        ax.semilogy(SPEEDS, linear, color="tab:blue", label="linear, forced")
        ax.plot(levels["speed"], levels, "--", color="tab:orange", label="run-up")
        ax.set(xlabel="speed [rad/s]", ylabel="second order of the flywheel [rad/s]", xlim=(80, 400), ylim=(1e-4, 50))
        ax.legend()
        quiet[name] = float(np.interp(200.0, SPEEDS, linear))
    if picture:
        figure.savefig(picture)
    return quiet["with pendulum"] / quiet["without pendulum"]


if __name__ == "__main__":
    main(*sys.argv[1:2])
