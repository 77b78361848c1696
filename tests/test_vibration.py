"""Modal energies, Campbell diagrams, forced response, order maps: against closed forms, scipy's eigenvalues, and simulated run-ups."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import eigh

import powertrain as pt
from powertrain.components.rotational import Clutch, Fixed, Inertia, Spring, SpringDamper, Torque
from powertrain.components.rotational.interfaces import Flange
from powertrain.components.vibration import CentrifugalPendulum

J, C = (0.2, 0.05, 0.3, 1.5), (4000.0, 900.0, 12000.0)


class Chain(pt.Component):
    """Inertias with springs between them, free at both ends."""

    inertias: tuple[Inertia, ...] = tuple(Inertia(J=j) for j in J)
    springs: tuple[SpringDamper, ...] = tuple(SpringDamper(c=c, d=0.02) for c in C)

    def equations(self) -> pt.Equations:
        for k, spring in enumerate(self.springs):
            yield pt.connect(self.inertias[k].flange_b, spring.flange_a)
            yield pt.connect(spring.flange_b, self.inertias[k + 1].flange_a)


def stiffness(c: tuple[float, ...] = C) -> NDArray[np.float64]:
    K = np.zeros((4, 4))
    for k, value in enumerate(c):
        K[k : k + 2, k : k + 2] += value * np.array([[1, -1], [-1, 1]])
    return K


CHAIN = pt.compile(Chain())
FREE = {f"springs[{k}].d": 0.0 for k in range(3)}


def test_energies_of_modes() -> None:
    """J v^2 and c (difference of v)^2/s^2, half of the energy each, from scipy's eigenvectors."""
    squares, vectors = eigh(stiffness(), np.diag(J))
    kinetic = (np.array(J)[:, None] * vectors[:, 1:] ** 2).T
    strain = (np.array(C)[:, None] * np.diff(vectors[:, 1:], axis=0) ** 2).T / squares[1:, None]
    found = pt.eigenmodes(CHAIN, parameters=FREE)["energy"]
    shares = found.sel(component=[*(f"inertias[{k}]" for k in range(4)), *(f"springs[{k}]" for k in range(3))])
    np.testing.assert_allclose(shares, np.hstack([kinetic, strain]) / 2, atol=1e-12)
    np.testing.assert_allclose(found.sum("component"), 1.0)


class Series(pt.Component):
    """A nonlinear and a linear spring in series, whose common end is an algebraic unknown."""

    flange: Flange = Flange()
    u: pt.Variable = pt.variable("rad", "Twist of the first", start=0.0)
    tau: pt.Variable = pt.variable("N.m", "Torque")

    def equations(self) -> pt.Equations:
        yield self.tau == 300.0 * (self.u + self.u**3 + 0.1 * ca.sin(self.u) ** 3)
        yield self.tau == 100.0 * (self.flange.phi - self.u)
        yield self.flange.tau == self.tau

    def energy(self) -> Any:
        return 300.0 * (self.u**2 / 2 + self.u**4 / 4) + 100.0 * (self.flange.phi - self.u) ** 2 / 2


class Hanging(pt.Component):
    """An inertia on both."""

    inertia: Inertia = Inertia(J=1.0)
    series: Series = Series()
    beside: Spring = Spring(c=75.0)
    ground: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.inertia.flange_b, self.series.flange, self.beside.flange_a)
        yield pt.connect(self.beside.flange_b, self.ground.flange)


def test_energies_through_algebraic_unknowns() -> None:
    """300 and 100 N.m/rad in series are 75, as much as the spring beside: a quarter of the energy each, and half in the inertia."""
    plant = pt.compile(Hanging())
    assert plant.compiled.dae.z.numel() == 1
    found = pt.eigenmodes(plant, at={"inertia.phi": 0.0, "inertia.w": 0.0})
    assert float(found["frequency"][0]) * 2 * math.pi == pytest.approx(math.sqrt(150.0))
    np.testing.assert_allclose(found["energy"].sel(component=["inertia", "series", "beside"])[0], [0.5, 0.25, 0.25])


