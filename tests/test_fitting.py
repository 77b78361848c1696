"""Identification against known parameters: noise-free, noisy within its own errors, several experiments, unidentifiable sets."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.stats import binom, chi2
from small_models import STARTS, Engaging

import powertrain as pt

TRUE = {
    "engine.J": 0.2,
    "clutch.fn_max": 200.0,
    "shaft.c": 500.0,
    "shaft.d": 5.0,
    "load.J": 1.0,
}
COMMAND = {"torque": ([0.0, 1.0, 1.0, 2.0], [40.0, 40.0, 5.0, 30.0]), "press": ([0.0, 0.5, 1.5], [0.0, 0.5, 0.6])}
GRID = np.linspace(0.0, 2.0, 201)
SIGNALS = ["engine.w", "load.w", "shaft.tau"]
SIGMA = {"engine.w": 0.5, "load.w": 0.5, "shaft.tau": 2.0}
WRONG = {name: value * k for (name, value), k in zip(TRUE.items(), (1.3, 0.8, 1.2, 0.6, 0.8), strict=True)}


@pytest.fixture(scope="module")
def plant() -> pt.Plant[Engaging]:
    return pt.compile(Engaging())


def measured(
    plant: pt.Plant[Engaging], noise: float, seed: int = 0, starts: dict[str, float] = STARTS
) -> pt.Experiment:
    run = plant.simulate(2.0, starts=starts, inputs=COMMAND, rtol=1e-10)
    assert any(e.new == 0.0 for e in run.events)
    rng, found = np.random.default_rng(seed), run.at(GRID, SIGNALS)
    values = {n: np.asarray(found[n]) + noise * SIGMA[n] * rng.standard_normal(len(GRID)) for n in SIGNALS}
    return pt.Experiment(GRID, values, SIGMA, starts=starts, inputs=COMMAND)


def test_without_noise_the_parameters_come_back(plant: pt.Plant[Engaging]) -> None:
    found = pt.fit(plant, measured(plant, 0.0), list(TRUE), first=WRONG)
    assert found.values == pytest.approx(TRUE, rel=1e-6)
    assert found.undetermined == ()
    assert found.evaluations < 30
    assert "clutch.fn_max" in str(found)
    assert np.abs(found.residuals().to_numpy()).max() < 1e-4


class Swing(pt.Component):
    """y = sin(w t): a sum of squares with many minima over w."""

    w: pt.Parameter = pt.parameter("rad/s", "Frequency", default=1.0)
    y: pt.Variable = pt.variable("1", "Deflection")

    def equations(self) -> pt.Equations:
        yield self.y == ca.sin(self.w * pt.time)


def test_a_minimum_that_is_not_the_lowest_is_said() -> None:
    """Residuals beyond sigma are no noise. From a good guess they are, and without sigma nothing can be said."""
    times = np.linspace(0.0, 10.0, 101)
    values = {"y": np.sin(2.0 * times) + 0.01 * np.random.default_rng(3).standard_normal(101)}
    data, plant = pt.Experiment(times, values, 0.01), pt.compile(Swing())
    far, near = (pt.fit(plant, data, "w", first={"w": first}) for first in (6.0, 1.9))
    assert near.values["w"] == pytest.approx(2.0, abs=3 * near.errors["w"])
    assert abs(far.values["w"] - 2.0) > 1.0
    assert far.unexplained
    assert "larger than sigma explains" in str(far)
    assert not near.unexplained
    assert "larger than" not in str(near)
    unknown = pt.fit(plant, pt.Experiment(times, values), "w", first={"w": 6.0})
    assert not unknown.unexplained
    assert "sigma is unknown" in str(unknown)
    few = pt.fit(plant, pt.Experiment([1.0, 2.0], {"y": [1.0, 1.0]}, 0.05), "w", first={"w": 1.0})
    assert few.cost > 1 + 5 * np.sqrt(2)  # five standard deviations of chi-square, whose tail is long
    assert not few.unexplained


@pytest.mark.slow
def test_noise_gives_the_errors_it_should(plant: pt.Plant[Engaging]) -> None:
    """Seven unknowns, two of them starts: over 20 draws the deviations follow the covariance, and 95.4 % of them are within two errors.

    Each draw by itself is a chi-square with seven degrees of freedom.
    """
    unknowns = [*TRUE, "engine.w", "load.w"]
    exact = np.array([*TRUE.values(), 100.0, 0.0])
    distances, within = [], 0
    for seed in range(20):
        found = pt.fit(plant, measured(plant, 1.0, seed), unknowns, first=WRONG)
        left = np.array(list(found.values.values())) - exact
        distances.append(float(left @ np.linalg.solve(found.covariance, left)))
        within += int((np.abs(left) <= 2.0 * np.array(list(found.errors.values()))).sum())
        assert found.spread == pytest.approx(1.0, abs=0.15)
    assert chi2.ppf(1e-4, 140) < sum(distances) < chi2.ppf(1 - 1e-4, 140)
    assert max(distances) < chi2.ppf(1.0 - 1e-4, 7)
    share = chi2.cdf(4.0, 1)
    assert binom.ppf(1e-4, 140, share) <= within <= binom.ppf(1.0 - 1e-4, 140, share)


def test_sigma_from_the_residuals(plant: pt.Plant[Engaging]) -> None:
    data = measured(plant, 1.0, 3)
    plain = pt.Experiment(GRID, {"engine.w": data.values["engine.w"]}, starts=STARTS, inputs=COMMAND)
    found = pt.fit(plant, plain, ["engine.J", "clutch.fn_max"], first={"engine.J": 0.26})
    assert found.spread == pytest.approx(0.5, rel=0.15)
    for name in ("engine.J", "clutch.fn_max"):
        assert abs(found.values[name] - TRUE[name]) < 4 * found.errors[name]


def test_several_experiments_with_starts_of_their_own(plant: pt.Plant[Engaging]) -> None:
    second = {**STARTS, "engine.w": 120.0}
    data = [measured(plant, 0.0), measured(plant, 0.0, starts=second)]
    blind = [pt.Experiment(e.times, e.values, SIGMA, starts=STARTS, inputs=COMMAND) for e in data]
    found = pt.fit(plant, blind, ["engine.J", "engine.w"])
    assert found.values["engine.w (experiment 0)"] == pytest.approx(100.0, rel=1e-6)
    assert found.values["engine.w (experiment 1)"] == pytest.approx(120.0, rel=1e-6)
    assert found.parameters == pytest.approx({"engine.J": 0.2}, rel=1e-6)


def test_what_the_data_do_not_determine_is_named(plant: pt.Plant[Engaging]) -> None:
    """Only the product of normal force and friction radius acts."""
    found = pt.fit(plant, measured(plant, 1.0), ["clutch.fn_max", "clutch.cgeo", "engine.J"])
    (direction,) = found.undetermined
    assert set(direction) == {"clutch.fn_max", "clutch.cgeo"}
    assert direction["clutch.fn_max"] == pytest.approx(-direction["clutch.cgeo"], rel=2e-2)
    assert found.errors["clutch.fn_max"] == np.inf
    assert 0.0 < found.errors["engine.J"] < 0.01
    assert list(found.correlation.index) == ["engine.J"]
    assert "not determined by the data: the combination" in str(found)


def test_what_the_data_do_not_determine_stays_near_its_first_value(plant: pt.Plant[Engaging]) -> None:
    """The product has to rise by 1/0.8: least together if both factors rise by the root of it."""
    wrt, wrong = ["clutch.fn_max", "clutch.cgeo", "engine.J"], {"clutch.fn_max": 160.0, "engine.J": 0.26}
    found = pt.fit(plant, measured(plant, 0.0), wrt, first=wrong).values
    assert found == pytest.approx(
        {"clutch.fn_max": 160.0 * 1.25**0.5, "clutch.cgeo": 1.25**0.5, "engine.J": 0.2}, rel=1e-5
    )


def test_bounds_hold(plant: pt.Plant[Engaging]) -> None:
    found = pt.fit(plant, measured(plant, 0.0), ["engine.J", "load.J"], bounds={"engine.J": (0.25, 1.0)})
    assert found.values["engine.J"] == pytest.approx(0.25, rel=1e-6)
    assert found.at_bounds == {"engine.J": 0.25}
    assert "engine.J is at its bound, 0.25 kg.m2" in str(found)


def test_fewer_measurements_than_unknowns(plant: pt.Plant[Engaging]) -> None:
    """Two numbers determine at most two combinations of three unknowns; the others have no standard error."""
    data = pt.Experiment(
        [0.1, 0.2], {"engine.w": [95.0, 90.0]}, 0.5, starts=STARTS, inputs={"torque": 20.0, "press": 0.6}
    )
    found = pt.fit(plant, data, ["engine.J", "clutch.fn_max", "load.J"])
    assert found.undetermined
    unsure = set().union(*found.undetermined)
    assert unsure
    assert all((found.errors[name] == np.inf) == (name in unsure) for name in found.values)


def test_gaps_and_files(plant: pt.Plant[Engaging], tmp_path: Path) -> None:
    import pandas as pd

    data = measured(plant, 0.0)
    frame = pd.DataFrame({"time": GRID, **data.values})
    frame.loc[10:60, "engine.w"] = np.nan
    frame.to_csv(tmp_path / "run.csv", index=False)
    read = pt.read_experiment(tmp_path / "run.csv", "engine.w", "load.w", starts=STARTS, inputs=COMMAND)
    found = pt.fit(plant, read, "engine.J", first={"engine.J": 0.3})
    assert found.values["engine.J"] == pytest.approx(0.2, rel=1e-5)
    with pytest.raises(pt.ParameterError, match="has no column speed"):
        pt.read_experiment(tmp_path / "run.csv", "speed")
    with pytest.raises(pt.ParameterError, match=r"install powertrain\[mdf\]|run"):
        pt.read_experiment(tmp_path / "run.mf4")
    with pytest.raises(pt.ParameterError, match=r"read from \.csv"):
        pt.read_experiment(tmp_path / "run.xlsx")


@pytest.mark.filterwarnings("ignore:The inplace keyword")
def test_measurement_files(tmp_path: Path) -> None:
    """Channels of different rasters are not interpolated: nobody measured such values."""
    asammdf = pytest.importorskip("asammdf")
    fast, slow = np.linspace(0.0, 2.0, 21), np.linspace(0.0, 2.0, 8)
    file = asammdf.MDF(version="4.10")
    for name, times in (("motor.w", fast), ("load.w", slow)):
        file.append([asammdf.Signal(np.exp(-times), times, name=name, unit="rad/s")])
    file.save(tmp_path / "run.mf4")
    read = pt.read_experiment(tmp_path / "run.mf4")
    assert {n: int(np.isfinite(np.asarray(v, float)).sum()) for n, v in read.values.items()} == {
        "motor.w": 21,
        "load.w": 8,
    }
    for given in read.values.values():
        values = np.asarray(given, float)
        np.testing.assert_allclose(values, np.where(np.isnan(values), np.nan, np.exp(-read.grid)), rtol=1e-12)
    assert len(pt.read_experiment(tmp_path / "run.mf4", "load.w").grid) == 8
    with pytest.raises(pt.ParameterError, match=r"run\.mf4 has no column engine\.w; it has"):
        pt.read_experiment(tmp_path / "run.mf4", "engine.w")
    (tmp_path / "text.mf4").write_text("no measurement " * 20)
    for name in ("text.mf4", "none.mf4"):
        with pytest.raises(pt.ParameterError, match="cannot be read"):
            pt.read_experiment(tmp_path / name)


def test_bad_input(plant: pt.Plant[Engaging]) -> None:
    data = measured(plant, 0.0)
    with pytest.raises(pt.ParameterError, match=r"no parameter or variable engine\.K; did you mean"):
        pt.fit(plant, data, "engine.K")
    with pytest.raises(pt.ParameterError, match="is not among the unknowns"):
        pt.fit(plant, data, "engine.J", first={"load.J": 1.0})
    with pytest.raises(pt.ParameterError, match="is empty"):
        pt.fit(plant, data, "engine.J", bounds={"engine.J": (1.0, 1.0)})
    with pytest.raises(pt.ParameterError, match=r"wrt: engine\.J appears twice"):
        pt.fit(plant, data, ["engine.J", "engine.J"])
    given = pt.Experiment(GRID, data.values, starts=STARTS, inputs=COMMAND, parameters={"engine.J": 0.3})
    with pytest.raises(pt.ParameterError, match=r"engine\.J is unknown, but experiment 1 gives it"):
        pt.fit(plant, [data, given], "engine.J")
    wrong: Any = [1]
    with pytest.raises(pt.ParameterError, match=r"one pt\.Experiment"):
        pt.fit(plant, wrong, "engine.J")
    with pytest.raises(pt.ParameterError, match="2 values for 3 times"):
        pt.Experiment([0, 1, 2], {"engine.w": [1, 2]})
    with pytest.raises(pt.ParameterError, match="times"):
        pt.Experiment([0, 2, 1], {"engine.w": [1, 2, 3]})
    with pytest.raises(pt.ParameterError, match="not positive"):
        pt.Experiment([0, 1], {"engine.w": [1, 2]}, 0.0)
    with pytest.raises(pt.ParameterError, match="no value for"):
        pt.Experiment([0, 1], {"engine.w": [1, 2]}, {"load.w": 1.0})


class Power(pt.Component):
    """y' = b a^0.04 + small a sin(5 t): hardly anything but the product is seen."""

    a: pt.Parameter = pt.parameter("1", "Factor with little influence", default=1.0)
    b: pt.Parameter = pt.parameter("1", "Factor", default=1.0)
    small: pt.Parameter = pt.parameter("1", "Share that tells them apart", default=0.0)
    y: pt.Variable = pt.variable("1", "Integral", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.y) == self.b * self.a**0.04 + self.small * self.a * ca.sin(5 * pt.time)


