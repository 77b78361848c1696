"""Operating points of linear models: from values by name, or an instant of a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np

from powertrain.dae.friction import FORWARD, STUCK
from powertrain.dae.hybrid import FrictionValues, OperatingPoint
from powertrain.dae.tolerances import balance_tolerance
from powertrain.errors import ParameterError
from powertrain.given_runs import instant_of_run
from powertrain.language.arguments import by_name, number
from powertrain.plant import Plant
from powertrain.result import Result

Point: TypeAlias = "Mapping[str, float] | tuple[Result[Any], float]"


def operating_point(plant: Plant[Any], at: Point | None, parameters: Mapping[str, float] | None) -> OperatingPoint:
    """The point that ``at`` describes: values by name, or (result, t). ParameterError for anything else.

    Laws at rest without limits, such as the friction of a gear in proportion to a torque that is zero, hold nothing: they slide.
    """
    point, frictions = _described(plant, at, parameters), plant.compiled.dae.frictions
    if not frictions:
        return point
    values = FrictionValues(*(found.full().ravel() for found in plant.compiled.dae.friction_values(*point)))
    m, limits = point.m.copy(), np.maximum(np.abs(values.lower), np.abs(values.upper))
    least = balance_tolerance(np.max(limits, where=np.isfinite(limits), initial=0.0))
    for law, limit in zip(frictions, limits, strict=True):
        if m[law.index] == STUCK and limit <= least and not law.prescribed:
            m[law.index] = FORWARD
    return replace(point, m=m)


def _described(plant: Plant[Any], at: Point | None, parameters: Mapping[str, float] | None) -> OperatingPoint:
    """The point in the modes that a run has there."""
    if not isinstance(at, tuple):
        values = dict(by_name("at", at))
        t = number("at: time", values.pop("time", 0.0), "s")
        given = {n: values.pop(n) for n in list(values) if n in plant.compiled.inputs}
        x, z, m, _ = plant.initialize(t, parameters, values, inputs=given)
        return OperatingPoint(t, x, z, m, plant.parameter_vector(parameters))
    if parameters is not None:
        raise ParameterError("at=(result, t) takes the parameters of the result; leave parameters out")
    samples = instant_of_run(plant.compiled, at, "at")
    return OperatingPoint(float(samples.t[0]), samples.x[0], samples.z[0], samples.m[0], at[0].p)
