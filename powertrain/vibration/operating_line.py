"""A row of operating points: one value of the model over a range."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain.analysis.operating_point import Point, operating_point
from powertrain.dae.hybrid import OperatingPoint
from powertrain.errors import ParameterError
from powertrain.language.arguments import by_name, row
from powertrain.plant import Plant
from powertrain.signals import signals_of

Line: TypeAlias = "Point | Callable[[float], Point]"
Along: TypeAlias = Callable[[float], Mapping[str, float]]
"""The parameters at a value of the line."""


@dataclass(frozen=True)
class OperatingLine:
    """The ``values`` of the signal or parameter ``name`` with its ``unit`` and meaning, and the operating point at each of them."""

    name: str
    values: NDArray[np.float64]
    unit: str
    doc: str
    points: list[OperatingPoint]

    @property
    def coordinate(self) -> tuple[str, NDArray[np.float64], dict[str, str]]:
        """The axis of a Dataset."""
        return self.name, self.values, {"units": self.unit, "long_name": self.doc or self.name}


def operating_line(
    plant: Plant[Any], over: Mapping[str, ArrayLike], at: Line | None, parameters: Along | Mapping[str, float] | None
) -> OperatingLine:
    """The operating points over a range: ``over`` = {name: values}; a parameter, or a value as in ``at`` (a start value, an input).

    If ``at`` is a function, it gives the operating point at each value, and ``over`` only names the axis, unless it is a parameter.
    ``parameters`` may be a function of the value, too.
    """
    given = by_name("over", over)
    if len(given) != 1:
        raise ParameterError(f"over: give one name with its values, not {len(given)}")
    ((name, values),) = given.items()
    values = row(f"over: {name}", values)
    if not len(values):
        raise ParameterError(f"over: {name} has no values")
    known = signals_of(plant.compiled)
    picked = known.pick(name) if name in known.entries or name in known.parameters else None
    inputs = plant.compiled.inputs
    if picked is None and name not in inputs and name != "time" and not callable(at):
        known.pick(name)  # says which names there are
    unit, doc = (picked.unit, picked.doc) if picked else (inputs[name].unit, name) if name in inputs else ("1", name)
    points = []
    for value in values.tolist():
        here = at(value) if callable(at) else at
        set_here = dict((parameters(value) if callable(parameters) else parameters) or {})
        if name in plant.compiled.parameters:
            set_here[name] = value
        elif not callable(at):
            if isinstance(here, tuple):
                raise ParameterError(
                    f"over {name}: at is one instant of a run; pass a function that gives one for each value"
                )
            here = {**by_name("at", here), name: value}
        points.append(operating_point(plant, here, set_here or None))
    return OperatingLine(name, values, unit, doc, points)
