"""A chain of 10 inertias with springs and dampers, 10 s, against hand-written CasADi and CVODES."""

from __future__ import annotations

import casadi as ca
import numpy as np
from numpy.typing import NDArray

import powertrain as pt
from benchmarks.timing import Row, at_most, duration, measure
from powertrain.components.blocks import Sine
from powertrain.components.rotational import Inertia, QuadraticSpeedDependentTorque, SpringDamper, Torque

STIFFNESS, DAMPING, INERTIA, LOAD, SPEED = 2e4, 4.0, 0.01, 0.01, 100.0
Array = NDArray[np.float64]


class Chain(pt.Component):
    """Inertias in a row, each joined to the next by a spring with a damper.

    A torque at one end; at the other a load that grows with the square of the speed.
    """

    drive: Sine = Sine(amplitude=5, f=20 / (2 * np.pi))
    torque: Torque = Torque()
    inertias: tuple[Inertia, ...] = ()
    shafts: tuple[SpringDamper, ...] = ()
    fan: QuadraticSpeedDependentTorque = QuadraticSpeedDependentTorque(tau_nominal=-LOAD * SPEED**2, w_nominal=SPEED)

    def equations(self) -> pt.Equations:
        """Connections."""
        yield pt.connect(self.drive.y, self.torque.tau)
        yield pt.connect(self.torque.flange, self.inertias[0].flange_a)
        for left, shaft, right in zip(self.inertias[:-1], self.shafts, self.inertias[1:], strict=True):
            yield pt.connect(left.flange_b, shaft.flange_a)
            yield pt.connect(shaft.flange_b, right.flange_a)
        yield pt.connect(self.inertias[-1].flange_b, self.fan.flange)

    def initial(self) -> pt.Equations:
        """All turn at one speed."""
        for inertia in self.inertias:
            yield inertia.w == SPEED


def chain(n: int) -> Chain:
    """A chain of ``n`` inertias."""
    return Chain(inertias=(Inertia(J=INERTIA),) * n, shafts=(SpringDamper(c=STIFFNESS, d=DAMPING),) * (n - 1))


def by_hand(n: int) -> dict[str, ca.SX]:
    """The same as an ODE in speeds and twists."""
    t, x, p = ca.SX.sym("t"), ca.SX.sym("x", 2 * n - 1), ca.SX.sym("p", 2)
    w, twist = x[:n], x[n:]
    tau = STIFFNESS * twist + DAMPING * (w[:-1] - w[1:])
    load = p[1] * w[n - 1] ** 2
    rates = (ca.vertcat(p[0] * ca.sin(20 * t), tau) - ca.vertcat(tau, load)) / INERTIA
    return {"t": t, "x": x, "p": p, "ode": ca.vertcat(rates, w[:-1] - w[1:])}


def run(rounds: int = 15, n: int = 10, stop: float = 10.0, points: int = 1001) -> list[Row]:
    """All rows of this benchmark."""
    grid = np.linspace(0.0, stop, points)
    plant = pt.compile(chain(n))
    x0 = np.concatenate([np.full(n, SPEED), np.zeros(n - 1)])
    p = np.array([5.0, LOAD])
    tolerances = {"reltol": 1e-6, "abstol": 1e-8, "max_num_steps": 1_000_000}
    cvodes = ca.integrator("powertrain_chain", "cvodes", by_hand(n), 0.0, list(grid), tolerances)

    def ours() -> list[Array]:
        result = plant.simulate(stop, times=grid)
        return [result[name] for name in plant.compiled.states]

    def hand() -> Array:
        return np.array(cvodes(x0=x0, p=p)["xf"]).T

    exact = _speeds(plant.simulate(stop, times=grid, rtol=1e-10), grid, n)
    errors = (
        np.abs(_speeds(plant.simulate(stop, times=grid), grid, n) - exact).max(),
        np.abs(hand()[:, :n] - exact).max(),
    )
    times = measure({"ours": ours, "cvodes": hand}, rounds)
    name = f"chain of {n}"
    return [
        Row(name, f"{stop:g} s, no compiler", f"{duration(times.median('ours'))}, error {errors[0]:.0e} rad/s"),
        Row(name, "by hand, CasADi cvodes", f"{duration(times.median('cvodes'))}, error {errors[1]:.0e} rad/s"),
        at_most(name, "against CasADi cvodes", times.ratio("ours", "cvodes"), 2),
    ]


def _speeds(result: pt.Result[Chain], grid: Array, n: int) -> Array:
    return np.column_stack(list(result.at(grid, [f"inertias[{i}].w" for i in range(n)]).values()))
