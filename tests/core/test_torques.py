"""Torques of friction laws against the equations of motion with constraints, solved by numpy, in every combination of modes."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any

import casadi as ca
import numpy as np
import pytest

import powertrain as pt
from powertrain.compiler.law_torques import LawTorque
from powertrain.compiler.torques import _replaceable, compliance, solve_torques
from powertrain.components import rotational as rot
from powertrain.components.blocks import Constant
from powertrain.language.laws import FrictionLaw, UnilateralLaw
from powertrain.language.recorder import Place

Matrix = np.ndarray[Any, Any]
CAPACITY = 3.0
MODES = (-1.0, 0.0, 1.0)


class Shafts(pt.Component):
    """Partial: inertias with a torque on each, and clutches that are pressed."""

    shafts: tuple[rot.Inertia, ...]
    drives: tuple[rot.ConstantTorque, ...]
    clutches: tuple[Any, ...]
    one: Constant = Constant(k=1.0)

    def _driven(self) -> pt.Equations:
        for shaft, drive in zip(self.shafts, self.drives, strict=True):
            yield pt.connect(drive.flange, shaft.flange_a)
        yield pt.connect(self.one.y, *(clutch.f_normalized for clutch in self.clutches))


class Series(Shafts):
    """Shafts one behind the other with a clutch between each two."""

    def equations(self) -> pt.Equations:
        yield from self._driven()
        for i, clutch in enumerate(self.clutches):
            yield pt.connect(self.shafts[i].flange_b, clutch.flange_a)
            yield pt.connect(clutch.flange_b, self.shafts[i + 1].flange_a)


class Planetary(Shafts):
    """Sun, carrier and ring of a planetary gear, a clutch between sun and carrier and a brake on the ring."""

    gear: rot.IdealPlanetary = rot.IdealPlanetary(ratio=2.0)

    def equations(self) -> pt.Equations:
        yield from self._driven()
        clutch, brake = self.clutches
        for shaft, port in zip(self.shafts, (self.gear.sun, self.gear.carrier, self.gear.ring), strict=True):
            yield pt.connect(shaft.flange_b, port)
        yield pt.connect(self.shafts[0].flange_a, clutch.flange_a)
        yield pt.connect(self.shafts[1].flange_a, clutch.flange_b)
        yield pt.connect(self.shafts[2].flange_a, brake.flange_a)


def made(kind: type[Shafts], J: Matrix, f: Matrix, clutches: tuple[Any, ...]) -> pt.Plant[Any]:
    shafts = tuple(rot.Inertia(J=float(v)) for v in J)
    return pt.compile(
        kind(shafts=shafts, drives=tuple(rot.ConstantTorque(tau_constant=float(v)) for v in f), clutches=clutches)
    )


def found(plant: pt.Plant[Any], modes: tuple[float, ...], x: Matrix) -> tuple[Matrix, Matrix]:
    """Accelerations of the shafts and torques of the laws, for given modes."""
    compiled = plant.compiled
    dae, m = compiled.dae, compiled.dae.held_start.copy()
    for law, mode in zip(dae.frictions, modes, strict=True):
        m[law.index] = mode
    a = [compiled.signals[f"shafts[{i}].a"].expression for i in range(len(plant.model.shafts))]
    outputs = [ca.vertcat(*a), ca.vertcat(*[law.torque for law in dae.frictions])]
    function = ca.Function("f", [dae.t, dae.x, dae.z, dae.m, dae.p], outputs)
    values = function(0.0, x, [], m, plant.parameter_vector())
    return np.array(values[0]).ravel(), np.array(values[1]).ravel()


def exact(J: Matrix, f: Matrix, G: Matrix, C: Matrix, modes: tuple[float, ...]) -> tuple[Matrix, Matrix]:
    """J a + G' T + C' lambda = f, C a = 0; G a = 0 where a law is stuck, T = +-capacity where it slides."""
    n, k, c = len(J), len(G), len(C)
    stuck = np.array(modes) == 0
    laws = np.hstack([np.where(stuck[:, None], G, 0.0), np.diag(np.where(stuck, 0.0, 1.0)), np.zeros((k, c))])
    matrix = np.vstack([np.hstack([np.diag(J), G.T, C.T]), laws, np.hstack([C, np.zeros((c, k + c))])])
    right = np.concatenate([f, np.where(stuck, 0.0, np.array(modes) * CAPACITY), np.zeros(c)])
    solution = np.linalg.solve(matrix, right)
    return solution[:n], solution[n : n + k]


def clutch() -> rot.Clutch:
    return rot.Clutch(fn_max=CAPACITY, mue_pos=((0.0, 1.0),))


@pytest.mark.parametrize("seed", range(4))
def test_clutches_in_series(seed: int) -> None:
    """Four shafts, three clutches, all 27 combinations, at any state."""
    rng = np.random.default_rng(seed)
    J, f = rng.uniform(0.2, 3.0, 4), rng.normal(size=4) * 5
    plant = made(Series, J, f, (clutch(), clutch(), clutch()))
    G = np.array([[-1.0, 1, 0, 0], [0, -1, 1, 0], [0, 0, -1, 1]])
    for modes in product(MODES, repeat=3):
        x = rng.normal(size=len(plant.compiled.states))
        for value, right in zip(found(plant, modes, x), exact(J, f, G, np.zeros((0, 4)), modes), strict=True):
            np.testing.assert_allclose(value, right, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("seed", range(4))
def test_clutch_and_brake_on_a_planetary(seed: int) -> None:
    """(1 + 2) w_carrier = w_sun + 2 w_ring as a constraint with its multiplier; all nine combinations."""
    rng = np.random.default_rng(seed)
    J, f = rng.uniform(0.2, 3.0, 3), rng.normal(size=3) * 5
    brake = rot.Brake(fn_max=CAPACITY, mue_pos=((0.0, 1.0),))
    plant = made(Planetary, J, f, (clutch(), brake))
    G, C = np.array([[-1.0, 1, 0], [0, 0, 1]]), np.array([[1.0, -3, 2]])
    for modes in product(MODES, repeat=2):
        x = rng.normal(size=len(plant.compiled.states))
        for value, right in zip(found(plant, modes, x), exact(J, f, G, C, modes), strict=True):
            np.testing.assert_allclose(value, right, rtol=1e-10, atol=1e-10)


def test_modes_are_those_of_coulomb() -> None:
    """The modes that a start finds satisfy the conditions of Coulomb friction, and they are the only ones that do."""
    rng = np.random.default_rng(7)
    G = np.array([[-1.0, 1, 0, 0], [0, -1, 1, 0], [0, 0, -1, 1]])
    for _ in range(12):
        J, f = rng.uniform(0.2, 3.0, 4), rng.normal(size=4) * 6
        plant = made(Series, J, f, (clutch(), clutch(), clutch()))
        fits = []
        for modes in product(MODES, repeat=3):
            a, T = exact(J, f, G, np.zeros((0, 4)), modes)
            held = np.array(modes) == 0
            if (np.abs(T[held]) <= CAPACITY).all() and (np.array(modes)[~held] * (G @ a)[~held] > 0).all():
                fits.append(modes)
        _, _, m, _ = plant.initialize()
        assert [tuple(m[law.index] for law in plant.compiled.dae.frictions)] == fits


EPS = 1e-8


def hand_made(
    rng: np.random.Generator, G: Matrix, contacts: int
) -> tuple[list[LawTorque], list[ca.SX], ca.SX, Matrix, Matrix, Matrix]:
    """Laws with rates a - G tau and bounds that are affine in all torques, the last ``contacts`` of them contacts (rate a + G f)."""
    n = len(G)
    tau, mode = [ca.SX.sym(f"tau{i}") for i in range(n)], ca.SX.sym("m", n)
    a, b, slopes = rng.normal(size=n), rng.uniform(1, 2, n), rng.normal(size=(n, n)) * 0.05
    sign = np.where(np.arange(n) < n - contacts, 1.0, -1.0)
    rates = ca.vertsplit(ca.DM(a) - ca.DM(G * sign) @ ca.vertcat(*tau))
    laws = []
    for i in range(n):
        bound = float(b[i]) + ca.dot(ca.DM(slopes[i]), ca.vertcat(*tau))
        law: FrictionLaw | UnilateralLaw
        if sign[i] > 0:
            law = FrictionLaw(ca.SX(0), tau[i], -bound, bound, ca.SX(1), "mode")
        else:
            law = UnilateralLaw(ca.SX(0), tau[i], ca.SX(0), "contact")
        laws.append(LawTorque(Place("law", "hand", 1), law, tau[i], mode[i], rate=rates[i]))
    return laws, tau, mode, a, b, slopes


def eliminated(G: Matrix, a: Matrix, b: Matrix, slopes: Matrix, contacts: int, modes: tuple[float, ...]) -> Matrix:
    """Dense: row + eps G_ii (tau - q) = 0 for laws at rest, twice."""
    n = len(G)
    sign = np.where(np.arange(n) < n - contacts, 1.0, -1.0)
    rows, right, soft = np.zeros((n, n)), np.zeros(n), np.zeros(n)
    for i, mode in enumerate(modes):
        if mode == (0.0 if sign[i] > 0 else 1.0):
            rows[i], right[i], soft[i] = -G[i] * sign, -a[i], -sign[i] * EPS * G[i, i]
        else:
            rows[i, i] = 1.0
            if sign[i] > 0:
                rows[i] -= mode * slopes[i]
                right[i] = mode * b[i]
    matrix = rows + np.diag(soft)
    first = np.linalg.solve(matrix, right)
    return np.linalg.solve(matrix, right + soft * first)


@pytest.mark.parametrize(("n", "rank", "contacts"), [(1, 1, 0), (3, 3, 0), (3, 2, 0), (3, 3, 1), (4, 2, 1)])
def test_all_modes_of_laws_with_bounds_that_lean_on_torques(n: int, rank: int, contacts: int) -> None:
    """Also where laws hold the same motion, and the torques are unique by their compliance."""
    rng = np.random.default_rng(10 * n + rank)
    root = rng.normal(size=(n, rank))
    G = root @ root.T
    laws, _, mode, a, b, slopes = hand_made(rng, G, contacts)
    if rank < n:  # rates that torques can make
        new = G @ rng.normal(size=n)
        laws = [replace(law, rate=law.rate + float(b - a)) for law, a, b in zip(laws, a, new, strict=True)]
        a = new
    solved = solve_torques(laws)
    assert not solved.implicit
    assert not solved.residuals
    function = ca.Function("f", [mode], [ca.vertcat(*solved.tau)])
    for modes in product(*[MODES] * (n - contacts), *[(0.0, 1.0)] * contacts):
        expected = eliminated(G, a, b, slopes, contacts, modes)
        if n == 1 and modes == (0.0,):
            expected = a / G[0]  # alone on its motion a law does not yield
        found = np.array(function(list(modes))).ravel()
        np.testing.assert_allclose(found, expected, atol=1e-5 if rank < n else 1e-10)


def test_stuck_laws_creep_by_round_off_only() -> None:
    """Three laws on one motion: what one step with compliance leaves, 1e-8 of what the torques accelerate, the second takes away."""
    G = np.full((3, 3), 2.0)
    laws, tau, mode, _, _, _ = hand_made(np.random.default_rng(2), G, 0)
    laws = [replace(law, rate=6.0 - 2.0 * ca.sum1(ca.vertcat(*tau))) for law in laws]
    solved = ca.vertcat(*solve_torques(laws).tau)
    found = np.array(ca.Function("f", [mode], [solved])([0, 0, 0])).ravel()
    np.testing.assert_allclose(found, 1.0, atol=1e-7)
    assert abs(6.0 - 2.0 * found.sum()) < 1e-14 * 6.0


def test_laws_that_are_not_linear_in_the_torques_stay_unknowns() -> None:
    """tau0 enters the bound of law 1 squared: its own row is left over, and solves it."""
    tau = [ca.SX.sym("tau0"), ca.SX.sym("tau1")]
    mode = ca.SX.sym("m", 2)
    rates = [3.0 - 2 * tau[0] - tau[1], 1.0 - tau[0] - 2 * tau[1]]
    bounds = [ca.SX(1.0), 1 + 0.1 * tau[0] ** 2]
    laws = [
        LawTorque(
            Place("law", "hand", 1), FrictionLaw(ca.SX(0), tau[i], -bounds[i], bounds[i], ca.SX(1), "mode"), tau[i], mode[i],
            rate=rates[i],
        )
        for i in range(2)
    ]  # fmt: skip
    solved = solve_torques(laws)
    assert solved.implicit == [0]
    residuals = ca.substitute(ca.vertcat(*solved.residuals), tau[1], solved.tau[1])
    function = ca.Function("f", [mode, tau[0]], [ca.vertcat(*solved.tau), residuals])
    for modes, expected in (((0.0, 1.0), None), ((1.0, 1.0), (1.0, 1.1)), ((-1.0, -1.0), (-1.0, -1.1))):
        if expected is None:  # 3 - 2 x - (1 + x^2/10) = 0
            x = -10 + np.sqrt(120.0)
            expected = (x, 1 + 0.1 * x**2)
        torques, left = (np.array(v).ravel() for v in function(list(modes), expected[0]))
        np.testing.assert_allclose(torques, expected, atol=1e-12)
        np.testing.assert_allclose(left, 0.0, atol=1e-9)


def test_laws_that_are_not_linear_share_their_motion_evenly() -> None:
    """Two stuck laws on one motion with the rate 3 - T - T^3/4, T = tau0 + tau1: their equations give each half of T."""
    tau, mode = [ca.SX.sym("tau0"), ca.SX.sym("tau1")], ca.SX.sym("m", 2)
    T = tau[0] + tau[1]
    both = [FrictionLaw(ca.SX(0), one, ca.SX(-9), ca.SX(9), ca.SX(1), "mode") for one in tau]
    rate = 3.0 - T - T**3 / 4
    laws = [LawTorque(Place("law", "hand", 1), law, tau[i], mode[i], rate=rate) for i, law in enumerate(both)]
    solved = solve_torques(laws)
    assert solved.implicit == [0, 1]
    x, residual = ca.vertcat(*tau), ca.vertcat(*solved.residuals)
    newton = ca.Function("newton", [x, mode], [residual, ca.jacobian(residual, x)])
    found = np.array([0.3, 0.1])
    for _ in range(20):
        r, J = newton(found, [0, 0])
        found = found - np.linalg.solve(np.array(J), np.array(r).ravel())
    roots = np.roots([0.25, 0.0, 1.0, -3.0])
    (total,) = roots[np.abs(roots.imag) < 1e-9].real
    np.testing.assert_allclose(found, total / 2, atol=1e-3)


def test_laws_may_all_be_replaced_where_no_slope_is_known() -> None:
    tau = ca.SX.sym("tau")
    law = FrictionLaw(ca.SX(0), tau, ca.SX(-1), ca.SX(1), ca.SX(1), "mode")
    assert _replaceable([LawTorque(Place("", "", 1), law, tau, ca.SX(0), rate=ca.sqrt(ca.SX(-1)) * tau)]) == {0}


@pytest.mark.parametrize("seed", range(20))
def test_laws_that_others_can_replace(seed: int) -> None:
    """Those without which the laws hold as many motions: the ranks of whole numbers, while inertias differ by 1e10."""
    rng = np.random.default_rng(seed)
    directions = rng.integers(-1, 2, (5, 4))
    J, tau = 10.0 ** rng.uniform(-5, 5, 4), [ca.SX.sym(f"tau{i}") for i in range(5)]
    rates = ca.vertsplit(-ca.DM(directions / J @ directions.T) @ ca.vertcat(*tau))
    each = [FrictionLaw(ca.SX(0), one, ca.SX(-1), ca.SX(1), ca.SX(1), "mode") for one in tau]
    laws = [LawTorque(Place("", "", 1), law, tau[i], ca.SX(0), rate=rates[i]) for i, law in enumerate(each)]
    rank = np.linalg.matrix_rank(directions)
    expected = {i for i in range(5) if np.linalg.matrix_rank(np.delete(directions, i, axis=0)) == rank}
    assert _replaceable(laws) == expected


def test_compliance_is_that_of_the_law_itself() -> None:
    """|G_ii| where other laws meet in its motion, none where it moves alone; the size of the terms where they cancel each other."""
    p = ca.SX.sym("p", 2)
    tau = [ca.SX.sym("tau0"), ca.SX.sym("tau1")]
    both, alone = -p[0] * tau[0] - tau[1], -p[0] * tau[0]
    cancelling = (p[0] - p[1]) * tau[0] + tau[1]

    def of(rate: ca.SX, *values: float) -> float:
        law = LawTorque(
            Place("", "", 1), FrictionLaw(rate, tau[0], ca.SX(-1), ca.SX(1), ca.SX(1), ""), tau[0], ca.SX(0), rate=rate
        )
        return float(ca.Function("f", [p], [compliance(law, ca.vertcat(*tau))])(list(values)))

    assert of(both, 3.0, 0.0) == pytest.approx(3.0)
    assert of(alone, 3.0, 0.0) == 0.0
    assert of(tau[1], 1.0, 1.0) == 0.0
    assert of(cancelling, 3.0, 1.0) == pytest.approx(2.0)
    assert of(cancelling, 3.0, 3.0) == pytest.approx(6.0)


@pytest.mark.parametrize(("lower", "upper", "expected"), [(1.0, 3.0, 1.0), (-3.0, -1.0, -1.0), (-1.0, 3.0, 0.0)])
def test_a_law_that_its_torque_cannot_move_takes_the_least_torque(lower: float, upper: float, expected: float) -> None:
    """At rest under a prescribed motion; sliding it takes its bound."""
    tau, mode = ca.SX.sym("tau"), ca.SX.sym("m")
    law = FrictionLaw(ca.SX(0), tau, ca.SX(lower), ca.SX(upper), ca.SX(1), "mode")
    solved = solve_torques([LawTorque(Place("law"), law, tau, mode, rate=ca.SX.sym("given"))])
    function = ca.Function("f", [mode], solved.tau)
    assert [float(function(v)) for v in (-1.0, 0.0, 1.0)] == [lower, expected, upper]


class Creeping(pt.Component):
    """A massless slider behind a lever, w = (1 + sin(3 t)/5) b, and a damper, (2 + cos t) b = 3 sin t - tau; friction of 1 N.m."""

    s: pt.Variable = pt.variable("rad", "Angle", start=0.0)
    w: pt.Variable = pt.variable("rad/s", "Speed")
    b: pt.Variable = pt.variable("rad/s", "Speed of the damper")
    tau: pt.Variable = pt.variable("N.m", "Friction torque")

    def equations(self) -> pt.Equations:
        yield pt.der(self.s) == self.w
        yield self.w == (1 + ca.sin(3 * pt.time) / 5) * self.b
        yield (2 + ca.cos(pt.time)) * self.b == 3 * ca.sin(pt.time) - self.tau
        yield pt.friction(self.w, self.tau, -1.0, 1.0)


def test_a_speed_that_follows_a_torque_at_once_through_others() -> None:
    """It rests while the pull is below 1 N.m; beyond that, the damper carries the rest of it."""
    result = pt.simulate(Creeping(), 6.0)
    t, pull = result.time, 3 * np.sin(result.time)
    rest = np.sign(pull) * np.maximum(np.abs(pull) - 1, 0)
    np.testing.assert_allclose(result["w"], (1 + np.sin(3 * t) / 5) * rest / (2 + np.cos(t)), atol=1e-6)
    np.testing.assert_allclose(result["tau"], np.clip(pull, -1, 1), atol=1e-6)
