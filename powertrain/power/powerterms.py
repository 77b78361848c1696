"""The power, loss, supply and storage of a model's components, at samples of a simulation or at operating points."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain.analysis.energy_terms import EnergyTerms, WrittenTerms, own_power, written_terms
from powertrain.compiler.assemble import Compiled
from powertrain.errors import ParameterError
from powertrain.language.arguments import array
from powertrain.language.component import Component
from powertrain.language.symbols import Symbol
from powertrain.plant import Plant, plant_of
from powertrain.power.powergraph import PowerGraph, power_graph
from powertrain.power.variator import named_port, pair, port_motion
from powertrain.result import Result
from powertrain.signals import Picked, Selector, signals_of

if TYPE_CHECKING:
    import xarray as xr

Matrix = NDArray[np.float64]
_TEXTS = {
    "power": ("W", "Power into the component"),
    "speed": ("", "Speed of the port"),
    "torque": ("", "Torque or force on the component"),
    "loss": ("W", "Dissipated power"),
    "supplied": ("W", "Power that sources supply"),
    "delivered": ("W", "Power that is delivered to loads"),
    "stored": ("W", "Rate of the stored energy"),
}


def power_outputs(plant: Plant[Any] | Component) -> dict[str, Selector]:
    """The ``outputs`` of ``pt.steady`` that ``pt.power_flow(plant, dataset)`` needs: names, and selectors of the terms."""
    compiled = plant_of(plant).compiled
    terms = written_terms(compiled)
    expressions = dict(zip((f"power({n})" for n in terms.ports), terms.power, strict=True))
    expressions |= _motions(compiled, terms.ports)
    expressions |= {f"loss({p.path})": e for p, e in zip(terms.parts, terms.loss, strict=True) if not e.is_zero()}
    return {name: _selector(e) for name, e in expressions.items()}


def _selector(expression: Symbol) -> Callable[[Any], Any]:
    return lambda _: expression


def _motions(compiled: Compiled, ports: Sequence[str]) -> dict[str, Symbol]:
    """Speed and flow of every port that has one of each."""
    found: dict[str, Symbol] = {}
    for name in ports:
        flow = pair(named_port(compiled, name))[1]
        if flow is not None:
            found[f"speed({name})"], found[f"torque({name})"] = port_motion(compiled, name), flow
    resolved = signals_of(compiled).resolve(list(found.values()))
    return dict(zip(found, resolved, strict=True))


def from_result(
    result: Result[Any], at: ArrayLike | None, whole: str | Sequence[str], outputs: Mapping[str, Selector]
) -> tuple[PowerGraph, xr.Dataset]:
    """The terms at times of a simulation, by default at all its samples."""
    compiled, trajectory = result.compiled, result.trajectory
    terms = EnergyTerms(compiled)
    times = np.unique(result.time) if at is None else result.trajectory.within("t = ", array("at", at))
    samples = trajectory.at(times.ravel(), with_events=at is None)
    signals, p = signals_of(compiled), result.p
    samples = signals.corrected(samples, p)
    values = terms.values(samples, p)
    motions = _motions(compiled, terms.ports)
    picked = {name: signals.pick(what) for name, what in outputs.items()}
    wanted = [*motions.values(), *(one.expression for one in picked.values())]
    rows = signals.evaluate(wanted, samples, p).T if wanted else np.zeros((0, len(samples.t)))
    named = dict(zip([*motions, *picked], rows, strict=True))
    graph, data = _dataset(compiled, terms, whole, values.power.T, values.loss.T, values.rate.T, named, picked)
    data = data.rename(point="time").assign_coords(time=("time", samples.t, {"units": "s", "long_name": "Time"}))
    return graph, data.isel(time=0) if times.ndim == 0 else data


def from_steady(compiled: Compiled, points: Any, whole: str | Sequence[str]) -> tuple[PowerGraph, xr.Dataset]:
    """The terms at operating points solved with ``power_outputs``. If states were held, power that is not lost is stored."""
    import xarray as xr

    terms = written_terms(compiled)
    missing = [n for n in ("status", *(f"power({n})" for n in terms.ports)) if n not in points]
    if missing:
        raise ParameterError(
            f"the dataset has no {missing[0]}: call pt.steady(..., outputs={{**pt.power_outputs(plant), ...}})"
        )
    dims = tuple(points["status"].dims)
    shape = tuple(points.sizes[d] for d in dims)

    def flat(name: str) -> NDArray[np.float64]:
        if name not in points:
            return np.zeros(int(np.prod(shape)))
        return np.asarray(points[name].broadcast_like(points["status"]).transpose(*dims).values, float).ravel()

    power = np.array([flat(f"power({n})") for n in terms.ports]).reshape(len(terms.ports), -1)
    loss = np.array([flat(f"loss({part.path})") for part in terms.parts])
    loss[:, ~np.isfinite(power).all(axis=0)] = np.nan
    own = own_power(terms.parts, len(terms.ports)) @ power - loss
    inner = np.array([not part.boundary for part in terms.parts])[:, None]
    held = any(str(n).startswith("der(") for n in points.data_vars)
    rate = np.where(inner, own, 0.0) if held else np.zeros(own.shape)
    motions = {n: flat(n) for name in terms.ports for n in (f"speed({name})", f"torque({name})") if n in points}
    graph, data = _dataset(compiled, terms, whole, power, loss, rate, motions, {})
    done = set(motions) | {f"power({n})" for n in terms.ports} | {f"loss({part.path})" for part in terms.parts}
    arrays = {
        str(name): xr.DataArray(v.values.reshape((*v.shape[:-1], *shape)), dims=(*v.dims[:-1], *dims), attrs=v.attrs)
        for name, v in data.data_vars.items()
    }
    rest = points.drop_vars([n for n in points.data_vars if n in done])
    return graph, rest.assign(arrays).assign_coords(port=data.port, component=data.component)


def _dataset(
    compiled: Compiled,
    terms: EnergyTerms | WrittenTerms,
    whole: str | Sequence[str],
    power: Matrix,
    loss: Matrix,
    rate: Matrix,
    named: Mapping[str, NDArray[np.float64]],
    picked: Mapping[str, Picked],
) -> tuple[PowerGraph, xr.Dataset]:
    """The graph of the model, and all terms over its ports, components and points."""
    import xarray as xr

    parts, ports = terms.parts, terms.ports
    graph = power_graph(compiled.source.nodes, parts, ports, whole)
    boundary = np.array([part.boundary for part in parts])[:, None]
    supply = np.where(boundary, loss + rate - own_power(parts, len(ports)) @ power, 0.0)
    members = np.zeros((len(graph.components), len(parts)))
    for row, inside in zip(members, graph.members, strict=True):
        row[list(inside)] = 1.0
    by_component = {
        "loss": members @ loss,
        "supplied": members @ np.maximum(supply, 0.0),
        "delivered": members @ np.maximum(-supply, 0.0),
        "stored": members @ rate,
    }
    nothing = np.full(power.shape[1], np.nan)
    by_port = {"power": power}
    for kind in ("speed", "torque"):
        by_port[kind] = np.array([named.get(f"{kind}({n})", nothing) for n in ports]).reshape(power.shape)
    data: dict[str, Any] = {n: (("component", "point"), v) for n, v in by_component.items()}
    data |= {n: (("port", "point"), v) for n, v in by_port.items()}
    data |= {n: ("point", named[n]) for n in picked}
    found = xr.Dataset(data, coords={"port": ports, "component": list(graph.components)})
    for name, (unit, text) in _TEXTS.items():
        found[name].attrs = {"units": unit, "long_name": text}
    for name, one in picked.items():
        found[name].attrs = {"units": one.unit, "long_name": one.doc or one.label}
    return graph, found
