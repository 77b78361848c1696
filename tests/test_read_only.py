"""What looks like a setting and is none cannot be set; what a run was given does not change with the user's arrays."""

from __future__ import annotations

import copy
import json
import pickle
from collections.abc import Callable

import numpy as np
import pytest

import powertrain as pt


class Integrated(pt.Component):
    """x' = k u."""

    u: pt.Input = pt.signal_input("1", "Input")
    k: pt.Parameter = pt.parameter("1/s", "Gain", default=2.0)
    x: pt.Variable = pt.variable("1", "Integral")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.k * self.u.value


def test_parameters_are_not_set_in_place() -> None:
    plant = pt.compile(Integrated())
    result = plant.simulate(1.0, inputs={"u": 1.0})
    with pytest.raises(
        pt.ParameterError, match=r"parameters\['k'\] = 5\.0 would have no effect; .*simulate\(\.\.\., parameters="
    ):
        plant.parameters["k"] = 5.0
    changes: list[Callable[[dict[str, float]], object]] = [
        lambda p: p.update(k=5.0),
        lambda p: p.__ior__({"k": 5.0}),
        lambda p: p.setdefault("m", 5.0),
        lambda p: p.pop("k"),
        lambda p: p.popitem(),
        lambda p: p.clear(),
        lambda p: p.__delitem__("k"),
    ]
    for change in changes:
        with pytest.raises(pt.ParameterError, match="would have no effect; simulate again"):
            change(result.parameters)
    with pytest.raises(pt.ParameterError, match="simulate again"):
        result.parameters["k"] = 5.0
    changed = plant.parameters | {"k": 5.0}
    changed["k"] *= 2.0
    assert plant.simulate(1.0, inputs={"u": 1.0}, parameters=changed)["x"][-1] == pytest.approx(10.0)
    for again in (copy.deepcopy(plant.parameters), pickle.loads(pickle.dumps(plant.parameters))):
        assert again == json.loads(json.dumps(plant.parameters)) == {"k": 2.0}


def test_inputs_of_a_result_stay_as_they_were() -> None:
    times, values = np.array([0.0, 1.0]), np.array([1.0, 3.0])
    result = pt.simulate(Integrated(), 1.0, inputs={"u": (times, values)})
    values *= 10.0
    assert result.inputs["u"][1].tolist() == [1.0, 3.0]
    with pytest.raises(ValueError, match="read-only"):
        result.inputs["u"][1][0] = 5.0
    gradient = pt.gradient(result, pt.final("x"), ["u"])
    assert "u[1]  3" in str(gradient)
