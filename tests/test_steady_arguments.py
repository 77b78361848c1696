"""Arguments of pt.steady: axes, arrays and their coordinates, outputs, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from split_path import closed_form

import powertrain as pt
from powertrain.components.rotational import (
    ConstantTorque,
    Inertia,
)
from powertrain.design import SplitPathBench

OUTPUTS = ["V", "efficiency", "K", "transmission.flange_a.tau", "transmission.differential.*.tau"]
OK, OUTSIDE = 0, 5


@pytest.fixture(scope="module")
def bench() -> pt.Plant[SplitPathBench]:
    return pt.compile(SplitPathBench())


def test_ratio_outside_its_range(bench: pt.Plant[SplitPathBench]) -> None:
    limits = {"transmission.cvu.ratio_min": 0.5, "transmission.cvu.ratio_max": 2.0}
    found = pt.steady(bench, {"V": [0.4, 1.5, 2.1], "load": -1.0}, parameters=limits, outputs=["efficiency"])
    assert found.status.values.tolist() == [OUTSIDE, OK, OUTSIDE]
    assert "speed ratio of the variable unit" in found.attrs["problems"]
    large = pt.steady(
        bench, {"V": np.linspace(0, 3, 301), "load": np.linspace(-9, -1, 70)}, parameters=limits, outputs=["efficiency"]
    )
    inside = (large.V >= 0.5 - 1e-9) & (large.V <= 2 + 1e-9) & (abs(large.V - 1) > 1e-9)
    assert (large.status.where(inside, OK) == OK).all()
    assert (large.status.where((large.V < 0.49) | (large.V > 2.01), OUTSIDE) == OUTSIDE).all()


def test_parameters_and_arrays_as_axes(bench: pt.Plant[SplitPathBench]) -> None:
    r = xr.DataArray([0.3, 0.5, 2.0], dims="case")
    load = xr.DataArray([-1.0, -2.0, 3.0], dims="case")
    found = pt.steady(bench, {"r": r, "load": load, "transmission.cvu.eta_ab": [0.8, 0.9]}, outputs=["efficiency"])
    assert found.efficiency.dims == ("case", "eta_ab")
    exact = closed_form("bHa", -1.7, 0.95, 0.9, r.values, load.values)
    delivered = np.where(exact.tau >= 0, exact.efficiency, 1 / exact.efficiency)
    np.testing.assert_allclose(found.efficiency[:, 1], delivered, rtol=1e-9)


def test_coordinates_of_arrays_stay(bench: pt.Plant[SplitPathBench]) -> None:
    cases = {"case": ["slow", "fast"], "number": ("case", [7, 9])}
    r = xr.DataArray([0.3, 0.5], dims="case", coords=cases)
    found = pt.steady(bench, {"r": r, "load": [-1.0, -2.0]}, outputs=["efficiency"])
    assert found["case"].values.tolist() == ["slow", "fast"]
    assert found["number"].values.tolist() == [7, 9]
    assert found["efficiency"].sel(case="fast", load=-2.0).item() == found["efficiency"].values[1, 1]
    large = pt.steady(bench, {"r": r, "load": np.linspace(-9, -1, 2000)}, outputs=["efficiency"])
    assert large["case"].values.tolist() == ["slow", "fast"]


@pytest.mark.parametrize(
    ("grid", "message"),
    [
        (
            {"load": xr.DataArray([0.01], dims="load", attrs={"units": "kN.m"})},
            "grid: load: the values are in 'kN.m'.* must be in N.m",
        ),
        (
            {
                "r": xr.DataArray([0.3, 0.4], dims="n", coords={"n": [1, 2]}),
                "load": xr.DataArray([5.0, 6.0], dims="n", coords={"n": [2, 1]}),
            },
            "load and r have different values of n",
        ),
        ({"r": xr.DataArray([0.3, 0.4], dims="load", coords={"load": [1, 2]}), "load": [5.0, 6.0]}, "values of load"),
        (
            {"r": xr.DataArray([0.3, 0.4], dims="n", coords={"V": ("n", [1, 2])})},
            "r has a coordinate V, .* name of a result",
        ),
        ({"r": xr.DataArray([0.3, 0.4], dims="status")}, "r has a coordinate status, .* name of a result"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(bench: pt.Plant[SplitPathBench], grid: Any, message: str) -> None:
    with pytest.raises(pt.ParameterError, match=message):
        pt.steady(bench, {"r": 0.3, "load": 5.0, **grid}, outputs=["V"])


def test_a_coordinate_does_not_take_the_name_of_an_output() -> None:
    class Displayed(pt.Component):
        """A rotor with a display of its speed in other units."""

        rotor: Inertia = Inertia(J=1.0)
        w: pt.Variable = pt.variable("rpm", "Speed on the display")

        def equations(self) -> pt.Equations:
            yield self.w == self.rotor.w * (30.0 / np.pi)

    plant = pt.compile(Displayed())
    found = pt.steady(plant, {"rotor.w": [np.pi, 2 * np.pi]}, outputs=["w"])
    assert found["w"].dims == ("rotor.w",)
    np.testing.assert_allclose(found["w"], [30.0, 60.0])
    for outputs in ({"w": "w"}, {"status": "w"}):
        with pytest.raises(pt.ParameterError, match=f"outputs: {next(iter(outputs))} is also the name of"):
            pt.steady(plant, {"rotor.w": xr.DataArray([1.0, 2.0], dims="w")}, outputs=outputs)


def test_a_result_is_a_grid(bench: pt.Plant[SplitPathBench]) -> None:
    found = pt.steady(bench, {"r": [0.3, 0.5], "load": [5.0, 6.0]}, outputs=OUTPUTS)
    assert pt.steady(bench, {"r": found["r"], "load": found["load"]}, outputs=OUTPUTS).equals(found)


def test_selectors_and_names(bench: pt.Plant[SplitPathBench]) -> None:
    found = pt.steady(
        bench, {"r": 0.3, "load": -1.0}, outputs={"twice": lambda m: 2 * m.load.value, "gain": "efficiency"}
    )
    assert float(found.twice) == -2
    assert set(found.data_vars) == {"twice", "gain", "status"}


def test_everything_by_default(bench: pt.Plant[SplitPathBench]) -> None:
    found = pt.steady(bench, {"r": 0.3, "load": -1.0})
    assert "transmission.differential.mode" in found
    assert "transmission.flange_a.phi" not in found
    assert all("units" in v.attrs and "long_name" in v.attrs for v in found.variables.values())


@pytest.mark.parametrize(
    ("grid", "options", "message"),
    [
        ({"rr": 1.0}, {}, "no input, parameter or variable rr; did you mean"),
        ({"r": [0.1], "V": 0.3, "load": 1.0}, {}, r"prescribes 1 variable \(r\), and no input or parameter to be found"),
        ({"r": [0.1]}, {}, "Name as many as are prescribed"),
        ({"r": [float("nan")], "load": 1.0}, {}, r"grid: r: nan at \[0\] is not a finite number"),
        ({"r": [[0.1]], "load": 1.0}, {}, "2 dimensions"),
        ({"r": 0.1, "load": 1.0}, {"free": ["load"]}, "already has a value"),
        ({"r": 0.1, "load": 1.0}, {"free": ["vv"]}, "no input or parameter vv"),
        ({"V": 0.1, "load": 1.0}, {"inputs": {"W": 1}}, "no input W"),
        ({"V": 0.1, "load": 1.0}, {"outputs": "transmission.flange_a.phi"}, "only rotates"),
        ({"V": 0.1, "load": 1.0, "transmission.cvu.eta_ab": [0.5, 1.5]}, {}, "eta_ab"),
        ({"efficiency": 0.5, "load": -1.0}, {"free": ["transmission.cvu.ratio_max"]}, "the conditions efficiency as the grid says"),
    ],
)  # fmt: skip
def test_what_is_wrong(
    bench: pt.Plant[SplitPathBench], grid: dict[str, Any], options: dict[str, Any], message: str
) -> None:
    with pytest.raises(pt.ParameterError, match=message):
        pt.steady(bench, grid, **options)


def test_no_condition_for_a_speed() -> None:
    class Free(pt.Component):
        torque: ConstantTorque = ConstantTorque(tau_constant=1.0)
        J: Inertia = Inertia(J=0.5)

        def equations(self) -> pt.Equations:
            yield pt.connect(self.torque.flange, self.J.flange_a)

    with pytest.raises(pt.ParameterError, match=r"der\(J.w\) = 0 cannot be met"):
        pt.steady(Free(), {}, outputs=["J.w"])
