"""Derivatives of steady points against differences, with explicit and with implicit unknowns, at intervals, and bad input."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.rotational import Brake, Inertia, QuadraticSpeedDependentTorque, SpringDamper, Torque
from powertrain.design import SplitPathBench
from powertrain.equilibrium.operating import Solver
from powertrain.equilibrium.system import formulate

R_O = "transmission.differential.ratio"
OUTPUTS = ["V", "efficiency", "K"]


@pytest.fixture(scope="module")
def bench() -> pt.Plant[SplitPathBench]:
    return pt.compile(SplitPathBench())


def differences(plant: Any, grid: dict[str, Any], name: str, outputs: Any, h: float = 1e-6) -> tuple[Any, Any]:
    up, down = (pt.steady(plant, {**grid, name: np.asarray(grid[name]) + d}, outputs=outputs) for d in (h, -h))
    return up, down


def test_derivatives_are_the_slopes(bench: pt.Plant[SplitPathBench]) -> None:
    grid: dict[str, Any] = {"r": [-0.6, -0.13, 0.4, 0.8, 1.7], "load": 10.0, R_O: -1.7}
    found = pt.steady_gradient(bench, grid, [R_O, "r"], outputs=OUTPUTS)
    assert not found.status.any()
    for name in (R_O, "r"):
        up, down = differences(bench, grid, name, OUTPUTS)
        for signal in OUTPUTS:
            slope = (up[signal].values - down[signal].values) / 2e-6
            np.testing.assert_allclose(found[f"d({signal})/d({name})"], slope, rtol=1e-6, atol=1e-8)
    assert found[f"d(K)/d({R_O})"].attrs["units"] == "1"
    assert found["d(efficiency)/d(r)"].attrs["units"] == "1"


def test_ends_of_an_interval_have_their_own(bench: pt.Plant[SplitPathBench]) -> None:
    grid: dict[str, Any] = {"r": 1.0, "load": -10.0, R_O: -1.7}
    found = pt.steady_gradient(bench, grid, R_O, outputs=OUTPUTS)
    up, down = differences(bench, grid, R_O, OUTPUTS)
    for signal in OUTPUTS:
        assert np.isnan(found[f"d({signal})/d({R_O})"])
        for end in ("low", "high"):
            slope = (up[f"{signal}_{end}"].item() - down[f"{signal}_{end}"].item()) / 2e-6
            assert found[f"d({signal})/d({R_O})_{end}"].item() == pytest.approx(slope, rel=1e-6, abs=1e-8)


class Twisted(pt.Component):
    """A rotor held by a spring and turned by a fan's torque and another: speeds and twist are implicit."""

    torque: pt.Input = pt.signal_input("N.m", "Torque")
    source: Torque = Torque()
    fan: QuadraticSpeedDependentTorque = QuadraticSpeedDependentTorque(
        tau_nominal=-5, w_nominal=50, TorqueDirection=False
    )
    rotor: Inertia = Inertia(J=1)
    shaft: SpringDamper = SpringDamper(c=1e3, d=3)
    other: Inertia = Inertia(J=1)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque, self.source.tau)
        yield pt.connect(self.source.flange, self.rotor.flange_a)
        yield pt.connect(self.rotor.flange_b, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.other.flange_a)
        yield pt.connect(self.other.flange_b, self.fan.flange)


def test_implicit_unknowns() -> None:
    """tau = 5 (w/50)^2."""
    plant = pt.compile(Twisted())
    tau = np.array([1.0, 2.0, 7.0])
    outputs = ["rotor.w", "shaft.phi_rel"]
    found = pt.steady_gradient(plant, {"torque": tau}, "torque", outputs=outputs, guesses={"rotor.w": 40.0})
    np.testing.assert_allclose(found["rotor.w"], 50 * np.sqrt(tau / 5))
    np.testing.assert_allclose(found["d(rotor.w)/d(torque)"], 25 / np.sqrt(5 * tau))
    np.testing.assert_allclose(found["d(shaft.phi_rel)/d(torque)"], -1e-3 * np.ones(3))


def test_the_problem_is_built_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another call with the same names takes what the first one built, with its own values: 25/sqrt(5 tau)."""
    plant = pt.compile(Twisted())
    built: list[Any] = []

    def counted(*given: Any) -> Any:
        built.append(given)
        return formulate(*given)

    monkeypatch.setattr("powertrain.steadystate.steady.formulate", counted)
    for nominal, torque in ((-5.0, 2.0), (-5.0, 3.0), (-20.0, 3.0)):
        found = pt.steady_gradient(
            plant, {"torque": torque}, "torque", outputs=["rotor.w"], parameters={"fan.tau_nominal": nominal},
            guesses={"rotor.w": 40.0},
        )  # fmt: skip
        assert found["d(rotor.w)/d(torque)"].item() == pytest.approx(25 / np.sqrt(-nominal * torque))
    assert len(built) == 2  # inertias that turn together do so by ratios that other parameters might change
    pt.steady_gradient(plant, {"torque": 2.0}, "torque", outputs=["other.w"], guesses={"rotor.w": 40.0})
    assert len(built) == 3


def test_points_are_solved_once(monkeypatch: pytest.MonkeyPatch) -> None:
    plant, solved, solve = pt.compile(Twisted()), [], Solver.solve

    def counted(solver: Solver, grid: Any, *side: Any) -> Any:
        solved.append(grid.shape[1])
        return solve(solver, grid, *side)

    monkeypatch.setattr(Solver, "solve", counted)
    pt.steady_gradient(plant, {"torque": [2.0, 3.0]}, "torque", outputs=["rotor.w"], guesses={"rotor.w": 40.0})
    assert solved == [2]


def test_what_is_not_on_the_grid_is_refused(bench: pt.Plant[SplitPathBench]) -> None:
    with pytest.raises(pt.ParameterError, match=r"wrt: lod is not on the grid.*load"):
        pt.steady_gradient(bench, {"r": 0.5, "load": 1.0}, "lod", outputs=["V"])


class Held(pt.Component):
    """A fan that a brake of 4 N.m holds back: it stands up to that torque, and turns with w^2 = 10 (tau - 4) beyond."""

    torque: pt.Input = pt.signal_input("N.m", "Torque")
    source: Torque = Torque()
    rotor: Inertia = Inertia(J=1.0)
    brake: Brake = Brake(fn_max=4.0, mue_pos=((0.0, 1.0),))
    fan: QuadraticSpeedDependentTorque = QuadraticSpeedDependentTorque(
        tau_nominal=-10, w_nominal=10, TorqueDirection=False
    )

    def equations(self) -> pt.Equations:
        yield self.brake.f_normalized.value == 1.0
        yield pt.connect(self.torque, self.source.tau)
        yield pt.connect(self.source.flange, self.rotor.flange_a)
        yield pt.connect(self.rotor.flange_b, self.fan.flange, self.brake.flange_a)


def test_a_law_that_slides_leaves_the_speed_free_and_one_that_is_stuck_does_not() -> None:
    torque = np.array([2.0, 5.0, 12.0, -9.0])
    found = pt.steady_gradient(Held(), {"torque": torque}, "torque", outputs=["rotor.w", "brake.tau"])
    w = np.sqrt(10 * np.maximum(np.abs(torque) - 4, 0))
    with np.errstate(divide="ignore"):
        slope = np.where(w > 0, 5 / w, 0.0)
    np.testing.assert_allclose(found["d(rotor.w)/d(torque)"], slope, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found["d(brake.tau)/d(torque)"], w == 0, rtol=1e-9, atol=1e-12)
