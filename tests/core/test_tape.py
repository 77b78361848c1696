"""Expressions as graphs: nodes in order, one operation on other operands, calls of functions."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from powertrain.language.symbols import column, key, scalars
from powertrain.numerics.tape import again, graph_of, grouped, operands_of, results_of

X, Y = ca.SX.sym("x"), ca.SX.sym("y")


def test_operands_come_before_their_operations_and_shared_nodes_once() -> None:
    shared = ca.sin(X) * Y
    first, second = shared + Y, shared - X
    found = graph_of(first, second)
    order = list(found)
    assert len(order) == 6  # x, sin, y, product, sum, difference
    for place, (node, operands) in found.items():
        assert place == key(node)
        assert all(order.index(key(operand)) < order.index(place) for operand in operands)
    assert order.index(key(first)) < order.index(key(second))


def test_an_operation_on_other_operands() -> None:
    node = ca.atan2(X, Y)
    made = again(node, [Y, 2 * X])
    assert float(ca.Function("f", [X, Y], [made])(0.3, 0.7)) == pytest.approx(np.arctan2(0.7, 0.6), rel=1e-15)
    assert float(ca.Function("f", [X], [again(ca.sin(X), [X + 1])])(0.3)) == pytest.approx(np.sin(1.3), rel=1e-15)


def test_calls_take_and_give_entries_one_after_the_other() -> None:
    a, b = ca.MX.sym("a", 2, 2), ca.MX.sym("b")
    function = ca.Function("pair", [a, b], [a @ a, b * a[0, :]], {"never_inline": True})
    given = ca.SX.sym("given", 5)
    found = results_of(function, scalars(given))
    values = np.array(ca.Function("f", [given], [column(found)])([1, 2, 3, 4, 5])).ravel()
    matrix = np.array([[1.0, 3.0], [2.0, 4.0]])
    assert values.tolist() == [*(matrix @ matrix).ravel(order="F"), 5.0, 15.0]
    assert [len(group) for group in grouped(function, range(5))] == [4, 1]
    node = found[4]
    assert [key(operand) for operand in operands_of(node)] == [key(s) for s in scalars(given)]
    moved = again(node, [s + 1 for s in scalars(given)])
    assert float(ca.Function("f", [given], [moved])([1, 2, 3, 4, 5])) == 12.0


def test_entries_of_sparse_and_empty_matrices() -> None:
    assert scalars(ca.SX(0, 1)) == []
    assert scalars(ca.SX(0, 3)) == []
    found = scalars(ca.diag(ca.vertcat(X, Y)))
    assert [e.is_zero() for e in found] == [False, True, True, False]
    assert (key(found[0]), key(found[3])) == (key(X), key(Y))
