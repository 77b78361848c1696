"""Piston engines against closed forms: slider crank, Otto cycle, work of the gas, orders of the torque; and a start."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from cases import few
from numpy.typing import NDArray

import powertrain as pt
from powertrain.components.blocks import TimeTable
from powertrain.components.electric import VoltageSource
from powertrain.components.engines import CoolantCircuit, Crankshaft, Cylinder, PistonEngine, Starter
from powertrain.components.rotational import ConstantSpeed, Inertia

W = 200.0
CYCLE = 4 * math.pi / W


class Dyno(pt.Component):
    """An engine whose speed is held."""

    engine: PistonEngine
    drive: ConstantSpeed = ConstantSpeed(w_fixed=W)
    throttle: pt.Input = pt.signal_input("1", "Throttle", default=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.crank, self.drive.flange)
        yield pt.connect(self.throttle, self.engine.throttle)


def cycle(engine: PistonEngine, throttle: float = 1.0, points: int = 1440) -> Any:
    return pt.simulate(Dyno(engine=engine), CYCLE, inputs={"throttle": throttle}, points=points)


def work(run: Any, number: int = 0) -> float:
    """The area of the indicator diagram [J]."""
    return float(np.trapezoid(run[f"engine.cylinders[{number}].p"], run[f"engine.cylinders[{number}].volume"]))


def orders(torque: NDArray[np.float64]) -> NDArray[np.float64]:
    """Amplitudes of a cycle that is sampled evenly, both ends included: [2 n] is order n per revolution."""
    return 2 * np.abs(np.fft.rfft(torque[:-1])) / (torque.size - 1)


def test_inertia_of_a_slider_crank() -> None:
    """Without gas and friction J(phi) w^2 is constant, J(phi) = J + m x'(phi)^2; its mean is J + m r^2 (1/2 + lambda^2/8 + ...)."""
    bare = Cylinder(m=2.0, p_closed=0, p_open=0, p_exhaust=0, p_0=0)
    engine = PistonEngine(cylinders=(bare,), crankshaft=Crankshaft(J=0.01, p_f0=0, p_f1=0, p_f2=0))
    run = pt.simulate(engine, 0.2, starts={"speed": 100.0}, rtol=1e-9, inputs={"throttle": 0.0})
    phi, w = run["crankshaft.phi"], run["crankshaft.w"]
    r, rod = 0.0815 / 2, 0.14
    sine, cosine = np.sin(phi), np.cos(phi)
    rate = r * sine + r**2 * sine * cosine / np.sqrt(rod**2 - (r * sine) ** 2)
    np.testing.assert_allclose(w, 100 * np.sqrt(0.01 / (0.01 + 2 * rate**2)), rtol=1e-7)
    assert w.min() < 90
    even = np.linspace(0, 2 * math.pi, 720, endpoint=False)
    speed = np.interp(even, phi, rate)  # of the piston over that of the crankshaft
    assert np.mean(speed**2) == pytest.approx(r**2 * (1 / 2 + (r / rod) ** 2 / 8), rel=1e-3)
    assert pt.energy_audit(run).closure < 1e-7


def test_heat_at_the_dead_centre_makes_an_otto_cycle() -> None:
    """Without pumping and with sudden combustion, late opening: efficiency 1 - eps^(1 - n)."""
    sudden = Cylinder(
        walls=0, ignition=0, duration=2e-3, opening=3.1, p_closed=1e5, p_open=1e5, p_exhaust=1e5, eps=9, n=1.4
    )
    run = cycle(PistonEngine(cylinders=(sudden,)), points=20_000)
    heat = 3.3e6 * math.pi / 4 * 0.079**2 * 0.0815
    assert work(run) / heat == pytest.approx(1 - 9**-0.4, rel=2e-4)
    assert run["engine.heat"][-1] * CYCLE == pytest.approx(heat, rel=1e-9)


