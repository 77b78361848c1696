"""A driveline of 60 states, 20 s: engine map, crankshaft and shafts of 24 inertias, gear, open differential, two slipping tyres, vehicle.

One tyre stands on worse ground, so that the differential works. Ours is built from components; the baselines have the ODE that an
engineer would derive by hand. Ours has two states more, the absolute angles, which the hand-reduced ODE leaves out.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

import powertrain as pt
from benchmarks import native
from benchmarks.timing import Call, Row, at_least, at_most, duration, measure
from powertrain.components.blocks import Sine
from powertrain.components.rotational import Flange as Shaft
from powertrain.components.rotational import IdealGear, Inertia, SpringDamper
from powertrain.components.translational import Flange, Mass
from powertrain.integration import rodas5p
from powertrain.language.map import Axis
from powertrain.numerics.buffers import bound

Array = NDArray[np.float64]
NAME = "driveline"
N, RADIUS, STOP, ATOL = 24, 0.31, 20.0, 1e-8
SPEED = 120.0
"""Of the engine at the start, rad/s."""
RATIO, MASS, GRIP = 6.0, 1400.0, (1.0, 0.6)
STIFFNESS, DAMPING = np.linspace(2e4, 6e4, N - 1), np.linspace(4.0, 9.0, N - 1)
INERTIAS = np.r_[0.15, np.full(N - 2, 0.01), 0.05]
GRID = np.linspace(0.0, STOP, 2001)
_SPEEDS, _PEDAL = np.linspace(60, 700, 33), np.linspace(0, 1, 11)
_W, _U = np.meshgrid(_SPEEDS, _PEDAL, indexing="ij")
_TORQUE = _U * (180 + 120 * np.exp(-(((_W - 320) / 180) ** 2))) - (1 - _U) * (15 + 0.05 * _W)


def engine_map() -> pt.Map:
    """Torque over speed and throttle."""
    axes = (Axis("speed", "rad/s", _SPEEDS, "clip"), Axis("throttle", "1", _PEDAL, "clip"))
    return pt.Map(axes, _TORQUE, "N.m", "torque", "smooth")


class Engine(pt.Component):
    """Torque from a map, with a lag of the throttle, fuel used and temperature."""

    torque_map: pt.Map
    crank: Shaft = pt.port(Shaft)
    pedal: pt.Input = pt.signal_input("1", "Position of the pedal")
    throttle: pt.Variable = pt.variable("1", "Throttle", start=0.45)
    fuel: pt.Variable = pt.variable("kg", "Fuel used", start=0.0)
    T: pt.Variable = pt.variable("K", "Temperature", start=350.0)
    w: pt.Variable = pt.variable("rad/s", "Speed")
    tau: pt.Variable = pt.variable("N.m", "Torque")

    def equations(self) -> pt.Equations:
        """Lag, map, fuel and heat."""
        yield 0.15 * pt.der(self.throttle) == self.pedal.value - self.throttle
        yield self.w == pt.der(self.crank.phi)
        yield self.tau == self.torque_map(self.w, self.throttle)
        yield self.crank.tau == -self.tau
        yield pt.der(self.fuel) == ca.fmax(self.tau, 0) * self.w * 6e-8
        yield 3e4 * pt.der(self.T) == ca.fabs(self.tau) * self.w * 0.3 - 50 * (self.T - 300)


class Differential(pt.Component):
    """Open differential without mass: the torque is halved, the cage turns with the mean speed."""

    cage: Shaft = pt.port(Shaft)
    left: Shaft = pt.port(Shaft)
    right: Shaft = pt.port(Shaft)

    def equations(self) -> pt.Equations:
        """Mean angle, equal torques."""
        yield 2 * self.cage.phi == self.left.phi + self.right.phi
        yield self.left.tau == self.right.tau
        yield self.cage.tau + self.left.tau + self.right.tau == 0


class Tyre(pt.Component):
    """Longitudinal slip force by the magic formula."""

    grip: pt.Parameter = pt.parameter("1", "Coefficient of friction")
    load: pt.Parameter = pt.parameter("N", "Wheel load")
    hub: Shaft = pt.port(Shaft)
    road: Flange = pt.port(Flange)
    slip: pt.Variable = pt.variable("1", "Longitudinal slip")
    force: pt.Variable = pt.variable("N", "Force on the vehicle")

    def equations(self) -> pt.Equations:
        """Slip and force."""
        v = pt.der(self.road.s)
        yield self.slip == (RADIUS * pt.der(self.hub.phi) - v) / ca.sqrt(v * v + 0.25)
        yield self.force == magic(self.slip, self.grip, self.load)
        yield self.road.f == -self.force
        yield self.hub.tau == RADIUS * self.force


class Drag(pt.Component):
    """Air and rolling resistance."""

    flange: Flange = pt.port(Flange)

    def equations(self) -> pt.Equations:
        """Force against the motion."""
        yield self.flange.f == resistance(pt.der(self.flange.s))


class Driveline(pt.Component):
    """Engine, torsional chain, gear, differential, half shafts, wheels on slipping tyres, vehicle."""

    slow: Sine = Sine(amplitude=0.35, f=0.9 / (2 * np.pi), offset=0.45)
    fast: Sine = Sine(amplitude=0.1, f=2.7 / (2 * np.pi))
    engine: Engine
    inertias: tuple[Inertia, ...] = tuple(Inertia(J=J) for J in INERTIAS.tolist())
    shafts: tuple[SpringDamper, ...] = tuple(
        SpringDamper(c=c, d=d) for c, d in zip(STIFFNESS.tolist(), DAMPING.tolist(), strict=True)
    )
    gear: IdealGear = IdealGear(ratio=RATIO)
    differential: Differential = Differential()
    inner: tuple[SpringDamper, ...] = (SpringDamper(c=3e4, d=60),) * 2
    hubs: tuple[Inertia, ...] = (Inertia(J=0.05),) * 2
    outer: tuple[SpringDamper, ...] = (SpringDamper(c=2.5e4, d=50),) * 2
    wheels: tuple[Inertia, ...] = (Inertia(J=0.9),) * 2
    tyres: tuple[Tyre, ...] = tuple(Tyre(grip=g, load=MASS * 9.81 / 4) for g in GRIP)
    body: Mass = Mass(m=MASS)
    drag: Drag = Drag()

    def equations(self) -> pt.Equations:
        """Connections."""
        yield self.engine.pedal.value == self.slow.y.value + self.fast.y.value
        yield pt.connect(self.engine.crank, self.inertias[0].flange_a)
        for left, shaft, right in zip(self.inertias[:-1], self.shafts, self.inertias[1:], strict=True):
            yield pt.connect(left.flange_b, shaft.flange_a)
            yield pt.connect(shaft.flange_b, right.flange_a)
        yield pt.connect(self.inertias[-1].flange_b, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.differential.cage)
        for k, side in enumerate((self.differential.left, self.differential.right)):
            yield pt.connect(side, self.inner[k].flange_a)
            yield pt.connect(self.inner[k].flange_b, self.hubs[k].flange_a)
            yield pt.connect(self.hubs[k].flange_b, self.outer[k].flange_a)
            yield pt.connect(self.outer[k].flange_b, self.wheels[k].flange_a)
            yield pt.connect(self.wheels[k].flange_b, self.tyres[k].hub)
            yield pt.connect(self.tyres[k].road, self.body.flange_b)
        yield pt.connect(self.body.flange_b, self.drag.flange)

    def initial(self) -> pt.Equations:
        """All turn at the engine's speed, the wheels roll."""
        for inertia in self.inertias:
            yield inertia.w == SPEED
        for inertia in (*self.hubs, *self.wheels):
            yield inertia.w == SPEED / RATIO
        yield self.body.v == SPEED / RATIO * RADIUS


