"""Two runs side by side."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from powertrain.errors import ParameterError, suggestion
from powertrain.language import htmltext
from powertrain.language.arguments import names as argument_names
from powertrain.language.reals import Array
from powertrain.result import Result
from powertrain.saved import Saved
from powertrain.signals import fits_pattern
from powertrain.viewer.recording import RunLike, a_run

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes

SAMPLES = 2001
"""Instants in the common span at which signals are compared."""


def compare(
    a: Result[Any] | RunLike | xr.Dataset,
    b: Result[Any] | RunLike | xr.Dataset,
    *signals: str,
    names: tuple[str, str] = ("a", "b"),
) -> Comparison:
    """Compare two runs: their main results, signals, energies and parameters.

    Parameters
    ----------
    a, b : Result, run of ``drive_cycle``, or dataset of ``load``
        The runs. They may have different models, parameters and time steps.
    *signals : str
        Names and patterns of the signals to compare; by default all that both runs have.
    names : tuple of two str
        What the runs are called in tables and plots.

    Returns
    -------
    Comparison
        With ``table``, ``signals``, ``parameters``, ``energy``, ``plot()`` and ``explore()``.

    Raises
    ------
    ParameterError
        If an argument is not a run, the runs have no common time, or a signal is missing in one of them.

    Examples
    --------
    >>> pt.compare(light, heavy, "body.v", names=("light", "heavy")).plot("body.v")  # doctest: +SKIP
    """
    runs = a_run(a, "compare"), a_run(b, "compare")
    called = tuple(argument_names("names", names))
    if len(called) != 2 or called[0] == called[1]:
        raise ParameterError(f"names = {names!r}: give two different names")
    results = _result(runs[0]), _result(runs[1])
    first, last = max(r.time[0] for r in results), min(r.time[-1] for r in results)
    if not first < last:
        spans = " and ".join(f"[{r.time[0]:g}, {r.time[-1]:g}] s" for r in results)
        raise ParameterError(f"compare: the runs have no common time: {spans}")
    common = [name for name in results[0] if name in results[1]]
    chosen = _chosen(signals, common) if signals else common
    return Comparison(runs, (called[0], called[1]), tuple(chosen), np.linspace(first, last, SAMPLES))


def _result(run: Any) -> Result[Any] | Saved:
    """The signals of a run."""
    found: Any = run if isinstance(run, Result | Saved) else getattr(run, "result", None)
    return cast("Result[Any] | Saved", found)


def _chosen(patterns: tuple[str, ...], common: list[str]) -> list[str]:
    found: dict[str, None] = {}
    for pattern in patterns:
        fitting = [name for name in common if fits_pattern(name, pattern)]
        if not fitting:
            raise ParameterError(f"compare: the runs have no common signal {pattern}{suggestion(pattern, common)}")
        found |= dict.fromkeys(fitting)
    return list(found)


@dataclass(frozen=True)
class Comparison:
    """Two runs side by side; ``time`` are the instants at which signals are compared, within the common span.

    ``table`` has the main results if the runs have some, else the signals.
    """

    runs: tuple[Result[Any] | RunLike | Saved, Result[Any] | RunLike | Saved]
    names: tuple[str, str]
    compared: tuple[str, ...]
    time: Array

    @property
    def results(self) -> tuple[Result[Any] | Saved, Result[Any] | Saved]:
        """The signals of both runs."""
        return _result(self.runs[0]), _result(self.runs[1])

    @cached_property
    def table(self) -> pd.DataFrame:
        """Main results of both runs with their difference, or ``signals`` for runs without such a table."""
        import pandas as pd

        one, other = (getattr(run, "table", None) for run in self.runs)
        if one is None or other is None:
            return self.signals
        rows = {
            what: (one.value[what], other.value[what], other.value[what] - one.value[what], one.unit[what])
            for what in one.index
            if what in other.index
        }
        return pd.DataFrame.from_dict(rows, orient="index", columns=[*self.names, "difference", "unit"])

    @cached_property
    def signals(self) -> pd.DataFrame:
        """Mean values of the compared signals over the common span, their difference, and the largest difference at one time."""
        import pandas as pd

        one, other = (result.at(self.time, list(self.compared)) for result in self.results)
        rows = {}
        for name in self.compared:
            means = [float(np.trapezoid(v[name], self.time) / np.ptp(self.time)) for v in (one, other)]
            largest = float(np.abs(other[name] - one[name]).max())
            rows[name] = (*means, means[1] - means[0], largest, self.results[0].unit(name))
        columns = [*self.names, "difference", "largest difference", "unit"]
        return pd.DataFrame.from_dict(rows, orient="index", columns=columns)

    @cached_property
    def parameters(self) -> pd.DataFrame:
        """The parameters in which the runs differ, with units; NaN where a run does not have one."""
        import pandas as pd

        one, other = (result.parameters for result in self.results)
        rows = {}
        for name in {**one, **other}:
            values = one.get(name, np.nan), other.get(name, np.nan)
            if values[0] != values[1]:
                owner = self.results[0] if name in one else self.results[1]
                rows[name] = (*values, owner.unit(name))
        return pd.DataFrame.from_dict(rows, orient="index", columns=[*self.names, "unit"])

    @cached_property
    def energy(self) -> pd.DataFrame:
        """Energy lost in every component [J] in both runs, and the difference."""
        import pandas as pd

        from powertrain.analysis.audit import energy_audit

        lost = []
        for run in self.runs:
            if isinstance(run, Saved):
                raise ParameterError("energy: a saved run has no energy balance; compare results of simulate")
            audit = energy_audit(run) if isinstance(run, Result) else run.audit
            lost.append(audit.components["lost"])
        table = pd.DataFrame(dict(zip(self.names, lost, strict=True)))
        table["difference"] = table[self.names[1]] - table[self.names[0]]
        table.attrs["units"] = dict.fromkeys(table.columns, "J")
        return table

    def plot(self, *signals: str, ax: Axes | None = None) -> Axes:
        """Signals of both runs over time in one Axes, the second run dashed; by default the compared signal that differs most.

        Raises ParameterError for unknown signals and for signals of different units.
        """
        from powertrain.figures.plot import plot_overlaid

        return plot_overlaid(self.results, self.names, signals or (self._most(),), ax=ax)

    def explore(self, file: str | PathLike[str] | None = None, *signals: str) -> Path:
        """The interactive page of both runs, as ``Result.explore`` makes it of one: curves overlaid, tables side by side."""
        from powertrain.viewer.document import write
        from powertrain.viewer.recording import recorded

        shown = self.signals if len(self.compared) <= 20 else self.signals.iloc[:0]
        rows = [
            (f"mean of {n}", row.unit, row[self.names[0]], row[self.names[1]], row["largest difference"])
            for n, row in shown.iterrows()
        ]
        recordings = [recorded(run, name) for run, name in zip(self.runs, self.names, strict=True)]
        return write(recordings, file, signals, " and ".join(self.names), {"signals": rows})

    def _most(self) -> str:
        """The compared signal with the largest difference relative to its own range."""
        values = self.results[0].at(self.time, list(self.compared))
        spans = {name: float(np.ptp(values[name])) or np.inf for name in self.compared}
        largest = self.signals["largest difference"]
        return max(self.compared, key=lambda name: largest[name] / spans[name])

    def __repr__(self) -> str:
        changed = self.parameters
        head = f"Comparison of {self.names[0]} and {self.names[1]}, {self.time[0]:g} .. {self.time[-1]:g} s"
        said = f"{len(changed)} parameter{'s' * (len(changed) != 1)} differ{'s' * (len(changed) == 1)}"
        return f"{head}; {said}\n{self.table.head(20).to_string(float_format='{:.6g}'.format)}"

    def _repr_html_(self) -> str:
        changed = self.parameters.to_html(float_format="{:.6g}".format, max_rows=40)
        table = self.table.to_html(float_format="{:.6g}".format, max_rows=40)
        head = htmltext.heading("Comparison", " and ".join(self.names))
        return head + table + htmltext.folded("parameters that differ", changed)
