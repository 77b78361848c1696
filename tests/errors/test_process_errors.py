"""What cannot go to another process is named."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
import pytest
from refusals import refused

import powertrain as pt
from powertrain.components import rotational as rot


def test_unpicklable_function_is_named() -> None:
    plant = pt.compile(OwnTorque(law=lambda w: -w))
    said = ("OwnTorque.law = <function", "lambda", "cannot be sent to another process", "top level of a module")
    refused(pt.ParameterError, *said, do=lambda: pickle.dumps(plant))
    with ProcessPoolExecutor(1) as pool:
        refused(pt.ParameterError, *said, do=lambda: pool.submit(run, plant).result())


class OwnTorque(pt.Component):
    """A shaft with a torque by a user's function."""

    law: Callable[[pt.Symbol], pt.Symbol]
    J1: rot.Inertia = rot.Inertia(J=1.0)
    source: rot.Torque = rot.Torque()
    w: pt.Output = pt.signal_output("N.m", "torque")

    def equations(self) -> pt.Equations:
        yield self.w.value == self.law(self.J1.w)
        yield pt.connect(self.w, self.source.tau)
        yield pt.connect(self.source.flange, self.J1.flange_a)


def test_what_was_pickled_with_other_fields_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    model = OwnTorque(law=drag)
    packed = pickle.dumps((model, pt.compile(model).simulate(1.0)))
    fields = {name: spec for name, spec in rot.Inertia._fields.items() if name != "J"}
    monkeypatch.setattr(rot.Inertia, "_fields", {**fields, "mass": pt.parameter("kg", "Mass")})
    old, result = pickle.loads(packed)
    assert repr(old.J1) == "Inertia(J=1.0)"
    assert result["J1.w"].size == result.time.size
    said = "J1: this Inertia was pickled with another version of its class, which differs in J, mass"
    refused(pt.ParameterError, said, do=lambda: pt.compile(old))
    refused(pt.ParameterError, said, do=lambda: pt.energy_audit(result))


def test_a_result_with_other_signals_than_its_model_is_refused() -> None:
    result = pickle.loads(pickle.dumps(pt.simulate(OwnTorque(law=drag), 1.0)))
    result._signals.names[0] = "as it was called before"
    refused(pt.ParameterError, "pickled with another version of powertrain or of the model", do=lambda: result.compiled)


def run(plant: pt.Plant[Any]) -> float:
    return float(plant.simulate(1.0, starts={"J1.w": 1.0})["J1.w"][-1])


def drag(w: pt.Symbol) -> pt.Symbol:
    return -w


def test_function_of_a_module_goes_to_a_process() -> None:
    plant = pt.compile(OwnTorque(law=drag))
    with ProcessPoolExecutor(1) as pool:
        assert pool.submit(run, plant).result() == pytest.approx(np.exp(-1.0), rel=1e-5)
