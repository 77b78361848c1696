"""Affine aliases against what their equations say, on random trees of them."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
from numpy.polynomial import Polynomial

import powertrain as pt
from powertrain.compiler.alias import eliminate_aliases
from powertrain.compiler.flatten import flatten


class Tied(pt.Component):
    """x0 grows at rate 1 + t; every other x is factor * x_parent + offset, said in one of several ways, or that of its parent's rate."""

    ties: tuple[tuple[int, float, float, int], ...]
    x: pt.Variable = pt.variable("1", "Root", start=0.5)

    def equations(self) -> pt.Equations:
        names = [self.x]
        for parent, factor, offset, way in self.ties:
            other = getattr(self, f"y{len(names)}")
            names.append(other)
            if way == 0:
                yield other == factor * names[parent] + offset
            elif way == 1:
                yield other - offset - factor * names[parent] == 0
            elif way == 3:
                yield other == factor * pt.der(names[parent]) + offset
            else:
                yield names[parent] == (other - offset) / factor
        yield pt.der(self.x) == 1.0 + pt.time


COUNT = 12
Random = type("Random", (Tied,), {f"y{i}": pt.variable("1", "Tied") for i in range(1, COUNT + 1)} | {
    "__annotations__": {f"y{i}": pt.Variable for i in range(1, COUNT + 1)}
})  # fmt: skip


def random_ties(seed: int) -> tuple[tuple[int, float, float, int], ...]:
    rng = np.random.default_rng(seed)
    return tuple(
        (
            int(rng.integers(0, i + 1)),
            float(rng.choice([-2.5, -1.0, 1.0, 0.5, 3.0])),
            float(rng.choice([0.0, 1.5])),
            int(k),
        )
        for i, k in enumerate(rng.integers(0, 4, COUNT))
    )


@pytest.mark.parametrize("seed", range(12))
def test_random_trees(seed: int) -> None:
    """One variable is left, and all others follow it as their equations say."""
    ties = random_ties(seed)
    model: Any = Random(ties=ties)
    flat = flatten(model)
    reduced = eliminate_aliases(flat, {})
    assert len(reduced.equations) == 1
    assert len(flat.unknowns) - len(reduced.aliases) == 1
    plant = pt.compile(model)
    result = plant.simulate(1.0, starts={"x": 0.7}, rtol=1e-10)
    values = [Polynomial([0.7, 1.0, 0.5])]
    for parent, factor, offset, way in ties:
        values.append(factor * (values[parent].deriv() if way == 3 else values[parent]) + offset)
    for i, value in enumerate(values[1:], 1):
        np.testing.assert_allclose(result[f"y{i}"], value(result.time), rtol=1e-8, atol=1e-8)


class Rates(pt.Component):
    """Derivatives of derivatives, through factors."""

    s: pt.Variable = pt.variable("m", "Place", start=1.0)
    v: pt.Variable = pt.variable("m/s", "Speed", start=2.0)
    a: pt.Variable = pt.variable("m/s2", "Acceleration")
    turned: pt.Variable = pt.variable("rad", "Angle")
    w: pt.Variable = pt.variable("rad/s", "Angular speed")

    def equations(self) -> pt.Equations:
        yield self.v == pt.der(self.s)
        yield self.a == pt.der(self.v)
        yield self.s == 0.5 * self.turned + 3
        yield self.w == pt.der(self.turned)
        yield self.a == ca.sin(pt.time)


def test_derivatives_are_aliases() -> None:
    reduced = eliminate_aliases(flatten(Rates()), {})
    assert len(reduced.equations) == 1
    result = pt.simulate(Rates(), 2.0, rtol=1e-10)
    t = result.time
    np.testing.assert_allclose(result["v"], 3 - np.cos(t), rtol=1e-8)
    np.testing.assert_allclose(result["s"], 1 + 3 * t - np.sin(t), rtol=1e-8)
    np.testing.assert_allclose(result["w"], 2 * (3 - np.cos(t)), rtol=1e-8)
    np.testing.assert_allclose(result["turned"], 2 * (1 + 3 * t - np.sin(t) - 3), rtol=1e-8, atol=1e-8)


