"""Long steps of machine code: what is constant is computed once, and the step in three parts is the step in one."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from models import COUPLED_PARAMETERS, COUPLED_START, coupled_clutches
from test_methods import implicit, nonlinear

import powertrain as pt
from powertrain.compiler.hybrid import HybridDae
from powertrain.engine.simulator import Simulator
from powertrain.integration import fused as steps
from powertrain.integration.parts import Parts, in_parts
from powertrain.numerics.buffers import Bound, Memory
from powertrain.numerics.compiled import compile_functions, uncompiled
from powertrain.numerics.hoisting import hoisted

COMPILER = pytest.mark.skipif(not (shutil.which("cc") or shutil.which("gcc")), reason="no C compiler on this machine")
MODELS = {"two": nonlinear(), "implicit": implicit(), "clutches": coupled_clutches()}


def after(
    functions: dict[str, ca.Function], method: str, model: HybridDae, model_of_steps: steps.Common, rtol: float
) -> Memory:
    """What memory holds after one step."""
    memory = Memory(model, model_of_steps.indicators, 0)
    n = model.x.numel() + model.z.numel()
    memory.time[:], memory.tolerance[:], memory.y[0][:n] = (0.2, 1e-3), (rtol, rtol, 1e-3), 0.3 + 0.1 * np.arange(n)
    memory.p[: model.p.numel()] = 1.0 + 0.1 * np.arange(model.p.numel())
    memory.slope[0][:n] = 0.1 * memory.y[0][:n]
    step: Parts | Bound
    if len(functions) > 1:
        step = Parts(functions, method, memory, 0)
    else:
        given = [memory.time, memory.y[0], memory.m, memory.p, memory.slope[0], memory.tolerance]
        step = Bound(
            functions[method], given, [memory.y[1], memory.slope[1], memory.info, memory.dense, memory.outside]
        )
    step.call()
    return memory


@COMPILER
@pytest.mark.parametrize("method", ["dopri5", "rodas5p"])
@pytest.mark.parametrize("name", list(MODELS))
def test_a_step_in_parts_is_the_step_in_one_function(name: str, method: str, tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setenv("POWERTRAIN_CACHE", str(tmp_path))
    model = MODELS[name]
    if method == "dopri5" and model.z.numel():
        return
    rows = [1, 0, 2] if model.z.numel() else None
    whole = after(
        {method: steps.step(steps.common(model, rows), method)}, method, model, steps.common(model, rows), 100.0
    )
    assert whole.info[0] <= 1.0
    common = steps.common(model, rows, ca.MX)
    written = in_parts(common, method)
    for functions in (compile_functions(written), uncompiled(written)):
        found = after(functions, method, model, common, 100.0)
        for kept in ("info", "dense"):
            np.testing.assert_allclose(getattr(found, kept), getattr(whole, kept), rtol=1e-9, atol=1e-12)
        for side in ("y", "slope"):
            np.testing.assert_allclose(getattr(found, side)[1], getattr(whole, side)[1], rtol=1e-9, atol=1e-12)


def test_a_rejected_step_ends_after_its_first_part() -> None:
    model = MODELS["clutches"]
    common = steps.common(model, None, ca.MX)
    functions = uncompiled(in_parts(common, "dopri5"))
    rejected = after(functions, "dopri5", model, common, 1e-9)
    assert rejected.info[0] > 1.0
    assert not rejected.info[1:].any()
    assert not rejected.slope[1].any()


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


@COMPILER
@pytest.mark.parametrize("compile", [True, "background"])
def test_runs_in_parts_switch_as_interpreted_ones(compile: Any, tmp_path: Path, monkeypatch: Any) -> None:
    """A car with maps, whose steps are long enough."""
    monkeypatch.setenv("POWERTRAIN_CACHE", str(tmp_path))
    plant = pt.compile(pt.vehicles.SplitPathCar())
    results = [plant.simulate(60.0, compile=c) for c in (False, compile, compile)]
    for other in results[1:]:
        assert [(e.name, e.old, e.new) for e in other.events] == [(e.name, e.old, e.new) for e in results[0].events]
        assert [e.time for e in other.events] == pytest.approx([e.time for e in results[0].events], abs=1e-6)


@COMPILER
def test_parts_are_taken_for_long_steps_alone(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setenv("POWERTRAIN_CACHE", str(tmp_path))
    kinds = []
    for long in (10**9, 0):
        monkeypatch.setattr("powertrain.engine.prepared._LONG", long)
        engine = Simulator(coupled_clutches(), "rodas5p", compile=True)
        engine.run(COUPLED_START, COUPLED_PARAMETERS, stop=0.1)
        kinds.append({type(each) for each in engine._kept})
    assert kinds == [{Bound}, {Parts}]
