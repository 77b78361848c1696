"""Operating points of linear models: from values by name, or an instant of a run."""

from __future__ import annotations

from collections.abc import Mapping
from reprlib import repr as short
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from powertrain.errors import ParameterError
from powertrain.language.arguments import by_name, number
from powertrain.plant import Plant
from powertrain.result import Result
from powertrain.signals import Samples, signals_of

Array = NDArray[np.float64]
Point: TypeAlias = "Mapping[str, float] | tuple[Result[Any], float]"


class OperatingPoint(NamedTuple):
    """Time, states, algebraic unknowns, held values and parameters of a model."""

    t: float
    x: Array
    z: Array
    m: Array
    p: Array


def operating_point(plant: Plant[Any], at: Point | None, parameters: Mapping[str, float] | None) -> OperatingPoint:
    """The point that ``at`` describes: values by name, or (result, t). ParameterError for anything else."""
    if not isinstance(at, tuple):
        values = dict(by_name("at", at))
        t = number("at: time", values.pop("time", 0.0), "s")
        given = {n: values.pop(n) for n in list(values) if n in plant.compiled.inputs}
        x, z, m, _ = plant.initialize(t, parameters, values, inputs=given)
        return OperatingPoint(t, x, z, m, plant.parameter_vector(parameters))
    if len(at) != 2 or not isinstance(at[0], Result):
        raise ParameterError(f"at = {short(at)}: pass values by name, or (result, t) with a result of this model")
    result, t = at[0], number("at: t", at[1], "s")
    if parameters is not None:
        raise ParameterError("at=(result, t) takes the parameters of the result; leave parameters out")
    trajectory, p = result.trajectory, result.parameters
    same = type(result.model) is type(plant.model) and list(p) == list(plant.compiled.parameters)
    if not same or trajectory.states != len(plant.compiled.states):
        raise ParameterError(f"at=(result, t): the result belongs to another model ({type(result.model).__name__})")
    if not trajectory.start <= t <= trajectory.end:
        raise ParameterError(
            f"at: t = {t:g} s lies outside the simulated span [{trajectory.start:g}, {trajectory.end:g}] s"
        )
    vector = np.array(list(p.values()), float)
    samples = signals_of(plant.compiled).corrected(Samples(*trajectory.at([t], with_events=False)), vector)
    return OperatingPoint(float(t), samples.x[0], samples.z[0], samples.m[0], vector)