class Two(pt.Component):
    """Two oscillators with a weak spring between them."""

    grounds: tuple[Fixed, ...] = (Fixed(), Fixed())
    first: Inertia = Inertia(J=1.0)
    second: Inertia = Inertia(J=2.0)
    soft: Spring = Spring(c=100.0)
    hard: Spring = Spring(c=800.0)
    weak: Spring = Spring(c=0.5)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.grounds[0].flange, self.soft.flange_a)
        yield pt.connect(self.soft.flange_b, self.first.flange_a, self.weak.flange_a)
        yield pt.connect(self.weak.flange_b, self.second.flange_a, self.hard.flange_b)
        yield pt.connect(self.hard.flange_a, self.grounds[1].flange)


def test_modes_keep_their_number_where_frequencies_cross() -> None:
    """sqrt(c/J) of each oscillator with the weak spring, which cross at c = 400; the coupling moves them by less than a thousandth."""
    values = np.linspace(100.0, 900.0, 40)
    found = pt.campbell(Two(), {"soft.c": values}, ["first.w", "second.w"])
    exact = np.sqrt([values + 0.5, np.full(40, 800.5 / 2)]).T / (2 * math.pi)
    np.testing.assert_allclose(found["frequency"], exact, rtol=1e-3)
    far = np.abs(values - 400.0) > 50.0
    assert np.abs(found["shape"].sel(signal="second.w").values[far, 0]).max() < 0.05
    assert found["mac"].values[1:].min() > 0.5
    assert found["soft.c"].attrs["units"] == "N.m/rad"


class Joined(pt.Component):
    """An inertia on a spring, a second one behind a clutch with a spring of its own."""

    press: pt.Input = pt.signal_input("1", "Clutch")
    grounds: tuple[Fixed, ...] = (Fixed(), Fixed())
    springs: tuple[SpringDamper, ...] = (SpringDamper(c=400.0, d=0.1), SpringDamper(c=500.0, d=0.1))
    first: Inertia = Inertia(J=1.0)
    clutch: Clutch = Clutch(fn_max=1.0, mue_pos=((0.0, 100.0),))
    second: Inertia = Inertia(J=3.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.grounds[0].flange, self.springs[0].flange_a)
        yield pt.connect(self.springs[0].flange_b, self.first.flange_a)
        yield pt.connect(self.first.flange_b, self.clutch.flange_a)
        yield pt.connect(self.press, self.clutch.f_normalized)
        yield pt.connect(self.clutch.flange_b, self.second.flange_a)
        yield pt.connect(self.second.flange_b, self.springs[1].flange_a)
        yield pt.connect(self.springs[1].flange_b, self.grounds[1].flange)


def test_a_mode_that_a_clutch_takes_away_comes_back_as_itself() -> None:
    still = {"first.w": 0.0, "clutch.w_rel": 0.0}
    found = pt.campbell(Joined(), {"press": [0.0, 1.0, 0.0]}, at=still)
    frequency = found["frequency"].values * 2 * math.pi
    assert frequency.shape == (3, 2)
    np.testing.assert_allclose(frequency[[0, 2]], np.sqrt([[500 / 3, 400.0]] * 2), rtol=1e-9)
    there = np.isfinite(frequency[1])
    assert there.sum() == 1
    assert frequency[1, there] == pytest.approx(math.sqrt(900 / 4))


