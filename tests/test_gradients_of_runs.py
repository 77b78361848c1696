"""Derivatives of runs without events against solutions by hand, in either direction, and what is refused."""

from __future__ import annotations

import math
import pickle
from typing import Any

import numpy as np
import pytest
from joined import joined
from runs_by_formula import TIGHT
from small_models import STARTS, Decay, Engaging

import powertrain as pt
from powertrain.components.blocks import Sine, Step
from powertrain.components.rotational import (
    ConstantTorque,
    IdealGear,
    Inertia,
    SpringDamper,
    Torque,
)


def run_of(plant: pt.Plant[Any], stop: float = 3.0, **options: Any) -> pt.Result[Any]:
    return plant.simulate(stop, starts={"inertia.w": 10.0}, inputs={"torque": 1.0}, **TIGHT, **options)


@pytest.fixture(scope="module")
def decay() -> pt.Plant[Decay]:
    return pt.compile(Decay())


def test_parameters_starts_and_inputs(decay: pt.Plant[Decay]) -> None:
    result = run_of(decay)
    found = pt.gradient(result, "inertia.w", ["inertia.J", "damper.d", "inertia.w", "torque"])
    J, d, u, w, t = 2.0, 0.5, 1.0, 10.0, 3.0
    e = math.exp(-d * t / J)
    assert found.value == pytest.approx(u / d + (w - u / d) * e, rel=1e-10)
    assert found["inertia.J"] == pytest.approx((w - u / d) * e * d * t / J**2, rel=1e-9)
    assert found["damper.d"] == pytest.approx(-u / d**2 * (1 - e) - (w - u / d) * e * t / J, rel=1e-9)
    assert found["inertia.w"] == pytest.approx(e, rel=1e-9)
    assert found["torque"] == pytest.approx((1 - e) / d, rel=1e-9)
    assert found.units["inertia.J"] == "rad/s/(kg.m2)"
    assert "inertia.w at the end" in str(found)
    assert found.to_dataframe().loc["damper.d", "derivative"] == found["damper.d"]


def test_pure_numbers_and_unknown_units_are_printed_without_unit() -> None:
    """w = ratio tau t/J = 2 t, and the integral of w^2 is 4/3."""
    parts = ConstantTorque(tau_constant=3.0), IdealGear(ratio=2.0), Inertia(J=3.0)
    run = pt.simulate(joined(*parts, joints="0.flange=1.flange_a 1.flange_b=2.flange_a"), 1.0)
    found = pt.gradient(run, pt.integral(lambda m: m.parts[2].w ** 2), ["parts[1].ratio", "parts[2].J"])
    heading, _, *rows = str(found).splitlines()
    assert heading.endswith(" = 1.3333333")
    assert [row.split()[1:-1] for row in rows] == [["2", "1.33333"], ["3", "kg.m2", "-0.888889"]]


def test_objectives(decay: pt.Plant[Decay]) -> None:
    """The integral of w is (J/d) (w0 - w(T)) + u T/d; an extremum that lies at the start moves with the start."""
    result = run_of(decay)
    t, e = 3.0, math.exp(-0.75)
    whole = pt.gradient(result, pt.integral("inertia.w"), ["inertia.w", "torque"])
    assert whole["inertia.w"] == pytest.approx(4.0 * (1 - e), rel=1e-9)
    assert whole["torque"] == pytest.approx((t - 4.0 * (1 - e)) / 0.5, rel=1e-9)
    assert whole.value == pytest.approx(4.0 * (10.0 - result["inertia.w"][-1]) + 2.0 * t, rel=1e-9)
    assert pt.gradient(result, pt.maximum("inertia.w"), "inertia.w")["inertia.w"] == pytest.approx(1.0)
    assert pt.gradient(result, pt.minimum("inertia.w"), "inertia.w")["inertia.w"] == pytest.approx(e)
    assert pt.gradient(result, pt.at("inertia.w", 1.0), "inertia.w")["inertia.w"] == pytest.approx(math.exp(-0.25))
    times, values = [0.5, 1.0, 2.0], [1.0, 2.0, 3.0]
    squares = pt.gradient(result, pt.squares("inertia.w", times, values, 0.1), "inertia.w")
    w = result.at(times, ["inertia.w"])["inertia.w"]
    decayed = np.exp(-0.25 * np.array(times))
    assert squares["inertia.w"] == pytest.approx(float(200 * (w - values) @ decayed), rel=1e-9)
    assert [g.unit for g in (whole, squares)] == ["rad/s.s", "1"]
    mixed = pt.gradient(result, 2 * pt.final("inertia.w") - pt.integral(lambda m: m.inertia.w), "inertia.w")
    assert mixed["inertia.w"] == pytest.approx(2 * e - 4 * (1 - e), rel=1e-9)


def test_forward_and_adjoint_agree(decay: pt.Plant[Decay], monkeypatch: pytest.MonkeyPatch) -> None:
    names = ["inertia.J", "damper.d", "inertia.w", "torque"]
    of = pt.integral(lambda m: m.inertia.w**2) + pt.final("inertia.w") + pt.maximum("inertia.w")
    result = decay.simulate(3.0, starts={"inertia.w": -1.0}, inputs={"torque": ([0, 1, 2], [3, 3, -4])}, **TIGHT)
    one = pt.gradient(result, of, names)
    monkeypatch.setattr("powertrain.variational.gradients._FEW", 0)
    other = pt.gradient(result, of, names)
    np.testing.assert_allclose(one.array, other.array, rtol=1e-11)


