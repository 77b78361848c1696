"""Damping the shuffle of a car with the engine's torque: root locus and LQR on the linear model, closed in the simulated one.

A tip-in excites the first mode of the driveline. The controller sees the speeds of engine and wheels. It is designed with python-control
on the model linearised at the operating point, then simulated as part of the complete model, with a limited torque and play in the gears.
"""

from __future__ import annotations

import sys
from typing import Any

import control
import matplotlib.pyplot as plt
import numpy as np

import powertrain as pt
from powertrain.components.blocks import Limiter
from powertrain.components.rotational import ElastoBacklash, IdealGear, Inertia, SpringDamper, Torque

RATIO, SPEED = 12.0, 20.0
"""Of the gears, and of the wheels at the tip-in [rad/s]."""
REQUEST = ([0.0, 0.2, 0.25, 2.0], [10.0, 10.0, 120.0, 120.0])
STOP, SETTLED = 2.0, 8.0
DAMPING, WEIGHT = 0.5, 3e-4
"""Of the shuffle, wanted of the root locus; of the engine's torque squared in the LQR, where the squared rate of twist has one."""


class Car(pt.Component):
    """Engine, gears with play, half shafts, tyres, car. Outside: the torque that the driver asks for, and what the controller adds."""

    request: pt.Input = pt.signal_input("N.m", "Torque that the driver asks for")
    correction: pt.Input = pt.signal_input("N.m", "Torque of the controller")
    limit: Limiter = Limiter(uMax=150.0, uMin=-30.0)
    torque: Torque = Torque()
    engine: Inertia = Inertia(J=0.2)
    gear: IdealGear = IdealGear(ratio=RATIO)
    play: ElastoBacklash = ElastoBacklash(c=2e5, d=300.0, b=0.01)
    differential: Inertia = Inertia(J=0.3)
    shaft: SpringDamper = SpringDamper(c=9000.0, d=40.0)
    wheels: Inertia = Inertia(J=2.5)
    tyres: SpringDamper = SpringDamper(c=30000.0, d=900.0)
    car: Inertia = Inertia(J=140.0)

    def equations(self) -> pt.Equations:
        """From the engine to the car."""
        yield self.limit.u.value == self.request.value + self.correction.value
        yield pt.connect(self.limit.y, self.torque.tau)
        yield pt.connect(self.torque.flange, self.engine.flange_a)
        yield pt.connect(self.engine.flange_b, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.play.flange_a)
        yield pt.connect(self.play.flange_b, self.differential.flange_a)
        yield pt.connect(self.differential.flange_b, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.wheels.flange_a)
        yield pt.connect(self.wheels.flange_b, self.tyres.flange_a)
        yield pt.connect(self.tyres.flange_b, self.car.flange_a)


def closed(plant: pt.Plant[Any], start: pt.Result[Any], model: Any = None, gain: Any = None) -> pt.Result[Any]:
    """A run with u = -gain (x - x_s) every 5 ms, where x_s = x_0 - A^-1 B (u_s - u_0) is the state that the request u_s settles at."""
    run = plant.start(starts={name: start.at(SETTLED, name) for name in plant.compiled.states})
    while run.time < STOP - 1e-9:
        request, correction = float(np.interp(run.time, *REQUEST)), 0.0
        if model is not None:
            change = -np.linalg.solve(model.A, model.B[:, 0]) * (request - REQUEST[1][0])
            correction = -float(gain @ (reduced(run, model) - reduced(model.linearization.values, model) - change))
        run.step(0.005, request=request, correction=correction)
    return run.result()


def reduced(values: Any, model: Any) -> Any:
    """The states of a reduced linear model: x, or x - g x_unseen."""
    note = model.linearization
    kept = [n for n in note.values if n not in (*note.unseen, *note.removed)]
    return np.array([values[n] - sum(g * values[m] for m, g in note.relative.get(n, {}).items()) for n in kept])


def main(picture: str | None = None) -> dict[str, float]:
    """Designs, closes the loops, draws; gives the overshoot of the shaft torque in percent of the final one."""
    plant = pt.compile(Car())
    rolling: dict[str, float] = dict.fromkeys(("differential.w", "wheels.w", "car.w"), SPEED)
    start = plant.simulate(SETTLED, starts=rolling, inputs={"request": REQUEST[1][0], "correction": 0.0})
    model = pt.linearize(plant, ["correction"], ["shaft.w_rel"], at=(start, SETTLED), reduced=True)
    gains = np.linspace(0.0, 60.0, 121)
    locus: Any = control.root_locus_map(-model, gains)
    poles = locus.loci
    shuffle = np.where(np.imag(poles) > 1.0, -np.real(poles) / np.abs(poles), 1.0).min(axis=1)
    best = int(np.argmax(shuffle >= DAMPING))
    proportional = -gains[best] * model.C[0]
    regulator = control.lqr(model, model.C.T @ model.C, [[WEIGHT]])[0][0]
    print(f"{len(model.A)} states of {len(plant.compiled.states)}: {', '.join(model.linearization.states)}")
    print(f"root locus: {gains[best]:g} N.m.s/rad raises the damping from {shuffle[0]:.3f} to {shuffle[best]:.3f}")
    loops = {
        "open loop": closed(plant, start),
        "rate of twist": closed(plant, start, model, proportional),
        "LQR": closed(plant, start, model, regulator),
    }
    figure, axes = plt.subplots(3, 1, figsize=(7, 8), layout="constrained")
    axes[0].plot(np.real(poles), np.imag(poles), ".", color="tab:blue", markersize=2)
    axes[0].plot(np.real(poles[best]), np.imag(poles[best]), "x", color="tab:red")
    axes[0].set(xlim=(-55, 1), ylim=(-1, 20), xlabel="real part [1/s]", ylabel="imaginary part [1/s]")
    overshoot = {}
    for name, run in loops.items():
        axes[1].plot(run.time, -run["shaft.tau"], label=name)
        axes[2].plot(run.time, run["torque.tau"])
        overshoot[name] = 100 * float(run["shaft.tau"].min() / run["shaft.tau"][-200:].mean() - 1.0)
        print(f"{name}: overshoot {overshoot[name]:.1f} %")
    axes[1].set(ylabel="half shafts [N.m]")
    axes[2].set(ylabel="engine [N.m]", xlabel="time [s]")
    axes[1].legend()
    if picture:
        figure.savefig(picture)
    return overshoot


if __name__ == "__main__":
    main(*sys.argv[1:2])