class Pendulum(pt.Component):
    """An inertia that carries a centrifugal pendulum: mass m on the radius r about a point at R."""

    J: pt.Parameter = pt.parameter("kg.m2", "Inertia of the carrier", default=0.1)
    m: pt.Parameter = pt.parameter("kg", "Mass", default=0.8)
    R: pt.Parameter = pt.parameter("m", "Radius of the point of suspension", default=0.12)
    r: pt.Parameter = pt.parameter("m", "Length", default=0.03)
    flange: Flange = Flange()
    w: pt.Variable = pt.variable("rad/s", "Speed of the carrier", start=0.0)
    psi: pt.Variable = pt.variable("rad", "Angle of the pendulum", start=0.0)
    v: pt.Variable = pt.variable("rad/s", "Its speed relative to the carrier", start=0.0)

    def equations(self) -> pt.Equations:
        spin = self.J * self.w + self.m * (
            self.R**2 * self.w
            + self.r**2 * (self.w + self.v)
            + self.R * self.r * (2 * self.w + self.v) * ca.cos(self.psi)
        )
        yield self.w == pt.der(self.flange.phi)
        yield self.v == pt.der(self.psi)
        yield self.flange.tau == pt.der(spin)
        pull = self.R * (pt.der(self.w) * ca.cos(self.psi) + self.w**2 * ca.sin(self.psi))
        yield self.r * (pt.der(self.w) + pt.der(self.v)) + pull == 0

    def energy(self) -> Any:
        both = self.w + self.v
        square = (self.R * self.w) ** 2 + (self.r * both) ** 2 + 2 * self.R * self.r * self.w * both * ca.cos(self.psi)
        return self.J * self.w**2 / 2 + self.m * square / 2


class Absorbed(pt.Component):
    """The pendulum's carrier with a torque."""

    tau: pt.Input = pt.signal_input("N.m", "Torque")
    source: Torque = Torque()
    carrier: Pendulum = Pendulum()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.tau, self.source.tau)
        yield pt.connect(self.source.flange, self.carrier.flange)


class Carried(pt.Component):
    """A pendulum on one of two inertias with a spring between them."""

    carrier: Inertia = Inertia(J=0.05)
    pendulum: CentrifugalPendulum = CentrifugalPendulum(m=1.0, c=0.1, n=1.5, d=0.0)
    spring: Spring = Spring(c=2000.0)
    far: Inertia = Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.carrier.flange_b, self.pendulum.flange, self.spring.flange_a)
        yield pt.connect(self.spring.flange_b, self.far.flange_a)


@pytest.mark.parametrize("w", [0.0, 50.0, 100.0, -200.0, 1000.0])
def test_energies_of_a_pendulum_in_a_body_that_turns(w: float) -> None:
    """M and K in carrier angle, path angle and far angle, with the stiffness m w^2 r R of the centrifugal field; and Rayleigh's changes."""
    r = 0.1 / (1 + 1.5**2)
    M = np.array([[0.05 + 0.01, 0.1 * r, 0.0], [0.1 * r, r**2, 0.0], [0.0, 0.0, 1.0]])
    K = np.array([[2000.0, 0.0, -2000.0], [0.0, w**2 * r * (0.1 - r), 0.0], [-2000.0, 0.0, 2000.0]])
    squares, v = (found[..., -2 if w else -1 :] for found in eigh(K, M))
    carrier, far = 0.05 * squares * v[0] ** 2, squares * v[2] ** 2
    pendulum = squares * (0.1 * v[0] + r * v[1]) ** 2 + K[1, 1] * v[1] ** 2
    exact = np.array([carrier, pendulum, 2000.0 * (v[0] - v[2]) ** 2, far]).T / (2 * squares[:, None])
    plant, turning = pt.compile(Carried()), {"carrier.w": w, "far.w": w}
    found = pt.eigenmodes(plant, at=turning)
    np.testing.assert_allclose(found["frequency"] * 2 * math.pi, np.sqrt(squares), rtol=1e-9)
    np.testing.assert_allclose(
        found["energy"].sel(component=["carrier", "pendulum", "spring", "far"]), exact, atol=1e-9
    )
    for name, value, part, factor in (("carrier.J", 0.05, "carrier", -2), ("spring.c", 2000.0, "spring", 2)):
        ends = [
            pt.eigenmodes(plant, at=turning, parameters={name: value * (1 + e)})["frequency"] ** 2
            for e in (-1e-4, 1e-4)
        ]
        change = (ends[1] - ends[0]) / 2e-4 / found["frequency"] ** 2
        np.testing.assert_allclose(change, factor * found["energy"].sel(component=part), rtol=1e-5, atol=1e-7)