_SECONDS = np.linspace(0.0, 3.0, 31)


def test_a_small_share_in_what_the_data_do_not_determine_counts_in_the_error() -> None:
    """b = y/(t a^0.04) is as unknown as a; its error used to be 5e-5 of it."""
    found = pt.fit(pt.compile(Power()), pt.Experiment(_SECONDS, {"y": 2.0 * _SECONDS}, sigma=1e-3), ["a", "b"])
    assert found.errors == {"a": np.inf, "b": np.inf}
    (direction,) = found.undetermined
    assert direction == pytest.approx({"a": 1.0, "b": -0.04}, rel=0.01)


def test_errors_where_a_combination_is_hardly_determined() -> None:
    """At a = b = 1 the derivatives are t and 0.04 t + small (1 - cos(5 t))/5; the error of b used to be 1e-4 instead of 0.42."""
    small, sigma = 1e-4, 1e-3
    extra = small * (1.0 - np.cos(5.0 * _SECONDS)) / 5.0
    jacobian = np.column_stack([0.04 * _SECONDS + extra, _SECONDS]) / sigma
    exact = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    data = pt.Experiment(_SECONDS, {"y": _SECONDS + extra}, sigma=sigma, parameters={"small": small})
    found = pt.fit(pt.compile(Power()), data, ["a", "b"])
    assert found.errors["a"] == np.inf
    assert found.errors["b"] == pytest.approx(exact[1], rel=0.05)


