"""Order of the two methods and of their dense output, and the automatic choice between them."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import casadi as ca
import numpy as np
import pytest
from models import dae, exact, implicit, nonlinear

from powertrain.dae.hybrid import HybridDae
from powertrain.engine.simulator import Simulator
from powertrain.errors import ParameterError
from powertrain.integration import fused as steps


def march(model: HybridDae, name: str, y0: np.ndarray, end: float, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Equal steps; the end and the middle of the last step by dense output."""
    rows = None
    if model.z.numel():
        rows = [1, 0, 2]
    common = steps.Model(model, rows)
    step = steps.step(common, name)
    y, h, dense = y0, end / n, np.zeros(5 * len(y0))
    for i in range(n):
        slope = np.array(common_rates(model, i * h, y))
        y, _, _, dense, _ = (np.array(v).ravel() for v in step([i * h, h], y, [], [], slope, [1e-6, 1e-6]))
    columns = dense.reshape(5, -1)
    return y, columns.T @ 0.5 ** np.arange(5)


def common_rates(model: HybridDae, t: float, y: np.ndarray) -> np.ndarray:
    n = model.x.numel()
    f = ca.Function("f", [model.t, model.x, model.z, model.m, model.p], [ca.vertcat(model.xdot, model.residual)])
    return np.array(f(t, y[:n], y[n:], [], [])).ravel()


@pytest.mark.parametrize("name", ["dopri5", "rodas5p"])
def test_order_five_and_dense_output_of_order_four(name: str) -> None:
    errors, inner = [], []
    for n in (16, 32, 64):
        end, middle = march(nonlinear(), name, exact(0), 3.0, n)
        errors.append(np.abs(end - exact(3.0)).max())
        inner.append(np.abs(middle - exact(3.0 - 1.5 / n)).max())
    assert np.log2(errors[-2] / errors[-1]) > 4.7
    assert np.log2(inner[-2] / inner[-1]) > 3.7


def test_rodas5p_keeps_its_order_on_an_implicit_system() -> None:
    model = implicit()
    z = Simulator(model).resolve(0.0, [1.0], [0.5, 0.5, 0.5], [], [])[1]
    start = np.concatenate([[1.0], z])
    reference, _ = march(model, "rodas5p", start, 2.0, 512)
    errors = [np.abs(march(model, "rodas5p", start, 2.0, n)[0] - reference).max() for n in (64, 128)]
    assert np.log2(errors[0] / errors[1]) > 4.5


def test_an_implicit_system_runs_and_keeps_its_equations() -> None:
    engine = Simulator(implicit())
    t, x, z, _ = engine.run([1.0], [], stop=2.0, rtol=1e-8, atol=1e-10).at(np.linspace(0, 2, 41))
    assert np.abs(z[:, 0] ** 3 + z[:, 0] - x[:, 0] - np.sin(t)).max() < 1e-6
    tight = engine.run([1.0], [], stop=2.0, rtol=1e-11, atol=1e-13).at([2.0])[1]
    assert abs(tight[-1, 0] - x[-1, 0]) < 1e-7


@pytest.mark.parametrize("name", ["dopri5", "rodas5p"])
def test_error_falls_with_the_tolerance(name: str) -> None:
    engine = Simulator(nonlinear(), name)  # type: ignore[arg-type]
    errors = [
        np.abs(engine.run(exact(0), [], stop=3.0, rtol=r, atol=r).final - exact(3.0)).max()
        for r in (1e-4, 1e-6, 1e-8, 1e-10)
    ]
    assert all(later < earlier / 10 for earlier, later in pairwise(errors))
    assert errors[-1] < 1e-9


def van_der_pol(mu: float) -> HybridDae:
    t, x, m, p = ca.SX.sym("t"), ca.SX.sym("x", 2), ca.SX.sym("m", 0), ca.SX.sym("p", 0)
    return dae(t, x, m, p, ca.vertcat(x[1], mu * (1 - x[0] ** 2) * x[1] - x[0]), ["x", "v"])


