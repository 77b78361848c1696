"""Power flow: the power through every port, the paths it takes, the loops in which it circulates, and how it is shared.

The graph has the components and the connections between them as vertices; every port is an edge that carries the port's power, in the
direction in which it flows. Losses, deliveries to loads, supplies and storage are edges out of and into the model.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from powertrain.analysis.energy_terms import written_terms
from powertrain.compiler.assemble import Compiled
from powertrain.errors import ParameterError
from powertrain.language.arguments import by_name, names, text
from powertrain.language.component import Component
from powertrain.language.reals import Array
from powertrain.plant import Plant, plant_of
from powertrain.power.circulation import Strand
from powertrain.power.directedflow import FLOOR, DirectedFlow
from powertrain.power.paths import Branch, Way
from powertrain.power.powergraph import PowerGraph
from powertrain.power.powerterms import from_result, from_steady, power_outputs
from powertrain.power.variator import NEGATIVE, VARIATOR_CASES, kinematic_share
from powertrain.result import Result
from powertrain.signals import Selector
from powertrain.steadystate.steady import steady

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

Matrix = NDArray[np.float64]


def power_flow(
    source: Result[Any] | Plant[Any] | Component,
    grid: Mapping[str, Any] | xr.Dataset | None = None,
    *,
    at: float | Sequence[float] | Array | None = None,
    whole: str | Sequence[str] = (),
    outputs: Mapping[str, Selector] | None = None,
    variator: str | None = None,
    shafts: tuple[str, str] | None = None,
    ratio: str | None = None,
    **options: Any,
) -> PowerFlow:
    """The power flow of a simulation or of operating points.

    Parameters
    ----------
    source : Result, Plant or Component
        A run, whose samples are used; or a model.
    grid : mapping or Dataset, optional
        For a model: the grid of operating points, as for ``pt.steady``, or points solved by
        ``pt.steady(plant, ..., outputs={**pt.power_outputs(plant), ...})``.
    at : float or sequence of float, optional
        For a run: one time [s], or several.
    whole : str or sequence of str
        Composite components (names or patterns) to be treated as one; all others are resolved into their parts.
    outputs : mapping, optional
        Other signals requested besides the powers, under new names, in ``.data``.
    variator : str, optional
        A component whose lossless share of the power is added, by differentiation of the kinematics (see ``PowerFlow.variator``). There
        is none where the ratio does not set the speeds, as with hydrostatic units and belts that creep between inertias.
    shafts : tuple of two str, optional
        Ports of the vehicle's or transmission's input and output, for ``variator``.
    ratio : str, optional
        The ratio of the variator if it is not ``<variator>.ratio``.
    **options
        Options of ``pt.steady``. If a point is stuck, ``side=1`` and ``side=-1`` give the power flow at either end of the interval,
        including K and the cases.

    Returns
    -------
    PowerFlow

    Raises
    ------
    ParameterError
        If names are wrong or the source does not fit.

    Examples
    --------
    >>> pt.power_flow(result, at=3.0).plot()  # doctest: +SKIP
    """
    if isinstance(source, Result):
        if grid is not None or options:
            raise ParameterError("power_flow(result) accepts at=..., whole=..., outputs=...; a grid is for a plant")
        wanted = dict(by_name("outputs", outputs)) | _share(source.compiled, variator, shafts, ratio)
        return PowerFlow(*from_result(source, at, whole, wanted))
    plant = plant_of(source)
    if grid is None or at is not None:
        raise ParameterError("power_flow(plant, ...) needs a grid, like pt.steady; at=... is for a result")
    if hasattr(grid, "data_vars"):
        return PowerFlow(*from_steady(plant.compiled, grid, whole))
    wanted = power_outputs(plant) | dict(by_name("outputs", outputs)) | _share(plant.compiled, variator, shafts, ratio)
    spanned: Any = grid
    return PowerFlow(*from_steady(plant.compiled, steady(plant, spanned, outputs=wanted, **options), whole))


def _share(
    compiled: Compiled, variator: str | None, shafts: tuple[str, str] | None, ratio: str | None
) -> dict[str, Selector]:
    if variator is None or shafts is None:
        if variator is not None or shafts is not None:
            raise ParameterError("variator=... and shafts=(port at the input, port at the output) belong together")
        return {}
    ends = names("shafts", shafts)
    if len(ends) != 2:
        raise ParameterError(f"shafts = {shafts!r}: give two ports, at the input and at the output")
    own = [name for name in written_terms(compiled).ports if name.rpartition(".")[0] == variator]
    share = kinematic_share(compiled, text("ratio", ratio or f"{variator}.ratio"), (ends[0], ends[1]), own)
    return {} if share is None else {f"share({variator})": lambda _: share}


class PowerFlow:
    """Power through every port at one point, over time, or over a grid; ``data`` is the dataset.

    ``data.power`` (port): power into the component; ``data.speed`` and ``data.torque`` (port): speed and flow of the connector;
    ``data.loss``, ``supplied``, ``delivered``, ``stored`` (component); and the other requested outputs. Points without
    a unique solution are nan.

    ``isel`` and ``sel`` select points. For one point: ``branches``, ``loops``, ``paths``, ``splits``. For any number: ``input``,
    ``output``, ``efficiency``, ``into()``, ``out_of()``, ``circulating``, ``split()``, ``variator()``, ``imbalance``.

    Power paths are not unique where power mixes. The rule: cycles are removed from the flow first, beginning with the cycle of the largest
    minimum flow, then paths in the same way. The circulating power is the power on cycles; with one loop it does not depend on the rule.
    """

    def __init__(self, graph: PowerGraph, data: xr.Dataset) -> None:
        self.graph, self.data = graph, data

    def isel(self, **indexers: Any) -> PowerFlow:
        """The points at these indices of the dimensions."""
        return PowerFlow(self.graph, self.data.isel(indexers))

    def sel(self, method: str | None = "nearest", **indexers: Any) -> PowerFlow:
        """The points at these values of the dimensions, by default the nearest ones."""
        return PowerFlow(self.graph, self.data.sel(indexers, method=method))

    @property
    def power(self) -> xr.DataArray:
        """Power into the component through every port (W)."""
        return self.data["power"]

    @property
    def input(self) -> xr.DataArray:
        """Power that sources supply to the model (W)."""
        return self._named(self.data["supplied"].sum("component", skipna=False), "W", "Input power")

    @property
    def output(self) -> xr.DataArray:
        """Power that the model delivers to loads (W)."""
        return self._named(self.data["delivered"].sum("component", skipna=False), "W", "Output power")

    @property
    def efficiency(self) -> xr.DataArray:
        """Power delivered or stored over power supplied or released from storage: output over input where nothing is stored.

        nan if no power enters. Power that a part such as drag takes as a loss is not output; in that case use
        ``into(part)/out_of(source)``.
        """
        stored = self.data["stored"]
        charging, released = (each.clip(min=0.0).sum("component", skipna=False) for each in (stored, -stored))
        given = self.input + released
        least = self._shaped(self._directed.floor)
        return self._named((self.output + charging) / given.where(given > least), "1", "Efficiency")

    def into(self, component: str) -> xr.DataArray:
        """Power that enters a component through its ports (W)."""
        values = self._directed.entering(self.graph.component(component))
        return self._named(self._shaped(values), "W", f"Power into {component}")

    def out_of(self, component: str) -> xr.DataArray:
        """Power that leaves a component through its ports (W)."""
        values = self._directed.leaving(self.graph.component(component))
        return self._named(self._shaped(values), "W", f"Power out of {component}")

    @cached_property
    def circulating(self) -> xr.DataArray:
        """Power on cycles of the directed graph (W)."""
        return self._named(self._shaped(self._directed.circulation[0]), "W", "Circulating power")

    @property
    def imbalance(self) -> xr.DataArray:
        """Power into every component plus its supply, minus its losses and the power it stores (W); round-off if the equations agree."""
        into = self._directed.own()
        rest = self.data["supplied"] - self.data["delivered"] - self.data["loss"] - self.data["stored"]
        return self._named(rest + self._shaped(into, "component"), "W", "Imbalance of power")

    def split(self, vertex: str) -> xr.DataArray:
        """The shares of the power that leaves a component, or a connection of several ports, through each of its ports.

        They sum to one over ``port``; ports through which power enters have zero. nan if no power leaves.
        """
        places, sign = self._around(vertex)
        leaving = np.maximum(sign * self._directed.power[places], 0.0)
        total = leaving.sum(axis=0)
        with np.errstate(invalid="ignore", divide="ignore"):
            shares = np.where(total > 0, leaving / total, np.nan)
        names = [self.graph.terminals[k].port for k in places]
        return self._named(self._shaped(shares, "port", names), "1", f"Share of the power that leaves {vertex}")

    def variator(self, name: str, source: str | None = None) -> xr.Dataset:
        """How much power goes through a component relative to the other paths: K (29), its case (Fig. 8), its efficiency.

        ``K``: power into it over the input power of the model (or of the component ``source``), negative in negative recirculation.
        ``case``: "split", power flows forward through it and in parallel to it; "series", all power flows through it; "positive
        recirculation", it lies on a loop that returns in parallel to it, so it carries more than the transmitted power; "negative
        recirculation", it lies on a loop and carries power back; "idle". ``share``, if shafts were given and V sets the speeds of the
        unit: d ln tau/d ln V, the power from flange_a to flange_b over the input power without losses; ``K_o``: the same with the sign of
        K.

        The cases follow from the directions of power in any topology. For the input-coupled transmission with its
        output at 3, K is Yu & Beachley's eq. (29): positive if power flows from the unit to the differential.
        """
        import xarray as xr

        v = self.graph.component(name)
        flow = self._directed
        into, given, case = flow.entering(v), self._input_of(source), flow.cases(v)
        sign = np.where(case == NEGATIVE, -1.0, 1.0)
        with np.errstate(invalid="ignore", divide="ignore"):
            K = np.where(given > flow.floor, sign * into / given, np.nan)
            efficiency = np.where(into > 0, flow.leaving(v) / into, np.nan)
        named = np.array([*VARIATOR_CASES, ""], dtype=object)[case]
        found = {
            "power": self._named(self._shaped(into), "W", f"Power into {name}"),
            "K": self._named(self._shaped(K), "1", f"Power into {name} over input power"),
            "efficiency": self._named(self._shaped(efficiency), "1", f"Efficiency of {name}"),
            "case": self._named(self._shaped(named), "1", "Case of the power flow"),
        }
        if f"share({name})" in self.data:
            share = self.data[f"share({name})"]
            found["share"] = self._named(share, "1", f"Lossless share of {name}, d ln τ/d ln V")
            signed = abs(share) * self._shaped(sign)
            found["K_o"] = self._named(signed, "1", f"Power into {name} over input power without losses")
        return xr.Dataset(found, attrs={"variator": name})

    @property
    def branches(self) -> list[Branch]:
        """Power between vertices at one point: from component to component, or through a connection of several."""
        power = self._point(self._directed.power)
        floor = FLOOR * np.abs(power).max(initial=0.0)
        found: list[Branch] = []
        for node, name in enumerate(self.graph.nodes):
            ends = [k for k in self.graph.at_node(node) if abs(power[k]) > floor]
            if len(ends) == 2:
                first, second = sorted(ends, key=lambda k: float(power[k]))
                ports = (self.graph.terminals[first].port, self.graph.terminals[second].port)
                found.append(Branch(self._owner(first), self._owner(second), float(power[second]), ports))
                continue
            for k in ends:
                source, target = (name, self._owner(k)) if power[k] > 0 else (self._owner(k), name)
                found.append(Branch(source, target, abs(float(power[k])), (self.graph.terminals[k].port,)))
        return found

    @property
    def loops(self) -> list[Way]:
        """The loops of circulating power at one point, the largest first."""
        return [self._way(strand, "loop") for strand in self.strands()[0]]

    @property
    def paths(self) -> list[Way]:
        """The paths of power from sources to loads, losses and storage at one point, without the loops, the largest first."""
        return [self._way(strand, self._directed.end(strand)) for strand in self.strands()[1]]

    @property
    def splits(self) -> dict[str, dict[str, float]]:
        """Every component and connection at which power branches at one point, with the share of every port through which it leaves."""
        found: dict[str, dict[str, float]] = {}
        for vertex in [*self.graph.components, *self.graph.nodes]:
            shares = self.split(vertex)
            leaving = {
                str(port): float(s) for port, s in zip(shares.port.values, shares.values, strict=True) if s > FLOOR
            }
            if len(leaving) > 1:
                found[vertex] = leaving
        return found

    def plot(self, ax: Axes | None = None, **options: Any) -> Axes:
        """The power flow of one point as a diagram; see ``powertrain.power.powerdiagram.plot_power_flow``."""
        from powertrain.power.powerdiagram import plot_power_flow

        return plot_power_flow(self, ax=ax, **options)

    def __repr__(self) -> str:
        sizes = {str(d): n for d, n in self._sizes.items()}
        head = f"PowerFlow: {len(self.graph.components)} components, {len(self.graph.terminals)} ports"
        if sizes:
            return f"{head}; {' × '.join(f'{n} {d}' for d, n in sizes.items())}"
        if not np.isfinite(self._directed.power).all():
            return f"{head}; no solution at this point"
        lines = [f"{head}; input {float(self.input):.6g} W, output {float(self.output):.6g} W"]
        lines += [f"  {b.power:12.6g} W  {b.source} → {b.target}" for b in self.branches]
        lines += [f"  loop {way}" for way in self.loops]
        return "\n".join(lines)

    def strands(self) -> tuple[list[Strand], list[Strand]]:
        """Cycles and paths at one point; edges are indices of ``graph.terminals``, and beyond them the edges to and from outside."""
        self._point(self._directed.power)
        return self._directed.strands(0)

    @cached_property
    def _directed(self) -> DirectedFlow:
        power = self._flat(self.data["power"].sel(port=[t.port for t in self.graph.terminals]), "port")
        terms = (self._flat(self.data[n], "component") for n in ("supplied", "loss", "delivered", "stored"))
        return DirectedFlow(self.graph, power, *terms)

    @property
    def _sizes(self) -> dict[Hashable, int]:
        return {d: n for d, n in self.data.sizes.items() if d not in ("port", "component")}

    def _flat(self, values: xr.DataArray, first: str) -> Matrix:
        """One row per port or component, one column per point."""
        return np.asarray(values.transpose(first, *self._sizes).values, float).reshape(values.sizes[first], -1)

    def _shaped(self, values: NDArray[Any], first: str = "", names: Sequence[str] = ()) -> xr.DataArray:
        """Values of all points, or rows of them, with their dimensions."""
        import xarray as xr

        labels = list(names or self.graph.components) if first else []
        shape = ((len(labels),) if first else ()) + tuple(self._sizes.values())
        dims = ((first,) if first else ()) + tuple(self._sizes)
        kept = {n: c for n, c in self.data.coords.items() if not {"port", "component"} & set(c.dims)}
        array = xr.DataArray(values.reshape(shape), dims=dims, coords=kept)
        return array.assign_coords({first: labels}) if first else array

    @staticmethod
    def _named(array: xr.DataArray, unit: str, text: str) -> xr.DataArray:
        return array.assign_attrs(units=unit, long_name=text)

    def _point(self, values: Matrix) -> Array:
        if values.shape[1] != 1:
            many = " × ".join(f"{n} {d}" for d, n in self._sizes.items())
            raise ParameterError(
                f"this needs a single point, but there are {many}: choose one with isel(...) or sel(...)"
            )
        return values[:, 0]

    def _around(self, vertex: str) -> tuple[list[int], float]:
        """The terminals of a component (sign -1: power into it counts negative) or of a node (+1)."""
        if vertex in self.graph.nodes:
            return self.graph.at_node(self.graph.nodes.index(vertex)), 1.0
        return self.graph.of_component(self.graph.component(vertex)), -1.0

    def _input_of(self, source: str | None) -> Array:
        if source is None:
            supplied: Array = self._flat(self.data["supplied"], "component").sum(axis=0)
            return supplied
        return self._directed.leaving(self.graph.component(source))

    def _owner(self, terminal: int) -> str:
        return self.graph.components[self.graph.terminals[terminal].component]

    def _way(self, strand: Strand, end: str) -> Way:
        edges, C = self._directed.edges(0), len(self.graph.components)
        names = [*self.graph.components, *self.graph.nodes]
        branching = {C + n for n in range(len(self.graph.nodes)) if len(self.graph.at_node(n)) > 2}
        visited = [edges[k][0] for k in strand.edges]
        return Way(strand.flow, tuple(names[v] for v in visited if v < C or v in branching), end)
