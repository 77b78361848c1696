"""Wrong values say their range and unit, wrong names what was meant."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from refusals import refused

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Sine


class Shaft(pt.Component):
    """A driven shaft."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    drive: rot.ConstantTorque = rot.ConstantTorque(tau_constant=2.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.J1.flange_a)


@pytest.fixture(scope="module")
def plant() -> pt.Plant[Shaft]:
    return pt.compile(Shaft())


@pytest.mark.parametrize(
    ("do", "said"),
    [
        (
            lambda: rot.Inertia(J=-1.0),
            ["Inertia.J = -1 kg.m2", "outside its range [0, inf) kg.m2", "Moment of inertia"],
        ),
        (lambda: rot.Inertia(J=float("nan")), ["Inertia.J = nan kg.m2"]),
        (lambda: rot.Inertia(J="heavy"), ["Inertia.J = 'heavy' is not a number", "kg.m2"]),  # type: ignore[arg-type]
        (lambda: rot.Gear(ratio=1.0, efficiency=1 + 1e-13), ["Gear.efficiency = 1.0000000000001 is outside", "1]"]),
        (rot.Inertia, ["Inertia.J must be given", "kg.m2"]),
        (lambda: rot.Inertia(Jay=1.0), ["Inertia has no field Jay", "its fields: J"]),  # type: ignore[call-arg]
        (lambda: rot.Gear(ratio=2.0, eficiency=0.9), ["no field eficiency", "did you mean efficiency?"]),  # type: ignore[call-arg]
        (lambda: pt.replace(Shaft(), {"J2.J": 1.0}), ["Shaft has no field J2", "did you mean J1?"]),
    ],
)
def test_wrong_value(do: Callable[[], Any], said: list[str]) -> None:
    refused(pt.ParameterError, *said, do=do)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (
            {"value": rot.Inertia},
            ["Shaft.J1 must be of class Inertia, not Inertia itself", "write Inertia(...)"],
        ),
        ({"value": Sine(f=1.0)}, ["Shaft.J1 must be", "Inertia", "not Sine"]),
        ({"value": 3.0}, ["Shaft.J1 must be", "Inertia", "not float"]),
    ],
)
def test_wrong_kind_in_a_slot(given: dict[str, Any], said: list[str]) -> None:
    refused(pt.ModelError, *said, do=lambda: Shaft(J1=given["value"]))


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"parameters": {"J1.j": 1.0}}, ["no parameter J1.j", "did you mean J1.J?"]),
        ({"parameters": {"J1.J": -2.0}}, ["J1.J = -2 kg.m2 is outside its range [0, inf) kg.m2"]),
        ({"parameters": {"J1.J": None}}, ["J1.J = None is not a number"]),
        ({"starts": {"J1.om": 1.0}}, ["starts: the model has no variable J1.om"]),
        ({"starts": {"J1.w": float("nan")}}, ["starts: J1.w = nan is not a finite number"]),
        ({"guesses": {"J1.ww": 1.0}}, ["guesses: the model has no variable J1.ww", "J1.w"]),
        ({"inputs": {"torque": 1.0}}, ["no input torque"]),
        ({"inputs": {"J1.J": 1.0}}, ["no input J1.J; it is a parameter", 'parameters={"J1.J": ...}']),
        ({"stop": -1.0}, ["stop = -1 s is before start = 0 s"]),
        ({"stop": float("nan")}, ["stop = nan s"]),
        ({"stop": "1 m"}, ["stop = '1 m'", "m cannot be converted to s"]),
        ({"stop": "1"}, ["stop = '1' is not a number with a unit, such as '1.5 s'"]),
        ({"times": [0.0, 2.0]}, ["times: 2 s lies outside the simulated span [0, 1] s"]),
        ({"times": [0.5, 0.2]}, ["must not decrease"]),
        ({"points": 0}, ["points = 0"]),
        ({"record": ["J1.v"]}, ["no signal J1.v"]),
        ({"method": "euler"}, ["method", "euler", "dopri5"]),
        ({"rtol": -1.0}, ["rtol", "-1"]),
        ({"max_step": 0.0}, ["max_step"]),
    ],
)
def test_wrong_option(plant: pt.Plant[Shaft], options: dict[str, Any], said: list[str]) -> None:
    refused(pt.ParameterError, *said, do=lambda: plant.simulate(**{"stop": 1.0, **options}))


def test_unknown_result(plant: pt.Plant[Shaft]) -> None:
    result = plant.simulate(0.1)
    refused(pt.ParameterError, "no signal J1.W", "did you mean", "J1.w", do=lambda: result["J1.W"])
    refused(pt.ParameterError, "Inertia has no field om", "w", do=lambda: result[lambda m: m.J1.om])  # type: ignore[attr-defined]


def test_unknown_port() -> None:
    class Misspelt(pt.Component):
        J1: rot.Inertia = rot.Inertia(J=1.0)
        drive: rot.ConstantTorque = rot.ConstantTorque(tau_constant=2.0)

        def equations(self) -> pt.Equations:
            yield pt.connect(self.drive.flange, self.J1.flange_c)  # type: ignore[attr-defined]

    refused(
        pt.ModelError,
        "self.J1.flange_c",
        "J1 (Inertia) has no flange_c; did you mean flange_",
        do=lambda: pt.compile(Misspelt()),
    )