def test_a_stiff_model_changes_the_method_during_the_run() -> None:
    trajectory = Simulator(van_der_pol(1000.0)).run([2.0, 0.0], [], stop=2000.0)
    assert trajectory.statistics["steps"] < 2000
    reference = Simulator(van_der_pol(1000.0), "rodas5p").run([2.0, 0.0], [], stop=2000.0, rtol=1e-9, atol=1e-11)
    times = [100.0, 500.0, 1500.0]
    assert np.abs(trajectory.at(times)[1][:, 0] - reference.at(times)[1][:, 0]).max() < 1e-4


def test_a_model_that_becomes_stiff_changes_the_method() -> None:
    """The rate 10^(2t) of a decay reaches 1e6: an explicit method is stable with steps of 3.3e-6 there, some 65,000 in all."""
    t, x, m, p = ca.SX.sym("t"), ca.SX.sym("x"), ca.SX.sym("m", 0), ca.SX.sym("p", 0)
    trajectory = Simulator(dae(t, x, m, p, -(10 ** (2 * t)) * (x - ca.cos(t)), ["x"])).run([1.0], [], stop=3.0)
    assert trajectory.statistics["steps"] < 1000
    assert trajectory.final[0] == pytest.approx(np.cos(3.0), abs=1e-6)


def test_explicit_method_refuses_algebraic_unknowns() -> None:
    with pytest.raises(ParameterError, match="algebraic unknowns"):
        Simulator(implicit(), "dopri5")
    with pytest.raises(ParameterError, match="must be one of"):
        Simulator(nonlinear(), "euler")  # type: ignore[arg-type]


def test_large_models_use_a_sparse_solver_with_the_same_result(monkeypatch: pytest.MonkeyPatch) -> None:
    times = np.linspace(0, 2, 21)
    fused = Simulator(implicit()).run([1.0], [], stop=2.0).at(times)
    monkeypatch.setattr("powertrain.engine.prepared._LARGE", 0)
    sparse = Simulator(implicit()).run([1.0], [], stop=2.0).at(times)
    assert np.abs(fused[1] - sparse[1]).max() < 1e-9
    assert np.abs(fused[2] - sparse[2]).max() < 1e-9


def in_units(model: HybridDae, sizes: list[float]) -> HybridDae:
    """The same model, with numbers for x and z that are larger by these factors, as are their nominal sizes."""
    n, given = model.x.numel(), ca.vertcat(model.x, model.z)
    units = ca.DM(sizes)
    rates, residual = ca.substitute([model.xdot, model.residual], [given], [given / units])
    return replace(model, xdot=units[:n] * rates, residual=residual, nominal=tuple(sizes))


@pytest.mark.parametrize("size", [2.0**-20, 2.0**20])
@pytest.mark.parametrize("method", ["dopri5", "rodas5p", "implicit", "sparse"])
def test_units_change_nothing(method: str, size: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """The steps are the same, the first one included; round-off where SuperLU chooses other pivots."""
    monkeypatch.setattr("powertrain.engine.prepared._LARGE", 0 if method == "sparse" else 100)
    model = nonlinear() if method in ("dopri5", "rodas5p") else implicit()
    n, sizes = model.x.numel(), [size, *[1.0] * (model.x.numel() - 1), *[size**2] * model.z.numel()]
    z = Simulator(model).resolve(0.0, np.ones(n), [0.5, 0.5, 0.5], [], [])[1] if model.z.numel() else np.zeros(0)
    runs = []
    for units in (np.ones(len(sizes)), np.array(sizes)):
        engine = Simulator(in_units(model, units.tolist()), "dopri5" if method == "dopri5" else "rodas5p")
        run = engine.run(units[:n], [], z0=z * units[n:], stop=2.0, rtol=1e-9, atol=1e-5)
        runs.append((run.times, run.final / units))
    for found, expected in zip(*runs, strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-9)