@pytest.mark.parametrize("throttle", few([0.0, 0.3, 1.0]))
def test_work_of_the_gas_is_that_of_the_crank(throttle: float) -> None:
    """The mean torque over a cycle is sum(work)/(4 pi): the oscillating masses take none, friction is apart."""
    run = cycle(PistonEngine.inline((1, 3, 4, 2)), throttle)
    mean = np.trapezoid(run["engine.tau"], run.time) / CYCLE
    areas = [work(run, k) for k in range(4)]
    np.testing.assert_allclose(areas, areas[0], atol=0.02)
    assert mean == pytest.approx(sum(areas) / (4 * math.pi), abs=0.02)
    friction = 1.6e-3 / (4 * math.pi) * (60e3 + 143 * W + 0.46 * W**2)
    assert run["engine.crankshaft.drag"][-1] == pytest.approx(friction, rel=2e-3)
    assert (mean > friction) == (throttle > 0.2)
    assert run["engine.cylinders[0].p"].max() > 0


def test_torque_of_the_gas() -> None:
    """(p - p_0) A dx/dphi at every angle."""
    run = cycle(PistonEngine(cylinders=(Cylinder(m=0),)))
    phi, r = W * run.time, 0.0815 / 2
    rate = r * np.sin(phi) + r**2 * np.sin(phi) * np.cos(phi) / np.sqrt(0.14**2 - (r * np.sin(phi)) ** 2)
    over = run["engine.cylinders[0].p"] - 101325
    np.testing.assert_allclose(run["engine.tau"], over * math.pi / 4 * 0.079**2 * rate, atol=1e-3)


def test_orders_of_the_torque() -> None:
    """n cylinders leave the orders n/2, n, 3n/2 ... of the cylinder's; the others vanish."""
    one = orders(cycle(PistonEngine())["engine.tau"])
    assert one[1] > 50  # order 1/2
    for order in [(1, 3, 2), (1, 5, 3, 6, 2, 4)]:
        n = len(order)
        found = orders(cycle(PistonEngine.inline(order))["engine.tau"])
        np.testing.assert_allclose(found[n : 5 * n : n], n * one[n : 5 * n : n], rtol=1e-4, atol=1e-2)
        assert max(found[k] for k in range(1, 60) if k % n) < 1e-2


def test_an_intake_pressure_that_falls_with_the_load_is_refused() -> None:
    with pytest.raises(pt.ParameterError, match="p_closed = 99000 Pa, p_open = 95000 Pa"):
        Cylinder(p_closed=99e3)


def test_firing_order_and_interval() -> None:
    """The pressures peak in the firing order, and each is that of the first later; odd intervals have the half order."""
    run = cycle(PistonEngine.inline((1, 3, 4, 2)), points=1440)
    peaks = [int(np.argmax(run[f"engine.cylinders[{k}].p"][:-1])) for k in range(4)]
    assert [int(np.argsort(peaks)[k]) + 1 for k in range(4)] == [1, 3, 4, 2]
    first, third = (run[f"engine.cylinders[{k}].p"][:-1] for k in (0, 2))
    np.testing.assert_allclose(third, np.roll(first, 360), rtol=1e-6)
    twin = PistonEngine(cylinders=(Cylinder(), Cylinder(phase=math.radians(270))))
    assert orders(cycle(twin)["engine.tau"])[1] > 50
    with pytest.raises(pt.ParameterError, match=r"order = \(1, 3\) is not a firing order"):
        PistonEngine.inline((1, 3))
    with pytest.raises(pt.ParameterError, match="it has cylinders"):
        pt.compile(PistonEngine(cylinders=()))


def test_the_phase_of_the_first_cylinder() -> None:
    """An engine whose cylinders have a phase fires that much later, every cylinder of it."""
    late = PistonEngine.inline((1, 3, 2), Cylinder(phase=0.5))
    assert [float(c.phase) for c in late.cylinders] == pytest.approx(
        [0.5, 0.5 + 8 * math.pi / 3, 0.5 + 4 * math.pi / 3]
    )


