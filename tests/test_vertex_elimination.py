"""Jacobians by elimination of vertices, against CasADi's modes, which are derived in another way, and against differences."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest

import powertrain as pt
from powertrain.language.symbols import Symbol
from powertrain.numerics.vertex_elimination import sparse_jacobian

UNARY = [
    ca.OP_NEG,
    ca.OP_SQ,
    ca.OP_TWICE,
    ca.OP_SIN,
    ca.OP_COS,
    ca.OP_TANH,
    ca.OP_ATAN,
    ca.OP_FABS,
    ca.OP_ASINH,
    ca.OP_ERF,
]
BOUNDED = [ca.OP_EXP, ca.OP_SINH, ca.OP_COSH, ca.OP_TAN, ca.OP_ASIN, ca.OP_ACOS, ca.OP_ATANH, ca.OP_EXPM1]
POSITIVE = [ca.OP_SQRT, ca.OP_LOG, ca.OP_INV, ca.OP_LOG1P]
BINARY = [ca.OP_ADD, ca.OP_SUB, ca.OP_MUL, ca.OP_FMIN, ca.OP_FMAX, ca.OP_COPYSIGN, ca.OP_HYPOT, ca.OP_ATAN2]
OVER_POSITIVE = [ca.OP_DIV, ca.OP_FMOD, ca.OP_POW]
FLAT = [ca.OP_SIGN, ca.OP_NOT, ca.OP_FLOOR, ca.OP_CEIL]
CONDITIONS = [ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_AND, ca.OP_OR]


def bounded(e: Symbol) -> Symbol:
    return 0.9 * ca.sin(e)


def positive(e: Symbol) -> Symbol:
    return 0.5 + e**2


def random_operation(rng: Any, a: Symbol, b: Symbol, c: Symbol) -> Symbol:
    kind = rng.integers(12)
    if kind == 0:
        return ca.SX.unary(int(rng.choice(FLAT)), a)
    if kind == 1:
        return ca.SX.unary(int(rng.choice(BOUNDED)), bounded(a))
    if kind == 2:
        return ca.SX.unary(int(rng.choice(POSITIVE)), positive(a))
    if kind == 3:
        return ca.SX.binary(int(rng.choice(OVER_POSITIVE)), positive(a), positive(b))
    if kind < 6:
        return ca.SX.binary(ca.OP_IF_ELSE_ZERO, ca.SX.binary(int(rng.choice(CONDITIONS)), a, b), c)
    if kind < 8:
        return ca.SX.unary(int(rng.choice(UNARY)), a)
    return ca.SX.binary(int(rng.choice(BINARY)), a, b)


def random_expressions(rng: Any, length: int = 80) -> tuple[list[Symbol], Symbol, Symbol]:
    """Of seven variables and two other symbols; the last of the outputs, and a number, a variable and the first output once more."""
    x, p = ca.SX.sym("x", 7), ca.SX.sym("p", 2)
    known = [*ca.vertsplit(p), *ca.vertsplit(x)]
    for _ in range(length):
        a, b, c = (known[max(0, len(known) - int(k))] for k in rng.geometric(0.1, 3))
        known.append(bounded(random_operation(rng, a, b, c)) + 0.3 * c)
    return [x, p], ca.vertcat(*known[-6:], 2.0, x[2], p[0], known[-6]), x


def compared(outputs: Symbol, x: Symbol, inputs: list[Symbol]) -> ca.Function:
    """Both Jacobians, both in full; the entries of ours are among CasADi's."""
    ours, theirs = sparse_jacobian(outputs, x), ca.jacobian(outputs, x)
    assert ours.shape == theirs.shape
    assert (ours.sparsity() + theirs.sparsity()).nnz() == theirs.nnz()
    return ca.Function("f", inputs, [ca.densify(ours), ca.densify(theirs), outputs])


def assert_equal_rows(ours: Any, theirs: Any, share: float) -> None:
    found, expected = np.array(ours), np.array(theirs)
    size = np.abs(expected).max(axis=1, keepdims=True, initial=0.0)
    assert (np.abs(found - expected) <= share * size).all()


@pytest.mark.parametrize("seed", range(40))
def test_random_expressions(seed: int) -> None:
    """Equal to CasADi's Jacobian; and to differences, wherever these agree with each other."""
    rng = np.random.default_rng(seed)
    inputs, outputs, x = random_expressions(rng)
    function = compared(outputs, x, inputs)
    for _ in range(5):
        at, p = rng.normal(size=7), rng.normal(size=2)
        ours, theirs, _ = function(at, p)
        assert np.count_nonzero(np.array(ours)) > 10
        assert_equal_rows(ours, theirs, 1e-10)
        for j, direction in enumerate(np.eye(7)):
            wide, narrow = (
                np.array(function(at + h * direction, p)[2] - function(at - h * direction, p)[2]).ravel() / (2 * h)
                for h in (2e-5, 1e-5)
            )
            smooth = np.abs(wide - narrow) < 1e-6 * (1 + np.abs(narrow))
            np.testing.assert_allclose(np.array(ours)[smooth, j], narrow[smooth], rtol=1e-4, atol=1e-4)


