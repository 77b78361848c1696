"""Roots of random expressions that are fractions of two affine expressions of one unknown, however they are written."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest

from powertrain.equilibrium.elimination import root_of_fraction


def affine(x: ca.SX, a: ca.SX, rng: np.random.Generator) -> ca.SX:
    """An affine expression of x, with coefficients that contain a."""
    p, q, r = rng.uniform(0.5, 2.0, 3)
    kinds: list[ca.SX] = [p * x - q * a, a - x / r, (x - p) + (x - p) - a * x, a * (q - x) + r]
    return kinds[rng.integers(4)]


def fraction(x: ca.SX, a: ca.SX, rng: np.random.Generator) -> ca.SX:
    """Sums, products and quotients of affine expressions that remain a fraction of two of these."""
    n, d, m = (affine(x, a, rng) for _ in range(3))
    kinds: list[ca.SX] = [
        n,
        n / d,
        n / d + m / d,
        n / d - m / d,
        (n / d) / (m / d),
        1 / d,
        (n / d) * (d / m),
        n / d + m / (a * d),
    ]
    f = kinds[rng.integers(8)]
    for _ in range(rng.integers(4)):
        c = rng.uniform(0.5, 2.0)
        f = [f + c, a - f, c / f, f / a, f + f, -f, 1 / f, a * f][rng.integers(8)]
    return f - rng.uniform(0.5, 2.0)


@pytest.mark.parametrize("seed", range(60))
def test_a_root_makes_the_residual_zero(seed: int) -> None:
    """The root at some value of the other symbol; central differences of the residual there tell its round-off."""
    rng = np.random.default_rng(seed)
    x, a = ca.SX.sym("x"), ca.SX.sym("a")
    residual = fraction(x, a, rng)
    root = root_of_fraction(residual, x)
    assert root is not None
    value = ca.Function("value", [x, a], [residual])
    at = float(rng.uniform(0.5, 2.0))
    found, h = float(ca.Function("root", [a], [root])(at)), 1e-6
    slope = float(value(found + h, at) - value(found - h, at)) / (2.0 * h)
    assert abs(float(value(found, at))) < 1e-8 * abs(slope) * (1.0 + abs(found))


def test_a_large_root_of_a_written_fraction_is_exact() -> None:
    x, a = ca.SX.sym("x"), ca.SX.sym("a")
    root = root_of_fraction((x - 3e6 * a) / (a + x), x)
    assert root is not None
    assert float(ca.Function("root", [a], [root])(0.7)) == pytest.approx(2.1e6, rel=1e-14)


@pytest.mark.parametrize(
    "other",
    [
        lambda x, a: x * x - a,
        lambda x, a: ca.sqrt(x) - a,
        lambda x, a: ca.fabs(x) - a,
        lambda x, a: 1 / x + x - a,
        lambda x, a: (x - a) / (x - 1) + (x - a) / (x - 2),
        lambda x, a: ca.if_else(x > 1, x, 2 * x) - a,
        lambda x, a: x + 1e-4 * x**2 - a,
    ],
)
def test_other_expressions_are_told_from_fractions(other: Callable[[ca.SX, ca.SX], ca.SX]) -> None:
    x, a = ca.SX.sym("x"), ca.SX.sym("a")
    assert root_of_fraction(other(x, a), x) is None