def test_turned_backward_an_engine_gives_nothing() -> None:
    """Without friction and oscillating mass the speed after whole cycles is what it was: the gas is a spring, and the throttle no motor."""
    engine = PistonEngine(cylinders=(Cylinder(m=0),), crankshaft=Crankshaft(J=0.5, p_f0=0, p_f1=0, p_f2=0))
    run = pt.simulate(engine, 1.0, starts={"speed": -60.0}, inputs={"throttle": 1.0}, points=4000, rtol=1e-9)
    phi, w = run["crankshaft.phi"], run["crankshaft.w"]
    np.testing.assert_allclose(np.interp([16 * math.pi, 8 * math.pi], -phi, w), -60, rtol=1e-5)
    assert np.all(run["heat"] == 0)


def test_angles_do_not_wear_out() -> None:
    """After 10,000 revolutions a cycle is the cycle it was."""
    first = cycle(PistonEngine())
    start = {"engine.crankshaft.phi": 20_000 * math.pi}
    later = pt.simulate(Dyno(engine=PistonEngine()), CYCLE, starts=start, inputs={"throttle": 1.0}, points=1440)
    np.testing.assert_allclose(later["engine.cylinders[0].p"], first["engine.cylinders[0].p"], rtol=1e-6)


class WarmingUp(pt.Component):
    """A piston engine at a held speed with its cooling."""

    cooling: CoolantCircuit = CoolantCircuit(C=2e3)
    engine: PistonEngine = PistonEngine()
    drive: ConstantSpeed = ConstantSpeed(w_fixed=W)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.crank, self.drive.flange)
        yield pt.connect(self.engine.heat_port, self.cooling.engine)
        yield pt.connect(self.cooling.warmth, self.engine.warmth)
        yield self.engine.throttle.value == 0.5


def test_walls_and_friction_heat_the_coolant() -> None:
    """A cold crankshaft rubs more; 22 % of the heat of combustion and the friction go to the coolant."""
    run = pt.simulate(WarmingUp(), 10.0, points=2000)
    drag = 0.4e-3 / (4 * math.pi) * (60e3 + 143 * W + 0.46 * W**2)
    np.testing.assert_allclose(run["engine.crankshaft.drag"], drag * run["cooling.warmth"], rtol=2e-3)
    assert run["cooling.warmth"][-1] < run["cooling.warmth"][0] - 0.1
    walls = 0.22 * 0.5 * 3.3e6 * math.pi / 4 * 0.079**2 * 0.0815 * W / (4 * math.pi)
    np.testing.assert_allclose(run["cooling.engine.Q_flow"], walls + run["engine.crankshaft.lossPower"], rtol=1e-9)


class Start(pt.Component):
    """An engine with its starter."""

    engine: PistonEngine = PistonEngine.inline((1, 3, 4, 2))
    starter: Starter = Starter()
    battery: VoltageSource = VoltageSource(V=12)
    throttle: pt.Input = pt.signal_input("1", "Throttle", default=0.2)
    starting: pt.Input = pt.signal_input("1", "Starter on", default=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.crank, self.starter.flange)
        yield pt.connect(self.starter.bus, self.battery.bus)
        yield pt.connect(self.starting, self.starter.on)
        yield pt.connect(self.throttle, self.engine.throttle)


class Cranked(pt.Component):
    """A shaft that turns freely with a starter."""

    starter: Starter = Starter()
    battery: VoltageSource = VoltageSource(V=12)
    shaft: Inertia = Inertia(J=0.15)
    switch: TimeTable = TimeTable(table=((0, 0), (0.1, 0), (0.1, 1)))

    def equations(self) -> pt.Equations:
        yield pt.connect(self.starter.flange, self.shaft.flange_a)
        yield pt.connect(self.starter.bus, self.battery.bus)
        yield pt.connect(self.switch.y, self.starter.on)


