"""Second derivatives of a result of a run, by differences of its exact gradients."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from powertrain.errors import ParameterError
from powertrain.language.arguments import by_name, positive
from powertrain.language.component import Component
from powertrain.plant import Plant
from powertrain.result import Result
from powertrain.variational.gradients import Gradient, gradient, quotient
from powertrain.variational.instants import NotDifferentiable
from powertrain.variational.objectives import objective
from powertrain.variational.unknowns import TIMES

if TYPE_CHECKING:
    import xarray as xr

_TOLERANCES = {"rtol": 1e-10, "atol": 1e-12}


def hessian(
    plant: Plant[Any] | Component, of: Any, wrt: Sequence[str], *, step: float = 1e-4, **options: Any
) -> xr.DataArray:
    """The second derivatives of a result of a run with respect to parameters and initial values.

    Column j is (g(p + h_j) - g(p - h_j))/(2 h_j), where g is the exact gradient of ``pt.gradient`` and h_j = ``step`` |p_j| (``step`` for
    zeros): 2 n + 1 runs with a gradient each for n unknowns. The error is of second order in the step: 2e-9 to 4e-9 of the largest entry
    against closed forms of a decay, a bouncing ball and a clutch that sticks, 100 times that at ten times the step. Below the default
    step, what the tolerances leave in the gradients dominates.

    Parameters
    ----------
    of
        The result, as for ``pt.gradient``.
    wrt
        Names or patterns of parameters and initial values, as for ``pt.gradient``.
    step
        Of the differences, relative to the values.
    options
        Of ``Plant.simulate``, such as ``stop=2.0``. Without ``rtol`` and ``atol`` the runs have 1e-10 and 1e-12.

    Returns
    -------
    xarray.DataArray
        Over ``wrt`` and ``wrt_2``, symmetric, with the coordinate ``units``. The attribute ``asymmetry`` is the largest difference between
        both ways to the same mixed derivative, relative to the geometric mean of the diagonal entries: a measure of the error.

    Raises
    ------
    SimulationError
        If the events of a neighbouring run are not those of the run itself, so that there is no second derivative, or the step is too
        large; and if the run has no gradient.
    ParameterError
        For unknown names, and inputs.

    Examples
    --------
    >>> import powertrain as pt
    >>> class Product(pt.Component):
    ...     a: pt.Parameter = pt.parameter("1", "First factor", default=2.0)
    ...     b: pt.Parameter = pt.parameter("1", "Second factor", default=3.0)
    ...     y: pt.Variable = pt.variable("1", "Integral", start=0.0)
    ...
    ...     def equations(self):
    ...         yield pt.der(self.y) == self.a**2 * self.b
    >>> pt.hessian(Product(), "y", ["a", "b"], stop=1.0).round(6).values.tolist()
    [[6.0, 4.0], [4.0, 0.0]]
    """
    import xarray as xr

    plant, wanted = plant if isinstance(plant, Plant) else Plant(plant), objective(of)
    small = positive("step", step)
    options = {**_TOLERANCES, **options}
    run, here = _differentiated(plant, wanted, wrt, options)
    names = list(here)
    if not names:
        raise ParameterError("wrt: name at least one parameter or initial value")
    for name in names:
        if name.partition("[")[0].removesuffix(TIMES) in plant.compiled.inputs:
            raise ParameterError(
                f"wrt: {name} is an input; second derivatives are those by parameters and initial values"
            )
    found = np.empty((len(names), len(names)))
    for j, name in enumerate(names):
        h = small * (abs(here.at[name]) or 1.0)
        ends = []
        for value in (here.at[name] + h, here.at[name] - h):
            other, slope = _differentiated(plant, wanted, names, _with(plant, options, name, value))
            _refuse_other_events(run, other, name, value)
            ends.append(slope.array)
        found[:, j] = (ends[0] - ends[1]) / (2.0 * h)
    units = [[quotient(quotient(here.unit, u), v) for v in _units(plant, names)] for u in _units(plant, names)]
    coordinates = {"wrt": names, "wrt_2": names, "units": (("wrt", "wrt_2"), units)}
    values, asymmetry = (found + found.T) / 2.0, _asymmetry(found)
    return xr.DataArray(values, coordinates, ("wrt", "wrt_2"), here.of, {"asymmetry": asymmetry})


def _differentiated(plant: Plant[Any], of: Any, wrt: Any, options: dict[str, Any]) -> tuple[Result[Any], Gradient]:
    run = plant.simulate(**options)
    return run, gradient(run, of, wrt)


def _with(plant: Plant[Any], options: dict[str, Any], name: str, value: float) -> dict[str, Any]:
    """The options with another value of a parameter or initial value."""
    kind = "parameters" if name in plant.compiled.parameters else "starts"
    return {**options, kind: {**by_name(kind, options.get(kind)), name: value}}


def _units(plant: Plant[Any], names: Sequence[str]) -> list[str]:
    known = plant.compiled
    return [(known.parameters[n] if n in known.parameters else known.signals[n]).unit for n in names]


def _refuse_other_events(run: Result[Any], other: Result[Any], name: str, value: float) -> None:
    first, second = ([(e.name, e.new) for e in each.events] for each in (run, other))
    if first == second:
        return
    k = next((i for i, (a, b) in enumerate(zip(first, second, strict=False)) if a != b), min(len(first), len(second)))
    events = list(run.events if k < len(first) else other.events)
    raise NotDifferentiable(
        f"with {name} = {value:.9g} the run has other events, from {events[k].name} at t = {events[k].time:.6g} s on: there is no second "
        "derivative, or step is too large; reduce step"
    )


def _asymmetry(found: NDArray[np.float64]) -> float:
    diagonal = np.sqrt(np.abs(np.diag(found)))
    scale = np.maximum(np.outer(diagonal, diagonal), np.abs(found + found.T) / 2.0)
    return float(
        np.divide(np.abs(found - found.T), scale, out=np.zeros_like(scale), where=scale > 0.0).max(initial=0.0)
    )