def length(inputs: list[Symbol], expression: Symbol) -> int:
    return ca.Function("f", inputs, ca.cse([expression])).n_instructions()


def test_neither_forward_nor_reverse() -> None:
    """A waist behind many variables and before many outputs: the sum of both widths is enough, where a mode needs the product."""
    n = 12
    x = ca.SX.sym("x", n)
    waist = [ca.sin(ca.sum1(x * x)), ca.cos(ca.sum1(x * x))]
    for _ in range(10):
        waist = [ca.sin(waist[0] * waist[1]), ca.exp(-waist[1])]
    outputs = ca.vertcat(*[ca.sqrt(k + waist[0] * waist[1]) for k in range(1, n + 1)])
    short, long = length([x], sparse_jacobian(outputs, x)), length([x], ca.jacobian(outputs, x))
    function = compared(outputs, x, [x])
    ours, theirs, _ = function(np.linspace(0.1, 0.5, n))
    assert_equal_rows(ours, theirs, 1e-12)
    assert short < 2 * n * n + 12 * n + 100  # one product and one output an entry; before and behind the waist
    assert long > 2 * short


def test_constant_slopes() -> None:
    """Signs, ones and repeated operands cost nothing, and what cancels leaves no entry."""
    x = ca.SX.sym("x", 3)
    assert sparse_jacobian(ca.vertcat(x[0] + x[1] - x[2], -x[0], x[0] + x[0]), x).is_constant()
    assert str(sparse_jacobian(x[0] * x[1], x)) == "[[x_1, x_0, 00]]"
    cancelled = sparse_jacobian(ca.vertcat(2 * x[0] - (x[0] + x[1]) - x[0], x[1]), x)
    assert cancelled.nnz() == 2


@pytest.mark.parametrize("operation", [ca.fmin, ca.fmax, ca.copysign, ca.hypot, ca.atan2, ca.fmod, ca.if_else])
def test_at_ties(operation: Any) -> None:
    """As CasADi has it: half of each of two equal operands."""
    x = ca.SX.sym("x", 2)
    expression = ca.if_else(x[0], x[1], x[0] * x[1]) if operation is ca.if_else else operation(x[0], x[1])
    function = compared(ca.vertcat(expression, ca.fabs(x[0] * x[1]), ca.sign(x[0])), x, [x])
    for at in ([1.0, 1.0], [-2.0, -2.0], [0.0, 0.0], [-0.0, 1.0], [0.0, -1.0], [3.0, 0.0]):
        ours, theirs, _ = function(at)
        np.testing.assert_array_equal(np.array(ours), np.array(theirs))
    if operation is ca.fmin:
        np.testing.assert_array_equal(np.array(function([1.0, 1.0])[0])[0], [0.5, 0.5])


def test_what_is_not_chosen_may_be_infinite() -> None:
    """The slope of a root at zero would make nan of a factor of zero."""
    x, k = ca.SX.sym("x"), ca.SX.sym("k")
    root, square = k * ca.if_else(x > 0, ca.sqrt(x), 0), ca.if_else(x > 0, x * x, 0)
    twice = ca.if_else(k > 0, k * ca.if_else(x > 0, 2 * k * root, 0), 0)
    for expression in (root, ca.if_else(k > 0, 3 * k * root, 0), twice, ca.sqrt(square)):
        function = compared(expression, ca.vertcat(x, k), [x, k])
        np.testing.assert_array_equal(np.array(function(0.0, 2.0)[0]), [[0.0, 0.0]])
        ours, theirs, _ = function(4.0, 2.0)
        assert_equal_rows(ours, theirs, 1e-15)


STEEP: dict[str, Callable[[Any, Any], Any]] = {
    "sqrt": lambda u, _: ca.sqrt(u),
    "power": lambda u, _: u**0.3,
    "variable power": lambda u, k: u**k,
    "acos": lambda u, _: ca.acos(1 - u),
    "asin": lambda u, _: ca.asin(1 - u),
    "acosh": lambda u, _: ca.acosh(1 + u),
}