@pytest.mark.parametrize("at", [0.1, 0.0])
@pytest.mark.parametrize(("w", "w_m"), [(-10.0, 0.0), (0.0, 1500.0), (20.0, 1500.0)])
def test_a_starter_that_is_faster_than_its_engine_slips(at: float, w: float, w_m: float) -> None:
    """An engine that rocks back, or a motor that still turns: one speed after J dw/tau_max, and the difference is heat."""
    table = ((0.0, 0.0), (at, 0.0), (at, 1.0)) if at else ((0.0, 1.0), (1.0, 1.0))
    weak: dict[str, Any] = {"starter": Starter(k=1e-9, d=0.0, tau_max=500.0), "battery": VoltageSource(V=1e-6)}
    model = Cranked(**weak, switch=TimeTable(table=table))
    run = pt.simulate(model, 0.2, starts={"shaft.w": w, "starter.w_m": w_m}, rtol=1e-9)
    armature, slip = 1e-4 * 50**2, w_m / 50 - w
    reduced = armature * 0.15 / (armature + 0.15)
    stuck = next(e.time for e in run.events if e.name == "starter.freewheel" and e.new == 0)
    assert stuck - at == pytest.approx(reduced * slip / 500, rel=1e-6)
    common = (0.15 * w + armature * w_m / 50) / (0.15 + armature)
    assert run["shaft.w"][-1] == pytest.approx(common, rel=1e-6)
    assert run["starter.w_m"][-1] == pytest.approx(50 * common, rel=1e-6)
    audit = pt.energy_audit(run)
    assert audit.components.lost["starter"] == pytest.approx(reduced * slip**2 / 2, rel=1e-6)
    assert audit.closure < 1e-7


@pytest.mark.slow
def test_a_starter_starts_and_is_overrun() -> None:
    run = pt.simulate(Start(), 2.0, inputs={"starting": ([0, 1, 1], [1, 1, 0])}, points=400)
    speed, motor = run["engine.speed"], run["starter.w_m"]
    assert speed[-1] > 120
    assert np.all(run["starter.w_rel"] >= -1e-6)
    idle = 12 * 6.8e-3 / (6.8e-3**2 + 0.045 * 1e-4)  # (V - k w)/R k = d w
    assert np.interp(0.99, run.time, motor) == pytest.approx(idle, rel=0.01)
    after = run.time > 1.001
    assert np.all(run["starter.tau"][after] == 0)
    assert np.all(run["starter.i"][after] == 0)
    assert pt.energy_audit(run).closure < 1e-5


def test_a_starter_cranks_where_its_torque_meets_the_drag() -> None:
    """Against a shaft with a constant drag: the armature at the speed at which k i = d w + drag/ratio."""

    class Bench(pt.Component):
        starter: Starter = Starter()
        battery: VoltageSource = VoltageSource(V=12)
        shaft: Inertia = Inertia(J=0.1)
        load: Crankshaft = Crankshaft(J=0.0, p_f1=0, p_f2=0, p_f0=300e3, displacement=2e-3)

        def equations(self) -> pt.Equations:
            yield pt.connect(self.starter.flange, self.shaft.flange_a)
            yield pt.connect(self.shaft.flange_b, self.load.flange)
            yield pt.connect(self.starter.bus, self.battery.bus)
            yield self.starter.on.value == 1

    run = pt.simulate(Bench(), 3.0)
    drag, k, R, d, ratio = 300e3 * 2e-3 / (4 * math.pi), 6.8e-3, 0.045, 1e-4, 50
    steady = (k * 12 / R - drag / ratio) / (k**2 / R + d)
    assert run["starter.w_m"][-1] == pytest.approx(steady, rel=1e-4)
    assert run["shaft.w"][-1] == pytest.approx(steady / ratio, rel=1e-4)