def magic(slip: Any, grip: Any, load: Any) -> Any:
    """Force of a tyre."""
    return grip * load * ca.sin(1.6 * ca.atan(10 * slip - 0.5 * (10 * slip - ca.atan(10 * slip))))


def resistance(v: Any) -> Any:
    """Air and rolling resistance of the vehicle."""
    return 0.5 * 1.2 * 0.32 * 0.65 * v * v + 0.012 * MASS * 9.81 * ca.tanh(v / 0.1)


def by_hand() -> tuple[dict[str, ca.SX], Array, Array]:
    """The reduced ODE (60 states, a mass and a gear ratio as parameters), its start and parameters."""
    t, x, p = ca.SX.sym("t"), ca.SX.sym("x", 2 * N + 12), ca.SX.sym("p", 2)
    mass, ratio = p[0], p[1]
    w, twist, o = x[:N], x[N : 2 * N - 1], 2 * N - 1
    inner, hub, outer, wheel = x[o : o + 2], x[o + 2 : o + 4], x[o + 4 : o + 6], x[o + 6 : o + 8]
    v, throttle, temperature = x[o + 8], x[o + 10], x[o + 12]
    pedal = 0.45 + 0.35 * ca.sin(0.9 * t) + 0.1 * ca.sin(2.7 * t)
    table = ca.interpolant("hand", "bspline", [_SPEEDS.tolist(), _PEDAL.tolist()], _TORQUE.ravel(order="F"))
    drive = table(ca.vertcat(w[0], throttle))
    tau = ca.DM(STIFFNESS) * twist + ca.DM(DAMPING) * (w[:-1] - w[1:])
    cage = w[N - 1] / ratio
    spread = (3e4 * (inner[1] - inner[0]) + 60 * (hub[0] - hub[1])) / 120
    side = ca.vertcat(cage + spread, cage - spread)
    half = 3e4 * inner + 60 * (side - hub)
    end = 2.5e4 * outer + 50 * (hub - wheel)
    slip = (RADIUS * wheel - v) / ca.sqrt(v * v + 0.25)
    force = magic(slip, ca.DM(GRIP), mass * 9.81 / 4)
    ode = ca.vertcat(
        (ca.vertcat(drive, tau) - ca.vertcat(tau, ca.sum1(half) / ratio)) / ca.DM(INERTIAS),
        w[:-1] - w[1:], side - hub, (half - end) / 0.05, hub - wheel, (end - RADIUS * force) / 0.9,
        (ca.sum1(force) - resistance(v)) / mass, v, (pedal - throttle) / 0.15,
        ca.fmax(drive, 0) * w[0] * 6e-8, (ca.fabs(drive) * w[0] * 0.3 - 50 * (temperature - 300)) / 3e4,
    )  # fmt: skip
    x0 = np.zeros(2 * N + 12)
    x0[:N], x0[o + 2 : o + 4], x0[o + 6 : o + 8] = SPEED, SPEED / RATIO, SPEED / RATIO
    x0[o + 8], x0[o + 10], x0[o + 12] = SPEED / RATIO * RADIUS, 0.45, 350.0
    return {"t": t, "x": x, "p": p, "ode": ode}, x0, np.array([MASS, RATIO])


