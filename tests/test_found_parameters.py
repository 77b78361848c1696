"""Parameters that ``pt.steady`` finds stay within their ranges and meet the conditions of the model."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

import powertrain as pt
from powertrain.components.rotational import Damper, Fixed, Inertia, Torque


class Braked(pt.Component):
    """A torque turns three dampers. The model sets the damping of one by the others', which must stay below a limit."""

    torque: pt.Input = pt.signal_input("N.m", "Torque")
    limit: pt.Parameter = pt.parameter("N.m.s/rad", "Largest damping", default=8.0)
    whole: pt.Parameter = pt.parameter("N.m.s/rad", "Damping of the first two", default=2.0)
    source: Torque = Torque()
    rotor: Inertia = Inertia(J=1.0)
    damper: Damper = Damper(d=1.0)
    other: Damper = Damper(d=1.0)
    third: Damper = Damper(d=0.0)
    ground: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque, self.source.tau)
        yield pt.connect(self.source.flange, self.rotor.flange_a)
        yield pt.connect(self.rotor.flange_b, self.damper.flange_a, self.other.flange_a, self.third.flange_a)
        yield pt.connect(self.damper.flange_b, self.other.flange_b, self.third.flange_b, self.ground.flange)
        yield self.other.d == self.whole - self.damper.d

    def check(self) -> pt.Equations:
        yield self.whole < self.limit


@pytest.mark.parametrize(
    ("free", "torque", "value", "named"),
    [
        ("third.d", 3.0, 0.5, "third.d (its range)"),
        ("whole", -5.0, 2.5, "other.d"),
        ("whole", 20.0, 2.5, "self.whole < self.limit"),
    ],
)
def test_a_parameter_is_found_within_its_range(free: str, torque: float, value: float, named: str) -> None:
    grid: dict[str, Any] = {"rotor.w": 2.0, "torque": [5.0, torque]}
    found = pt.steady(Braked(), grid, outputs=free, free=[free])
    meanings = dict(zip(found.status.flag_values, found.status.flag_meanings.split(), strict=True))
    assert [meanings[int(s)] for s in found.status] == ["ok", "outside_range"]
    np.testing.assert_allclose(found[free], [value, np.nan])
    assert named in found.problems


def test_a_parameter_that_is_found_is_among_the_results() -> None:
    found = pt.steady(Braked(), {"rotor.w": 2.0, "torque": [5.0]}, free=["third.d"])
    np.testing.assert_allclose(found["third.d"], [0.5])
    assert found["third.d"].attrs["units"] == "N.m.s/rad"


@pytest.mark.parametrize("argument", ["free", "held"])
def test_a_name_is_given_once(argument: str) -> None:
    named: Any = {argument: ["third.d"] * 2 if argument == "free" else ["rotor.w"] * 2}
    with pytest.raises(pt.ParameterError, match=f"{argument}: {named[argument][0]} appears twice"):
        pt.steady(Braked(), {"rotor.w": 2.0, "rotor.a": 0.0}, inputs={"torque": 5.0}, **named)


def test_derivatives_with_respect_to_a_name_given_twice_are_given_once() -> None:
    grid: dict[str, Any] = {"torque": [5.0], "whole": 2.0}
    once, twice = (pt.steady_gradient(Braked(), grid, wrt, outputs="rotor.w") for wrt in ("whole", ["whole", "whole"]))
    xr.testing.assert_identical(once, twice)
