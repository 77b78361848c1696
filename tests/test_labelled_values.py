"""Units and labels of xarray's and pandas' values are never passed over."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import powertrain as pt
from powertrain.components.rotational import Inertia, Torque


class Driven(pt.Component):
    """A torque accelerates a rotor."""

    torque: pt.Input = pt.signal_input("N.m", "Torque")
    source: Torque = Torque()
    rotor: Inertia = Inertia(J=2.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque, self.source.tau)
        yield pt.connect(self.source.flange, self.rotor.flange_a)


@pytest.fixture(scope="module")
def plant() -> pt.Plant[Driven]:
    return pt.compile(Driven())


def stated(values: Any, unit: str) -> Any:
    return xr.DataArray(values, attrs={"units": unit})


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (
            {"parameters": {"rotor.J": stated(4.0, "kg.cm2")}},
            r"rotor\.J: the values are in 'kg\.cm2', .* must be in kg\.m2",
        ),
        (
            {"starts": {"rotor.w": stated(4.0, "rpm")}},
            r"starts: rotor\.w: the values are in 'rpm', .* must be in rad/s",
        ),
        ({"inputs": {"torque": stated(4.0, "kN.m")}}, r"input torque: the values are in 'kN\.m'"),
        ({"inputs": {"torque": ([0, 1], stated([4.0, 5.0], "kN.m"))}}, r"input torque: the values are in 'kN\.m'"),
        ({"inputs": {"torque": (stated([0, 1000], "ms"), [4.0, 5.0])}}, r"input torque: the values are in 'ms'"),
        ({"inputs": {"torque": stated(4.0, "newton meter")}}, r"input torque: the values are in 'newton meter'"),
    ],
)
def test_another_unit_is_refused(plant: pt.Plant[Driven], given: Any, said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        plant.simulate(1.0, **given)


def test_another_unit_is_refused_in_a_step(plant: pt.Plant[Driven]) -> None:
    with pytest.raises(pt.ParameterError, match=r"input torque: the values are in 'kN\.m'"):
        plant.start().step(0.1, torque=stated(4.0, "kN.m"))


def test_another_unit_is_refused_at_operating_points(plant: pt.Plant[Driven]) -> None:
    with pytest.raises(pt.ParameterError, match=r"inputs: torque: the values are in 'kN\.m'"):
        pt.steady(plant, {"rotor.w": 3.0}, inputs={"torque": stated(4.0, "kN.m")})
    with pytest.raises(pt.ParameterError, match=r"grid: rotor\.w: the values are in 'rpm'"):
        pt.steady(plant, {"rotor.w": stated(3.0, "rpm")}, inputs={"torque": 4.0})
    again = pt.steady(plant, {"rotor.w": 3.0, "torque": stated(4.0, "Nm")}, outputs="source.tau")
    assert pt.steady(plant, {"rotor.w": 3.0, "torque": again["source.tau"]}).identical(
        pt.steady(plant, {"rotor.w": 3.0, "torque": 4.0})
    )


def test_values_in_the_unit_of_the_model_are_taken(plant: pt.Plant[Driven]) -> None:
    given = {"torque": (stated([0.0, 1.0], "s"), stated([4.0, 4.0], "Nm"))}
    first = plant.simulate(1.0, inputs=given, parameters={"rotor.J": stated(4.0, "kg.m2")})
    again = plant.simulate(1.0, inputs=given, starts={"rotor.w": first.to_xarray()["rotor.w"][-1]})  # type: ignore[dict-item]
    assert again["rotor.w"][-1] == pytest.approx(3.0)


def test_another_unit_is_refused_in_a_fit(plant: pt.Plant[Driven]) -> None:
    times = np.linspace(0.0, 1.0, 5)
    with pytest.raises(pt.ParameterError, match=r"experiment: times: the values are in 'ms'"):
        pt.Experiment(stated(1000.0 * times, "ms"), {"rotor.w": times})
    data = pt.Experiment(times, {"rotor.w": stated(30.0 * times, "rpm")}, inputs={"torque": 4.0})
    for experiment in (data, replace(data, sigma=0.1)):
        with pytest.raises(pt.ParameterError, match=r"rotor\.w: the values are in 'rpm', .* must be in rad/s"):
            pt.fit(plant, experiment, "rotor.J")


AXES = pt.Axis("speed", "rad/s", [0.0, 1.0]), pt.Axis("torque", "N.m", [0.0, 1.0])
LOSS = np.array([[0.0, 1.0], [2.0, 3.0]])


def labelled(**coords: list[float]) -> xr.DataArray:
    return xr.DataArray(LOSS, dims=("speed", "torque"), coords=coords)


@pytest.mark.parametrize(
    "values",
    [LOSS, labelled(), labelled(torque=[0.0, 1.0]).T, pd.DataFrame(LOSS), xr.DataArray(LOSS, dims=("w", "tau"))],
)
def test_dimensions_of_a_map_go_by_their_names(values: Any) -> None:
    assert pt.Map(AXES, values, "W", "loss")(1.0, 0.0) == 2.0


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: pt.Map(AXES, labelled(speed=[1.0, 0.0]), "W"), "labels along speed .* points in another order"),
        (lambda: pt.Map(AXES, pd.DataFrame(LOSS, columns=[1.0, 0.0]), "W"), "labels along torque"),
        (lambda: pt.Map(AXES[:1], pd.Series([0.0, 1.0], index=[1.0, 0.0]), "W"), "labels along speed"),
        (lambda: pt.Map(AXES[:1], stated([0.0, 1.0], "kW"), "W"), "the values are in 'kW', .* must be in W"),
        (lambda: pt.Axis("speed", "rad/s", stated([0.0, 1000.0], "rpm")), "axis speed: the values are in 'rpm'"),
        (
            lambda: pt.Map(AXES, LOSS, "W", "loss")([0.0, 1.0], [0.0, 0.5, 1.0]),
            r"map loss: .* speed \(2,\), torque \(3,\)",
        ),
    ],
)
def test_labels_that_contradict_a_map_are_refused(make: Callable[[], Any], said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        make()