def signals() -> list[str]:
    """Our names of the states of the hand-reduced ODE that are compared."""
    hubs = [f"{part}[{k}].w" for part in ("hubs", "wheels") for k in (0, 1)]
    return [*(f"inertias[{i}].w" for i in range(N)), *hubs, "body.v", "body.s", "engine.throttle", "engine.T"]


def places() -> list[int]:
    """Where the same stand in the hand-reduced ODE."""
    o = 2 * N - 1
    return [*range(N), o + 2, o + 3, o + 6, o + 7, o + 8, o + 9, o + 10, o + 12]


def whole_run_in_c(ode: dict[str, ca.SX], x0: Array, p: Array) -> Callable[[], Array]:
    """Rodas5P: a step of the hand-reduced ODE as generated C, its linear algebra included, in a loop in C."""
    n, t, h = x0.size, ca.SX.sym("t"), ca.SX.sym("h")
    f = ca.Function("floor_f", [ode["t"], ode["x"], ode["p"]], [ode["ode"]])
    slopes = [ca.jacobian(ode["ode"], ode["x"]), ca.densify(ca.jacobian(ode["ode"], ode["t"]))]
    jacobian, time_slope = ca.Function("floor_j", [ode["t"], ode["x"], ode["p"]], slopes)(t, ode["x"], ode["p"])
    taken = rodas5p.step(
        lambda s, y: f(s, y, ode["p"]), jacobian, time_slope, n, t, h, ode["x"], f(t, ode["x"], ode["p"])
    )
    tolerance = ca.SX.sym("tolerance", 2)
    scale = tolerance[1] + tolerance[0] * ca.fmax(ca.fabs(ode["x"]), ca.fabs(taken.end))
    results = ca.cse([taken.end, ca.sqrt(ca.sumsqr(taken.error / scale) / n), ca.vec(taken.dense)])
    inputs = [ca.vertcat(t, h), ode["x"], ode["p"], tolerance]
    step = ca.Function("floor_step", inputs, results)
    library = native.build(native.FLOORS / "driveline.c", generated=step)
    out = np.empty((len(GRID), n))

    def run() -> Array:
        pointers = [native.pointer(a) for a in (x0, p, GRID, out)]
        steps = library.run(
            n, *pointers, len(GRID), ctypes.c_double(STOP), ctypes.c_double(1e-6), ctypes.c_double(ATOL)
        )
        if steps < 0:
            raise RuntimeError("the C program failed")
        return out

    return run