SPEEDS = np.linspace(50.0, 400.0, 8)


def test_a_centrifugal_pendulum_follows_an_order() -> None:
    """Frequency^2 = w^2 R/r (1 + m (R + r)^2/J); a torque of order sqrt(R/r) = 2 leaves the carrier at rest."""
    plant = pt.compile(Absorbed())
    found = pt.campbell(plant, {"carrier.w": SPEEDS})
    order = math.sqrt(0.12 / 0.03 * (1 + 0.8 * 0.15**2 / 0.1))
    np.testing.assert_allclose(found["frequency"].values[:, 0], order * SPEEDS / (2 * math.pi), rtol=1e-9)
    crossings = pt.critical_speeds(found, [1.0, order * 1.0001, order * 0.9999])
    assert crossings.empty
    forced = pt.order_response(
        plant, {"carrier.w": SPEEDS}, {"tau": {2.0: 10.0, 1.0: 10.0}}, ["carrier.w", "carrier.psi"]
    )
    assert (
        abs(forced.sel(signal="carrier.w", order=2.0)).max()
        < 1e-12 * abs(forced.sel(signal="carrier.w", order=1.0)).max()
    )
    swing = 10.0 / (0.8 * 0.03 * 0.15 * (2 * SPEEDS) ** 2)  # of the pendulum, whose torque balances the excitation
    np.testing.assert_allclose(abs(forced.sel(signal="carrier.psi", order=2.0)), swing, rtol=1e-9)


@pytest.mark.parametrize("w", [100.0, -300.0])
def test_energy_of_a_pendulum_contains_the_centrifugal_field(w: float) -> None:
    """Shares from the eigenvector of M = (J + m c^2, m r c; m r c, m r^2), K = diag(0, m r R w^2); -2 E_J is the slope of ln(w_0^2)."""
    plant = pt.compile(Absorbed())
    J, m, R, r = 0.1, 0.8, 0.12, 0.03
    pendulum = m * np.array([[(R + r) ** 2, r * (R + r)], [r * (R + r), r**2]])
    field = np.diag([0.0, m * r * R * w**2])
    squares, vectors = eigh(field, pendulum + np.diag([J, 0.0]))
    carrier = J * vectors[0, 1] ** 2 / 2
    masses = vectors[:, 1] @ (pendulum + field / squares[1]) @ vectors[:, 1] / 2
    line = pt.compile(Split())
    found = pt.eigenmodes(line, at={"carrier.w": w})
    assert found["energy"].sel(component=["extra", "carrier"]).values[0] == pytest.approx(
        [carrier * 0.7, masses + carrier * 0.3], rel=1e-9
    )
    assert found["frequency"].item() == pytest.approx(pt.eigenmodes(plant, at={"carrier.w": w})["frequency"].item())
    by_inertia = [pt.eigenmodes(line, at={"carrier.w": w}, parameters={"extra.J": 0.07 * k}) for k in (0.999, 1.001)]
    slope = math.log(by_inertia[1]["frequency"].item() / by_inertia[0]["frequency"].item()) / 0.001
    assert slope == pytest.approx(-2 * found["energy"].sel(component="extra").item(), rel=1e-5)


class Split(pt.Component):
    """The pendulum's carrier, with 70 % of its inertia in a part of its own."""

    extra: Inertia = Inertia(J=0.07)
    carrier: Pendulum = Pendulum(J=0.03)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.extra.flange_b, self.carrier.flange)


