"""The energy audit of a simulation: where energy came in, where it was lost and stored, and how well that adds up."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from powertrain.analysis.energy_terms import EnergyTerms, EnergyValues, with_parts
from powertrain.analysis.jumps import jumps
from powertrain.analysis.quadrature import NODES, Pieces
from powertrain.engine.trajectory import Trajectory
from powertrain.language import htmltext
from powertrain.language.arguments import of_kind
from powertrain.language.reals import Array
from powertrain.result import Result

if TYPE_CHECKING:
    import pandas as pd

Matrix = NDArray[np.float64]
ROUNDING = 1e-6
"""Largest error of a power or an energy that counts as round-off, relative to the component's own terms."""
NOISE = 1e-9
"""Power in watts and energy in joules that count as zero: round-off of speeds at rest and of torques under load."""


def energy_audit(result: Result[Any]) -> EnergyAudit:
    """Follow the energy of a simulation through every port and every component.

    For every component except sources and ground, at every instant: power in through its ports = loss() + d energy()/dt. Over the run:
    E(end) - E(start) = supply - losses. The integrals are evaluated by Gauss quadrature of the integrator's dense output, in its steps or
    finer, so the residual is of the order of the integration error. Energy lost at one instant (an impact, a reset) is a loss of the
    component that declares it.

    Raises ParameterError for a result that kept only samples, ModelError if a term cannot be computed or is not finite.
    """
    of_kind("energy_audit", result, Result, "the result of a simulation")
    return EnergyAudit(result)


@dataclass
class _Sums:
    """Integrals over the run in joules, extremes in watts, and the largest energy ``stored`` by components and model (at ``most``).

    ``forward`` and ``backward`` are the positive and negative parts of ``power``. ``gain`` is the magnitude of the most negative loss,
    ``gained`` its time in seconds and ``given`` its integral; ``unbalanced`` is the time of the largest imbalance.
    """

    power: Array
    forward: Array
    backward: Array
    highest: Array
    lowest: Array
    loss: Array
    supply: Array
    turned: Array
    imbalance: Array
    unbalanced: Array
    gain: Array
    gained: Array
    given: Array
    scale: Array
    stored: Array
    most: Array

    @classmethod
    def of(cls, ports: int, parts: int) -> _Sums:
        sums = cls(*(np.zeros(n) for n in (*[ports] * 5, *[parts] * 10, 1)))
        sums.highest[:], sums.lowest[:] = -np.inf, np.inf
        return sums


