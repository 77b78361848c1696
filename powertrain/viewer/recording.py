"""What a page shows of one run: decimated curves, events, energies, layouts, maps and parameters, as one frozen record."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from powertrain.analysis.audit import EnergyAudit, energy_audit
from powertrain.analysis.energy_terms import EnergyTerms
from powertrain.errors import ParameterError
from powertrain.events import MODES
from powertrain.figures.layout import Layout, layout
from powertrain.language.component import Component, Parameter, children
from powertrain.language.connectors import Connector
from powertrain.language.replacing import replace
from powertrain.result import Result
from powertrain.viewer.decimation import Array, Places, kept_samples
from powertrain.viewer.operating_map import OperatingMap

if TYPE_CHECKING:
    import xarray as xr

ERROR = 2e-3
"""Largest distance of a drawn curve from the samples, relative to the range of the signal."""
STRETCHED = 1.17
"""Distance of the columns relative to that of a drawn schematic: powers are written at the lines."""
ROUNDING = 1e-9
"""A signal that varies by less than this of its size is drawn as a constant."""


@dataclass(frozen=True)
class Curve:
    """A decimated signal: the places of its samples in the time axis, their values, unit, meaning, and the kind of law of a mode."""

    places: Places
    values: NDArray[np.float32]
    unit: str
    meaning: str
    mode: str = ""


@dataclass(frozen=True)
class Recording:
    """One run as a page shows it.

    ``energy``: component, class, energy supplied, lost and stored [J]; ``results``: quantity, value, unit.
    """

    name: str
    message: str
    time: Array
    curves: Mapping[str, Curve]
    events: Sequence[tuple[float, str, str]]
    parameters: Sequence[tuple[str, float, str, str]]
    results: Sequence[tuple[str, float, str]] = ()
    energy: Sequence[tuple[str, str, float, float, float]] = ()
    closure: float = 0.0
    layouts: Mapping[str, Layout] = field(default_factory=dict)
    ports: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    maps: Sequence[tuple[str, OperatingMap]] = ()
    states: Sequence[str] = ()


def recorded(
    result: Result[Any],
    name: str = "",
    results: Sequence[tuple[str, float, str]] = (),
    audit: EnergyAudit | None = None,
) -> Recording:
    """A run with its powers, losses and energies; ``audit``: its energy audit, if there is one already.

    Errors: ParameterError for a result that kept only samples; ModelError where a loss or an energy cannot be computed.
    """
    audit = audit or energy_audit(result)
    terms = EnergyTerms(result.compiled)
    p = np.array(list(result.parameters.values()), float)
    values = terms.values(result.samples, p)
    losses = values.loss.copy()
    for i in reversed(range(len(terms.parts))):  # of a component with its parts, which come after it
        losses[:, i] += losses[:, list(terms.parts[i].parts)].sum(axis=1)
    curves = _curves(result)
    for term, kind, names in (
        (values.power, "power", terms.ports),
        (losses, "loss", [part.path for part in terms.parts]),
    ):
        meaning = "Power into the component" if kind == "power" else "Dissipated power"
        columns = {f"{kind}({n})": term[:, k] for k, n in enumerate(names) if n}
        curves |= {n: _curve(result.time, y, "W", meaning) for n, y in columns.items()}
    table = audit.components
    rows = zip(table.index, table["type"], table["sources"], table["lost"], table["stored"], strict=True)
    return Recording(
        name or type(result.model).__name__,
        result.message,
        result.time,
        curves,
        [
            (float(event.time), event.name, row[2])
            for event, row in zip(result.events, result.events.rows(), strict=True)
        ],
        [(n, v, result.unit(n), result.description(n)) for n, v in result.parameters.items()],
        results,
        [(str(path), str(kind), float(given), float(lost), float(kept)) for path, kind, given, lost, kept in rows],
        audit.closure,
        dict(_layouts(result.model)),
        {part.path: tuple(terms.ports[k] for k in part.ports) for part in terms.parts},
        list(_maps(result)),
        list(result.compiled.states),
    )


def read(data: xr.Dataset, name: str) -> Recording:
    """A run that ``Result.save`` wrote: signals, events and parameters. Without the model there are no energies and no schematic."""
    time = np.asarray(data["time"].values, float)
    curves = {}
    for column, values in data.data_vars.items():
        attributes = values.attrs
        mode = next((k for k, v in MODES.items() if " ".join(v.values()) == attributes.get("flag_meanings")), "")
        unit, meaning = str(attributes.get("units", "")), str(attributes.get("long_name", ""))
        curves[str(column)] = _curve(time, np.asarray(values.values, float), unit, meaning, mode)
    events = [(float(t), str(law), str(said)) for t, law, said in json.loads(data.attrs.get("events", "[]"))]
    parameters = [(n, float(v), "", "") for n, v in json.loads(data.attrs.get("parameters", "{}")).items()]
    return Recording(name, str(data.attrs.get("message", "")), time, curves, events, parameters)


def _curves(result: Result[Any]) -> dict[str, Curve]:
    return {
        name: _curve(result.time, result[name], result.unit(name), result.description(name), result.modes.get(name, ""))
        for name in result
    }


def _curve(time: Array, values: Array, unit: str, meaning: str, mode: str = "") -> Curve:
    span = float(np.ptp(values)) if len(values) else 0.0
    if span <= ROUNDING * float(np.abs(values).max(initial=0.0)):
        places = np.unique([0, max(len(time) - 1, 0)])[: len(time)]
    else:
        places = kept_samples(time, values, ERROR * span)
    return Curve(places, values[places].astype(np.float32), unit, meaning, mode)


def _layouts(model: Component) -> Iterator[tuple[str, Layout]]:
    """The schematic of the whole (path "") and of every composite component."""
    for path, part in (("", model), *_parts(model)):
        try:
            found = layout(part)
        except ParameterError:  # it has no connected parts
            continue
        for vertex in found.vertices:
            vertex.x *= STRETCHED
        yield path, found


def _maps(result: Result[Any]) -> Iterator[tuple[str, OperatingMap]]:
    """The operating maps of the components with the parameters of the run."""
    for path, part in _parts(result.model):
        if hasattr(part, "operating_map"):
            own = {
                n: result.parameters.get(f"{path}.{n}")
                for n, spec in part._fields.items()
                if isinstance(spec, Parameter)
            }
            yield path, replace(part, {n: v for n, v in own.items() if v is not None}).operating_map()


def _parts(whole: Component, path: str = "") -> Iterator[tuple[str, Any]]:
    """All components of a model with their paths."""
    for name, part in children(whole):
        if not isinstance(part, Connector):
            yield f"{path}{name}", part
            yield from _parts(part, f"{path}{name}.")
