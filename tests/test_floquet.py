"""Floquet multipliers: linear motions by hand, stick-slip, and a bouncing ball on a moving table."""

from __future__ import annotations

import math
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import powertrain as pt
from powertrain.components.blocks import Constant
from powertrain.components.rotational import Clutch, ConstantSpeed, Damper, Fixed, Inertia, Spring, SpringDamper, Torque
from powertrain.components.vibration import DualMassFlywheel, StagedSpring
from powertrain.variational.record import nearest

TIGHT: dict[str, Any] = {"rtol": 1e-10}


class Damped(pt.Component):
    """J phi'' + d phi' + c phi = 0."""

    inertia: Inertia = Inertia(J=1.0)
    spring: Spring = Spring(c=9.0)
    damper: Damper = Damper(d=0.5)
    ground: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.inertia.flange_b, self.spring.flange_a, self.damper.flange_a)
        yield pt.connect(self.spring.flange_b, self.damper.flange_b, self.ground.flange)


def test_linear_vibration() -> None:
    """The multipliers of a linear system are exp(lambda T)."""
    result = pt.simulate(Damped(), 4.0, starts={"inertia.w": 1.0}, **TIGHT)
    found = pt.floquet(result, 1.0, 1.5)
    exact = np.exp(1.5 * np.roots([1.0, 0.5, 9.0]))
    np.testing.assert_allclose(sorted(found.multipliers, key=np.angle), sorted(exact, key=np.angle), rtol=1e-8)
    assert "modulus" in str(found)
    ends = result.at([1.0, 2.5], list(found.closure))
    for name, change in found.closure.items():
        assert change == pytest.approx(ends[name][1] - ends[name][0], abs=1e-9)
        assert f"{name} by {change:.3g}" in str(found).splitlines()[-1]