def test_forced_response_against_the_dynamic_stiffness() -> None:
    """(K + s D - w^2 M) phi = T, with an amplitude for each speed, and a phase."""
    speeds = np.linspace(20.0, 300.0, 25)
    amplitude = 50.0 + 0.1 * speeds
    found = pt.order_response(
        CHAIN, {"inertias[0].w": speeds},
        {"inertias[0].flange_a.tau": {2.0: amplitude, 4.0: 7j}, "inertias[3].flange_b.tau": {4.0: 3.0}},
        ["inertias[3].w", "springs[1].tau"],
    )  # fmt: skip
    for order in (2.0, 4.0):
        for k, w in enumerate(order * speeds):
            s = 1j * w
            torque = [amplitude[k] if order == 2.0 else 7j, 0.0, 0.0, 0.0 if order == 2.0 else 3.0]
            phi = np.linalg.solve(stiffness() + s * stiffness((0.02,) * 3) - w**2 * np.diag(J), torque)
            here = found.sel(order=order).isel({"inertias[0].w": k})
            assert here.sel(signal="inertias[3].w").item() == pytest.approx(s * phi[3], rel=1e-9)
            assert here.sel(signal="springs[1].tau").item() == pytest.approx(
                (900.0 + 0.02 * s) * (phi[2] - phi[1]), rel=1e-8
            )
    assert found["units"].values.tolist() == ["rad/s", "N.m"]


def test_critical_speeds() -> None:
    """Orders meet the constant frequencies of a chain at w = 2 pi f/n."""
    diagram = pt.campbell(CHAIN, {"inertias[0].w": np.linspace(10.0, 500.0, 4)}, parameters=FREE)
    table = pt.critical_speeds(diagram, [1.0, 2.0])
    squares = eigh(stiffness(), np.diag(J), eigvals_only=True)[1:]
    wanted = sorted(w / n for w in np.sqrt(squares) for n in (1.0, 2.0) if 10 < w / n < 500)
    assert table["speed"].to_numpy() == pytest.approx(wanted)
    assert table["frequency"].to_numpy() * 2 * math.pi == pytest.approx(table["speed"] * table["order"])


def test_a_shaft_that_turns_backward_has_the_same_critical_speeds() -> None:
    """Frequencies depend on w^2, and so does the absolute forced response; its phase has the other sign."""
    speeds = np.linspace(10.0, 500.0, 4)
    forward, backward = (
        pt.critical_speeds(pt.campbell(CHAIN, {"inertias[0].w": side * speeds}, parameters=FREE), [1.0, 2.0])
        for side in (1.0, -1.0)
    )
    assert len(forward) > 0
    assert -backward["speed"].to_numpy()[::-1] == pytest.approx(forward["speed"].to_numpy())
    assert backward["frequency"].to_numpy()[::-1] == pytest.approx(forward["frequency"].to_numpy())
    torque = {"inertias[0].flange_a.tau": {2.0: 5.0}}
    there, back = (
        pt.order_response(CHAIN, {"inertias[0].w": side * speeds}, torque, ["inertias[3].w"]) for side in (1.0, -1.0)
    )
    np.testing.assert_allclose(back.values, there.values.conj(), rtol=1e-9)


@pytest.mark.parametrize(("values", "sign"), [([500.0, 10.0, 300.0, 100.0, 300.0], 1), ([-500.0, -10.0, -300.0], -1)])
def test_critical_speeds_in_any_order_and_direction(values: list[float], sign: int) -> None:
    """Each of them once, whatever the order of the points, and the same ones in reverse."""
    even = pt.critical_speeds(pt.campbell(CHAIN, {"inertias[0].w": [10.0, 500.0]}), [1.0, 2.0])
    found = pt.critical_speeds(pt.campbell(CHAIN, {"inertias[0].w": values}), [1.0, 2.0])
    assert len(found) == 6
    assert sorted(sign * found["speed"]) == pytest.approx(sorted(even["speed"]))


