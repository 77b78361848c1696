"""Arguments of any kind: what a function does not take is refused with a PowertrainError, never with one from inside."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import spin_down
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import powertrain as pt

PLANT = pt.compile(spin_down.SpinDown())
RUN = PLANT.simulate(1.0, points=3)
WAYS = settings(
    derandomize=True,
    deadline=None,
    database=None,
    max_examples=40,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)

PLAIN = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 3),
    st.just(10**400),
    st.floats(-2, 2),
    st.sampled_from([float("nan"), float("inf"), 1j, b"x", "", "x", "inertia.w", "inertia.J", "a\0b", "raise"]),
    st.builds(object),
    st.sampled_from([np.zeros(2), np.zeros((2, 2)), np.array("x"), range(2), RUN, PLANT.model]),
)
NAMES = st.sampled_from(["inertia.w", "inertia.J", "stop", "x", "", 1])
ANY = st.one_of(PLAIN, st.lists(PLAIN, max_size=2), st.tuples(PLAIN, PLAIN), st.dictionaries(NAMES, PLAIN, max_size=2))

SIMULATE = (
    "stop",
    "start",
    "parameters",
    "starts",
    "guesses",
    "inputs",
    "times",
    "points",
    "rtol",
    "atol",
    "max_step",
    "method",
)
SWEEP = ("record", "scalars", "executor", "on_error", "progress", "parameters", "starts", "stop")


def simulated(name: str, value: Any) -> None:
    options: dict[str, Any] = {"stop": 0.1, name: value}
    PLANT.simulate(**options)


def swept(name: str, value: Any) -> None:
    options: dict[str, Any] = {"stop": 0.1, name: value}
    pt.sweep(PLANT, [{}], **options)


FUNCTIONS: dict[str, Callable[[Any], Any]] = {
    **{f"simulate {name}": partial(simulated, name) for name in SIMULATE},
    **{f"sweep {name}": partial(swept, name) for name in SWEEP},
    "sweep cases": lambda value: pt.sweep(PLANT, value, stop=0.1),
    "sweep case": lambda value: pt.sweep(PLANT, [value], stop=0.1),
    "sweep a scalar": lambda value: pt.sweep(PLANT, [{}], stop=0.1, scalars={"x": lambda _: value}).table,
    "initialize": PLANT.initialize,
    "record": lambda value: PLANT.simulate(0.1, record=value),
    "recorded": RUN.recorded,
    "names": RUN.names,
    "at": lambda value: RUN.at(value, "inertia.w"),
    "at what": lambda value: RUN.at(0.5, value),
    "signal": lambda value: RUN[value],
    "to_xarray": RUN.to_xarray,
    "to_dataframe": RUN.to_dataframe,
    "netcdf": RUN.netcdf,
    "load": pt.load,
    "from_csv": pt.Map.from_csv,
    "energy_audit": lambda value: None if value is RUN else pt.energy_audit(value),
    "eigenmodes": lambda value: pt.eigenmodes(PLANT, value),
    "eigenmodes at": lambda value: pt.eigenmodes(PLANT, at=value),
    "eigenmodes parameters": lambda value: pt.eigenmodes(PLANT, parameters=value),
    "linearize reduced": lambda value: pt.linearize(PLANT, ["inertia.J"], reduced=value),
    "campbell": lambda value: pt.campbell(PLANT, value),
    "campbell at": lambda value: pt.campbell(PLANT, {"inertia.J": [1.0]}, at=value),
    "sensitivity_indices": lambda value: pt.sensitivity_indices(PLANT, value, {"inertia.J": (1, 2)}, 1, stop=0.1),
    "sensitivity_indices distributions": lambda value: pt.sensitivity_indices(
        PLANT, {"w": "inertia.w"}, value, 1, method="morris", stop=0.1
    ),
    "sensitivity_indices number": lambda value: pt.sensitivity_indices(
        PLANT, {"w": "inertia.w"}, {"inertia.J": (1, 2)}, value, stop=0.1
    ),
    "steady_function": lambda value: pt.steady_function(PLANT, value, ["inertia.w"]),
    "hessian": lambda value: pt.hessian(PLANT, "inertia.w", value, stop=0.1),
    "pareto_front": lambda value: pt.pareto_front(PLANT, value, {"inertia.J": (1, 2)}, stop=0.1),
    "pareto_front bounds": lambda value: pt.pareto_front(PLANT, {"a": "inertia.w", "b": "inertia.a"}, value, stop=0.1),
    "to_zarr times": lambda value: pt.sweep(PLANT, [{}], stop=0.1).to_zarr("/nowhere/x", value),
    "critical_speeds": lambda value: pt.critical_speeds(value, [1.0]),
    "order_response": lambda value: pt.order_response(PLANT, {"inertia.w": [1.0]}, value, ["inertia.w"]),
    "order_response outputs": lambda value: pt.order_response(
        PLANT, {"inertia.w": [1.0]}, {"inertia.flange_a.tau": {1.0: 1.0}}, value
    ),
    "order_map": lambda value: pt.order_map(value, "inertia.w", "inertia.w"),
    "order_map orders": lambda value: pt.order_map(RUN, "inertia.w", "inertia.w", orders=value),
    "order_map span": lambda value: pt.order_map(RUN, "inertia.w", "inertia.w", span=value),
    "linearize inputs": lambda value: pt.linearize(PLANT, inputs=value),
    "linearize outputs": lambda value: pt.linearize(PLANT, inputs=["inertia.J"], outputs=value),
}


def said(function: Callable[[Any], Any], value: Any) -> str:
    """The message with which a value is refused; '' where it is taken."""
    try:
        function(value)
    except pt.PowertrainError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("function", FUNCTIONS)
@WAYS
@given(value=ANY)
def test_any_argument(function: str, value: Any) -> None:
    message = said(FUNCTIONS[function], value)
    assert len(message) < 1500
    assert "the run failed" not in message  # what a sweep says to errors that are none of the library's


@WAYS
@given(value=ANY)
def test_any_place_to_write_to(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, value: Any) -> None:
    monkeypatch.chdir(tmp_path)
    for function in RUN.save, lambda to: pt.sweep(PLANT, [{}], stop=0.1, to=to):
        assert "the run failed" not in said(function, value)