class Mathieu(pt.Component):
    """x'' + (a + b cos(2 t)) x = 0."""

    a: pt.Parameter = pt.parameter("1/s2", "Mean stiffness over mass", default=1.0)
    b: pt.Parameter = pt.parameter("1/s2", "Its amplitude", default=0.4)
    x: pt.Variable = pt.variable("m", "Position", start=0.0)
    v: pt.Variable = pt.variable("m/s", "Speed", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.v
        yield pt.der(self.v) == -(self.a + self.b * ca.cos(2 * pt.time)) * self.x


@pytest.mark.parametrize("a", [1.0, 2.5, 30.0])
def test_a_motion_at_rest_has_multipliers(a: float) -> None:
    """Steps of a run at rest are longer than the period. Mathieu's multipliers mu: |mu + 1/mu| > 2, unstable, for a = 1 +- b/2."""
    found = np.sort_complex(pt.floquet(pt.simulate(Mathieu(a=a), 40.0), 1.0, math.pi).multipliers)

    def rates(t: float, s: np.ndarray) -> np.ndarray:
        return np.concatenate([s[2:], -(a + 0.4 * math.cos(2 * t)) * s[:2]])

    end = solve_ivp(rates, (1.0, 1.0 + math.pi), [1.0, 0.0, 0.0, 1.0], rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(found, np.sort_complex(np.linalg.eigvals(end.y[:, -1].reshape(2, 2))), rtol=1e-6)
    assert (abs(found).max() > 1.1) == (a == 1.0)


def test_a_period_that_closes_says_nothing() -> None:
    """The steady swing at w = sqrt(c/J) comes back after 2 pi/w; after another span the printed result names what does not."""
    result = pt.simulate(Damped(damper=Damper(d=0.0)), 8.0, starts={"inertia.w": 1.0}, **TIGHT)
    assert "changed" not in str(pt.floquet(result, 1.0, 2 * math.pi / 3.0))
    assert "changed over the period: " in str(pt.floquet(result, 1.0, 2.0))


class Touched(pt.Component):
    """As ``Damped``, and a torque while the angle is above a limit."""

    limit: pt.Parameter = pt.parameter("rad", "Limit", default=1.0)
    phi: pt.Variable = pt.variable("rad", "Angle", start=0.0)
    w: pt.Variable = pt.variable("rad/s", "Speed", start=1.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.phi) == self.w
        yield pt.der(self.w) == -9.0 * self.phi - 0.5 * self.w + pt.switch(self.phi > self.limit, 1.0, 0.0)


def test_only_the_period_counts() -> None:
    """The first swing barely reaches the limit, where a run has no derivative."""
    plant = pt.compile(Touched())
    peak = plant.simulate(1.0, points=100_000, **TIGHT)["phi"].max()
    result = plant.simulate(4.0, parameters={"limit": peak - 1e-9}, **TIGHT)
    with pytest.raises(pt.SimulationError, match="only just switches"):
        pt.floquet(result, 0.1, 1.5)
    found = pt.floquet(result, 1.0, 1.5)
    exact = np.exp(1.5 * np.roots([1.0, 0.5, 9.0]))
    np.testing.assert_allclose(sorted(found.multipliers, key=np.angle), sorted(exact, key=np.angle), rtol=1e-8)


class Bilinear(pt.Component):
    """A mass on a spring that is stiffer on one side."""

    x: pt.Variable = pt.variable("m", "Deflection", start=0.3)
    v: pt.Variable = pt.variable("m/s", "Speed", start=1.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.v
        yield pt.der(self.v) == -4.0 * self.x - 5.0 * ca.fmax(self.x, 0.0)


@pytest.mark.parametrize("start", [0.0, 0.7])
def test_a_corner_of_the_rates(start: float) -> None:
    """Half a period on one side turns every change into its negative, so that the whole period pi/2 + pi/3 leaves it as it is."""
    period = math.pi / 2 + math.pi / 3
    found = pt.floquet(pt.simulate(Bilinear(), start + period, rtol=1e-7), start, period)
    np.testing.assert_allclose(found.matrix, np.eye(2), atol=1e-5)


class Belt(pt.Component):
    """An inertia on a spring, dragged by a disc that turns: it sticks until the spring tears it off, and slips back."""

    belt: ConstantSpeed = ConstantSpeed(w_fixed=1.0)
    command: Constant = Constant(k=1.0)
    clutch: Clutch = Clutch(fn_max=10.0, mue_pos=((0.0, 0.5), (20.0, 0.3)), peak=1.0)
    inertia: Inertia = Inertia(J=1.0)
    spring: Spring = Spring(c=20.0)
    ground: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.belt.flange, self.clutch.flange_a)
        yield pt.connect(self.command.y, self.clutch.f_normalized)
        yield pt.connect(self.clutch.flange_b, self.inertia.flange_a)
        yield pt.connect(self.inertia.flange_b, self.spring.flange_a)
        yield pt.connect(self.spring.flange_b, self.ground.flange)


def test_stick_slip() -> None:
    """Falling friction excites the vibration until it sticks once a period: the sticking forgets, so that one multiplier is 0, one is 1."""
    result = pt.simulate(Belt(), 30.0, starts={"inertia.w": 0.0, "inertia.phi": 0.0}, **TIGHT)
    sticks = [e.time for e in result.events if e.name == "clutch.mode" and e.new == 0.0]
    assert len(sticks) > 5
    period = sticks[-2] - sticks[-3]
    assert period == pytest.approx(sticks[-1] - sticks[-2], rel=1e-7)
    slipping = sticks[-3] - 0.2
    found = pt.floquet(result, slipping, period)
    sizes = np.abs(found.multipliers)
    assert sizes[: len(sizes) - 1] == pytest.approx(np.ones(len(sizes) - 1), abs=1e-6)
    assert sizes[-1] < 1e-9
    np.testing.assert_allclose(found.matrix @ found.vectors, found.vectors * found.multipliers, atol=1e-9)
    assert max(abs(v) for n, v in found.closure.items() if n.endswith(("w", "w_rel"))) < 1e-6


class Table(pt.Component):
    """A ball on a table that moves with A sin(w t); restitution e."""

    A: pt.Parameter = pt.parameter("m", "Amplitude", default=0.01)
    e: pt.Parameter = pt.parameter("1", "Restitution", default=0.6)
    omega: pt.Parameter = pt.parameter("rad/s", "Frequency", default=40.0)
    y: pt.Variable = pt.variable("m", "Height", start=0.0)
    v: pt.Variable = pt.variable("m/s", "Speed", start=0.0)
    f: pt.Variable = pt.variable("N", "Force")

    def equations(self) -> pt.Equations:
        yield pt.der(self.y) == self.v
        yield pt.der(self.v) == self.f - 9.81
        yield pt.unilateral(self.y - self.A * ca.sin(self.omega * pt.time), self.f, restitution=self.e)


@pytest.mark.parametrize("e", [0.5, 0.6])
def test_bouncing_on_a_moving_table(e: float) -> None:
    """One bounce a period, with the jump of the derivatives at a hit by hand."""
    omega, g = 40.0, 9.81
    T = 2 * math.pi / omega
    # speed relative to the table before and after: flight time T, so the ball leaves with g T/2 and hits with -g T/2
    table = (1 - e) / (1 + e) * g * T / 2
    A = table / omega / math.cos(-0.4)  # hits at the phase -0.4, where the table moves up and accelerates upwards
    phase = brentq(lambda q: A * omega * math.cos(q) - table, -0.5, -0.3)
    begin = (phase + 2 * math.pi) / omega
    height, speed = A * math.sin(phase), g * T / 2
    starts = {"y": height + speed * 1e-3 - g * 1e-6 / 2, "v": speed - g * 1e-3}
    result = pt.compile(Table()).simulate(
        begin + 1e-3 + 2.5 * T, start=begin + 1e-3, starts=starts, parameters={"A": A, "e": e, "omega": omega}, **TIGHT
    )
    assert len(result.trajectory.instants) == 2
    found = pt.floquet(result, begin + 2e-3, T)
    # S+ = [[-e, 0], [-(1 + e)(a_t + g)/(v- - u), -e]] S-, then free flight [[1, T], [0, 1]]; a_t and u are the table's
    acceleration = -A * omega**2 * math.sin(phase)
    hit = np.array([[-e, 0.0], [(1 + e) * (acceleration + g) / (speed + table), -e]])
    exact = np.linalg.eigvals(np.array([[1.0, T], [0.0, 1.0]]) @ hit)
    np.testing.assert_allclose(np.sort_complex(found.multipliers), np.sort_complex(exact.astype(complex)), rtol=1e-6)


class Walls(pt.Component):
    """A mass between two walls, without anything else: it keeps its speed from hit to hit."""

    x: pt.Variable = pt.variable("m", "Position", start=0.0)
    v: pt.Variable = pt.variable("m/s", "Speed", start=1.0)
    left: pt.Variable = pt.variable("N", "Force of one wall")
    right: pt.Variable = pt.variable("N", "Force of the other wall")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.v
        yield pt.der(self.v) == self.left - self.right
        yield pt.unilateral(self.x + 1.0, self.left, restitution=0.5)
        yield pt.unilateral(1.0 - self.x, self.right, restitution=0.5)


def test_two_contacts_of_one_component() -> None:
    """A hit multiplies every change by -e, so two of them with flights between make e^2 [[1, T], [0, 1]] of (x, v)."""
    plant = pt.compile(Walls())
    result = plant.simulate(6.0, **TIGHT)
    assert [e.name for e in result.events] == ["contact_2", "contact"]
    found = pt.floquet(result, 0.5, 5.25)
    exact = 0.25 * (
        np.array([[1.0, 5.25], [0.0, 1.0]]) if found.names[0] == "x" else np.array([[1.0, 0.0], [5.25, 1.0]])
    )
    np.testing.assert_allclose(found.matrix, exact, atol=1e-9)
    assert set(plant.function(modes=(result, 0.5)).modes) == {"contact", "contact_2"}


OMEGA = 84.0


class Rubbing(pt.Component):
    """A dual-mass flywheel whose coils stick and slip, and whose stages engage, under a torque of one frequency."""

    torque: Torque = Torque()
    flywheel: DualMassFlywheel = DualMassFlywheel(stages=StagedSpring(stages=((0.05, 400.0), (0.1, 3000.0))))
    shaft: SpringDamper = SpringDamper(c=300.0, d=3.0)
    drive: ConstantSpeed = ConstantSpeed(w_fixed=60.0)

    def equations(self) -> pt.Equations:
        yield self.torque.tau.value == 60.0 * ca.cos(OMEGA * pt.time)
        yield pt.connect(self.torque.flange, self.flywheel.flange_a)
        yield pt.connect(self.flywheel.flange_b, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.drive.flange)


@pytest.mark.slow
def test_coils_that_stick_and_slip() -> None:
    """The columns of the matrix are the differences of two runs over the period, from starts next to one another."""
    period = 2 * math.pi / OMEGA
    start, plant = 20.3 * period, pt.compile(Rubbing())
    turning = {"flywheel.primary.w": 60.0, "flywheel.secondary.w": 60.0}
    result = plant.simulate(22 * period, starts=turning, **TIGHT)
    assert sum(start < e.time <= start + period for e in result.events) > 10
    found = pt.floquet(result, start, period)
    here = {name: float(result.at([start], name)[0]) for name in found.names}
    for name in ("flywheel.primary.w", "shaft.phi_rel", "flywheel.flange_b.phi"):
        ends = [
            plant.simulate(start + period, start=start, starts={**here, name: here[name] + h}, rtol=1e-12)
            for h in (-3e-6, 3e-6)
        ]
        change = [(ends[1][other][-1] - ends[0][other][-1]) / 6e-6 for other in found.names]
        exact = found.matrix[:, found.names.index(name)]
        np.testing.assert_allclose(change, exact, atol=1e-4 * np.abs(exact).max())


def test_distance_from_the_nearest_event() -> None:
    """In the memory of the times alone: a run has thousands of events."""
    events, times = np.array([3.0, 1.0]), np.array([0.0, 1.0, 1.9, 2.2, 7.0])
    assert nearest(events, times).tolist() == pytest.approx([1.0, 0.0, 0.9, 0.8, 4.0])
    assert np.isinf(nearest(events[:0], times)).all()
    assert nearest(np.arange(3e5), np.arange(3e5) + 0.25).tolist() == [0.25] * 300_000


def test_bad_input() -> None:
    result = pt.simulate(Damped(), 1.0)
    with pytest.raises(pt.ParameterError, match="is outside the simulated span"):
        pt.floquet(result, 0.5, 0.7)
