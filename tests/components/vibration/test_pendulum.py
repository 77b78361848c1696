"""Centrifugal pendulums: order, tautochrone, effective inertia, torque balance, stops."""

from __future__ import annotations

import math
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.special import ellipk

import powertrain as pt
from powertrain.components.engines import Crankshaft, PistonEngine
from powertrain.components.rotational import ConstantSpeed, Inertia, SpringDamper, Torque, TwoFlanges
from powertrain.components.vibration import CentrifugalPendulum, DualMassFlywheel

W = 100.0


class Steady(pt.Component):
    """A pendulum in a carrier of constant speed."""

    pendulum: CentrifugalPendulum
    drive: ConstantSpeed = ConstantSpeed(w_fixed=W)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.pendulum.flange, self.drive.flange)


class Shaken(pt.Component):
    """A pendulum on an inertia with a torque."""

    pendulum: CentrifugalPendulum
    rotor: Inertia = Inertia(J=0.1)
    source: Torque = Torque()
    torque: pt.Input = pt.signal_input("N.m", "Torque", default=0.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.pendulum.flange, self.rotor.flange_a)
        yield pt.connect(self.rotor.flange_b, self.source.flange)
        yield pt.connect(self.torque, self.source.tau)


def order_of(run: Any) -> float:
    """Oscillations per revolution, from the zeros of the path."""
    s, t = run["pendulum.s"], run.time
    i = np.flatnonzero((s[:-1] > 0) & (s[1:] <= 0))
    zeros = t[i] + (t[i + 1] - t[i]) * s[i] / (s[i] - s[i + 1])
    return float(2 * math.pi / np.diff(zeros).mean() / W)


@pytest.mark.parametrize("path", ["circle", "cycloid", "epicycloid"])
def test_order_is_root_of_R_over_r(path: Any) -> None:
    """Small oscillations: n = root(R/r) with r = c/(1 + n^2), R = c - r, on every path, and no loss of energy."""
    run = pt.simulate(
        Steady(pendulum=CentrifugalPendulum(path=path, n=2.0, d=0, s_max=0.015)),
        0.4,
        starts={"pendulum.psi": 0.02},
        points=4000,
        rtol=1e-9,
        atol=1e-12,
    )
    assert order_of(run) == pytest.approx(2.0, rel=2e-4)
    assert pt.energy_audit(run).closure < 1e-7


@pytest.mark.parametrize(
    ("path", "change"), [("circle", math.pi / (2 * ellipk(math.sin(0.5) ** 2))), ("epicycloid", 1)]
)
def test_order_at_large_amplitude(path: Any, change: float) -> None:
    """On a circle psi'' + n^2 w^2 sin(psi) = 0: slower by the elliptic integral; an epicycloid is tautochronic."""
    pendulum = CentrifugalPendulum(path=path, n=2.0, d=0, s_max=0.0215)
    start = {"pendulum.psi": 1.0}
    run = pt.simulate(Steady(pendulum=pendulum), 0.4, starts=start, points=4000, rtol=1e-9, atol=1e-12)
    assert run["pendulum.s"].max() > 0.017
    assert order_of(run) == pytest.approx(2.0 * change, rel=1e-5)


@pytest.mark.parametrize("order", [1.0, 1.4, 1.5, 3.0])
def test_effective_inertia(order: float) -> None:
    """w/torque at order k is 1/(i k w (J + m c^2 n^2/(n^2 - k^2))): none at k = n, where the carrier stands still."""
    model = Shaken(pendulum=CentrifugalPendulum(n=1.5, d=0))
    linear = pt.linearize(model, inputs=["torque"], outputs=["rotor.w"], at={"rotor.w": W})
    response = np.squeeze(linear(1j * order * W))
    inertia = 0.1 * (1.5**2 - order**2) + 1.0 * 0.1**2 * 1.5**2
    assert response == pytest.approx((1.5**2 - order**2) / (1j * order * W * inertia), rel=1e-6, abs=1e-12)


def test_attenuation_of_an_order() -> None:
    """A torque of order n at 20 N.m: the order in the speed is that of the linear theory with damping, a third of what it was."""

    class Engine(pt.Component):
        shaken: Shaken

        def equations(self) -> pt.Equations:
            yield self.shaken.torque.value == 20 * ca.sin(1.5 * self.shaken.rotor.phi)

    model = Engine(shaken=Shaken(pendulum=CentrifugalPendulum(n=1.5, d=5)))
    run = pt.simulate(model, 4.0, starts={"shaken.rotor.w": W}, points=20_000)
    late = run.time > 2.5
    phi, w = run["shaken.rotor.phi"][late], run["shaken.rotor.w"][late]
    swing, mean = order_amplitude(phi, w), w.mean()
    inertia = abs(0.1 + 1.0 * 0.1**2 * (1 + 1.5**2 / (1.5j * 5 / (1.0 * mean))))
    assert swing == pytest.approx(20 / (1.5 * mean * inertia), rel=0.03)  # the mean speed still settles
    assert np.ptp(run["shaken.pendulum.s"][late]) / 2 == pytest.approx(20 / (0.1 * (1.5 * mean) ** 2), rel=0.1)
    assert pt.energy_audit(run).closure < 1e-6


