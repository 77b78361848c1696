"""What jumps is declared or refused; what only bends is computed; what is computed is what the text says."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest

import powertrain as pt
from powertrain.compiler import walks
from powertrain.compiler.flatten import flatten
from powertrain.compiler.jumps import refuse_jumps
from powertrain.components.cvu import ElectricVariator
from powertrain.components.gearless.spherical_cam import SphericalCamDifferential
from powertrain.components.rotational import Gear, Inertia, Torque

pytestmark = pytest.mark.filterwarnings("ignore:(?s).*numpy function was called on a casadi value:FutureWarning")


class Shaft(pt.Component):
    """A shaft whose torque is any function of its speed, of time, of a held number and of a parameter."""

    law: Any
    J: Inertia = Inertia(J=1.0)
    source: Torque = Torque()
    k: pt.Parameter = pt.parameter("1", "A number", default=2.0)
    count: pt.Discrete = pt.discrete("1", "A held number", start=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.source.flange, self.J.flange_a)
        yield self.source.tau.value == self.law(self)
        yield pt.when(pt.time >= 0.5, pt.reinit(self.count, self.count + 1))


JUMPS: dict[str, Callable[[Any], Any]] = {
    "sign": lambda m: ca.sign(m.J.w),
    "sign beside a slope": lambda m: 2 * m.J.w + ca.sign(m.J.w),
    "square of a sign": lambda m: ca.sign(m.J.w) ** 2,
    "choice": lambda m: ca.if_else(m.J.w > 0, 1, -1),
    "comparison as a number": lambda m: 3 * (m.J.w > 5),
    "floor": lambda m: ca.floor(m.J.w),
    "ceil": lambda m: ca.ceil(m.J.w),
    "round": lambda m: round(m.J.w),
    "whole quotient": lambda m: m.J.w // 2,
    "remainder": lambda m: m.J.w % 3,
    "fmod": lambda m: ca.fmod(m.J.w, 3),
    "NumPy's where": lambda m: np.where(m.J.w > 0, 1, 2),
    "NumPy's heaviside": lambda m: np.heaviside(m.J.w, 0.5),
    "angle across the negative axis": lambda m: ca.atan2(m.J.w, m.J.a - 1),
    "copysign": lambda m: ca.copysign(2, m.J.w),
    "one instant": lambda m: ca.if_else(m.J.w == 0, 5, m.J.w),
    "truth of a number": lambda m: ca.if_else(m.J.w, 1, 0),
    "narrow band": lambda m: ca.if_else((m.J.w - 3) ** 2 < 1e-12, 1, 0),
    "two at once": lambda m: ca.if_else(ca.logic_and(m.J.w > 1, m.J.a < 1), 1, 0),
    "branches that nearly agree": lambda m: ca.if_else(m.J.w > m.k, m.k * m.J.w, m.k**2 + 1e-3),
    "branches that agree for one value of the parameter": lambda m: ca.if_else(m.J.w > 2, m.J.w, m.k),
    "derivative of a jump": lambda m: 1 + pt.der(ca.floor(m.J.w)),
    "beside a declared one": lambda m: pt.switch(m.J.w > 0, 1, 2) * ca.sign(m.J.w),
    "size over value": lambda m: ca.fabs(m.J.w) / m.J.w,
    "value over size": lambda m: m.J.w / ca.fabs(m.J.w),
    "value over sizes": lambda m: m.J.w / (ca.fabs(m.J.w) + m.J.w**2),
    "value over the larger size": lambda m: m.J.w / ca.fmax(2 * ca.fabs(m.J.w), m.J.w**2),
    "value over size and a trifle": lambda m: m.J.w / (ca.fabs(m.J.w) + 1e-15),
    "value over a size that underflows": lambda m: m.J.w * ca.fabs(m.J.w) / ca.fmax(ca.fabs(m.J.w), 1e-200) ** 2,
    "root over value": lambda m: ca.sqrt(m.k * (m.J.w - 1) ** 2) / (m.J.w - 1),
    "angle of a tangent": lambda m: ca.atan(2 * ca.tan(m.J.w)),
    "time": lambda m: ca.floor(pt.time),
    "period of time": lambda m: pt.switch(ca.fmod(pt.time, 2) > 1, 1, 2),
}
BENDS: dict[str, tuple[Callable[[Any], Any], Callable[[float], float]]] = {
    "fabs": (lambda m: ca.fabs(m.J.w), abs),
    "fmax": (lambda m: ca.fmax(m.J.w, 3), lambda w: max(w, 3)),
    "sign of what vanishes there": (
        lambda m: ca.sign(m.J.w) * (1 - ca.cos(m.J.w)),
        lambda w: np.sign(w) * (1 - np.cos(w)),
    ),
    "choice": (lambda m: ca.if_else(m.J.w > 0, m.J.w, 2 * m.J.w), lambda w: w if w > 0 else 2 * w),
    "choice at a parameter": (lambda m: ca.if_else(m.J.w > m.k, m.k * m.J.w, m.k**2), lambda w: 2 * w if w > 2 else 4),
    "quotient with its limit": (
        lambda m: ca.if_else(m.J.w == 0, 1, ca.sin(m.J.w) / m.J.w),
        lambda w: np.sinc(w / np.pi),
    ),
    "pole": (lambda m: 1 / (m.J.w - 5), lambda w: 1 / (w - 5)),
    "pole of a tangent": (lambda m: ca.tan(m.J.w), math.tan),
    "far beyond what is meant": (lambda m: ca.exp(-300 / (m.J.w + 273)), lambda w: math.exp(-300 / (w + 273))),
    "slip": (lambda m: m.J.w / ca.fmax(ca.fabs(m.J.w), 0.1), lambda w: w / max(abs(w), 0.1)),
    "saturation": (lambda m: m.J.w / ca.sqrt(1 + (1e9 * m.J.w) ** 2), lambda w: w / math.sqrt(1 + (1e9 * w) ** 2)),
    "root on one side": (lambda m: ca.if_else(m.J.w > 0, ca.sqrt(m.J.w), 0), lambda w: math.sqrt(max(w, 0))),
    "periodic": (lambda m: ca.cos(2 * np.pi * (m.J.w - ca.floor(m.J.w))), lambda w: np.cos(2 * np.pi * w)),
    "clip": (lambda m: np.clip(m.J.w, -1, 1), lambda w: min(max(w, -1), 1)),
    "condition that always holds": (lambda m: ca.if_else(m.J.w**2 + 1 > 0, m.J.w, 7), lambda w: w),
    "jump of a parameter": (lambda m: ca.floor(m.k + 0.6) * m.J.w, lambda w: 2 * w),
    "jump of a held value": (lambda m: ca.if_else(m.count > 1.5, 3, ca.sign(m.count)), lambda w: 1),
    "declared": (lambda m: pt.switch(m.J.w > 1, 1, 2), lambda w: 1 if w > 1 else 2),
}


@pytest.mark.parametrize("law", JUMPS.values(), ids=JUMPS)
def test_undeclared_jump_is_refused_with_its_line(law: Callable[[Any], Any]) -> None:
    with pytest.raises(pt.ModelError, match=r"(?s)\(test_jumps.py:\d+\).*makes this jump.*(switch|when|schedule)\("):
        pt.compile(Shaft(law=law))


@pytest.mark.parametrize(("law", "value"), BENDS.values(), ids=BENDS)
def test_what_does_not_jump_is_computed(law: Callable[[Any], Any], value: Callable[[float], float]) -> None:
    plant = pt.compile(Shaft(law=law))
    for w in -2.5, -0.4, 0.0, 0.7, 1.9, 3.3, 40.0:
        result = plant.simulate(0.0, starts={"J.w": w})
        assert result["source.tau"][0] == pytest.approx(value(w), abs=1e-12)


def test_rough_expressions_are_looked_at_in_few_places(monkeypatch: pytest.MonkeyPatch) -> None:
    places = 0
    codes = walks._Walk.codes

    def counted(walk: Any, line: Any, place: Any) -> Any:
        nonlocal places
        places += line.size
        return codes(walk, line, place)

    monkeypatch.setattr(walks._Walk, "codes", counted)
    refuse_jumps(flatten(SphericalCamDifferential()))
    assert places < 100_000  # 2.5 million where every change of every operation is narrowed down


def test_a_quotient_whose_divisor_is_positive_does_not_jump() -> None:
    """u/root(1 + u^2) of a sum whose round-off is far beyond one: a machine that is limited to 0.3 mN.m was refused."""
    small = ElectricVariator(k=0.1, tau_max_a=3e-4, tau_max_b=3e-4, copper=50, iron=2e-6, k_E=0.05, E_0=5e-3, slow=1e-3)
    refuse_jumps(flatten(small))


def test_held_value_in_a_jump_changes_with_its_event() -> None:
    law, _ = BENDS["jump of a held value"]
    result = pt.simulate(Shaft(law=law), 1.0)
    assert result["J.w"][-1] == pytest.approx(0.5 * 1 + 0.5 * 3, abs=1e-6)


class Geared(pt.Component):
    """A variable that follows from a held number through other variables decides where an expression jumps."""

    gear: pt.Discrete = pt.discrete("1", "Gear", start=1.0)
    chosen: pt.Variable = pt.variable("1", "The gear as a signal")
    twice: pt.Variable = pt.variable("1", "Twice the gear")
    ratio: pt.Variable = pt.variable("1", "Ratio")

    def equations(self) -> pt.Equations:
        yield self.ratio == ca.if_else(ca.fabs(self.twice - 4) < 0.5, 10, 20)
        yield self.twice == 2 * self.chosen
        yield self.chosen == self.gear
        yield pt.when(pt.time >= 0.5, pt.reinit(self.gear, 2))


def test_variable_that_follows_from_a_held_value_may_decide_a_jump() -> None:
    result = pt.simulate(Geared(), 1.0, times=[0, 0.25, 0.75])
    assert result["ratio"][0] == 20
    assert result["ratio"][-1] == 10


class Fixed(pt.Component):
    """A speed that stands still, in a sign."""

    w: pt.Variable = pt.variable("rad/s", "Speed")
    tau: pt.Variable = pt.variable("N.m", "Torque")

    def equations(self) -> pt.Equations:
        yield self.tau == ca.sign(self.w)
        yield self.w == -3


def test_jump_of_a_constant_is_its_value() -> None:
    assert pt.simulate(Fixed(), 1.0)["tau"][-1] == -1


def only_at(law: Callable[[Any], Any]) -> str:
    with pytest.raises(pt.ModelError) as caught:
        pt.compile(Shaft(law=law))
    return str(caught.value)


def test_advice_is_for_what_jumps() -> None:
    assert "schedule(times, values)" in only_at(JUMPS["time"])
    assert "count with a discrete variable" in only_at(JUMPS["floor"])
    assert "friction(w, torque, lower, upper)" in only_at(JUMPS["sign"])
    assert "from 1 to -1" in only_at(JUMPS["sign"]) or "from -1 to 1" in only_at(JUMPS["sign"])


@pytest.mark.parametrize(
    "law",
    [
        lambda m: 1 if float(m.J.w) > 0 else 2,
        lambda m: math.sin(m.J.w),
        lambda m: np.float64(m.J.w),
        lambda m: 3 * math.exp(m.k),
        lambda m: int(m.J.w),
    ],
)
def test_number_of_a_symbol_is_refused(law: Callable[[Any], Any]) -> None:
    said = only_at(law)
    assert re.search(r"yield self.source.tau.value == self.law\(self\) \(test_jumps.py:\d+\)", said)
    assert "a symbol has no value while the equations are read" in said


def test_line_with_nan_is_refused() -> None:
    assert "not a number (nan)" in only_at(lambda m: math.nan * m.J.w)


def test_float_of_a_symbol_is_left_alone_elsewhere() -> None:
    assert math.isnan(float(ca.SX.sym("x")))


class Square(ca.Callback):
    """A function in Python, without or with a derivative."""

    def __init__(self, slope: bool) -> None:
        ca.Callback.__init__(self)
        self.slope = slope
        self.construct("square", {})

    def eval(self, given: Any) -> Any:
        return [-0.1 * given[0] ** 2]

    def has_jacobian(self) -> bool:
        return self.slope

    def get_jacobian(self, name: str, inames: Any, onames: Any, opts: Any) -> Any:
        w, out = ca.MX.sym("w"), ca.MX.sym("out")
        return ca.Function(name, [w, out], [-0.2 * w], inames, onames, opts)


def test_callback_without_derivative_is_refused_with_what_works() -> None:
    square = Square(slope=False)
    said = only_at(lambda m: square(m.J.w))
    assert "square is a Python callback without derivatives" in said
    assert "Map.curve(points, [float(square(x)) for x in points]" in said


def test_what_the_message_offers_works() -> None:
    square, points = Square(slope=False), np.linspace(0, 4, 41)
    table = pt.Map.curve(points, [float(square(x)) for x in points], outside="clip", method="smooth")
    result = pt.simulate(Shaft(law=lambda m: table(m.J.w)), 1.0, starts={"J.w": 3.0})
    assert result["J.w"][-1] == pytest.approx(3 / 1.3, rel=1e-5)


def test_callback_with_derivative_is_called() -> None:
    square = Square(slope=True)
    result = pt.simulate(Shaft(law=lambda m: square(m.J.w)), 1.0, starts={"J.w": 3.0})
    assert result["J.w"][-1] == pytest.approx(3 / 1.3, rel=1e-5)


def test_function_that_hides_a_jump() -> None:
    w = ca.SX.sym("w")
    hidden = ca.Function("hidden", [w], [ca.floor(w)], {"never_inline": True})
    assert "hidden contains a comparison" in only_at(lambda m: hidden(m.J.w))


def test_gear_without_ratio() -> None:
    with pytest.raises(pt.ParameterError, match=r"Gear.ratio = 0 is outside its range .* without 0"):
        Gear(ratio=0.0)