@pytest.mark.parametrize("more", [0, 1, 2])
@pytest.mark.parametrize("nested", [True, False])
@pytest.mark.parametrize("steep", STEEP)
def test_sums_of_what_is_not_chosen_meet_infinite_slopes(steep: str, nested: bool, more: int) -> None:
    """One branch after the other does, as in reverse mode, also where what is in the root is used elsewhere."""
    x, k = ca.SX.sym("x", 5), ca.SX.sym("k")
    inside = ca.if_else(x[0] > 0, x[0] ** 2, 0) + ca.if_else(x[0] > 1, x[0], 0)
    root = STEEP[steep](inside, k)
    others = ca.vertcat(*([inside * x[1], ca.acos(1 - inside) * x[2]][:more]))
    rates = ca.vertcat(
        -x[0] + root * x[1] - x[2] - x[3] - x[4], root * x[2], (ca.sqrt(2 * root) if nested else root) * x[3], others
    )
    function = compared(rates, x, [x, k])
    for at in ([-1.0, 1.0, 1.0, 1.0, 1.0], [0.5, 1.0, 2.0, 1.0, 1.0]):
        ours = np.array(function(at, 0.3)[0])
        assert np.isfinite(ours).all()
    np.testing.assert_array_equal(np.array(function([-1.0, 1.0, 1.0, 1.0, 1.0], 0.3)[0])[1:, 0], 0.0)


def test_calls() -> None:
    """Tables of one and two axes, and a function of several columns with sparse results."""
    x = ca.SX.sym("x", 3)
    one = ca.interpolant("one", "linear", [[0.0, 1.0, 2.0]], [1.0, 3.0, 2.0])
    two = ca.interpolant("two", "linear", [[0.0, 1.0, 2.0], [0.0, 1.0]], [1.0, 2.0, 4.0, 3.0, 5.0, 9.0])
    a, b = ca.MX.sym("a", 2), ca.MX.sym("b")
    several = ca.Function("several", [a, b], [ca.diag(a * b), ca.sin(a[0]) * b], {"never_inline": True})
    matrix, number = several.call([ca.vertcat(x[0] * x[1], x[2]), x[0]], False, True)
    outputs = ca.vertcat(
        one(x[0]) * x[1], two(ca.vertcat(x[0] * x[2], x[1])), matrix[1, 1] * x[2], number, one(0.4), x[1]
    )
    function = compared(outputs, x, [x])
    for at in np.random.default_rng(1).uniform(0.1, 0.9, (5, 3)):
        ours, theirs, _ = function(at)
        assert_equal_rows(ours, theirs, 1e-14)


def test_nothing() -> None:
    """No outputs, no variables, or none that moves the outputs."""
    x, p = ca.SX.sym("x", 2), ca.SX.sym("p")
    assert sparse_jacobian(Symbol(0, 1), x).shape == (0, 2)
    assert sparse_jacobian(ca.vertcat(p, 1), Symbol(0, 1)).shape == (2, 0)
    still = sparse_jacobian(ca.vertcat(p * p, 3, x[0] > 1, ca.floor(x[1])), x)
    assert still.shape == (4, 2)
    assert still.nnz() == 0


def test_the_order_is_the_same_every_time() -> None:
    """Ties go to the earlier operation."""
    texts = set()
    for _ in range(3):
        _, outputs, x = random_expressions(np.random.default_rng(3), 80)
        texts.add(str(sparse_jacobian(outputs, x)))
    assert len(texts) == 1


def test_deep_expressions() -> None:
    """Deeper than Python's stack."""
    x = ca.SX.sym("x")
    e = x
    for _ in range(5000):
        e = ca.sin(e)
    assert float(ca.Function("f", [x], [sparse_jacobian(e, x)])(0.0)) == 1.0


CARS = {
    "ManualCar": 0.8,
    "DualClutchCar": 0.97,
    "RearDriveCar": 0.65,
    "SplitPathCar": 0.9,
    "ParallelHybrid": 0.8,  # these two call tables
    "SeriesHybrid": 0.65,
}


@pytest.mark.parametrize("name", CARS)
def test_cars(name: str) -> None:
    """At random points as in CasADi's reverse mode, where no sums cancel that the forward mode makes; in fewer instructions."""
    dae = pt.compile(getattr(pt.vehicles, name)()).compiled.dae
    rates, y = ca.densify(ca.vertcat(dae.xdot, dae.residual)), ca.vertcat(dae.t, dae.x, dae.z)
    inputs = [dae.t, dae.x, dae.z, dae.m, dae.p]
    ours, theirs = sparse_jacobian(rates, y), ca.jacobian(rates, y)
    assert (ours.sparsity() + theirs.sparsity()).nnz() == theirs.nnz()
    reverse = ca.jtimes(rates, y, ca.SX.eye(rates.numel()), True).T
    function = ca.Function("f", inputs, [ca.densify(ours), ca.densify(reverse)])
    rng = np.random.default_rng(1)
    for _ in range(10):
        found, expected = function(*(rng.uniform(0.1, 1.0, e.numel()) for e in inputs))
        assert np.isfinite(np.array(expected)).all()
        assert_equal_rows(found, expected, 1e-12)
    assert length(inputs, ours) < CARS[name] * length(inputs, theirs)