class Apart(pt.Component):
    """Two speeds of very different size."""

    a: pt.Parameter = pt.parameter("1", "Slow", default=1.0)
    b: pt.Parameter = pt.parameter("1", "Fast", default=1.0)
    y: pt.Variable = pt.variable("1", "Integral", start=0.0)
    z: pt.Variable = pt.variable("1", "Integral", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.y) == 1e3 * self.b
        yield pt.der(self.z) == 1e-2 * self.a


def test_what_the_data_determine_weakly_is_not_held_back() -> None:
    """The first value used to pull a to 1.495, five hundred standard errors away."""
    data = pt.Experiment(_SECONDS, {"y": 1.1e3 * _SECONDS, "z": 1.5e-2 * _SECONDS}, sigma=1e-6)
    found = pt.fit(pt.compile(Apart()), data, ["a", "b"])
    assert found.values == pytest.approx({"a": 1.5, "b": 1.1}, rel=1e-5)
    assert found.spread < 0.1


class Square(pt.Component):
    """The square of a decaying quantity."""

    x: pt.Variable = pt.variable("1", "Quantity", start=5.0)
    y: pt.Variable = pt.variable("1", "Square")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == -self.x
        yield self.y == self.x**2


def test_the_first_value_of_a_start_is_that_of_the_model() -> None:
    """It used to be 0, where the square has no slope: the fit stayed there."""
    found = pt.fit(pt.compile(Square()), pt.Experiment(_SECONDS, {"y": 49.0 * np.exp(-2.0 * _SECONDS)}), "x")
    assert found.values["x"] == pytest.approx(7.0, rel=1e-7)