@pytest.mark.parametrize("few", [0, 9])
def test_a_run_at_rest_has_the_derivatives_of_its_vibrations(monkeypatch: pytest.MonkeyPatch, few: int) -> None:
    """A rotor on a shaft; without torque the run takes steps of seconds. The model is linear: a torque of 1 N.m moves it as they say."""
    monkeypatch.setattr("powertrain.variational.gradients._FEW", few)
    parts = Inertia(J=0.1), SpringDamper(c=100.0, d=0.1), Inertia(J=1.0), Torque(), Step(height=0.0, startTime=-1.0)
    model = joined(*parts, joints="0.flange_b=1.flange_a 1.flange_b=2.flange_a 3.flange=0.flange_a 4.y=3.tau")
    plant = pt.compile(model)
    still = plant.simulate(2.0, starts={"parts[0].w": 0.0, "parts[2].w": 0.0})
    assert still.statistics["steps"] < 20
    for signal in "parts[1].tau", "parts[0].w", "parts[2].w":
        pushed = plant.simulate(2.0, parameters={"parts[4].height": 1.0}, **TIGHT)
        released = plant.simulate(2.0, starts={"parts[0].w": 1.0, "parts[2].w": 0.0}, **TIGHT)
        found = pt.gradient(still, signal, ["parts[4].height", "parts[0].w"])
        assert found.array == pytest.approx([pushed[signal][-1], released[signal][-1]], abs=1e-7)


class Waved(pt.Component):
    """A signal that oscillates while nothing moves."""

    signal: Sine = Sine(f=3.0, amplitude=2.0)
    inertia: Inertia = Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield from ()


def test_the_integral_of_a_signal_that_no_state_follows() -> None:
    """The integral of (a sin(2 pi f t))^2 over whole periods is a^2 t/2; the steps of this run are longer than the periods."""
    result = pt.simulate(Waved(), 10.0, starts={"inertia.w": 1.0})
    assert result.statistics["steps"] < 20
    found = pt.gradient(result, pt.integral(lambda m: m.signal.y.value**2), "signal.amplitude")
    assert (found.value, found.array[0]) == pytest.approx((20.0, 20.0), rel=1e-7)


def test_columns_of_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    """Long runs are evaluated instruction by instruction at all samples."""
    plant = pt.compile(Engaging())
    inputs: dict[str, Any] = {"torque": 20.0, "press": ([0, 0.5, 1.5], [0.1, 0.3, 0.9])}
    result = plant.simulate(2.0, starts=STARTS, inputs=inputs)
    few = pt.gradient(result, pt.integral(lambda m: m.clutch.tau * m.clutch.w_rel))
    monkeypatch.setattr("powertrain.numerics.many._MANY", 1)
    many = pt.gradient(result, pt.integral(lambda m: m.clutch.tau * m.clutch.w_rel))
    np.testing.assert_allclose(many.array, few.array, rtol=1e-9, atol=1e-12 * np.abs(few.array).max())
    assert (few.array != 0.0).sum() > 5


def test_sensitivity_over_time(decay: pt.Plant[Decay]) -> None:
    times = np.linspace(0, 3, 7)
    found = pt.sensitivity(run_of(decay), ["inertia.w", "inertia.phi"], ["inertia.w"], times)
    np.testing.assert_allclose(found["inertia.w"].sel(wrt="inertia.w"), np.exp(-0.25 * times), rtol=1e-9)
    np.testing.assert_allclose(found["inertia.phi"][:, 0], 4 * (1 - np.exp(-0.25 * times)), rtol=1e-9, atol=1e-12)
    assert found["inertia.w"].attrs["units"] == "1"


class Springs(pt.Component):
    """Three inertias on two springs: no modes, no discrete variables."""

    one: Inertia = Inertia(J=1.0)
    two: Inertia = Inertia(J=2.0)
    three: Inertia = Inertia(J=0.5)
    stiff: SpringDamper = SpringDamper(c=100.0, d=1.0)
    soft: SpringDamper = SpringDamper(c=50.0, d=0.5)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.one.flange_b, self.stiff.flange_a)
        yield pt.connect(self.stiff.flange_b, self.two.flange_a)
        yield pt.connect(self.two.flange_b, self.soft.flange_a)
        yield pt.connect(self.soft.flange_b, self.three.flange_a)


def test_many_unknowns_without_held_values() -> None:
    """Backward for all nine parameters as forward for one at a time."""
    run = pt.compile(Springs()).simulate(1.0, starts={"one.w": 10.0}, **TIGHT)
    found = pt.gradient(run, "three.w")
    assert len(found) == 9
    alone = [pt.gradient(run, "three.w", name).array[0] for name in found]
    np.testing.assert_allclose(found.array, alone, rtol=1e-10, atol=1e-12)


def test_bad_input(decay: pt.Plant[Decay]) -> None:
    result = run_of(decay)
    with pytest.raises(pt.ParameterError, match=r"no parameter, input or initial value inertia\.K; did you mean"):
        pt.gradient(result, "inertia.w", "inertia.K")
    with pytest.raises(pt.ParameterError, match="neither a parameter nor an input"):
        pt.gradient(result, "inertia.w", "inertia.a")
    with pytest.raises(pt.ParameterError, match="outside the simulated span"):
        pt.gradient(result, pt.at("inertia.w", 7.0), "inertia.J")
    with pytest.raises(pt.ParameterError, match="pass a signal"):
        pt.gradient(result, 3.0, "inertia.J")  # type: ignore[arg-type]
    with pytest.raises(pt.ParameterError, match="the numbers must be equal"):
        pt.squares("inertia.w", [1.0], [1.0, 2.0])
    with pytest.raises(pt.ParameterError, match="simulate again"):
        pt.gradient(pickle.loads(pickle.dumps(result)), "inertia.w", "inertia.J")
    recorded = run_of(decay, record=["inertia.w"])
    with pytest.raises(pt.ParameterError, match="record="):
        pt.gradient(recorded, "inertia.w", "inertia.J")
