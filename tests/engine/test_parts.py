"""Long steps of machine code: what is constant is computed once, and the step in parts is the step in one function."""

from __future__ import annotations

import shutil
import time
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from models import COUPLED_PARAMETERS, COUPLED_START, coupled_clutches, dae, implicit, nonlinear

import powertrain as pt
from powertrain.dae.hybrid import Contact, Guard, HybridDae, Opened
from powertrain.engine.simulator import Simulator
from powertrain.integration import fused as steps
from powertrain.integration.parts import Parts, in_parts
from powertrain.integration.sparse_step import SparseStep
from powertrain.numerics.background import progress
from powertrain.numerics.buffers import Memory, bound
from powertrain.numerics.compiled import compile_functions, uncompiled
from powertrain.numerics.hoisting import hoisted

COMPILER = pytest.mark.skipif(not (shutil.which("cc") or shutil.which("gcc")), reason="no C compiler on this machine")


def guarded() -> HybridDae:
    """A model with parameters and held values in its rates, one of two values outside its range."""
    t, x, m, p = ca.SX.sym("t"), ca.SX.sym("x", 2), ca.SX.sym("m", 1), ca.SX.sym("p", 2)
    rates = ca.vertcat(x[1], -ca.exp(p[0]) * x[0] - ca.if_else(m[0] == 1, p[1] ** 2, 0.3) * x[1] + ca.sin(t))
    inside, outside = (
        Guard(name, "", x[0], ca.SX(low), ca.SX(1.0), "", "count") for name, low in (("inside", -1.0), ("outside", 0.9))
    )
    return dae(t, x, m, p, rates, ["a", "b"], guards=(inside, outside))


def on_a_moving_ramp() -> HybridDae:
    """A mass on a closed contact whose gap bends with the position, and with time."""
    t, x, m, p = ca.SX.sym("t"), ca.SX.sym("x", 2), ca.SX.sym("m", 1), ca.SX.sym("p", 0)
    force, none, one = ca.SX.sym("force"), ca.SX(0, 1), ca.SX(1)
    gap = x[0] ** 2 - 0.1 - ca.sin(3 * t)
    opened = Opened(force, ca.vertcat(x[1], force - 9.81), none, one, one, none, none, none, one, one, none)
    contact = Contact("ramp", "", 0, gap, one, one, one, ca.SX(0))
    return dae(t, x, m, p, ca.vertcat(x[1], -x[0]), ["y", "v"], contacts=(contact,), opened=opened)


MODELS = {"two": nonlinear(), "implicit": implicit(), "clutches": coupled_clutches(), "guarded": guarded()}
PAIRS = [(name, "rodas5p") for name in MODELS] + [(name, "dopri5") for name in MODELS if name != "implicit"]


class OneStep:
    """Steps of a model from one point."""

    def __init__(self, model: HybridDae, method: str, make: Any = None) -> None:
        common = steps.Model(model, [1, 0, 2] if model.z.numel() else None, ca.MX if make else ca.SX)
        self.memory, self.n = Memory(model, common.indicators, 0), model.x.numel() + model.z.numel()
        self.memory.time[:] = 0.2, 1e-3
        self.memory.y[0][: self.n] = 0.3 + 0.1 * np.arange(self.n)
        self.memory.p[: model.p.numel()] = 1.0 + 0.1 * np.arange(model.p.numel())
        self.memory.reached[0][: self.n] = 0.1 * self.memory.y[0][: self.n]
        self.memory.reached[0][self.n :] = 1e6  # the indicators fall steeply
        if make:
            self.call = Parts(make(in_parts(common, method)), self.memory).calls[0]
            return
        memory = self.memory
        given = [memory.time, memory.y[0], memory.m, memory.p, memory.reached[0], memory.tolerance]
        found = [memory.y[1], memory.reached[1], memory.info, memory.dense, memory.outside]
        self.call = bound(steps.step(common, method), given, found)

    def after(self, rtol: float = 100.0) -> dict[str, Any]:
        """What memory holds after a step."""
        self.memory.tolerance[:] = rtol
        self.call()
        m = self.memory
        return {
            name: a.copy()
            for name, a in {
                "info": m.info,
                "dense": m.dense,
                "y": m.y[1],
                "reached": m.reached[1],
                "outside": m.outside,
            }.items()
        }


