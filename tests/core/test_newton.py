"""Damped Newton steps for many systems at once, against roots that are known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from powertrain.numerics.newton import newton, solved

Matrix = np.ndarray[Any, Any]
RNG = np.random.default_rng


def diagonal(function: Any, slope: Any) -> Any:
    """Equations f(z) = 0 for every unknown of every system, and a list of the systems that are asked for."""
    asked: list[list[int]] = []

    def equations(which: Matrix, z: Matrix) -> tuple[Matrix, Matrix]:
        asked.append(which.tolist())
        return slope(z)[:, :, None] * np.eye(z.shape[1]), function(z)

    return equations, asked


ARCTAN = (np.arctan, lambda z: 1.0 / (1.0 + z**2))


def test_many_small_systems() -> None:
    """Against numpy one by one, of rows that differ by many orders; a singular one gets the shortest solution, one without values nan."""
    matrices, right = RNG(0).normal(size=(6, 3, 3)), RNG(1).normal(size=(6, 3))
    matrices[1] *= np.array([[1e-9], [1.0], [1e9]])
    matrices[2, 2], right[2, 2] = matrices[2, 1], right[2, 1]
    matrices[3, 0, 0], matrices[5, 2, 1] = np.nan, np.inf
    before = matrices.copy()
    found = solved(matrices, right)
    for k in (0, 1, 4):
        np.testing.assert_allclose(found[k], np.linalg.solve(matrices[k], right[k]), rtol=1e-9)
    np.testing.assert_allclose(matrices[2] @ found[2], right[2], rtol=1e-9)
    assert np.linalg.norm(found[2]) <= np.linalg.norm(np.linalg.pinv(matrices[2]) @ right[2]) * 10
    assert np.isnan(found[[3, 5]]).all()
    np.testing.assert_array_equal(matrices, before)


@pytest.mark.parametrize("singular", [False, True])
def test_a_right_hand_side_without_a_value_leaves_the_others(singular: bool) -> None:
    """Also where a singular matrix sends all systems to be solved one by one."""
    matrices, right = RNG(1).normal(size=(4, 3, 3)), RNG(2).normal(size=(4, 3, 2))
    if singular:
        matrices[3, 0] = matrices[3, 1]
    matrices[2, 0, 0], right[1, 2, 0] = np.nan, np.inf
    found = solved(matrices, right)
    np.testing.assert_allclose(matrices[0] @ found[0], right[0], rtol=1e-9)
    np.testing.assert_allclose(matrices[1] @ found[1, :, 1], right[1, :, 1], rtol=1e-9)
    assert np.isnan(found[1, :, 0]).all()
    assert np.isnan(found[2]).all()


def test_an_equation_without_unknowns_gives_the_shortest_solution() -> None:
    """A row of zeros, beside a regular system."""
    matrices = np.array([[[3.0, 4.0], [0.0, 0.0]], [[2.0, 0.0], [0.0, 4.0]]])
    found = solved(matrices, np.array([[25.0, 0.0], [1.0, 1.0]]))
    np.testing.assert_allclose(found, [[3.0, 4.0], [0.5, 0.25]], rtol=1e-12)


def test_large_rows_are_no_better_pivots() -> None:
    """x + 1e20 y = 1e20 and x + y = 2: unless rows count alike, x is lost."""
    found = solved(np.array([[[1.0, 1e20], [1.0, 1.0]]]), np.array([[1e20, 2.0]]))
    np.testing.assert_allclose(found, [[1.0, 1.0]])


@pytest.mark.parametrize("start", [0.5, 3.0, -40.0, 1e4])
def test_full_steps_go_astray_where_halved_ones_arrive(start: float) -> None:
    """Full steps on arctan diverge from beyond 1.39."""
    equations, _ = diagonal(*ARCTAN)
    z, fine = newton(equations, np.array([[start]]), still=1e-10, most=60)
    assert fine[0]
    assert z[0, 0] == pytest.approx(0.0, abs=1e-12)
    z, fine = newton(equations, np.array([[start]]), still=1e-10, most=6, halvings=0)
    assert fine[0] == (abs(start) < 1.39)


def test_systems_do_not_see_each_other() -> None:
    """Each ends where it would alone, and is not asked for once it has."""
    starts = np.array([[0.1, 2.0], [0.0, 0.0], [-30.0, 9.0], [np.nan, 1.0]])
    equations, asked = diagonal(*ARCTAN)
    z, fine = newton(equations, starts, still=1e-10, most=60)
    assert fine.tolist() == [True, True, True, False]
    for k in range(3):
        alone, _ = newton(diagonal(*ARCTAN)[0], starts[[k]], still=1e-10, most=60)
        np.testing.assert_array_equal(z[k], alone[0])
    assert asked[0] == [0, 1, 2]
    assert asked[-1] == [2]
    assert np.isnan(starts[3, 0])


@pytest.mark.parametrize("together", [1, 16])
def test_systems_of_different_sizes_do_not_see_each_other(together: int) -> None:
    """z = 1e9, whose first step is halved, beside a double root at z = 1, which is found in steps that 1e9 would call small."""
    roots, starts = np.array([[1e9], [1.0]]), np.array([[1e9 + 3.0], [3.0]])

    def equations(which: Matrix, z: Matrix) -> tuple[Matrix, Matrix]:
        d, first = z - roots[which], which[:, None] == 0
        slope = np.where(first, 1.0 / (1.0 + d**2), 2.0 * d)
        return slope[:, :, None], np.where(first, np.arctan(d), d**2)

    z, fine = newton(equations, starts, still=1e-8, most=60, together=together)
    assert fine.all()
    np.testing.assert_allclose(z, roots, rtol=1e-7)


def test_units_of_the_equations_make_no_difference() -> None:
    """Multiplied by a matrix with entries from 1e-9 to 1e9: the same iterates but for round-off, and as many."""
    mixed = RNG(2).normal(size=(4, 4)) * 10.0 ** np.linspace(-9, 9, 4)[:, None]
    plain, asked = diagonal(*ARCTAN)
    ends, counts = [], []
    for scale in (np.eye(4), mixed):
        asked.clear()

        def equations(which: Matrix, z: Matrix, scale: Matrix = scale) -> tuple[Matrix, Matrix]:
            matrix, value = plain(which, z)
            return scale @ matrix, value @ scale.T

        ends.append(newton(equations, np.array([[3.0, -5.0, 0.2, 50.0]]), still=1e-8, most=60)[0])
        counts.append(len(asked))
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-7)
    assert counts[0] == counts[1]


def test_the_last_step_is_taken() -> None:
    """One that is small enough ends the search at an error of its square."""
    equations, asked = diagonal(lambda z: z**2 - 2.0, lambda z: 2.0 * z)
    z, fine = newton(equations, np.array([[np.sqrt(2.0) + 1e-6]]), still=1e-5, most=1)
    assert fine[0]
    assert abs(z[0, 0] - np.sqrt(2.0)) < 1e-12
    assert len(asked) == 1


@pytest.mark.parametrize("halvings", [0, 16])
def test_steps_are_as_many_as_allowed(halvings: int) -> None:
    """(z - 1)^2 halves its error with every step."""
    equations, _ = diagonal(lambda z: (z - 1.0) ** 2, lambda z: 2.0 * (z - 1.0))
    z, fine = newton(equations, np.array([[2.0]]), still=1e-10, most=7, halvings=halvings)
    assert not fine[0]
    assert z[0, 0] == 1.0 + 2.0**-7


def test_sizes_say_what_is_small() -> None:
    """An unknown that counts in thousands is found sooner."""
    equations, asked = diagonal(lambda z: (z - 1.0) ** 2, lambda z: 2.0 * (z - 1.0))
    newton(equations, np.array([[2.0]]), still=1e-6, most=50)
    usual = len(asked)
    newton(equations, np.array([[2.0]]), still=1e-6, most=50, sizes=lambda z: np.full(z.shape, 1e3))
    assert len(asked) - usual == usual - 9  # 2^9 = 512 less its own size of two


def test_steps_without_values() -> None:
    """sqrt(z) + 1 has no root: full steps leave nan, halved ones the last point with a value."""
    with np.errstate(invalid="ignore", divide="ignore"):
        equations, _ = diagonal(lambda z: np.sqrt(z) + 1.0, lambda z: 0.5 / np.sqrt(z))
        full, fine = newton(equations, np.array([[1.0]]), still=1e-10, most=9, halvings=0)
        halved, other = newton(equations, np.array([[1.0]]), still=1e-10, most=9)
    assert not fine[0]
    assert not other[0]
    assert np.isnan(full[0, 0])
    assert halved[0, 0] >= 0.0


def test_no_step_leads_back() -> None:
    """A saturation: tanh(z) = 0.5 from far beyond, where the slope all but vanishes."""
    equations, _ = diagonal(lambda z: np.tanh(z) - 0.5 + 1e-6 * z, lambda z: 1.0 - np.tanh(z) ** 2 + 1e-6)
    z, fine = newton(equations, np.array([[8.0], [-8.0]]), still=1e-10, most=60)
    assert fine.all()
    np.testing.assert_allclose(z, np.arctanh(0.5), atol=1e-5)


@pytest.mark.parametrize("together", [1, 64])
def test_one_system_whose_matrix_is_singular(together: int) -> None:
    """ln x = ln 3, twice, for x and y: the shortest step, halved where the logarithm has no value."""

    def equations(_: Matrix, z: Matrix) -> tuple[Matrix, Matrix]:
        with np.errstate(invalid="ignore"):
            value = np.log(z[:, 0]) - np.log(3.0)
        matrix = np.zeros((len(z), 2, 2))
        matrix[:, 0, 0] = matrix[:, 1, 0] = 1.0 / z[:, 0]
        return matrix, np.stack([value, value], axis=1)

    z, fine = newton(equations, np.array([[20.0, 1.0]]), still=1e-12, most=60, together=together)
    assert fine.all()
    np.testing.assert_allclose(z, [[3.0, 1.0]], rtol=1e-10)


def test_a_step_that_makes_the_next_one_longer_is_halved() -> None:
    """From 0 the full step on 1 - z + 2 z^2 - z^4/2 leads to 1, where the next one with the same slope is half as long again; so does
    half of it, to 31/32 as long, which is more than 3/4. A quarter leads to 0.873 < 7/8 of the first."""

    def bump(z: Matrix) -> Matrix:
        return np.asarray(-(1 - z + 2 * z**2 - 0.5 * z**4))

    equations, _ = diagonal(bump, lambda z: 1 - 4 * z + 2 * z**3)
    z, _ = newton(equations, np.array([[0.0]]), still=1e-10, most=1)
    assert z[0, 0] == 0.25


@pytest.mark.parametrize(("half", "quarter"), [(-0.6, 0.5), (0.8, 0.85)])
def test_a_step_that_helps_too_little_or_leads_back_is_halved(half: float, quarter: float) -> None:
    """The half step leaves 0.6 of the function with the other sign, or more than 3/4 of it; a quarter less than 7/8."""

    def beyond(z: Matrix) -> Matrix:
        return np.interp(z, [0.0, 0.25, 0.5, 1.0], [1.0, quarter, half, -2.0])

    equations, _ = diagonal(beyond, lambda z: np.full_like(z, -1.0))
    z, _ = newton(equations, np.array([[0.0]]), still=1e-10, most=1)
    assert z[0, 0] == 0.25


def test_steps_are_compared_by_one_matrix() -> None:
    """0.4 of the function is left, with a tenth of its slope: by the slope there the next step would be four times as long."""
    equations, _ = diagonal(lambda z: np.interp(z, [0.0, 1.0], [1.0, 0.4]), lambda z: np.where(z < 0.5, -1.0, -0.1))
    z, _ = newton(equations, np.zeros((2, 1)), still=1e-10, most=1)
    np.testing.assert_array_equal(z, 1.0)


@pytest.mark.parametrize("together", [1, 64])
@pytest.mark.parametrize("halvings", [1, 2, 3])
def test_steps_are_halved_as_often_as_allowed(halvings: int, together: int) -> None:
    """Only an eighth of the step has an equation."""
    equations, _ = diagonal(lambda z: np.where(z < 0.2, 1.0 - z, np.nan), lambda z: np.full_like(z, -1.0))
    z, _ = newton(equations, np.array([[0.0]]), still=1e-10, most=1, halvings=halvings, together=together)
    assert z[0, 0] == (0.125 if halvings == 3 else 0.0)


@pytest.mark.parametrize("halvings", [0, 16])
def test_a_solved_system_needs_no_slope(halvings: int) -> None:
    """The cube root of z at zero, alone and beside another system."""
    equations, _ = diagonal(np.cbrt, lambda z: np.where(z == 0.0, np.inf, 1.0))
    for starts in ([[0.0]], [[0.0], [1e-9]]):
        z, fine = newton(equations, np.array(starts), still=1e-2, most=9, halvings=halvings)
        assert fine[0]
        assert z[0, 0] == 0.0


@pytest.mark.parametrize(("halvings", "calls"), [(0, 2), (16, 2)])
@pytest.mark.parametrize("together", [1, 64])
def test_equations_that_contradict_each_other_end_at_once(halvings: int, calls: int, together: int) -> None:
    """x + y = 1 and x + (1 + 1e-9) y = 1 + lack, where y gives way to itself, which takes its present value off the right-hand side.

    All steps are the same. Full ones lead as far as they would one by one, damped ones nowhere; a system beside it is solved.
    """
    asked, lack = list[int](), np.array([1.0, 0.0])

    def equations(which: Matrix, z: Matrix) -> tuple[Matrix, Matrix]:
        asked.extend(k for k in which.tolist() if k == 0)
        matrix = np.array([[1.0, 1.0], [1.0, 1.0 + 1e-9]])
        total = z.sum(axis=1) - 1.0
        return np.tile(matrix, (len(z), 1, 1)), np.stack([total, total + lack[which]], axis=1)

    z, fine = newton(equations, np.zeros((2, 2)), still=1e-10, most=20, halvings=halvings, together=together)
    assert fine.tolist() == [False, True]
    assert len(asked) <= max(calls, together)
    np.testing.assert_allclose(z, [[20e9 + 1.0, -20e9] if not halvings else [0.0, 0.0], [1.0, 0.0]], rtol=1e-6)


def test_steps_that_are_equal_by_chance_are_no_drift() -> None:
    """With another slope: from 4 to 2 and to 0, the root."""
    equations, asked = diagonal(lambda z: np.where(z > 3.0, 4.0, z), lambda z: np.where(z > 3.0, 2.0, 1.0))
    z, fine = newton(equations, np.array([[4.0]]), still=1e-10, most=20, halvings=0)
    assert (z[0, 0], bool(fine[0]), len(asked)) == (0.0, True, 3)
