"""Blocks of algebraic equations: linear ones against numpy, torn ones against their own equations."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

import powertrain as pt
from powertrain.numerics import sparse_lu

SIZE = 6
Numbers = tuple[tuple[float, ...], ...]


class _Unknowns(pt.Component):
    """Partial: unknowns u0 .. u5."""

    u0: pt.Variable = pt.variable("1", "unknown")
    u1: pt.Variable = pt.variable("1", "unknown")
    u2: pt.Variable = pt.variable("1", "unknown")
    u3: pt.Variable = pt.variable("1", "unknown")
    u4: pt.Variable = pt.variable("1", "unknown")
    u5: pt.Variable = pt.variable("1", "unknown")

    @property
    def u(self) -> list[pt.Symbol]:
        """All of them."""
        return [getattr(self, f"u{i}") for i in range(SIZE)]


class Linear(_Unknowns):
    """A(x) u = b + c x with A = A0 + x A1, beside a state x."""

    A0: Numbers
    A1: Numbers
    b: tuple[float, ...]
    x: pt.Variable = pt.variable("1", "state", start=0.5)

    def equations(self) -> pt.Equations:
        for i in range(SIZE):
            row = [
                (a + self.x * d) * u for a, d, u in zip(self.A0[i], self.A1[i], self.u, strict=True) if a != 0 or d != 0
            ]
            yield sum(row[1:], row[0]) == self.b[i] + 2 * self.x
        yield pt.der(self.x) == self.u0


def as_rows(matrix: np.ndarray) -> Numbers:
    return tuple(tuple(float(v) for v in row) for row in matrix)


@pytest.mark.parametrize("seed", range(12))
def test_linear_blocks(seed: int) -> None:
    """Sparse systems with a coefficient that varies along the motion; also those that fall into smaller blocks."""
    rng = np.random.default_rng(seed)
    pattern = rng.random((SIZE, SIZE)) < 0.5
    A0 = np.where(pattern, rng.normal(size=(SIZE, SIZE)), 0.0) + 3 * np.eye(SIZE)[rng.permutation(SIZE)]
    A1 = np.where(pattern & (rng.random((SIZE, SIZE)) < 0.3), 0.2 * rng.normal(size=(SIZE, SIZE)), 0.0)
    b = rng.normal(size=SIZE)
    plant = pt.compile(Linear(A0=as_rows(A0), A1=as_rows(A1), b=tuple(b.tolist())))
    assert plant.compiled.dae.z.numel() == 0
    result = plant.simulate(0.1, points=5)
    for x, *u in zip(result["x"], *(result[f"u{i}"] for i in range(SIZE)), strict=True):
        np.testing.assert_allclose(u, np.linalg.solve(A0 + x * A1, b + 2 * x), rtol=1e-9, atol=1e-9)


class Bent(_Unknowns):
    """Equations that no linear elimination solves: u = 0.3 tanh(P u) + b sin(t), in a ring, and a chain behind it."""

    P: Numbers
    b: tuple[float, ...]

    def equations(self) -> pt.Equations:
        for i in range(SIZE):
            inside = sum((p * u for p, u in zip(self.P[i], self.u, strict=True) if p), pt.Symbol(0))
            yield self.u[i] == 0.3 * ca.tanh(inside) + self.b[i] * ca.sin(pt.time)


@pytest.mark.parametrize("seed", range(6))
def test_torn_blocks(seed: int) -> None:
    """The equations hold; and fewer unknowns stay implicit than there are where a ring can be torn."""
    rng = np.random.default_rng(seed)
    P = np.roll(np.eye(SIZE), 1, axis=1) * rng.uniform(0.5, 1.5, SIZE)
    if seed % 2:
        P = P + np.where(rng.random((SIZE, SIZE)) < 0.3, rng.normal(size=(SIZE, SIZE)), 0.0)
    b = rng.normal(size=SIZE)
    plant = pt.compile(Bent(P=as_rows(P), b=tuple(b.tolist())))
    assert 1 <= plant.compiled.dae.z.numel() <= (1 if seed % 2 == 0 else SIZE)
    result = plant.simulate(1.0, points=5)
    u = np.array([result[f"u{i}"] for i in range(SIZE)])
    np.testing.assert_allclose(u, 0.3 * np.tanh(P @ u) + b[:, None] * np.sin(result.time), rtol=1e-7, atol=1e-8)


class Hub(_Unknowns):
    """u0 .. u4 follow from u5, which depends on all of them."""

    def equations(self) -> pt.Equations:
        for k in range(5):
            yield self.u[k] == 0.3 * ca.tanh(self.u5 + k)
        yield self.u5 + self.u0 + self.u1 * self.u2 + self.u3 * self.u4 == ca.sin(pt.time)


def test_a_block_is_torn_at_the_unknown_in_most_of_its_equations() -> None:
    z = pt.compile(Hub()).compiled.dae.z
    assert [z[k].name() for k in range(z.numel())] == ["u5"]


class Divided(pt.Component):
    """y = x^2 p, written as a quotient that has no value for the default of p."""

    p: pt.Parameter = pt.parameter("1", "Divisor", default=0.0)
    x: pt.Variable = pt.variable("1", "State", start=1.5)
    y: pt.Variable = pt.variable("1", "Follows")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == 0
        yield self.y / self.p == self.x**2


def test_a_coefficient_without_a_value_for_the_defaults() -> None:
    assert pt.simulate(Divided(), 1.0, parameters={"p": 2.0})["y"][-1] == pytest.approx(4.5)


class Vanishing(_Unknowns):
    """The coefficient of u0 in the first equation passes through zero; x is the time."""

    x: pt.Variable = pt.variable("1", "state", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == 1
        yield ca.sin(self.x) * self.u0 + self.u1 == 1
        yield self.u0 - self.u1 - self.u2 == 0
        yield self.u0 + self.u1 + 2 * self.u2 == 3
        for u in self.u[3:]:
            yield u == 1


def test_a_coefficient_that_vanishes_is_no_pivot() -> None:
    """At t = 0 and t = pi, and beside them."""
    times = np.array([0.0, 1.0, np.pi, 4.0])
    result = pt.simulate(Vanishing(), stop=5.0)
    for t in times:
        matrix = [[np.sin(t), 1, 0], [1, -1, -1], [1, 1, 2]]
        found = [result.at(t, f"u{i}") for i in range(3)]
        np.testing.assert_allclose(found, np.linalg.solve(matrix, [1, 0, 3]), rtol=1e-7)


class Singular(_Unknowns):
    """Three equations of which one repeats the others."""

    def equations(self) -> pt.Equations:
        yield self.u0 + self.u1 + self.u2 == 1
        yield self.u0 - self.u1 == 2
        yield 2 * self.u0 + self.u2 == 3
        for u in self.u[3:]:
            yield u == 1


def test_a_block_that_repeats_itself_is_refused() -> None:
    with pytest.raises(pt.ModelError, match="rigid loop") as caught:
        pt.compile(Singular())
    assert "self.u0 + self.u1 + self.u2 == 1" in str(caught.value)


def test_elimination_with_an_entry_that_is_zero() -> None:
    """x0 + 0 x1 = 3,  x0 + x2 = 5,  x1 + x2 = 6: the zero brings nothing new into the second row."""
    rows = [{0: ca.SX(1), 1: ca.SX(0)}, {0: ca.SX(1), 2: ca.SX(1)}, {1: ca.SX(1), 2: ca.SX(1)}]
    numbers = [{j: float(entry) for j, entry in row.items()} for row in rows]
    found = sparse_lu.solve(rows, [ca.SX(b) for b in (3, 5, 6)], numbers)
    assert [float(found[j]) for j in range(3)] == [3.0, 4.0, 2.0]


class Curved(pt.Component):
    """An unknown that stays implicit, and a state that it follows."""

    x: pt.Variable = pt.variable("1", "State", start=0.3, prefer=True)
    z: pt.Variable = pt.variable("1", "Implicit unknown", guess=0.3)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == 0.5 - self.x
        yield self.z + 0.4 * ca.sin(3 * self.z) == self.x


def test_derivative_of_an_implicit_unknown() -> None:
    """The equations contain no derivative of z: (1 + 1.2 cos 3 z) der(z) = der(x)."""
    result = pt.simulate(Curved(), 2.0)
    assert result.compiled.dae.z.numel() == 1
    rate = result[lambda m: pt.der(m.z)]
    np.testing.assert_allclose(rate, (0.5 - result["x"]) / (1 + 1.2 * np.cos(3 * result["z"])), rtol=1e-9, atol=1e-12)
