"""What a page shows of one run: decimated curves, events, energies, layouts, maps and parameters, as one frozen record."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from dataclasses import replace as replaced
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from powertrain.analysis.audit import EnergyAudit, energy_audit
from powertrain.analysis.energy_terms import EnergyTerms, with_parts
from powertrain.errors import ParameterError
from powertrain.events import change
from powertrain.figures.layout import Layout, layout
from powertrain.language.component import Component, descendants
from powertrain.language.connectors import Connector
from powertrain.language.fields import Parameter
from powertrain.language.reals import Array
from powertrain.language.replacing import replace
from powertrain.result import Result
from powertrain.saved import Saved
from powertrain.viewer.decimation import Places, kept_samples
from powertrain.viewer.operating_map import OperatingMap

ERROR = 2e-3
"""Largest distance of a drawn curve from the samples, relative to the range of the signal."""
STRETCHED = 1.31
"""Distance of the columns relative to that of a drawn schematic: powers are written at the lines."""
ROUNDING = 1e-9
"""A signal that varies by less than this of its size is drawn as a constant."""
INTO, LOST = "Power into the component", "Dissipated power"


class RunLike(Protocol):
    """A run with a table of its main results, such as that of a vehicle over a cycle."""

    @property
    def result(self) -> Result[Any]:
        """The simulation."""
        ...

    @property
    def table(self) -> Any:
        """Quantities with value and unit, a DataFrame; Any, because pyright takes a cached property for nothing else."""
        ...

    @property
    def audit(self) -> Any:
        """The energy audit of the simulation, an EnergyAudit."""
        ...


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


def a_run(run: Any, what: str) -> Result[Any] | RunLike | Saved:
    """The run that a user passes to ``what``: a dataset is a saved run. Errors: ParameterError for anything else."""
    if hasattr(run, "data_vars"):
        return Saved(run)
    if not isinstance(run if isinstance(run, Result) else getattr(run, "result", None), Result):
        raise ParameterError(
            f"{what} takes results of simulate, runs over cycles and datasets of load, not a {type(run).__name__}"
        )
    found: Result[Any] | RunLike = run
    return found


def recorded(run: Result[Any] | RunLike | Saved, name: str = "") -> Recording:
    """A run with its powers, losses and energies, as far as they are known: a saved run has signals, events and parameters.

    Errors: ParameterError for a result that kept only samples; ModelError where a loss or an energy cannot be computed.
    """
    if isinstance(run, Saved):
        return _of_signals(run, name or run.name)
    if isinstance(run, Result):
        return _of_result(run, energy_audit(run), name)
    rows = [(str(what), float(value), str(unit)) for what, value, unit in run.table.itertuples()]
    return replaced(_of_result(run.result, run.audit, name), results=rows)


def _of_signals(run: Result[Any] | Saved, name: str) -> Recording:
    events = run.events if isinstance(run, Saved) else [(e.time, e.name, change(e)) for e in run.events]
    parameters = [(n, v, run.unit(n), run.description(n)) for n, v in run.parameters.items()]
    return Recording(name, run.message, run.time, _curves(run), events, parameters)


def _of_result(result: Result[Any], audit: EnergyAudit, name: str) -> Recording:
    terms = EnergyTerms(result.compiled)
    values = terms.values(result.samples, result.p)
    losses = with_parts(terms.parts, values.loss.T)
    paths = [part.path for part in terms.parts]
    curves = {
        f"power({n})": _curve(result.time, y, "W", INTO) for n, y in zip(terms.ports, values.power.T, strict=True)
    }
    curves |= {f"loss({n})": _curve(result.time, y, "W", LOST) for n, y in zip(paths, losses, strict=True) if n}
    table = audit.components
    rows = zip(table.index, table["type"], table["sources"], table["lost"], table["stored"], strict=True)
    plain = _of_signals(result, name or type(result.model).__name__)
    return replaced(
        plain,
        curves={**plain.curves, **curves},
        energy=[(str(path), str(kind), float(a), float(b), float(c)) for path, kind, a, b, c in rows],
        closure=audit.closure,
        layouts=dict(_layouts(result.model)),
        ports={part.path: tuple(terms.ports[k] for k in part.ports) for part in terms.parts},
        maps=list(_maps(result)),
        states=list(result.compiled.states),
    )


def _curves(run: Result[Any] | Saved) -> dict[str, Curve]:
    modes = run.modes
    return {
        name: _curve(run.time, run[name], run.unit(name), run.description(name), modes.get(name, "")) for name in run
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


def _parts(whole: Component) -> Iterator[tuple[str, Any]]:
    """All components of a model with their paths, without their ports."""
    return ((path, part) for path, part in descendants(whole) if not isinstance(part, Connector))
