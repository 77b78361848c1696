"""Random equations as text, over all that CasADi, NumPy and Python offer on a symbol, and what they mean for numbers."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Mapping
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np

import powertrain as pt

UNARY = (
    "sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh exp expm1 log log1p log10 sqrt fabs sign floor ceil erf "
    "heaviside ramp logic_not"
).split()
NUMPY_UNARY = (
    "sin cos tan arcsin arccos arctan sinh cosh tanh arcsinh exp expm1 log log1p log10 sqrt abs fabs sign floor ceil trunc rint "
    "cbrt square exp2 deg2rad round"
).split()
BINARY = "fmin fmax fmod remainder atan2 copysign hypot".split()
NUMPY_BINARY = "maximum minimum fmin fmax fmod mod remainder arctan2 hypot power copysign heaviside".split()
SIGNS = ["+", "-", "*", "/"] * 3 + ["//", "%", "**"]
COMPARISONS = "< <= > >= == !=".split()


def _guarded(function: Callable[..., float]) -> Callable[..., float]:
    """nan where Python raises, or gives a complex number: CasADi's functions do not."""

    def call(*given: float) -> float:
        try:
            return float(function(*given))
        except (ValueError, ArithmeticError, TypeError):
            return math.nan

    return call


CASADI = {
    **{name: _guarded(getattr(math, name)) for name in UNARY if hasattr(math, name)},
    **{name: _guarded(getattr(math, name)) for name in BINARY if hasattr(math, name)},
    "sign": np.sign,
    "heaviside": lambda x: np.heaviside(x, 0.5),
    "ramp": lambda x: max(x, 0.0),
    "logic_not": lambda x: float(not x),
    "logic_and": lambda x, y: float(bool(x) and bool(y)),
    "logic_or": lambda x, y: float(bool(x) or bool(y)),
    "fmin": np.fmin,
    "fmax": np.fmax,
    "if_else": lambda c, a, b: a if c else b,
}
"""What CasADi's functions are on numbers, by Python's own."""


def namespace(values: Mapping[str, Any], numbers: bool) -> dict[str, Any]:
    """What a text may name: variables, and the functions for symbols or for numbers."""
    if numbers:
        return {"ca": SimpleNamespace(**CASADI), "np": np, "math": math, "switch": CASADI["if_else"], **values}
    return {"ca": ca, "np": np, "math": math, "switch": pt.switch, **values}


def expression(rng: random.Random, names: list[str], depth: int) -> str:
    """A random expression."""
    if depth == 0 or rng.random() < 0.1:
        return rng.choice(names) if rng.random() < 0.75 else f"{rng.choice([-1, 1]) * rng.uniform(0.2, 3):.2f}"

    def inner() -> str:
        return expression(rng, names, depth - 1)

    kind = rng.random()
    if kind < 0.35:
        return f"({inner()} {rng.choice(SIGNS)} {inner()})"
    if kind < 0.5:
        return f"ca.{rng.choice(UNARY)}({inner()})"
    if kind < 0.6:
        return f"np.{rng.choice(NUMPY_UNARY)}({inner()})"
    if kind < 0.68:
        return f"ca.{rng.choice(BINARY)}({inner()}, {inner()})"
    if kind < 0.74:
        return f"np.{rng.choice(NUMPY_BINARY)}({inner()}, {inner()})"
    if kind < 0.78:
        return f"{rng.choice(['abs', 'round', 'math.floor', 'math.ceil', 'math.trunc', '-', 'float', 'math.sin'])}({inner()})"
    if kind < 0.81:
        return f"np.clip({inner()}, {rng.uniform(-2, 0):.2f}, {rng.uniform(0, 2):.2f})"
    if kind < 0.83:
        return f"np.interp({inner()}, [-1.0, 0.5, 2.0], [{rng.uniform(-2, 2):.2f}, 1.0, {rng.uniform(-2, 2):.2f}])"
    return _choice(rng, inner)


def _choice(rng: random.Random, inner: Callable[[], str]) -> str:
    """A condition, as a number or to choose by; often one whose branches agree."""
    a, b = inner(), inner()
    condition = f"{a} {rng.choice(COMPARISONS)} {b}"
    kind = rng.random()
    if kind < 0.15:
        return f"({condition})"
    if kind < 0.25:
        condition = f"ca.logic_{rng.choice(['and', 'or'])}({condition}, {inner()} < {inner()})"
    if kind < 0.55:
        return (
            f"ca.if_else({a} > {b}, {a}, {b})"
            if rng.random() < 0.5
            else f"ca.if_else({a} > {b}, ({a} - {b}) * {inner()}, 0)"
        )
    if kind < 0.7:
        return f"switch({a} > {b}, {inner()}, {inner()})"
    return f"{rng.choice(['ca.if_else', 'np.where'])}({condition}, {inner()}, {inner()})"


class Text(pt.Component):
    """A state x, a held number n, a parameter k, the rate of x and three variables, each by a random text in what is before it."""

    rate: str
    first: str
    second: str
    third: str
    forms: tuple[int, ...] = (0, 0, 0)
    k: pt.Parameter = pt.parameter("1", "A parameter", default=1.37)
    n: pt.Discrete = pt.discrete("1", "A held number", start=2.0)
    x: pt.Variable = pt.variable("1", "A state", start=0.0, prefer=True)
    v: pt.Variable = pt.variable("1/s", "Its rate")
    y1: pt.Variable = pt.variable("1", "By the first text")
    y2: pt.Variable = pt.variable("1", "By the second text")
    y3: pt.Variable = pt.variable("1", "By the third text")

    def equations(self) -> pt.Equations:
        given = {"x": self.x, "k": self.k, "n": self.n, "y1": self.y1, "y2": self.y2}
        yield self.v == pt.der(self.x)
        yield pt.der(self.x) == eval(self.rate, namespace(given, numbers=False))
        for text, form, y in zip(self.texts, self.forms, (self.y1, self.y2, self.y3), strict=True):
            value = eval(text, namespace(given, numbers=False))
            yield (y == value, value == y, y - value == 0, 3 * y + 2 * value == self.k)[form]
        yield pt.when(pt.time >= 1e9, pt.reinit(self.n, self.n + 1))

    @property
    def texts(self) -> tuple[str, str, str]:
        """Those of y1, y2 and y3."""
        return self.first, self.second, self.third

    def value(self, **given: float) -> dict[str, float]:
        """Direct evaluation of the texts with numbers."""
        given = {name: np.float64(value) for name, value in given.items()}
        for name, text, form in zip(("v", "y1", "y2", "y3"), (self.rate, *self.texts), (0, *self.forms), strict=True):
            with np.errstate(divide="raise", invalid="raise"):  # CasADi takes 0/0 for 0 where the numerator is nothing
                value = np.float64(_guarded(lambda text: eval(text, namespace(given, numbers=True)))(text))
            given[name] = value if form < 3 else (given["k"] - 2 * value) / 3
        return given


def random_text(seed: int) -> Text:
    """One of many texts."""
    rng = random.Random(seed)
    names = ["x", "x", "k", "n"]
    texts = []
    for name in ("y1", "y2", "y3"):
        texts.append(expression(rng, names, rng.randint(1, 3)))
        names = [*names, name, name]
    rate = expression(rng, ["x", "k", "n"], rng.randint(0, 2))
    return Text(
        rate=rate, first=texts[0], second=texts[1], third=texts[2], forms=tuple(rng.randint(0, 3) for _ in range(3))
    )
