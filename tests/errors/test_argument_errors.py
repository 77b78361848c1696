"""What is given to the public functions: a wrong kind of value is named, not met somewhere inside."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from refusals import refused

import powertrain as pt
from powertrain.components.rotational import Inertia, SignTorque, Spring, Torque


class Two(pt.Component):
    """Two inertias on a spring, and two more."""

    J1: Inertia = Inertia(J=1.0)
    spring: Spring = Spring(c=100.0)
    J2: Inertia = Inertia(J=1.0)
    js: tuple[Inertia, ...] = (Inertia(J=1.0), Inertia(J=2.0))
    exact: bool = True
    n: int = 3

    def equations(self) -> pt.Equations:
        yield pt.connect(self.J1.flange_b, self.spring.flange_a)
        yield pt.connect(self.spring.flange_b, self.J2.flange_a)


class Driven(pt.Component):
    """An inertia with a torque from outside."""

    u: pt.Input = pt.signal_input("N.m", "Torque")
    J1: Inertia = Inertia(J=1.0)
    source: Torque = Torque()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.source.flange, self.J1.flange_a)
        yield pt.connect(self.u, self.source.tau)


TWO, DRIVEN = pt.compile(Two()), pt.compile(Driven())
Given = Any
PATHS: dict[Any, list[str]] = {
    "J1.J.x": ["Inertia.J is 1.0, which has no fields, so it has no x"],
    "J1[0].J": ["Two.J1 is not a tuple, so there is no J1[0]; write J1"],
    "js[2].J": ["Two.js has 2 members, so there is no js[2]", "indices begin at 0"],
    "js[a].J": ["'js[a].J' is not a path such as J, wheels[0] or wheels[0].r"],
    "js[0.J": ["is not a path"],
    "js.J": ["write js[0].J for its first member"],
    "J3.J": ["Two has no field J3", "did you mean J2 or J1"],
    "weight": ["Two has no field weight (its fields: J1, "],
    3: ["changes = {3: 2.0}"],
}
OPTIONS: list[tuple[dict[str, Any], list[str]]] = [
    ({"starts": "fast"}, ["starts = 'fast'", "a dictionary of names and values"]),
    ({"starts": {"J1.w": "fast"}}, ["starts: J1.w = 'fast' is not a finite number"]),
    ({"guesses": {"J1.w": [1.0, 2.0]}}, ["guesses: J1.w = [1.0, 2.0] is not a finite number"]),
    ({"parameters": ["J1.J"]}, ["parameters = ['J1.J']"]),
    (
        {"parameters": {"J1.J": "1.0"}},
        ["J1.J = '1.0' is a text without a unit; write 1.0, or '1.0 kg.m2' (Moment of inertia"],
    ),
    ({"points": 10.5}, ["points = 10.5 must be a whole number"]),
    ({"points": 0}, ["points = 0 must be at least 1"]),
    ({"rtol": "small"}, ["rtol = 'small' is not a finite number"]),
    ({"rtol": math.nan}, ["rtol = nan"]),
    ({"rtol": 1}, ["rtol = 1 must be at most 0.1"]),
    ({"atol": math.inf}, ["atol = inf must be finite"]),
    ({"max_step": 0}, ["max_step = 0 must be positive"]),
    ({"max_step": 5e-324}, ["max_step = 4.94066e-324 s is shorter than 1e-12 s"]),
    ({"times": "all"}, ["times = 'all' is not a sequence of numbers"]),
    ({"times": [0, math.nan]}, ["times: nan at [1] is not a finite number"]),
    ({"inputs": "u"}, ["inputs = 'u'"]),
    ({"record": 3}, ["signals = 3: pass a list of names"]),
    ({"progress": "yes"}, ["progress = 'yes' must be True or False"]),
    ({"stop": "long"}, ["stop = 'long' is not a number with a unit, such as '1.5 s'"]),
    ({"stop": True}, ["stop = True s is not a finite number"]),
    ({"tol": 1e-6}, ["simulate() has no option tol; did you mean rtol or atol"]),
]


@pytest.mark.parametrize(("path", "said"), PATHS.items(), ids=map(str, PATHS))
def test_path_of_a_change(path: Any, said: list[str]) -> None:
    refused(pt.ParameterError, *said, do=lambda: pt.replace(Two(), {path: 2.0}))


@pytest.mark.parametrize(("options", "said"), OPTIONS, ids=[str(o) for o, _ in OPTIONS])
def test_option_of_a_run(options: dict[str, Any], said: list[str]) -> None:
    given = {"stop": 1.0, **options}
    refused(pt.ParameterError, *said, do=lambda: TWO.simulate(**given))
    refused(pt.ParameterError, *said, do=lambda: pt.simulate(TWO, **given))


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (lambda t: t, ["input u is a function", "(times, [u(t) for t in times])"]),
        ("full", ["input u = 'full'", "(times, values) of equal length"]),
        (([0, 1], [1, [2, 3]]), ["input u", "(times, values)"]),
        (([0, 1], [1, 2], [3]), ["input u", "(times, values)"]),
        (([1, 0], [1, 2]), ["times that do not decrease"]),
        ((np.array([0, 1], "timedelta64[s]"), [1, 2]), ["input u", "give times in seconds"]),
        ((np.array(["2026-01-01T00", "2026-01-01T01"], "datetime64"), [1, 2]), ["input u", "give times in seconds"]),
        (([0, 1], np.array([1 + 1j, 2])), ["input u", "(1+1j) is not a real number"]),
    ],
)
def test_input(value: Any, said: list[str]) -> None:
    refused(pt.ParameterError, *said, do=lambda: DRIVEN.simulate(1.0, inputs={"u": value}))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Two(exact="no"), "Two.exact = 'no' is not a bool"),  # type: ignore[arg-type]
        (lambda: Two(exact=1), "Two.exact = 1 is not a bool"),  # type: ignore[arg-type]
        (lambda: Two(n=2.5), "Two.n = 2.5 is not an int"),  # type: ignore[arg-type]
        (lambda: Two(n=True), "Two.n = True is not an int"),
        (lambda: Inertia(J=True), "Inertia.J = True is not a number (Moment of inertia"),
        (lambda: Inertia(J="1.0"), "Inertia.J = '1.0' is a text without a unit"),  # type: ignore[arg-type]
        (lambda: Inertia(J=np.array([1.0, 2.0])), "is not a number"),  # type: ignore[arg-type]
        (lambda: SignTorque(tau_nominal=1.0, reg="tanh"), "reg = 'tanh' is none of 'exp', 'sine', 'linear', 'cosine'"),  # type: ignore[arg-type]
        (lambda: pt.Map.curve([0, 1], ["a", "b"]), "'a' is not a real number"),
        (lambda: pt.Map.curve(np.array([0, 1], "timedelta64[s]"), [1, 2]), "give times in seconds"),
        (lambda: pt.Map.curve([0, 1], [1, [2, 3]]), "[2, 3] is not a real number"),  # type: ignore[arg-type]
        (lambda: pt.Map("xy", [1], "1"), "axes = 'xy': give a list of Axis(name, unit, points)"),  # type: ignore[arg-type]
        (lambda: pt.Map.from_csv(3), "path = 3 is not the path of a file"),  # type: ignore[arg-type]
        (lambda: pt.energy_audit(3), "takes the result of a simulation, not 3"),  # type: ignore[arg-type]
        (lambda: pt.schematic("car"), "a model is a component, not 'car'"),  # type: ignore[arg-type]
        (lambda: pt.eigenmodes("car"), "a model is a component, not 'car'"),  # type: ignore[arg-type]
        (lambda: pt.linearize(TWO, inputs=3), "inputs = 3: pass a list of names"),  # type: ignore[arg-type]
        (lambda: pt.replace(3, {"a": 1}), "replace() requires a component, not 3"),  # type: ignore[type-var]
    ],
)
def test_kind_of_a_value(make: Callable[[], Any], said: str) -> None:
    refused(pt.ParameterError, said, do=make)


def test_unit_is_a_text() -> None:
    refused(pt.ModelError, "None is not a unit", do=lambda: pt.Axis("x", None, [0, 1]))  # type: ignore[arg-type]


def test_whole_numbers_of_numpy_are_taken() -> None:
    assert Two(n=np.int64(4), exact=np.bool_(False)).n == 4  # type: ignore[arg-type]
    assert TWO.simulate(np.float64(0.1), starts={"J1.w": np.float32(1)}).time[-1] == 0.1  # type: ignore[dict-item]


@pytest.mark.parametrize("given", [lambda m: m.J1.w, "J1.w", 1.0, ["J1.w"]])
def test_expressions_of_a_result(given: Any) -> None:
    result = TWO.simulate(0.1)
    refused(pt.ParameterError, "pass a list of expressions", "result[...]", do=lambda: result.evaluate(given))