class EnergyAudit:
    """The energy balance of one simulation.

    Tables: ``components``, ``ports`` and ``jumps`` in joules over the whole run; ``power``, ``loss``, ``energy``, ``supply`` and
    ``imbalance`` over time, with one column for each port or component ("" is the whole model; a component includes its parts). Their
    units are in ``attrs["units"]``.

    ``closure`` is the energy residual of all components relative to ``turnover``, the energy exchanged.
    ``violations`` lists what no component may do: a negative loss, stored energy that jumps, power that does not balance. A small closure
    alone is no proof, because energy that is created and declared as a loss closes as well.
    """

    def __init__(self, result: Result[Any]) -> None:
        trajectory, p = result.trajectory, result.p
        terms = EnergyTerms(result.compiled)
        self.model = type(result.model).__name__
        self._parts, self._ports, self._own = terms.parts, terms.ports, terms.own
        self._sums = _integrate(terms, trajectory, p)
        self._jumps = jumps(terms, result.compiled.dae, trajectory, p)
        self._samples = trajectory.at(np.unique(result.time), with_events=True)
        self.time: Array = self._samples.t
        self._at = partial(terms.values, p=p)
        first, last = (
            self._at(trajectory.at([t], with_events=False)).energy[0] for t in (trajectory.start, trajectory.end)
        )
        self._stored = last - first

    def __getstate__(self) -> dict[str, Any]:
        """Numbers only: what remains to be evaluated at ``time`` is evaluated."""
        return {**self.__dict__, "_values": self._values, "_at": None}

    @cached_property
    def _values(self) -> EnergyValues:
        """The terms at ``time``."""
        return self._at(self._samples)

    @cached_property
    def components(self) -> pd.DataFrame:
        """Energies of every component over the run in joules, with supplied + sources + impulses = lost + stored + residual.

        supplied: received through connections; sources: from boundaries inside it; impulses: received at instants (impacts, resets);
        lost: over time and at instants; stored: change of the stored energy; residual: the difference.
        """
        import pandas as pd

        whole = {name: with_parts(self._parts, values) for name, values in self._balance().items()}
        supplied = with_parts(self._parts, self._own @ self._sums.power)
        rows = {"type": [part.kind for part in self._parts], "supplied": supplied, **whole}
        table = pd.DataFrame(rows, index=pd.Index([part.path for part in self._parts], name="component"))
        table.attrs["units"] = dict.fromkeys(list(table.columns)[1:], "J")
        return table

    @cached_property
    def ports(self) -> pd.DataFrame:
        """Every port over the run: net energy into its component, energy in and out (J), maximum and minimum power (W)."""
        import pandas as pd

        s = self._sums
        columns = {
            "energy": s.power,
            "energy_in": s.forward,
            "energy_out": s.backward,
            "max_power": s.highest,
            "min_power": s.lowest,
        }
        table = pd.DataFrame(columns, index=pd.Index(self._ports, name="port"))
        table.attrs["units"] = dict(zip(columns, ("J", "J", "J", "W", "W"), strict=True))
        return table

    @cached_property
    def jumps(self) -> pd.DataFrame:
        """Every instant at which stored energy changes: time (s), cause, the components that declare it, and the change in joules.

        ``supplied`` is what sources of motion give with impulses of their own, in joules.
        If neither a contact nor a reset is the cause, ``components`` is empty and the change is part of the residual.
        """
        import pandas as pd

        rows = [
            (
                j.time,
                j.cause,
                ", ".join(self._parts[i].path for i in j.owners),
                float(j.change.sum()),
                float(j.supplied.sum()),
            )
            for j in self._jumps
            if j.owners or np.abs(j.change).sum() > 1e-9 * self._scale
        ]
        table = pd.DataFrame(rows, columns=["time", "cause", "components", "energy", "supplied"])
        table.attrs["units"] = {"time": "s", "energy": "J", "supplied": "J"}
        return table

    @cached_property
    def power(self) -> pd.DataFrame:
        """Power into the component through every port over time (W)."""
        return self._frame(self._values.power, self._ports, "W")

    @cached_property
    def loss(self) -> pd.DataFrame:
        """Dissipated power of every component over time (W), without losses at single instants."""
        return self._frame(with_parts(self._parts, self._values.loss.T).T, [part.path for part in self._parts], "W")

    @cached_property
    def energy(self) -> pd.DataFrame:
        """Stored energy of every component over time (J)."""
        return self._frame(with_parts(self._parts, self._values.energy.T).T, [part.path for part in self._parts], "J")

    @cached_property
    def supply(self) -> pd.DataFrame:
        """Power that sources and ground supply to the model over time (W), one column each."""
        places = [i for i, part in enumerate(self._parts) if part.boundary]
        return self._frame(_supply(self._values, self._own)[:, places], [self._parts[i].path for i in places], "W")

    @cached_property
    def imbalance(self) -> pd.DataFrame:
        """The residual of every component's own power balance over time (W): rounding if its equations are right."""
        inner = [i for i, part in enumerate(self._parts) if not part.boundary]
        return self._frame(-_supply(self._values, self._own)[:, inner], [self._parts[i].path for i in inner], "W")

    @cached_property
    def hidden(self) -> dict[str, float]:
        """Components whose own power does not balance, with the largest imbalance in watts."""
        found = self._sums.imbalance
        return {self._parts[i].path: float(found[i]) for i in np.flatnonzero(found > self._tolerances)}

    @cached_property
    def violations(self) -> pd.DataFrame:
        """What no component may do, each with its worst instant: component, time (s), violation, amount, unit.

        A negative loss() creates energy, and so does an impact or a reset after which more energy is stored than sources supply. Stored
        energy that jumps at an event without either has no source. Power that does not balance means that energy() or loss() disagrees
        with the equations (``hidden``). Violations within rounding are not listed.
        """
        import pandas as pd

        sums, paths, rows = self._sums, [part.path for part in self._parts], list[tuple[str, float, str, float, str]]()
        # An event located some microseconds late produces a negligible energy, and a part that others hold at rest only round-off.
        enough = np.maximum(1e-8 * sums.turned, 1e-14 * self._scale)
        for i in np.flatnonzero((sums.gain > self._tolerances) & (sums.given > enough)):
            rows.append((paths[i], sums.gained[i], "negative loss", -sums.gain[i], "W"))
        jumped = ROUNDING * np.maximum(sums.stored, 1e-9 * self._scale) + NOISE
        for jump in self._jumps:
            for i in () if jump.owners else np.flatnonzero(np.abs(jump.change) > jumped):
                rows.append((paths[i], jump.time, f"stored energy jumps ({jump.cause})", jump.change[i], "J"))
            given, owners = jump.given, [i for i in jump.owners if not self._parts[i].boundary]
            if given > jumped.max() and owners:
                rows.append(
                    (", ".join(paths[i] for i in owners), jump.time, f"gives energy ({jump.cause})", given, "J")
                )
        for i in np.flatnonzero(sums.imbalance > self._tolerances):
            rows.append((paths[i], sums.unbalanced[i], "power does not balance", sums.imbalance[i], "W"))
        return pd.DataFrame(rows, columns=["component", "time", "violation", "amount", "unit"])

    @property
    def _tolerances(self) -> Array:
        """The power of each component that counts as round-off (W)."""
        scale = self._sums.scale
        return np.asarray(ROUNDING * np.maximum(scale, 1e-9 * scale.max(initial=0.0)) + NOISE)

    @cached_property
    def turnover(self) -> float:
        """Energy exchanged in joules: half of all energy supplied, lost, stored and released.

        At events, energy stored and released counts; energy supplied and lost at impacts and resets does not count again. An impact that
        turns all of its kinetic energy into heat counts half of it.
        """
        changed = np.abs(self._sums.turned).sum() + sum(np.abs(jump.change).sum() for jump in self._jumps)
        return float(changed / 2)

    @property
    def residual(self) -> float:
        """The sum of the absolute energy residuals of the components in joules."""
        return float(np.abs(self._balance()["residual"]).sum())

    @property
    def closure(self) -> float:
        """The residual relative to the turnover."""
        return self.residual / self._scale if self._scale else 0.0

    @property
    def _scale(self) -> float:
        return max(self.turnover, 1e-9 * float(self._sums.most[0]))

    def _balance(self) -> dict[str, Array]:
        """The columns of every component's own balance."""
        sums, n = self._sums, len(self._parts)
        lost, impulses, supplied = sums.loss.copy(), np.zeros(n), np.zeros(n)
        for jump in self._jumps:
            if jump.owners:
                share = -jump.given / len(jump.owners)
                supplied += jump.supplied
                impulses += jump.change - jump.supplied
                impulses[list(jump.owners)] += share
                lost[list(jump.owners)] += share
        boundary = np.array([part.boundary for part in self._parts])
        sources = np.where(boundary, sums.supply, 0.0) + supplied
        residual = self._own @ sums.power + sources + impulses - lost - self._stored
        return {"sources": sources, "impulses": impulses, "lost": lost, "stored": self._stored, "residual": residual}

    def _frame(self, values: Matrix, names: list[str], unit: str) -> pd.DataFrame:
        import pandas as pd

        table = pd.DataFrame(values, index=pd.Index(self.time, name="time"), columns=names)
        table.attrs["units"] = {"time": "s", **dict.fromkeys(names, unit)}
        return table

    def _repr_html_(self) -> str:
        table = self.components
        largest = float(table[["sources", "lost", "stored"]].abs().to_numpy().max(initial=0.0)) / 1e3
        decimals = max(0, 4 - math.floor(math.log10(largest))) if 0 < largest < math.inf else 0
        rows = [
            (
                str(path) or "whole model",
                str(kind),
                *(f"{round(each / 1e3, decimals) or 0.0:.{decimals}f}" for each in amounts),
            )
            for path, kind, *amounts in table[["type", "sources", "lost", "stored"]].itertuples()
            if "." not in str(path)
        ]
        about = f"{self.model}: residual {self.residual:.3g} J, {self.closure:.2g} of the energy exchanged"
        wrong = self.violations
        said = htmltext.table(list(wrong.columns), wrong.head(8).astype(str).to_numpy().tolist()) if len(wrong) else ""
        head = ("component", "class", "supplied [kJ]", "lost [kJ]", "stored [kJ]")
        return htmltext.heading("EnergyAudit", about) + said + htmltext.table(head, rows)

    def __repr__(self) -> str:
        balance = self._balance()
        span = f"{self.time[0]:g} .. {self.time[-1]:g} s" if len(self.time) else "no time"
        at_once = -sum(jump.given for jump in self._jumps if jump.owners)
        lines = [
            f"EnergyAudit of {self.model}, {span}",
            f"  supplied  {balance['sources'].sum():12.6g} J",
            f"  lost      {balance['lost'].sum():12.6g} J"
            + (f"  ({at_once:.6g} J of it at impacts and resets)" if at_once else ""),
            f"  stored    {balance['stored'].sum():12.6g} J",
            f"  residual  {self.residual:12.3g} J  = {self.closure:.2g} of the {self.turnover:.6g} J exchanged",
        ]
        order = np.argsort(-np.abs(balance["lost"]), kind="stable")
        largest = [
            f"{self._parts[i].path or self.model} {balance['lost'][i]:.4g} J" for i in order[:5] if balance["lost"][i]
        ]
        if largest:
            lines.append(f"  losses: {', '.join(largest)}")
        for name, time, violation, amount, unit in self.violations.head(8).itertuples(index=False):
            lines.append(f"  {name or self.model}: {violation}, {amount:.4g} {unit} at {time:.6g} s")
        if self.hidden:
            lines.append(
                "  where power does not balance, energy() or loss() is missing or wrong, or the component is a boundary"
            )
        return "\n".join(lines)