class Loop(pt.Component):
    """Three variables tied in a ring."""

    last: pt.Parameter = pt.parameter("1", "Last factor", default=1.0)
    fixed: float = 0.25
    a: pt.Variable = pt.variable("1", "first")
    b: pt.Variable = pt.variable("1", "second")
    c: pt.Variable = pt.variable("1", "third")

    def equations(self) -> pt.Equations:
        yield self.b == 2 * self.a
        yield self.c == 2 * self.b
        yield self.a == self.fixed * self.c + 1


def test_rings_are_solved_or_refused() -> None:
    """a = f 4 a + 1: solved where 4 f is not one, refused where it is."""
    result = pt.simulate(Loop(fixed=0.5), 0.1)
    assert result["a"][-1] == pytest.approx(-1.0)
    with pytest.raises(pt.ModelError, match=r"self.a == self.fixed"):
        pt.compile(Loop(fixed=0.25))


class Geared(pt.Component):
    """Two wheels that two gears in a row and a third beside them connect."""

    ratios: tuple[float, float, float]
    w: pt.Variable = pt.variable("rad/s", "Speed of the first", start=1.0)
    between: pt.Variable = pt.variable("rad/s", "Speed between the gears")
    other: pt.Variable = pt.variable("rad/s", "Speed of the last")
    row: pt.Variable = pt.variable("N.m", "Torque of the gears in a row")
    beside: pt.Variable = pt.variable("N.m", "Torque of the third")

    def equations(self) -> pt.Equations:
        first, second, whole = self.ratios
        yield self.between == first * self.w
        yield self.other == second * self.between
        yield self.other == whole * self.w
        yield pt.der(self.w) == -first * second * self.row - whole * self.beside
        yield pt.der(self.other) == self.row + self.beside


@pytest.mark.parametrize("seed", range(20))
def test_a_loop_of_decimal_ratios_closes_within_round_off(seed: int) -> None:
    """1.13 times 1.99 is not quite 2.2487 in floating point: no reason to take the wheels for standing still."""
    first, second = (round(ratio, 2) for ratio in np.random.default_rng(seed).uniform(0.1, 5.0, 2).tolist())
    with pytest.raises(pt.ModelError, match="rigid loop"):
        pt.compile(Geared(ratios=(first, second, round(first * second, 4))))


class Value(pt.Component):
    x: pt.Variable = pt.variable("1", "Value")

    def equations(self) -> pt.Equations:
        yield from ()


class Sums(pt.Component):
    """Homogeneous equations: {value: coefficient} for each."""

    values: tuple[Value, ...]
    sums: tuple[dict[int, float], ...]

    def equations(self) -> pt.Equations:
        for row in self.sums:
            yield sum(c * self.values[i].x for i, c in row.items()) == 0


@pytest.mark.parametrize("seed", [*range(9), 100060, 239, 312, 339])
def test_no_equation_of_two_variables_is_left(seed: int) -> None:
    """Whatever becomes usable by other eliminations is used; in the last three by that of a variable which has replaced its own.

    Equations that depend on each other are refused.
    """
    rng = np.random.default_rng(seed)
    sums = tuple(
        {int(i): float(rng.normal()) for i in rng.choice(14, int(n), replace=False)}
        for n in rng.choice([2, 3, 4], 11, p=[0.3, 0.4, 0.3])
    )
    flat = flatten(Sums(values=tuple(Value() for _ in range(14)), sums=sums))
    if np.linalg.matrix_rank([[row.get(i, 0.0) for i in range(14)] for row in sums]) < len(sums):
        with pytest.raises(pt.ModelError, match="rigid loop"):
            eliminate_aliases(flat, {})
        return
    left = eliminate_aliases(flat, {}).equations
    assert all(len(ca.symvar(e.residual)) > 2 for e in left)