@pytest.mark.parametrize("mode", [0, 1, 2])
def test_no_amplitude_where_an_undamped_vibration_is_excited(mode: int) -> None:
    """Round-off would decide it; a millionth beside, it is that of the dynamic stiffness."""
    w = math.sqrt(eigh(stiffness(), np.diag(J), eigvals_only=True)[1 + mode])
    excited = {"inertias[0].flange_a.tau": {1.0: 3.0}}
    with pytest.raises(pt.ModelError, match="the order 1 excites an undamped vibration"):
        pt.order_response(CHAIN, {"inertias[0].w": [w]}, excited, ["inertias[3].phi"], parameters=FREE)
    beside = w * (1 + 1e-6)
    found = pt.order_response(CHAIN, {"inertias[0].w": [beside]}, excited, ["inertias[3].phi"], parameters=FREE).item()
    exact = np.linalg.solve(stiffness() - beside**2 * np.diag(J), [3.0, 0.0, 0.0, 0.0])[3]
    assert found == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_loss_factor_is_a_complex_stiffness(side: float) -> None:
    """Viscous damping that falls with the frequency of each order; a vibration that turns backward has the other phase."""
    eta, orders, speeds = (0.17, 0.05, 0.3), (0.5, 2.0), np.array([17.0, 60.0])

    def damping(k: int) -> Callable[[float], float]:
        return lambda f: eta[k] * C[k] / f

    lossy = {f"springs[{k}].d": damping(k) for k in range(3)}
    complex_stiffness = stiffness() + 1j * stiffness(tuple(e * c for e, c in zip(eta, C, strict=True)))
    found = pt.order_response(
        CHAIN,
        {"inertias[0].w": side * speeds},
        {"inertias[0].flange_a.tau": dict.fromkeys(orders, 3.0)},
        ["inertias[3].phi"],
        parameters=lossy,
    )
    for k, order in enumerate(orders):
        for i, speed in enumerate(speeds):
            dynamic = complex_stiffness - (order * speed) ** 2 * np.diag(J)
            exact = np.linalg.solve(dynamic, [3.0, 0.0, 0.0, 0.0])[3]
            assert found.values[i, k, 0] == pytest.approx(exact if side > 0 else exact.conj(), rel=1e-9)


def test_modal_damping_from_loss_factors() -> None:
    """The sum of loss factors times shares of the energy, to first order: that of viscous damping eta c/w at the mode's frequency."""
    eta = (0.002, 0.0005, 0.003)
    modes = pt.eigenmodes(CHAIN, parameters=FREE)
    for k in range(3):
        w = 2 * np.pi * float(modes["frequency"][k])
        viscous = {f"springs[{i}].d": eta[i] * C[i] / w for i in range(3)}
        damping = float(pt.eigenmodes(CHAIN, parameters=viscous)["damping"][k])
        shares = modes["energy"][k].sel(component=[f"springs[{i}]" for i in range(3)])
        assert float(shares.values @ eta) == pytest.approx(damping, rel=1e-4)


def test_functions_of_the_frequency_are_checked() -> None:
    torque = {"inertias[0].flange_a.tau": {2.0: 5.0}}
    for wrong in (lambda f: -f, lambda f: math.nan):
        with pytest.raises(pt.ParameterError, match=r"springs\[0\]\.d"):
            pt.order_response(
                CHAIN, {"inertias[0].w": [10.0]}, torque, ["inertias[3].phi"], parameters={"springs[0].d": wrong}
            )
    over = {"inertias[0].w": [9.0, 0.0]}
    for given in ({}, {"springs[0].d": lambda f: 1 / f}):
        with pytest.raises(pt.ParameterError, match="must be a speed in rad/s, and not 0"):
            pt.order_response(CHAIN, over, torque, ["inertias[3].phi"], parameters=given)


def test_parameters_do_not_vibrate() -> None:
    """The column of a parameter is the effect of another constant: the speed of a mount that moves would be missing at the damper."""
    with pytest.raises(pt.ParameterError, match=r"excitation: grounds\[0\].phi0 is a parameter, which is constant"):
        pt.order_response(Joined(), {"first.w": [8.0]}, {"grounds[0].phi0": {2.0: 1.0}}, ["first.phi"])


