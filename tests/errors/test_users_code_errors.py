"""What a component's text raises comes with the component and the line; what it gives is looked at."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pandas as pd
import pytest
from refusals import refused

import powertrain as pt
from powertrain.components.blocks import TimeTable
from powertrain.components.rotational import Flange, IdealPlanetary, Inertia, LossyGear, Torque


class Part(pt.Component):
    """A torque by any function of the part."""

    law: Any
    J: Inertia = Inertia(J=1.0)
    source: Torque = Torque()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.source.flange, self.J.flange_a)
        yield self.source.tau.value == self.law(self)


class Whole(pt.Component):
    """A part with such a torque."""

    part: Part

    def equations(self) -> pt.Equations:
        yield from ()


def gain(m: Any) -> Any:
    table: dict[str, float] = {}
    return table["gain"] * m.J.w


def assigned(m: Any) -> Any:
    m.J.w = 3
    return m.J.w


TEXTS: dict[str, tuple[Callable[[Any], Any], list[str]]] = {
    "key": (gain, ['table["gain"]', "this raises KeyError: 'gain'"]),
    "division": (lambda m: m.J.w * (1 / 0), ["ZeroDivisionError"]),
    "signal": (lambda m: 2 * m.source.tau, ["2 * m.source.tau", "an Input is a port; write .value for its value"]),
    "function": (
        lambda m: pt.sin(m.J.w),  # type: ignore[attr-defined]
        ["lambda m: pt.sin(m.J.w)", "functions of expressions are those of CasADi: casadi.sin"],
    ),
    "type": (lambda m: "a" + m.J.w, ["this raises TypeError"]),
    "assignment": (assigned, ["m.J.w = 3", "w cannot be assigned a value", "an equation is written  yield a == b"]),
    "recursion": (lambda m: m.law(m), ["this calls itself without end"]),
    "column": (lambda m: ca.vertcat(m.J.w, 1), ["between single expressions, this one has 2 x 1"]),
    "array": (lambda m: np.array([1.0, 2.0]), ["single expressions"]),
    "foreign symbol": (lambda m: ca.SX.sym("gain"), ["gain is not a variable of the model"]),
    "switch of a text": (lambda m: pt.switch("w > 0", 1, 2), ["switch requires expressions", "not 'w > 0'"]),  # type: ignore[arg-type]
    "der of a text": (lambda m: pt.der("w"), ["der requires expressions of variables and numbers, not 'w'"]),  # type: ignore[arg-type]
    "schedule of a text": (lambda m: pt.schedule("t", [1]), ["schedule requires sequences of numbers"]),
    "wrong function": (lambda m: ca.if_else(m.J.w, "a", 1), ["CasADi cannot compute this", "if_else"]),  # type: ignore[arg-type]
}


@pytest.mark.parametrize(("law", "said"), TEXTS.values(), ids=TEXTS)
def test_text_that_fails(law: Callable[[Any], Any], said: list[str]) -> None:
    message = refused(
        pt.ModelError, "part: ", "(test_users_code_errors.py:", *said, do=lambda: pt.compile(Whole(part=Part(law=law)))
    )
    assert len(message) < 400


def test_condition_may_be_known() -> None:
    result = pt.simulate(Part(law=lambda m: pt.switch(True, 2.0, m.J.w)), 1.0)  # type: ignore[arg-type]
    assert result["J.w"][-1] == pytest.approx(2.0)


def test_fields_of_quantities_have_plain_names() -> None:
    def define() -> None:
        class Hidden(pt.Component):
            _x: pt.Variable = pt.variable("1", "Hidden")

    refused(pt.ModelError, "Hidden._x", "must not begin with an underscore", do=define)


@pytest.mark.parametrize("kind", ["Hub", None, Flange()])
def test_a_port_has_a_class(kind: Any) -> None:
    def define() -> None:
        class Rotor(pt.Component):
            hub: Flange = pt.port(kind)

    refused(pt.ModelError, "Rotor.hub", "write  hub: Flange = port(Flange)", do=define)


class Listed(pt.Component):
    """Parts in a list."""

    js: Any = (Inertia(J=1.0),)

    def equations(self) -> pt.Equations:
        yield from ()


def test_list_of_parts() -> None:
    refused(pt.ModelError, "Listed.js is a list of components; use a tuple", do=lambda: Listed(js=[Inertia(J=1.0)]))


def test_part_that_contains_itself() -> None:
    whole = Listed()
    whole._values["js"] = whole
    refused(pt.ModelError, "js: Listed contains itself", do=lambda: pt.compile(whole))


class Terms(pt.Component):
    """An inertia with any loss and energy."""

    terms: Any
    J: Inertia = Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield from ()

    def loss(self) -> pt.Symbol:
        return self.terms()  # type: ignore[no-any-return]

    def energy(self) -> pt.Symbol:
        return pt.Symbol(0)


@pytest.mark.parametrize(
    ("terms", "said"),
    [
        (lambda: None, ["the model: loss() of Terms returns None instead of one expression", "return ..."]),
        (lambda: "much", ["returns 'much'"]),
        (lambda: ca.SX.ones(2), ["instead of one expression"]),
        (lambda: 1 / 0, ["the model: ", "ZeroDivisionError", "test_users_code_errors.py:"]),
    ],
)
def test_loss(terms: Callable[[], Any], said: list[str]) -> None:
    result = pt.simulate(Terms(terms=terms), 0.1)
    refused(pt.ModelError, *said, do=lambda: pt.energy_audit(result))


@pytest.mark.parametrize("table", [((0.0, 0.5), (1.0,)), (1, 2), "flat", ((0.0, "a", 1.0, 0.0, 0.0),)])
def test_table_of_losses(table: Any) -> None:
    refused(pt.ParameterError, "lossTable", "the row", do=lambda: pt.compile(LossyGear(ratio=1.0, lossTable=table)))


class Reset(pt.Component):
    """A planetary whose carrier's angle is reset."""

    a: Inertia = Inertia(J=1.0)
    b: Inertia = Inertia(J=1.0)
    gear: IdealPlanetary = IdealPlanetary(ratio=2.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.a.flange_b, self.gear.sun)
        yield pt.connect(self.b.flange_b, self.gear.ring)
        yield pt.when(pt.time > 0.5, pt.reinit(self.gear.carrier.phi, 5))


def test_reset_of_what_is_no_state_names_the_states() -> None:
    refused(
        pt.ModelError,
        "reinit of gear.carrier.phi",
        "not a state of the model",
        "a.phi",
        "b.phi",
        "reset these",
        do=lambda: pt.compile(Reset()),
    )


@pytest.mark.parametrize(
    ("table", "said"),
    [
        (((0.0, 0.0), (1.0,)), "TimeTable.table is not a table of rows of numbers: the row (1.0,) is not 2 finite"),
        (((0.0, "a"), (1.0, 2.0)), "the row (0.0, 'a')"),
        (((0.0, 0.0), (1.0, math.nan)), "the row (1.0, nan)"),
        ("flat", "the row 'f'"),
        (5, "table = 5 is not a table"),
        ((), "it has rows"),
        (
            pd.DataFrame({"t": [0.0, 1.0], "y": [0.0, 2.0]}),
            "DataFrame is not a table of rows of numbers; write .to_numpy()",
        ),
        (((1.0, 0.0), (0.0, 1.0)), "times do not decrease"),
    ],
)
def test_table_over_time(table: Any, said: str) -> None:
    refused(pt.ParameterError, said, do=lambda: TimeTable(table=table))