class Rigid(TwoFlanges):
    """A flywheel and a clutch disc with a damper."""

    mass: Inertia = Inertia(J=0.14)
    damper: SpringDamper = SpringDamper(c=1000, d=3)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.flange_a, self.mass.flange_a)
        yield pt.connect(self.mass.flange_b, self.damper.flange_a)
        yield pt.connect(self.damper.flange_b, self.flange_b)


class WithPendulum(TwoFlanges):
    """A dual-mass flywheel with a pendulum on its secondary mass."""

    flywheel: DualMassFlywheel = DualMassFlywheel()
    pendulum: CentrifugalPendulum = CentrifugalPendulum()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.flange_a, self.flywheel.flange_a)
        yield pt.connect(self.flywheel.flange_b, self.flange_b, self.pendulum.flange)


class ThreeCylinders(pt.Component):
    """An engine at 190 rad/s with a flywheel, a gearbox and half shafts."""

    flywheel: TwoFlanges
    engine: PistonEngine = PistonEngine.inline((1, 3, 2), crankshaft=Crankshaft(J=0.03))
    gearbox: Inertia = Inertia(J=0.01)
    shafts: SpringDamper = SpringDamper(c=500, d=1)
    brake: ConstantSpeed = ConstantSpeed(w_fixed=190)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.crank, self.flywheel.flange_a)
        yield pt.connect(self.flywheel.flange_b, self.gearbox.flange_a)
        yield pt.connect(self.gearbox.flange_b, self.shafts.flange_a)
        yield pt.connect(self.shafts.flange_b, self.brake.flange)
        yield self.engine.throttle.value == 1

    def initial(self) -> pt.Equations:
        yield self.engine.crankshaft.w == 190
        yield self.gearbox.w == 190


@pytest.mark.slow
def test_behind_a_piston_engine() -> None:
    """Order 1.5 of a three-cylinder engine at the gearbox: less behind a dual-mass flywheel, less still with a pendulum."""
    swing = []
    for part in (Rigid(), DualMassFlywheel(), WithPendulum()):
        run = pt.simulate(ThreeCylinders(flywheel=part), 2.0, points=8_000)
        late = run.time > 1.2
        swing.append(order_amplitude(run["engine.crankshaft.phi"][late], run["gearbox.w"][late]))
    rigid, dual, pendulum = swing
    assert dual < 0.6 * rigid
    assert pendulum < 0.2 * dual


def order_amplitude(phi: Any, signal: Any) -> float:
    """Amplitude of order 1.5 over whole cycles of two revolutions."""
    cycles = int((phi[-1] - phi[0]) / (4 * math.pi))
    even = phi[0] + np.arange(400 * cycles) * math.pi / 100
    return float(2 * abs(np.fft.rfft(np.interp(even, phi, signal))[3 * cycles]) / even.size)


def test_stops_hold_and_take_energy() -> None:
    """Started fast, the mass stays within s_max, bounces with e and comes to swing below it."""
    pendulum = CentrifugalPendulum(n=2.0, d=0, s_max=0.01, e=0.5)
    run = pt.simulate(Shaken(pendulum=pendulum), 0.5, starts={"rotor.w": W, "pendulum.w_psi": 200.0}, points=2000)
    assert np.abs(run["pendulum.s"]).max() <= 0.01 + 1e-7
    audit = pt.energy_audit(run)
    assert audit.closure < 1e-6
    assert len(audit.jumps) > 1
    assert audit.jumps["energy"].max() <= 0
    w, psi = run["rotor.w"], run["pendulum.w_psi"]
    assert np.ptp(w) > 0.1
    assert np.abs(psi[run.time > 0.4]).max() < 190
    with pytest.raises(pt.ParameterError, match="s_max"):
        CentrifugalPendulum(s_max=0.05)
    for start in (1.2, -1.2):
        with pytest.raises(pt.InitializationError, match=r"stop_(ahead|behind) .* overlap: the gap is -0.0"):
            pt.simulate(Steady(pendulum=CentrifugalPendulum()), 0.1, starts={"pendulum.psi": start})
