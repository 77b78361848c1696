from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest

from powertrain.language.symbols import Symbol
from powertrain.numerics.replay import row_forms


def test_a_choice_by_what_is_the_same_along_a_row_stays_affine() -> None:
    x, c, ends = Symbol.sym("x"), Symbol.sym("c"), Symbol.sym("ends", 2)
    chosen = ca.if_else(ca.fabs(c) <= 1, 2 * x + c, 3 - x)
    forms = row_forms(x, ends, [c, ends[0], ends[1]], [chosen], [chosen + 10], [])
    assert forms is not None
    form = forms.outputs[0]
    assert form.a is not None
    assert form.b is not None
    affine = ca.Function("affine", [c], [form.a, form.b])
    assert np.array(affine(0.5)).ravel().tolist() == [0.5, 2.0]
    assert np.array(affine(4.0)).ravel().tolist() == [3.0, -1.0]


def test_a_choice_by_the_row_itself_is_not_affine() -> None:
    x, ends = Symbol.sym("x"), Symbol.sym("ends", 2)
    assert row_forms(x, ends, [ends[0], ends[1]], [ca.if_else(x > 1, x, 2 * x)], [], []) is None


@pytest.mark.parametrize(
    ("expression", "ahead", "behind"),
    [
        (lambda a, b: a / b, 1.5, 1.5),
        (lambda a, b: a > b, 1.0, 0.0),
        (lambda a, b: a == b, 0.0, 0.0),
        (lambda a, b: ca.sign(a), 1.0, -1.0),
        (lambda a, b: ca.if_else(a == 0, 2.0, 3.0), 3.0, 3.0),
        (lambda a, b: ca.fabs(a) / b, 1.5, -1.5),
        (lambda a, b: ca.fmin(a, -b) / b, -1.0, 1.5),
        (lambda a, b: ca.fmax(a, 0) / b, 1.5, 0.0),
    ],
)
def test_multiples_are_known_where_the_row_does_not_pass_zero(
    expression: Callable[[Symbol, Symbol], Symbol], ahead: float, behind: float
) -> None:
    """Of 6 x and 4 x, on rows ahead of x = 0 and behind it."""
    x, c, d, ends = Symbol.sym("x"), Symbol.sym("c"), Symbol.sym("d"), Symbol.sym("ends", 2)
    forms = row_forms(x, ends, [c, d, ends[0], ends[1]], [expression(c * x, d * x)], [], [])
    assert forms is not None
    (form,) = forms.outputs
    assert form.constant
    assert form.a is not None
    found = ca.Function("found", [c, d, ends], [form.a, forms.fits])
    for row, value in ([1.0, 2.0], ahead), ([-2.0, -1.0], behind):
        assert tuple(map(float, found(6.0, 4.0, row))) == (value, 1.0)
    assert [float(found(6.0, 4.0, row)[1]) for row in ([-1.0, 2.0], [0.0, 1.0])] == [0.0, 0.0]


def random_expression(rng: Any, leaves: list[Symbol], depth: int) -> Symbol:
    """Affine in the row's x as often as not."""
    if depth == 0:
        return leaves[rng.integers(len(leaves))] if rng.random() < 0.8 else Symbol(float(rng.integers(-2, 3)))
    a, b = (random_expression(rng, leaves, depth - 1) for _ in range(2))
    chosen = [ca.if_else(condition, a, b) for condition in (leaves[0], leaves[1] > 0)]
    signs = [ca.fabs(a), ca.fmin(a, b), ca.fmax(a, b), a < b, a <= b, a == b, a != b, ca.sign(a)]
    made = [a + b, a - b, -a, 2 * a, a * b, a / (b + 0.5), *chosen, *signs]
    weights = np.array([4, 4, 2, 2, 2, 1, 1, 2, *[1] * len(signs)])
    return made[int(rng.choice(len(made), p=weights / weights.sum()))]


@pytest.mark.parametrize("seed", range(120))
def test_random_rows(seed: int) -> None:
    """Where forms fit, all margins hold and some margin of every rival group fails; outputs are those of the expressions.

    Rows on which everything is affine fit if the margins hold at all points, and one margin of every rival group fails at all points.
    Small integers: many values are exactly zero, which holds.
    """
    rng = np.random.default_rng(seed)
    x, c, d, ends = Symbol.sym("x"), Symbol.sym("c"), Symbol.sym("d"), Symbol.sym("ends", 2)
    sizes = [3, int(rng.integers(0, 4)), *[2] * int(rng.integers(0, 3))]
    given = [[random_expression(rng, [x, c, d], 2) for _ in range(n)] for n in sizes]
    forms = row_forms(x, ends, [c, d, ends[0], ends[1]], given[0], given[1], given[2:])
    if forms is None:
        return
    all_affine = row_forms(x, ends, [c, d, ends[0], ends[1]], [e for group in given for e in group], [], []) is not None
    zero = Symbol(0)

    def filled(part: Symbol | None) -> Symbol:
        return zero if part is None else part

    values = [filled(f.a) + filled(f.b) * x for f in forms.outputs]
    found = ca.Function("found", [x, c, d, ends], [ca.vertcat(*values), forms.fits])
    plain = [ca.Function("plain", [x, c, d], [ca.vertcat(*group, zero)]) for group in given]
    for _ in range(25):
        low, *rest = rng.integers(-3, 4, 3).tolist()
        high = low + int(rng.integers(1, 4))
        points = np.arange(low, high + 0.25, 0.5)
        fitted = np.array([float(found(at, *rest, [low, high])[1]) for at in points]) > 0
        wanted, margins, *rivals = (np.array([np.array(f(at, *rest)).ravel()[:-1] for at in points]) for f in plain)
        for k in np.flatnonzero(fitted):
            outputs = np.array(found(points[k], *rest, [low, high])[0]).ravel()
            np.testing.assert_allclose(outputs, wanted[k], rtol=1e-12, atol=1e-12)
            assert (margins[k] >= 0).all()
            assert all((~(rival[k] >= 0)).any() for rival in rivals)  # 0/0 is not a margin that holds
        if all_affine and low * high > 0:
            shown = (margins >= 0).all() and all((rival < 0).all(axis=0).any() for rival in rivals)
            assert fitted.all() == shown
