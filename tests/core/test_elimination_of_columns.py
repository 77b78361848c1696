"""Many systems of one sparsity at once, against dense linear algebra one by one."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

from powertrain.numerics import elimination
from powertrain.numerics.elimination import Pattern

Matrix = np.ndarray[Any, Any]
COUNT = 600


def systems(mask: Matrix, seed: int = 0) -> tuple[Pattern, Matrix, Matrix]:
    """The pattern of ``mask``, random entries and right sides, a row for each system."""
    rng, pattern = np.random.default_rng(seed), Pattern(ca.sparsify(ca.DM(mask.astype(float))).sparsity())
    return pattern, rng.normal(size=(COUNT, pattern.rows.size)), rng.normal(size=(COUNT, len(mask)))


def backward_error(pattern: Pattern, entries: Matrix, x: Matrix, right: Matrix) -> float:
    """The largest residual, relative to the largest entry of its row and the largest unknown."""
    full = pattern.dense(entries)
    terms = np.abs(full).max(axis=2) * np.abs(x).max(axis=1, keepdims=True) + np.abs(right)
    return float((np.abs(np.einsum("pij,pj->pi", full, x) - right) / terms).max())


@pytest.mark.parametrize("seed", range(8))
def test_random_sparse_systems(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """With zeros, and equations in any unit: pivots differ from system to system."""
    monkeypatch.setattr(elimination, "FEW", 4)
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 9))
    pattern, entries, right = systems(rng.permutation(np.eye(n)) + (rng.random((n, n)) < 0.3) > 0, seed)
    entries[rng.random(entries.shape) < 0.1] = 0.0
    units = 10.0 ** rng.uniform(-8, 8, right.shape)
    entries, right = entries * units[:, pattern.rows], right * units
    full = pattern.dense(entries)
    regular = np.linalg.cond(full / np.maximum(np.abs(full).max(axis=2, keepdims=True), 1e-300)) < 1e12
    found = pattern.solver(entries[regular])(right[regular])
    assert regular.any()
    assert backward_error(pattern, entries[regular], found, right[regular]) < 1e-13
    several = np.stack([right, -2.0 * right, right[:, ::-1]], axis=2)[regular]
    solutions = pattern.solver(entries[regular])(several)
    for k in range(3):
        assert backward_error(pattern, entries[regular], solutions[:, :, k], several[:, :, k]) < 1e-13


def test_a_pivot_is_not_small_beside_its_row() -> None:
    """Eliminated by 1e-17, the first unknown would be lost."""
    pattern, entries, right = systems(np.ones((2, 2)))
    full = np.array([[1e-17, 1.0], [1.0, 1.0]])
    entries[:] = full[pattern.rows, pattern.columns]
    entries[::2] = full[::-1][pattern.rows, pattern.columns]
    expected = np.linalg.solve(pattern.dense(entries), right[..., None])[..., 0]
    np.testing.assert_allclose(pattern.solver(entries)(right), expected, rtol=1e-14)


def test_singular_systems_and_those_without_values_do_not_spoil_others() -> None:
    pattern, entries, right = systems(np.ones((2, 2)))
    entries[0], entries[1, 0], entries[2], entries[3, 0] = 0.0, np.nan, 1.0, np.inf
    found = pattern.solver(entries)(right)
    np.testing.assert_array_equal(found[0], 0.0)
    assert np.isnan(found[[1, 3]]).all()
    np.testing.assert_allclose(found[2], right[2].mean() / 2)
    np.testing.assert_allclose(np.einsum("pij,pj->pi", pattern.dense(entries[4:]), found[4:]), right[4:], atol=1e-11)


def test_products() -> None:
    pattern, entries, vectors = systems(np.array([[1, 0, 1], [0, 0, 1], [1, 1, 1]]) > 0)
    expected = np.einsum("pij,pj->pi", pattern.dense(entries), vectors)
    np.testing.assert_allclose(pattern.product(entries, vectors), expected, rtol=1e-14, atol=1e-14)
