"""Expressions that call functions are found among any number of expressions."""

from __future__ import annotations

import casadi as ca
import pytest

from powertrain.compiler.calls import calling


def test_calls_among_many_expressions(capfd: pytest.CaptureFixture[str]) -> None:
    """CasADi warns of functions with more than 10,000 outputs; these are the rows of one."""
    x = ca.SX.sym("x")
    square = ca.Function("square", [x], [x**2], {"never_inline": True})
    rows = [x + k for k in range(12_000)]
    rows[7], rows[300], rows[-1] = ca.SX(1, 1), square(x), 2 * square(x) + x
    assert calling(rows) == [300, 11_999]
    assert capfd.readouterr() == ("", "")
