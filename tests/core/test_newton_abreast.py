"""Newton's method as machine code against that in numpy and against the equations themselves, on random systems."""

from __future__ import annotations

import shutil
from typing import Any

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray

from powertrain.numerics.elimination import Pattern
from powertrain.numerics.newton import newton, relative
from powertrain.numerics.newton_abreast import NewtonAbreast

pytestmark = pytest.mark.skipif(not (shutil.which("cc") or shutil.which("gcc")), reason="no C compiler on this machine")
Array = NDArray[np.float64]


class Systems:
    """P (A o s) z + sin(B z)/8 = b: sparse matrices with rows in any order, s and b given for each system; ``own`` as in the method."""

    def __init__(self, n: int, own: int, rng: np.random.Generator) -> None:
        self.own = own
        A = np.where(rng.random((n, n)) < 0.4, rng.normal(size=(n, n)), 0.0) + np.diag(rng.uniform(3.0, 5.0, n))
        B = np.where(rng.random((n, n)) < 0.3, rng.normal(size=(n, n)), 0.0)
        A = A[rng.permutation(n)] * 10.0 ** rng.uniform(-12, 12, (n, 1))
        z, b, s = ca.SX.sym("z", n), ca.SX.sym("b", n), ca.SX.sym("s")
        value = ca.mtimes(ca.DM(A * (np.abs(A) > 0)), z) * s + np.abs(A).max(axis=1) * ca.sin(ca.DM(B) @ z) / 8 - b
        matrix = ca.jacobian(value, z)
        self.pattern = Pattern(matrix.sparsity())
        outputs = [*(matrix.nz[k] for k in range(matrix.nnz())), *ca.vertsplit(value)]
        self.function = ca.Function("f", [ca.vertcat(b, s), z], [ca.vertcat(*outputs)])
        self.method = NewtonAbreast(
            [*ca.vertsplit(b), s], ca.vertsplit(z), ca.SX.sym("c", 0), self.pattern, outputs, own
        )
        self.scale = np.abs(A).max(axis=1)

    def here(self, given: Array, z: Array) -> tuple[Array, Array]:
        found = np.array(self.function(given.T, z.T)).T
        size = self.pattern.rows.size
        return found[:, :size], found[:, size:]

    def sizes(self, z: Array) -> Array:
        size = relative(z)
        size[:, self.own :] = size[:, self.own :].max(axis=1, keepdims=True, initial=1.0)
        return size

    def in_numpy(self, given: Array, z: Array, **options: Any) -> tuple[Array, NDArray[np.bool_]]:
        return newton(
            lambda which, z: self.here(given[which], z), z, halvings=0, sizes=self.sizes,
            factors=self.pattern.solver, **options,
        )  # fmt: skip

    def in_c(self, given: Array, z: Array, **options: Any) -> tuple[Array, NDArray[np.bool_]]:
        return self.method(list(given.T.copy()), z, np.zeros(0), **options)


@pytest.mark.parametrize("seed", range(12))
def test_random_systems(seed: int) -> None:
    """The same iterates after any number of steps, and solutions of the equations."""
    rng = np.random.default_rng(seed)
    n = 1 + seed % 9
    systems = Systems(n, int(rng.integers(0, n + 1)), rng)
    for count in (1, 3, 4, 9, 700):
        given = np.column_stack([systems.scale * rng.normal(size=(count, n)), 10.0 ** rng.uniform(-0.3, 0.3, count)])
        z = rng.normal(size=(count, n))
        for most in (1, 2, 30):
            found, fine = systems.in_c(given, z, still=1e-10, most=most)
            expected, known = systems.in_numpy(given, z, still=1e-10, most=most)
            np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)
            assert (fine == known).mean() > 0.99  # the last step may be as large as its limit
        assert fine.mean() > 0.9
        order = rng.permutation(count)
        np.testing.assert_array_equal(systems.in_c(given[order], z[order], still=1e-10, most=30)[0], found[order])
        _, value = systems.here(given, found)
        assert np.abs(value[fine] / systems.scale).max() < 1e-11


def test_systems_without_a_solution_do_not_converge() -> None:
    """Among others that do: a singular matrix, a value that is not a number, and an iteration that never ends."""
    x, a, c = ca.SX.sym("x"), ca.SX.sym("a"), ca.SX.sym("c")
    value = ca.if_else(a == 0, 0 * x + 1, ca.if_else(a == 1, x**2 + c, x - a))
    slope = ca.jacobian(value, x)
    method = NewtonAbreast([a], [x], c, Pattern(slope.sparsity()), [slope.nz[0], value], 1)
    given = np.array([5.0, 0.0, 1.0, np.nan, 7.0])
    found, fine = method([given], np.full((5, 1), 0.3), np.ones(1), still=1e-10, most=20)
    assert fine.tolist() == [True, False, False, False, True]
    assert found[fine, 0].tolist() == [5.0, 7.0]
    assert method([given], np.full((5, 1), 0.3), -np.ones(1), still=1e-10, most=20)[1].tolist()[2]


@pytest.mark.parametrize(
    ("own", "first", "step", "small"),
    [
        (2, (1.0, 1e6), (0.9e-8, 0.9e-2), True),
        (2, (1.0, 1e6), (1.1 * 2e-8, 0.9e-2), False),
        (1, (1e6, 1.0), (0.9e-2, 1.1 * 2e-8), False),
        (1, (1.0, 1e6), (1.1 * 2e-8, 0.9e-2), False),
        (1, (1.0, 1e6), (0.9 * 2e-8, 0.9e-2), True),
        (0, (1.0, 1e6), (0.9e-2, 0.9e-2), True),
        (0, (1.0, 1e6), (0.9e-2, 1.1e-2), False),
    ],
)
def test_steps_end_when_they_are_small(own: int, first: Any, step: Any, small: bool) -> None:
    """Beside each of the first ``own`` unknowns, and beside the largest of the others."""
    z, b = [ca.SX.sym("x"), ca.SX.sym("y")], [ca.SX.sym("b"), ca.SX.sym("d")]
    value = ca.vertcat(*z) - ca.vertcat(*b)
    pattern = Pattern(ca.jacobian(value, ca.vertcat(*z)).sparsity())
    method = NewtonAbreast(b, z, ca.SX.sym("c", 0), pattern, [ca.SX(1), ca.SX(1), *ca.vertsplit(value)], own)
    given = [np.array([x + dx]) for x, dx in zip(first, step, strict=True)]
    fine = method(given, np.array([first], float), np.zeros(0), still=1e-8, most=1)[1]
    assert fine.tolist() == [small]


def test_the_scale_of_a_row_does_not_matter() -> None:
    """10 x + 1e17 y = 1e17 + 10 and x + y = 2: with the larger of 10 and 1 as the pivot, x would be lost."""
    z = [ca.SX.sym("x"), ca.SX.sym("y")]
    value = ca.vertcat(10 * z[0] + 1e17 * z[1] - 1e17 - 10, z[0] + z[1] - 2)
    matrix = ca.jacobian(value, ca.vertcat(*z))
    outputs = [*(matrix.nz[k] for k in range(4)), *ca.vertsplit(value)]
    method = NewtonAbreast([], z, ca.SX.sym("c", 0), Pattern(matrix.sparsity()), outputs, 2)
    found, _ = method([], np.zeros((5, 2)), np.zeros(0), still=1e-10, most=1)
    np.testing.assert_allclose(found, 1.0, rtol=1e-9)
