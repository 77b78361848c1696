"""Values of a run that the tables of a model do not have are noted, and only those."""

from __future__ import annotations

import random
from typing import Any

import casadi as ca
import numpy as np
import pytest
from cases import few

import powertrain as pt
from powertrain.compiler.flatten import flatten
from powertrain.components.body import VehicleBody
from powertrain.components.rotational import Inertia, Torque
from powertrain.language.symbols import column, free_symbols
from powertrain.presets.catalogue import vehicles
from powertrain.vehicles.split_path_car import SplitPathCar

CARS = {entry.name: entry.kind for entry in vehicles()}


def residuals(model: pt.Component, values: dict[str, float]) -> Any:
    """The equations and laws of a model with these parameters, at numbers that depend on the names of the variables alone."""
    flat = flatten(model)
    rows = [e.residual for e in (*flat.equations, *flat.initial)]
    rows += [s.g for s in (*flat.recorder.switches, *flat.recorder.relations)]
    rows += [b.value for b in flat.bindings.values()]

    def kept(listed: list[Any]) -> list[Any]:
        rows.extend(listed)
        return listed

    for _, law in flat.laws:
        law.mapped(kept)
    whole = column(rows)
    symbols = free_symbols(whole)
    numbers = [values.get(s.name(), random.Random(s.name()).uniform(0.1, 0.9)) for s in symbols]
    return np.array(ca.Function("rows", [column(symbols)], [whole])(numbers)).ravel()


@pytest.mark.parametrize("name", few(CARS))
def test_a_model_made_with_values_has_the_equations_of_a_run_with_them(name: str) -> None:
    """All parameters at once but those that are noted: no table of any car knows another value."""
    plant, draws = pt.compile(CARS[name]()), random.Random(7)
    evaluated = plant.compiled.source.recorder.evaluated
    given: dict[str, float] = {}
    for parameter, value in plant.parameters.items():
        trial = {parameter: value * draws.uniform(0.95, 1.05)}
        try:
            plant.parameter_vector(given | trial)
            pt.replace(plant.model, given | trial)
        except pt.ParameterError:
            continue  # beyond its range, or the default of an input
        given |= trial if parameter not in evaluated else {}
    assert len(given) > 30
    made = pt.replace(plant.model, given)
    np.testing.assert_array_equal(residuals(made, given), residuals(plant.model, given))
    assert plant.initialize(parameters=given)[-1].notes == plant.initialize()[-1].notes


@pytest.mark.slow
def test_the_operating_line_of_another_engine_is_noted() -> None:
    plant = pt.compile(SplitPathCar())
    (note,) = plant.simulate(0.1, parameters={"engine.tau_max": 200.0, "engine.w_idle": 95.0, "body.m": 1500.0}).notes
    assert note == (
        "tables and limits that were computed when the model was compiled are those for engine.w_idle = 85 rad/s and "
        "engine.tau_max = 150 N.m, not for the given values; pt.replace makes a model that has the new values everywhere"
    )
    assert plant.simulate(0.1, parameters={"engine.J": 0.2}).notes == ()
    assert plant.simulate(0.1, parameters={"engine.tau_max": 150.0}).notes == ()
    found = pt.gradient(plant.simulate(0.1), "engine.w", wrt=["engine.w_idle", "body.m"])
    assert found.notes == (
        "without the change of tables and limits that were computed when the model was compiled, for engine.w_idle = 85 rad/s",
    )
    assert str(found).endswith(found.notes[0])
    assert pt.gradient(plant.simulate(0.1), "engine.w", wrt=["engine.J", "body.m"]).notes == ()
    other = pt.replace(plant.model, {"engine.tau_max": 200.0})
    assert pt.simulate(other, 0.1).notes == ()


class Tabled(pt.Component):
    """A limit that is computed from the values of a part within a part."""

    inner: SplitPathCar = SplitPathCar()
    y: pt.Variable = pt.variable("1", "Ratio of two values")

    def equations(self) -> pt.Equations:
        car = pt.replace(self.inner)
        yield self.y == float(car.body.m) / float(pt.replace(car.engine).w_idle)


