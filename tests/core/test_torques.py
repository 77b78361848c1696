"""Torques of friction laws against the equations of motion with constraints, solved by numpy, in every combination of modes."""

from __future__ import annotations

from itertools import product
from typing import Any

import casadi as ca
import numpy as np
import pytest

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Constant

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