class RunUp(pt.Component):
    """An engine that speeds up evenly, with torque of the second order and of a constant frequency, on the chain's first spring."""

    rate: pt.Parameter = pt.parameter("rad/s2", "Acceleration", default=4.0)
    w: pt.Variable = pt.variable("rad/s", "Speed of the engine", start=30.0)
    phi: pt.Variable = pt.variable("rad", "Angle of the engine", start=0.0)
    twist: pt.Variable = pt.variable("rad", "Vibration", start=0.0)
    v: pt.Variable = pt.variable("rad/s", "Its speed", start=0.0)
    tau: pt.Variable = pt.variable("N.m", "Torque")

    def equations(self) -> pt.Equations:
        yield pt.der(self.w) == self.rate
        yield pt.der(self.phi) == self.w
        yield self.tau == 5.0 + 3.0 * ca.cos(2.0 * self.phi + 0.3) + 2.0 * ca.cos(2 * math.pi * 25.0 * pt.time)
        yield pt.der(self.twist) == self.v
        yield pt.der(self.v) == self.tau - 20.0 * self.v - 150.0**2 * self.twist


@pytest.fixture(scope="module")
def run_up() -> pt.Result[RunUp]:
    return pt.simulate(RunUp(), 20.0, rtol=1e-8)


@pytest.mark.parametrize("shaft", ["phi", "w", lambda m: -m.w])
def test_orders_of_a_run_up(run_up: pt.Result[RunUp], shaft: Any) -> None:
    """The torque's orders are exact; the constant frequency crosses the map; the vibration is the forced response, |Y| = 3/|Z|."""
    found = pt.order_map(run_up, "tau", shaft, orders=6, revolutions=8)
    np.testing.assert_allclose(found.sel(order=0.0), 5.0, atol=2e-2)
    away = np.abs(2 * math.pi * 25.0 / found["speed"].values - 2.0) > 0.5
    np.testing.assert_allclose(found.sel(order=2.0)[away], 3.0, atol=2e-2)
    np.testing.assert_allclose(found["speed"], 30.0 + 4.0 * found["time"], rtol=2e-3)
    late = (
        found.isel(time=-1)
        .where(abs(found["order"] - 2.0) > 0.5, drop=True)
        .where(lambda m: m["order"] > 0.3, drop=True)
    )
    assert float(late["order"][int(np.argmax(late.values))]) == pytest.approx(
        2 * math.pi * 25.0 / float(late["speed"]), abs=0.125
    )
    vibration = pt.order_map(run_up, lambda m: 1000.0 * m.twist, shaft, orders=6).sel(order=2.0)
    s = 2j * vibration["speed"].values
    exact = 3000.0 / np.abs(s**2 + 20.0 * s + 150.0**2)
    np.testing.assert_allclose(vibration.values[away], exact[away], rtol=0.03)


class Irregular(pt.Component):
    """A shaft whose speed fluctuates with the order 12, and a torque with the orders 1/2 and 2 of its angle."""

    turned: pt.Variable = pt.variable("rad", "Mean angle", start=0.0)
    mean: pt.Variable = pt.variable("rad/s", "Mean speed", start=20.0)
    phi: pt.Variable = pt.variable("rad", "Angle")
    w: pt.Variable = pt.variable("rad/s", "Speed")
    tau: pt.Variable = pt.variable("N.m", "Torque")

    def equations(self) -> pt.Equations:
        yield pt.der(self.mean) == 5.0
        yield pt.der(self.turned) == self.mean
        yield self.phi == self.turned + 0.1 / 12 * ca.sin(12 * self.turned)
        yield self.w == pt.der(self.phi)
        yield self.tau == 10 + 3 * ca.cos(2 * self.phi) + ca.cos(self.phi / 2)