def test_values_of_parts_within_parts_are_noted() -> None:
    evaluated = flatten(Tabled()).recorder.evaluated
    assert {"inner.body.m", "inner.engine.w_idle"} <= evaluated
    assert "inner.body.A" not in evaluated


class Bound(pt.Component):
    """Computes a limit from the number of a part, which it also sets by an equation."""

    mass: pt.Parameter = pt.parameter("kg", "Mass", default=1500.0)
    body: VehicleBody = VehicleBody()
    y: pt.Variable = pt.variable("kg", "Mass in the limit")

    def equations(self) -> pt.Equations:
        yield self.body.m == self.mass
        yield self.y == float(pt.replace(self.body).m)


def test_the_number_of_a_parameter_that_the_model_sets_is_refused() -> None:
    with pytest.raises(pt.ModelError, match=r"number that body\.m has in its part.*\n.*self\.body\.m == self\.mass"):
        pt.compile(Bound())


class Doubled(pt.Component):
    """Twice the mass of a part that a run may give another one."""

    body: VehicleBody = VehicleBody()
    force: pt.Input = pt.signal_input("N", "Force on it")
    a: pt.Output = pt.signal_output("m/s2", "Acceleration of twice its mass")

    def equations(self) -> pt.Equations:
        yield self.a.value == self.force.value / (2 * float(pt.replace(self.body).m))


@pytest.mark.parametrize("spanned", [True, False])
def test_operating_points_with_values_that_tables_do_not_have_are_noted(spanned: bool) -> None:
    plant, grid = pt.compile(Doubled()), {"force": np.array([1.0, 2.0]), "body.v": np.array(1.0)}
    mass = {"body.m": np.array([1500.0, 1600.0])} if spanned else {}
    others = None if spanned else {"body.m": 1600.0}
    found = pt.steady(plant, grid | mass, outputs=["a"], parameters=others, held=["body.v"])
    assert "those for body.m = 1500 kg, not for the given values" in found.attrs["notes"]
    assert pt.steady(plant, grid, outputs=["a"], held=["body.v"]).attrs["notes"] == ""


class Geared(pt.Component):
    """A torque whose gain was computed for the inertia that it turns."""

    torque: pt.Input = pt.signal_input("N.m", "Torque")
    source: Torque = Torque()
    load: Inertia = Inertia(J=2.0)

    def equations(self) -> pt.Equations:
        yield self.source.tau.value == self.torque.value * float(pt.replace(self.load).J)
        yield pt.connect(self.source.flange, self.load.flange_a)


NOT_MOVED = (
    "without the change of tables and limits that were computed when the model was compiled, for load.J = 2 kg.m2",
)


def test_a_plan_says_which_tables_its_parameters_leave() -> None:
    plant = pt.compile(Geared())
    guess = plant.simulate(1.0, starts={"load.w": 0.0}, inputs={"torque": 1.0})
    given: dict[str, Any] = {"minimize": -pt.final("load.w"), "guess": guess, "intervals": 4}
    plan = pt.optimal_control(plant, **given, parameters={"load.J": (1.0, 3.0)})
    assert plan.notes == NOT_MOVED
    assert str(plan).endswith(NOT_MOVED[0])
    assert pt.optimal_control(plant, **given, inputs={"torque": (0.0, 1.0)}).notes == ()


def test_a_fit_says_which_tables_its_parameters_leave() -> None:
    plant, t = pt.compile(Geared()), np.linspace(0.0, 1.0, 11)
    data = pt.Experiment(t, {"load.w": t}, starts={"load.w": 0.0}, inputs={"torque": 1.0})
    found = pt.fit(plant, data, ["load.J"])
    assert found.notes == NOT_MOVED
    assert str(found).endswith(NOT_MOVED[0])
