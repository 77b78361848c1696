"""Speeds of stuck laws that share states are set to zero by the smallest change of the states."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from models import dae

from powertrain.compiler.hybrid import Friction, HybridDae
from powertrain.modes.projection import project
from powertrain.modes.rules import snapped
from powertrain.numerics.buffers import Memory

Matrix = np.ndarray[Any, Any]


def laws(speeds: Any, n: int, modes: Matrix) -> tuple[HybridDae, Memory]:
    """Friction laws with these speeds, functions of (t, x, p)."""
    t, x, m, p = ca.SX.sym("t"), ca.SX.sym("x", n), ca.SX.sym("m", len(modes)), ca.SX.sym("p", 1)
    zero = ca.SX(0)
    frictions = tuple(
        Friction(f"law{k}", "hand", k, w, zero, zero, zero, ca.SX(1), zero) for k, w in enumerate(speeds(t, x, p))
    )
    model = dae(t, x, m, p, ca.SX.zeros(n), [f"x{i}" for i in range(n)], frictions=frictions)
    memory = Memory(model, 0, 0)
    memory.m[: len(modes)] = modes
    return model, memory


@pytest.mark.parametrize("seed", range(8))
def test_least_change(seed: int) -> None:
    """x - A+ A x for the stuck rows; other laws and the other side stay; repeated rows do no harm."""
    rng = np.random.default_rng(seed)
    n, k = 6, 4
    A = rng.normal(size=(k, n))
    A[3] = A[0] - 2 * A[1]
    modes = np.array([0.0, 0.0, 1.0 if seed % 2 else -1.0, 0.0])
    model, memory = laws(lambda t, x, p: ca.vertsplit(ca.DM(A) @ x), n, modes)
    x = rng.normal(size=n)
    memory.y[0][:], memory.y[1][:] = x, 7.0
    project(model, memory, 0)
    stuck = A[modes == 0]
    np.testing.assert_allclose(memory.y[0], x - np.linalg.pinv(stuck) @ stuck @ x, atol=1e-12)
    assert (memory.y[1] == 7.0).all()


def test_speeds_that_are_not_linear_and_depend_on_time_and_parameters() -> None:
    """Two steps: from 1e-3 off to 1e-10 and less."""
    model, memory = laws(lambda t, x, p: [x[0] * (1 + 0.3 * x[1]) - t * p[0], x[1] ** 2 - 1], 2, np.zeros(2))
    memory.time[0], memory.p[0] = 2.0, 0.65
    memory.y[1][:] = 1.001, 0.999
    project(model, memory, 1)
    np.testing.assert_allclose(memory.y[1], [1.0, 1.0], atol=1e-10)


@pytest.mark.parametrize("kind", ["algebraic", "prescribed"])
def test_laws_whose_speed_is_no_state_are_left_alone(kind: str) -> None:
    model, memory = laws(lambda t, x, p: [x[0], x[1]], 2, np.zeros(2))
    flags: dict[str, Any] = {kind: True}
    model = replace(model, frictions=(model.frictions[0], replace(model.frictions[1], **flags)))
    memory.y[0][:] = 3.0, 4.0
    project(model, memory, 0)
    np.testing.assert_allclose(memory.y[0], [0.0, 4.0], atol=1e-15)


@pytest.mark.parametrize("seed", range(4))
def test_what_a_step_snaps_is_the_same_change_but_for_what_it_reports(seed: int) -> None:
    """``snapped`` sets plain states and goes round the coupled ones; the speed that it leaves is what it says."""
    rng = np.random.default_rng(seed)
    n = 5
    A = rng.normal(size=(2, n))
    A[:, 0] = 0.0
    model, _ = laws(lambda t, x, p: [x[0], *ca.vertsplit(ca.DM(A) @ x)], n, np.zeros(3))
    state, left = snapped(model)
    function = ca.Function("f", [model.x, model.m], [state, left])
    x = rng.normal(size=n)
    found, speed = (np.array(v).ravel() for v in function(x, [0, 0, 0]))
    assert found[0] == 0.0
    assert float(speed[0]) == pytest.approx(np.abs(A @ found).max(), abs=1e-15)
    target = x * np.array([0, 1, 1, 1, 1])
    target -= np.linalg.pinv(A) @ A @ target
    cosine = abs(A[0] @ A[1]) / np.linalg.norm(A[0]) / np.linalg.norm(A[1])
    assert np.linalg.norm(found - target) <= cosine**7 * np.linalg.norm(A @ x) * 3 + 1e-14
    loose, speed = (np.array(v).ravel() for v in function(x, [1, 0, 1]))
    np.testing.assert_allclose(loose, x - A[0] * (A[0] @ x) / (A[0] @ A[0]), atol=1e-12)
    assert float(speed[0]) < 1e-14