@COMPILER
@pytest.mark.parametrize(("name", "method"), PAIRS)
def test_a_step_in_parts_is_the_step_in_one_function(name: str, method: str, tmp_path: Path, monkeypatch: Any) -> None:
    """Also after held values and parameters have changed, one at a time."""
    monkeypatch.setenv("POWERTRAIN_CACHE", str(tmp_path))
    model = MODELS[name]
    for make in (compile_functions, uncompiled):
        whole, parts = OneStep(model, method), OneStep(model, method, make)
        for change in ("", "m", "p", "m"):
            for each in (whole, parts):
                if change:
                    getattr(each.memory, change)[: getattr(model, change).numel()] += 1.0
            expected, found = whole.after(), parts.after()
            assert expected["info"][0] <= 1.0
            for key, value in found.items():
                np.testing.assert_allclose(value, expected[key], rtol=1e-9, atol=1e-12, err_msg=key)
    assert name != "guarded" or expected["outside"].tolist() == [0.0, 1.0]


@pytest.mark.parametrize("h", [1e-3, 0.05])
@pytest.mark.parametrize("model", [*MODELS.values(), on_a_moving_ramp()], ids=[*MODELS, "ramp"])
def test_a_step_by_sparse_factors_is_the_step_in_one_function(model: HybridDae, h: float) -> None:
    """Unknowns, dense output, error, indicators and what is out of its range; from both sides of the buffer."""
    whole = OneStep(model, "rodas5p")
    whole.memory.m[: len(model.contacts)] = 1.0
    whole.memory.time[1] = h
    rates = ca.Function("f", [model.t, model.x, model.z, model.m, model.p], [ca.vertcat(model.xdot, model.residual)])
    whole.memory.reached[0][: whole.n] = np.array(rates(*whole.memory.instant(0))).ravel()
    expected = whole.after()
    expected["info"][4] = 0.0  # the explicit method's ratio
    expected["indicators"] = expected["reached"][whole.n :]
    np.testing.assert_allclose(expected["dense"].reshape(5, -1).sum(axis=0), expected["y"], rtol=1e-12)
    for side in (0, 1):
        sparse = OneStep(model, "rodas5p")
        memory = sparse.memory
        memory.y[side][:], memory.reached[side][:] = whole.memory.y[0], whole.memory.reached[0]
        memory.time[1], memory.m[:] = h, whole.memory.m
        sparse.call = SparseStep(steps.Model(model), memory).calls[side]
        found = sparse.after() | {"y": memory.y[1 - side], "indicators": memory.reached[1 - side][whole.n :]}
        for key in ("y", "dense", "info", "outside", "indicators"):
            np.testing.assert_allclose(found[key], expected[key], rtol=1e-8, atol=1e-10, err_msg=key)


@pytest.mark.parametrize("rate", [lambda x: ca.sqrt(x[0] - 0.2999) - 100 * x[0], lambda x: ca.sqrt(x[0] - 0.3)])
def test_a_step_by_sparse_factors_without_values_is_rejected(rate: Any) -> None:
    """A root that has no value at the stages, or no slope at the start."""
    t, x, m, p = ca.SX.sym("t"), ca.SX.sym("x", 1), ca.SX.sym("m", 0), ca.SX.sym("p", 0)
    one = OneStep(dae(t, x, m, p, rate(x), ["a"]), "rodas5p")
    one.call = SparseStep(steps.Model(dae(t, x, m, p, rate(x), ["a"])), one.memory).calls[0]
    assert np.isnan(one.after()["info"][0])