@pytest.mark.parametrize("shaft", ["phi", "w"])
def test_orders_of_an_irregular_shaft(shaft: str) -> None:
    """Whichever orders are asked for, their amplitudes are exact although the shaft has higher ones."""
    found = pt.order_map(pt.simulate(Irregular(), 10.0, rtol=1e-9), "tau", shaft, orders=2)
    np.testing.assert_allclose(found.sel(order=2.0), 3.0, rtol=2e-4)
    np.testing.assert_allclose(found.sel(order=0.5), 1.0, rtol=2e-4)
    assert float(found.sel(order=[1.0, 1.5]).max()) < 3e-4


class Half(pt.Component):
    """A shaft that turns evenly, with a mean torque and one of the order 1/2."""

    phi: pt.Variable = pt.variable("rad", "Angle", start=0.0)
    tau: pt.Variable = pt.variable("N.m", "Torque")

    def equations(self) -> pt.Equations:
        yield pt.der(self.phi) == 100.0
        yield self.tau == -20.0 + 0.5 * ca.sin(0.5 * self.phi + 0.2)


@pytest.mark.parametrize("revolutions", [2, 4, 8])
def test_the_mean_does_not_hide_the_lowest_order(revolutions: int) -> None:
    """Half an order is the first line of a block of two revolutions; the mean is forty times as large."""
    found = pt.order_map(pt.simulate(Half(), 1.0, rtol=1e-8), "tau", "phi", orders=2, revolutions=revolutions)
    np.testing.assert_allclose(found.sel(order=0.5), 0.5, rtol=1e-5)
    np.testing.assert_allclose(found.sel(order=0.0), 20.0, rtol=0.02)


def test_bad_input(run_up: pt.Result[RunUp]) -> None:
    with pytest.raises(pt.ParameterError, match=r"tau is in N\.m; give an angle in rad or a speed in rad/s"):
        pt.order_map(run_up, "tau", "tau")
    with pytest.raises(pt.ParameterError, match=r"the shaft stands still or reverses at t = 0.0\d* s"):
        pt.order_map(run_up, "tau", "v")
    with pytest.raises(pt.ParameterError, match="fewer than the 8 of a block"):
        pt.order_map(run_up, "tau", "w", span=(0.0, 0.5))
    with pytest.raises(pt.ParameterError, match=r"over: the model has no signal spring.c|no signal spring"):
        pt.campbell(CHAIN, {"spring.c": [1.0]})
    with pytest.raises(pt.ParameterError, match="must be a speed in rad/s, and not 0"):
        pt.order_response(CHAIN, {"springs[0].c": [1.0]}, {"inertias[0].flange_a.tau": {1.0: 1.0}}, ["inertias[0].w"])
    with pytest.raises(pt.ParameterError, match="the order -1 is not positive"):
        pt.order_response(CHAIN, {"inertias[0].w": [1.0]}, {"inertias[0].flange_a.tau": {-1.0: 1.0}}, ["inertias[0].w"])
    with pytest.raises(pt.ParameterError, match="is not a finite number or one for each speed"):
        pt.order_response(
            CHAIN, {"inertias[0].w": [1.0]}, {"inertias[0].flange_a.tau": {1.0: [1.0, 2.0]}}, ["inertias[0].w"]
        )
    with pytest.raises(pt.ParameterError, match="the order 0 is not positive"):
        pt.critical_speeds(pt.campbell(CHAIN, {"inertias[0].w": [1.0]}), [0.0])
    with pytest.raises(pt.ParameterError, match="orders: the order -2 is not positive"):
        pt.critical_speeds(pt.campbell(CHAIN, {"inertias[0].w": [1.0]}), [1.0, -2.0])
    with pytest.raises(pt.ParameterError, match="runs from -1 to 2 rad/s; make a diagram for each direction"):
        pt.critical_speeds(pt.campbell(CHAIN, {"inertias[0].w": [2.0, -1.0]}), [1.0])
    with pytest.raises(pt.ParameterError, match="not over a speed"):
        pt.critical_speeds(pt.campbell(CHAIN, {"springs[0].c": [1.0]}), [1.0])
