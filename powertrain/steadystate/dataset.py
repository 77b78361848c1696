"""The results of a map as an ``xarray.Dataset``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.assemble import Compiled
from powertrain.equilibrium.points import DIVERGED, IMMOVABLE, NONE, OK, OUTSIDE, SEVERAL, STUCK_POINT, UNDEFINED
from powertrain.initialization.outdated import outdated
from powertrain.language.reals import Array
from powertrain.plant import Plant
from powertrain.steadystate.axes import Grid, GridAxis
from powertrain.steadystate.results import MOST_LAWS, MapResults
from powertrain.steadystate.steady_map import SteadyMap

if TYPE_CHECKING:
    import xarray as xr

STATUS = {
    OK: "ok",
    STUCK_POINT: "stuck",
    SEVERAL: "several_solutions",
    NONE: "no_solution",
    IMMOVABLE: "cannot_move",
    OUTSIDE: "outside_range",
    DIVERGED: "no_convergence",
    UNDEFINED: "undefined_value",
}
_PROBLEMS = {
    STUCK_POINT: "friction is at rest under a prescribed motion; its torque is not determined and given as an interval",
    SEVERAL: "several solutions (laws hold each other in several ways, share a load with an input that is sought, one held by its peak "
    "may slide, the torques balance at several speeds, or an unknown is not determined); first=True returns one of them, and guesses may "
    "lead to another",
    NONE: "no consistent combination of modes; the mechanism locks itself, limits of friction are in the wrong order (lower above "
    "upper), or nothing balances the prescribed values",
    IMMOVABLE: "cannot move: a speed or ratio is infinite",
    OUTSIDE: "a quantity is outside its range",
    DIVERGED: "no operating point was found, although there may be one; give guesses, or check whether an equilibrium exists",
    UNDEFINED: "a signal has no value there, such as an efficiency at zero power",
}


def dataset(
    plant: Plant[Any], grid: Grid, common: Array, map_: SteadyMap, ordered: Grid, results: MapResults
) -> xr.Dataset:
    """Variables over the dimensions of ``grid``; ``results`` holds them in the order of ``ordered``."""
    import xarray as xr

    from powertrain import __version__

    compiled, problem, quantities = plant.compiled, map_.problem, map_.quantities
    turn = [ordered.dims.index(d) for d in grid.dims]

    def shaped(flat: NDArray[Any]) -> NDArray[Any]:
        return flat.reshape(ordered.shape).transpose(turn)

    data: dict[str, Any] = {}
    intervals = results.intervals or ()
    coords: dict[str, Any] = {name: c for axis in grid.axes for name, c in axis.coords.items()}
    coords |= {axis.coordinate: _axis(compiled, axis) for axis in grid.axes}
    for k, q in enumerate(quantities):
        if q.name in coords:
            continue
        attributes = {"units": q.unit, "long_name": q.doc or q.name}
        data[q.name] = (grid.dims, shaped(results.rows[k]), attributes)
        for end, rows, text in zip(("low", "high"), intervals, ("least", "greatest"), strict=False):
            told = {**attributes, "long_name": f"{attributes['long_name']}, {text} possible value"}
            data[f"{q.name}_{end}"] = (grid.dims, shaped(rows[k]), told)
    data["status"] = (grid.dims, shaped(results.status), _flags())
    named = [(law.name, str(law.where)) for law in (*problem.laws, *problem.guards)]
    if results.involved is not None:
        data["status_laws"] = (grid.dims, shaped(results.involved), _law_flags([n for n, _ in named]))
    said = {"problems": _problems(results, named), "notes": "\n".join(_notes(compiled, grid, common))}
    said |= {"model": type(plant.model).__name__, "powertrain_version": __version__}
    return xr.Dataset(data, coords=coords, attrs=said)


def _axis(compiled: Compiled, axis: GridAxis) -> tuple[tuple[str, ...], NDArray[np.float64], dict[str, str]]:
    unit, doc = described(compiled, axis.name)
    return axis.dims, axis.values, {"units": unit, "long_name": doc or axis.name, "signal": axis.name}


def _law_flags(names: list[str]) -> dict[str, Any]:
    masks = np.array([1 << k for k in range(min(len(names), MOST_LAWS))], np.int64)
    meanings = " ".join(n.replace(" ", "_") for n in names[:MOST_LAWS])
    return {"units": "1", "long_name": "Laws that the status is about", "flag_masks": masks, "flag_meanings": meanings}


def _problems(results: MapResults, named: list[tuple[str, str]]) -> str:
    """The problems in words, with the numbers of points."""
    status, lines = results.status, []
    for code, text in _PROBLEMS.items() if status.any() else ():
        hit = status == code
        if not hit.any():
            continue
        said = f"{int(hit.sum())} of {results.size} points: {text}"
        if results.involved is not None:
            bits = int(np.bitwise_or.reduce(results.involved[hit]))
            laws = [f"{n} ({w})" for k, (n, w) in enumerate(named) if k < MOST_LAWS and bits >> k & 1]
            said += f": {', '.join(laws[:6])}" if laws else ""
        lines.append(said)
    return "\n".join(lines)


def _notes(compiled: Compiled, grid: Grid, common: Array) -> tuple[str, ...]:
    """Where tables of the model have other values than the points."""
    values = dict(zip(compiled.parameters, common[: len(compiled.parameters)].tolist(), strict=True))
    return outdated(compiled, values | {a.name: a.values for a in grid.axes if a.name in values})


def _flags() -> dict[str, Any]:
    named = " ".join(STATUS.values())
    return {
        "units": "1",
        "long_name": "Status of the operating point",
        "flag_values": np.array(list(STATUS), np.int8),
        "flag_meanings": named,
    }


def described(compiled: Compiled, name: str) -> tuple[str, str]:
    """Unit and description of an input, a parameter or a variable."""
    if name in compiled.inputs:
        return compiled.inputs[name].unit, compiled.inputs[name].doc
    if name in compiled.parameters:
        return compiled.parameters[name].unit, compiled.parameters[name].doc
    return compiled.signals[name].unit, compiled.signals[name].doc