def _supply(values: EnergyValues, own: Matrix) -> Matrix:
    """The residual of each part's own power balance: the supply of a boundary, or minus the imbalance of any other part."""
    return values.loss + values.rate - values.power @ own.T


def _integrate(terms: EnergyTerms, trajectory: Trajectory, p: Array) -> _Sums:
    sums = _Sums.of(len(terms.ports), len(terms.parts))
    boundary = np.array([part.boundary for part in terms.parts])
    waiting = Pieces.of(trajectory, terms.instants(p)).blocks(terms.block)
    while waiting:
        pieces = waiting.pop()
        samples, w = pieces.samples(trajectory), pieces.weights
        values = terms.values(samples, p)
        supply, power = _supply(values, terms.own), values.power
        own = np.hstack((values.loss, values.rate, np.where(boundary, supply, 0.0)))
        rough = pieces.rough(np.hstack((power, own)), sums.turned.sum() + (w @ np.abs(own)).sum())
        if rough.any():
            waiting += pieces.halves(rough).blocks(terms.block)
            w = w * np.repeat(~rough, len(NODES))
        sums.power += w @ power
        sums.forward += w @ np.maximum(power, 0.0)
        sums.backward += w @ np.maximum(-power, 0.0)
        sums.highest = np.maximum(sums.highest, power.max(axis=0))
        sums.lowest = np.minimum(sums.lowest, power.min(axis=0))
        sums.loss += w @ values.loss
        sums.given += w @ np.maximum(-values.loss, 0.0)
        sums.supply += w @ supply
        sums.turned += w @ (np.abs(values.loss) + np.abs(values.rate) + np.where(boundary, np.abs(supply), 0.0))
        _exceed(sums.imbalance, sums.unbalanced, np.where(boundary, 0.0, np.abs(supply)), samples.t)
        _exceed(sums.gain, sums.gained, -values.loss, samples.t)
        scale = np.abs(values.loss) + np.abs(values.rate) + np.abs(power) @ np.abs(terms.own.T)
        sums.scale = np.maximum(sums.scale, scale.max(axis=0))
        sums.stored = np.maximum(sums.stored, np.abs(values.energy).max(axis=0))
        sums.most = np.maximum(sums.most, np.abs(values.energy.sum(axis=1)).max())
    for extreme in (sums.highest, sums.lowest):
        extreme[~np.isfinite(extreme)] = 0.0
    return sums


def _exceed(largest: Array, instants: Array, values: Matrix, t: Array) -> None:
    """Update the largest values of the columns and their times if exceeded."""
    row = values.argmax(axis=0)
    found = np.take_along_axis(values, row[None], axis=0)[0]
    higher = found > largest
    largest[higher], instants[higher] = found[higher], t[row][higher]