@pytest.mark.parametrize("error", [0.9, 1.1])
def test_a_rejected_step_ends_after_its_first_part(error: float) -> None:
    whole, parts = OneStep(MODELS["clutches"], "dopri5"), OneStep(MODELS["clutches"], "dopri5", uncompiled)
    for each in (whole, parts):
        each.memory.time[1] = 0.05
    tolerance = 100 * whole.after(100)["info"][0] / error
    found, expected = parts.after(tolerance), whole.after(tolerance)
    assert found["info"][0] == pytest.approx(error, rel=1e-6)
    if error < 1:
        np.testing.assert_allclose(found["info"], expected["info"], rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(found["reached"], expected["reached"], rtol=1e-9, atol=1e-12)
    else:
        assert not found["info"][1:].any()
        assert not found["reached"].any()


@pytest.mark.parametrize("seed", range(4))
def test_what_depends_on_constants_is_computed_apart(seed: int) -> None:
    rng = np.random.default_rng(seed)
    x, m, p = ca.SX.sym("x", 2), ca.SX.sym("m", 2), ca.SX.sym("p", 2)
    fixed = ca.sin(p[0]) * ca.exp(m[1]) + p[1] ** 2
    outputs = [ca.densify(ca.vertcat(x[0] * fixed, ca.if_else(m[0] == 0, x[1], fixed), fixed, p[0], 2)), ca.SX(2, 2)]
    outputs.append(ca.jacobian(ca.vertcat(x[0] * fixed, x[1]), x))
    function, prepare = hoisted("f", [x], [m, p], outputs)
    values = [rng.normal(size=2) for _ in range(3)]
    whole = ca.Function("whole", [x, m, p], outputs)(*values)
    found = function(*values, prepare(*values[1:]))
    for a, b in zip(found, whole, strict=True):
        assert a.sparsity() == b.sparsity()
        np.testing.assert_array_equal(np.array(a), np.array(b))
    operations = {function.instruction_id(k) for k in range(function.n_instructions())}
    assert ca.OP_SIN not in operations
    assert ca.OP_EXP not in operations


def test_divisions_by_constants_are_multiplications() -> None:
    x, m, p = ca.SX.sym("x", 2), ca.SX.sym("m", 1), ca.SX.sym("p", 2)
    outputs = [ca.vertcat(x[0] / p[0], x[1] / (m + p[1]), ca.sin(x[0]) / (m + p[1]), x[0] / x[1])]
    function, prepare = hoisted("f", [x], [m, p], outputs)
    values = [np.array([0.3, -0.7]), np.array([2.0]), np.array([3.0, 0.1])]
    whole = ca.Function("whole", [x, m, p], outputs)(*values)
    np.testing.assert_allclose(function(*values, prepare(*values[1:])), whole, rtol=1e-15)
    operations = [function.instruction_id(k) for k in range(function.n_instructions())]
    assert operations.count(ca.OP_DIV) == 1


@pytest.mark.slow
@COMPILER
@pytest.mark.parametrize("compile", [True, "background"])
def test_runs_in_parts_switch_as_interpreted_ones(compile: Any, tmp_path: Path, monkeypatch: Any) -> None:
    """A car, whose steps are long enough."""
    monkeypatch.setenv("POWERTRAIN_CACHE", str(tmp_path))
    plant = pt.compile(pt.vehicles.SplitPathCar())
    plain, first = (plant.simulate(60.0, compile=c) for c in (False, compile))
    deadline = time.monotonic() + 120.0
    while progress() and time.monotonic() < deadline:
        time.sleep(0.05)
    again = plant.simulate(60.0, compile=compile)
    for other in (first, again):
        assert [(e.name, e.old, e.new) for e in other.events] == [(e.name, e.old, e.new) for e in plain.events]
        assert [e.time for e in other.events] == pytest.approx([e.time for e in plain.events], abs=1e-6)
        assert other.statistics.keys() == plain.statistics.keys()
    outside = [key for key in plain.statistics if key.startswith("outside")]
    assert [again.statistics[key] for key in outside] == [plain.statistics[key] for key in outside]
    assert any("advance" in step for step in plant._engine("auto", compile)._machine_code.values())


@pytest.mark.slow
@COMPILER
@pytest.mark.parametrize(("long", "many", "parts"), [(10**9, 50, False), (0, 50, True), (10**9, 0, True)])
def test_parts_are_taken_for_long_steps_alone(
    long: int, many: int, parts: bool, tmp_path: Path, monkeypatch: Any
) -> None:
    monkeypatch.setenv("POWERTRAIN_CACHE", str(tmp_path))
    monkeypatch.setattr("powertrain.engine.prepared._LONG", long)
    monkeypatch.setattr("powertrain.engine.prepared._MANY", many)
    engine = Simulator(coupled_clutches(), "rodas5p", compile=True)
    engine.run(COUPLED_START, COUPLED_PARAMETERS, stop=0.1)
    assert ("advance" in engine._machine_code["rodas5p"]) == parts
