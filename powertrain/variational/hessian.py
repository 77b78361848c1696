"""Second derivatives of a result of a run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

from powertrain.compiler.calls import calling
from powertrain.errors import ParameterError
from powertrain.language.component import Component
from powertrain.language.symbols import Symbol, column, scalars
from powertrain.language.units import quotient
from powertrain.plant import Plant, plant_of
from powertrain.variational.differences import differences
from powertrain.variational.functional import functional
from powertrain.variational.gradients import model_of
from powertrain.variational.objectives import objective
from powertrain.variational.second import SecondOrder
from powertrain.variational.sweeps import Model
from powertrain.variational.unknowns import unknowns

if TYPE_CHECKING:
    import xarray as xr

_TOLERANCES = {"rtol": 1e-10}
_known: WeakKeyDictionary[Model, SecondOrder | None] = WeakKeyDictionary()


def hessian(plant: Plant[Any] | Component, of: Any, wrt: Sequence[str], **options: Any) -> xr.DataArray:
    """The second derivatives of a result of a run with respect to parameters and initial values.

    One run, the tangents of its states for all unknowns (forward) and the adjoint of the result (backward) give the second derivatives of
    all steps and events, which are summed: the curvature of the motion of events, of resets and impacts, of laws that stick, and of
    corners such as those of a friction curve. They are as accurate as the run, except for corners that it passes twice within a step, and
    for vibrations that a step of a run at rest leaves out, more than forty periods of them; ``max_step`` helps with both. If the model
    looks up maps, the second derivatives are central differences of gradients, which take 2 n further runs for n unknowns.

    Parameters
    ----------
    of
        The result, as for ``pt.gradient``.
    wrt
        Names or patterns of parameters and initial values, as for ``pt.gradient``.
    options
        Options of ``Plant.simulate``, such as ``stop=2.0``. By default the run has an ``rtol`` of 1e-10.

    Returns
    -------
    xarray.DataArray
        Over ``wrt`` and ``wrt_2``, symmetric, with the coordinate ``units``. Differences have two attributes that measure their error,
        relative to the geometric mean of the diagonal entries: ``asymmetry``, the largest difference between both orders of a mixed
        derivative, and ``spread``, that between forward and backward differences, which is large where a run passes kinks of maps.

    Raises
    ------
    SimulationError
        If the run has no gradient; if an unknown moves laws apart that switch together, or changes a speed at which a law sticks
        without an event of its own; if an extremum is at a corner of the signal; with maps, if neighbouring runs have other events.
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

    plant, target = plant_of(plant), objective(of)
    result = plant.simulate(**{**_TOLERANCES, **options})
    wanted, number = unknowns(result, wrt), functional(result, target)
    if not wanted.names:
        raise ParameterError("wrt: name at least one parameter or initial value")
    for knots in wanted.inputs:
        raise ParameterError(
            f"wrt: {knots.name} is an input; second derivatives are with respect to parameters and initial values"
        )
    model = model_of(result, wanted, number)
    if model not in _known:
        _known[model] = None if _calls(model) else SecondOrder(model)
    exact, notes = _known[model], dict[str, float]()
    if exact is not None:
        found = exact(result, wanted, number)
    else:
        found, notes = differences(plant, target, wanted.names, result, {**_TOLERANCES, **options})
    units = [[quotient(quotient(number.unit, u), v) for v in wanted.units] for u in wanted.units]
    coordinates = {"wrt": list(wanted.names), "wrt_2": list(wanted.names), "units": (("wrt", "wrt_2"), units)}
    return xr.DataArray((found + found.T) / 2.0, coordinates, ("wrt", "wrt_2"), number.label, notes)


def _calls(model: Model) -> bool:
    """Whether rates, equations, events or the result look up maps."""
    dae = model.system.dae
    integrand = Symbol(0) if model.of.integrand is None else model.of.integrand
    asked = column([dae.xdot, dae.residual, model.saltation.asked, model.of.expressions, integrand])
    return bool(calling(scalars(asked)))
