from __future__ import annotations

import casadi as ca
import numpy as np

from powertrain.language.symbols import Symbol
from powertrain.numerics.replay import row_forms


def test_a_choice_by_what_is_the_same_along_a_row_stays_affine() -> None:
    x, c, ends = Symbol.sym("x"), Symbol.sym("c"), Symbol.sym("ends", 2)
    chosen = ca.if_else(ca.fabs(c) <= 1, 2 * x + c, 3 - x)
    forms = row_forms(x, ends, [c, ends[0], ends[1]], [chosen], [chosen + 10], [])
    assert forms.flat
    form = forms.outputs[0]
    assert form.a is not None
    assert form.b is not None
    affine = ca.Function("affine", [c], [form.a, form.b])
    assert np.array(affine(0.5)).ravel().tolist() == [0.5, 2.0]
    assert np.array(affine(4.0)).ravel().tolist() == [3.0, -1.0]


def test_a_choice_by_the_row_itself_is_a_curve() -> None:
    x, ends = Symbol.sym("x"), Symbol.sym("ends", 2)
    assert not row_forms(x, ends, [ends[0], ends[1]], [ca.if_else(x > 0, x, 2 * x)], [], []).flat


def test_a_quotient_of_two_multiples_is_constant_where_the_row_does_not_pass_zero() -> None:
    x, c, d, ends = Symbol.sym("x"), Symbol.sym("c"), Symbol.sym("d"), Symbol.sym("ends", 2)
    forms = row_forms(x, ends, [c, d, ends[0], ends[1]], [(c * x) / (d * x)], [], [])
    (form,) = forms.outputs
    assert form.constant
    assert form.a is not None
    assert float(ca.Function("quotient", [c, d], [form.a])(6.0, 4.0)) == 1.5
    fits = ca.Function("fits", [ends], [forms.fits])
    assert [float(fits(row)) for row in ([1.0, 2.0], [-2.0, -1.0], [-1.0, 2.0], [0.0, 1.0])] == [1.0, 1.0, 0.0, 0.0]