def radau(ode: dict[str, ca.SX], x0: Array, p: Array) -> Callable[[], Array]:
    """SciPy's Radau with the Jacobian from CasADi, both through buffers (a tenth of a microsecond per call)."""
    from scipy.integrate import solve_ivp

    n = x0.size
    f = ca.Function("radau_f", [ode["t"], ode["x"], ode["p"]], [ode["ode"]])
    jacobian = ca.densify(ca.jacobian(ode["ode"], ode["x"]).T)
    j = ca.Function("radau_j", [ode["t"], ode["x"], ode["p"]], [jacobian])
    time, y, parameters, rates, matrix = np.zeros(1), np.zeros(n), p.copy(), np.zeros(n), np.zeros(n * n)
    calls = [bound(function, (time, y, parameters), (result,)) for function, result in ((f, rates), (j, matrix))]

    def evaluate(k: int, t: float, x: Array, result: Array) -> Array:
        time[0], y[:] = t, x
        calls[k]()
        return result.copy()

    def run() -> Array:
        done = solve_ivp(
            lambda t, x: evaluate(0, t, x, rates), (0.0, STOP), x0, "Radau", GRID, rtol=1e-6, atol=ATOL,
            jac=lambda t, x: evaluate(1, t, x, matrix).reshape(n, n),
        )  # fmt: skip
        return np.asarray(done.y).T

    return run


def run(rounds: int = 9) -> list[Row]:
    """All rows of this benchmark."""
    plant = pt.compile(Driveline(engine=Engine(torque_map=engine_map())))
    ode, x0, p = by_hand()
    cvodes = ca.integrator(
        "powertrain_driveline",
        "cvodes",
        ode,
        0.0,
        list(GRID),
        {"reltol": 1e-6, "abstol": ATOL, "max_num_steps": 1_000_000},
    )
    scipy_radau = radau(ode, x0, p)
    calls: dict[str, Call] = {
        "ours": lambda: simulate(plant),
        "cvodes": lambda: np.array(cvodes(x0=x0, p=p)["xf"]).T,
        "radau": scipy_radau,
    }
    reason = native.no_compiler()
    if not reason:
        calls |= {"C": whole_run_in_c(ode, x0, p), "compiled": lambda: simulate(plant, compile=True)}
    names = signals()
    exact = _columns(plant.simulate(STOP, times=GRID, rtol=1e-10), names)
    scale = np.abs(exact).max(axis=0)
    errors = {"ours": float((np.abs(_columns(plant.simulate(STOP, times=GRID), names) - exact) / scale).max())}
    for name in calls.keys() - {"ours", "compiled"}:
        found = calls[name]()
        assert isinstance(found, np.ndarray)
        errors[name] = float((np.abs(found[:, places()] - exact) / scale).max())
    times = measure(calls, rounds, inner=1)
    said = {name: f"{duration(times.median(name))}, error {error:.0e} of the range" for name, error in errors.items()}
    rows = [
        Row(NAME, f"20 s, {len(plant.compiled.states)} states, no compiler", said["ours"]),
        Row(NAME, "CasADi cvodes, ODE reduced by hand", said["cvodes"]),
        at_most(NAME, "against CasADi cvodes", times.ratio("ours", "cvodes"), 1),
        at_most(NAME, "error against that of CasADi cvodes", errors["ours"] / errors["cvodes"], 1),
    ]
    if reason:
        rows.append(Row(NAME, "against C", reason))
    else:
        rows.append(Row(NAME, "the whole run in C, ODE reduced by hand", said["C"]))
        rows.append(at_most(NAME, "no compiler against C", times.ratio("ours", "C"), 8))
        rows.append(Row(NAME, "compiled steps against C", f"{times.ratio('compiled', 'C'):.3g} x"))
    rows.append(Row(NAME, "SciPy Radau with Jacobian, ODE reduced by hand", said["radau"]))
    rows.append(at_least(NAME, "faster than SciPy Radau with Jacobian", 1 / times.ratio("ours", "radau"), 6))
    return rows


def simulate(plant: pt.Plant[Driveline], **options: Any) -> list[Array]:
    """What is timed for powertrain: one run of the compiled model and its states (those that have a name) at 2,001 instants."""
    result = plant.simulate(STOP, times=GRID, **options)
    return [result[name] for name in plant.compiled.states if name in result]


def _columns(result: pt.Result[Driveline], names: list[str]) -> Array:
    return np.column_stack(list(result.at(GRID, names).values()))
