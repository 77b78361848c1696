"""Measured runs: what was prescribed, and what was measured when."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from powertrain.errors import ParameterError
from powertrain.language.arguments import by_name, number, row
from powertrain.language.arguments import path as argument_path
from powertrain.language.labelled import check_unit, stated_unit
from powertrain.language.reals import Array

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Experiment:
    """One measured run.

    ``times`` (s) ascend; ``values``: signals by name, one value for each time, nan where none was measured; ``sigma``: the standard
    deviation of a measurement, one for all or one per signal, None if it is unknown; ``starts``, ``inputs`` and ``parameters`` as for
    ``simulate``. A run starts at 0 s, or at the first time if that is below zero, and ``starts`` are the values then: shift the times of
    a part of a longer recording so that it begins at zero. ParameterError for unequal lengths; ``fit`` refuses values in another unit
    than the model's.
    """

    times: ArrayLike
    values: Mapping[str, ArrayLike]
    sigma: float | Mapping[str, float] | None = None
    starts: Mapping[str, float] = field(default_factory=dict)
    inputs: Mapping[str, Any] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)
    units: Mapping[str, str] = field(repr=False, compare=False, default_factory=dict)
    """Units of the values, by default those that their attributes name; empty where they name none."""

    def __post_init__(self) -> None:
        check_unit("experiment: times", self.times, "s")
        times = row("times", self.times)
        if not times.size or (np.diff(times) <= 0).any():
            raise ParameterError("experiment: times (s) must ascend, and there must be at least one")
        given, known = by_name("experiment: values", self.values), by_name("experiment: units", self.units)
        measured = {name: row(f"experiment: {name}", v, finite=False) for name, v in given.items()}
        units = {name: stated_unit(v) or known.get(name, "") for name, v in given.items()}
        if not measured:
            raise ParameterError("experiment: give the values of at least one signal")
        for what in ("starts", "inputs", "parameters"):
            by_name(f"experiment: {what}", getattr(self, what))
        for name, values in measured.items():
            if values.shape != times.shape:
                raise ParameterError(f"experiment: {name} has {values.size} values for {times.size} times")
            if not np.isfinite(values).any() or np.isinf(values).any():
                raise ParameterError(f"experiment: {name} has no finite value, or an infinite one")
            self.deviation(name)
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "values", measured)
        object.__setattr__(self, "units", units)

    @property
    def grid(self) -> Array:
        """The times as an array."""
        return np.asarray(self.times, float)

    @property
    def begin(self) -> float:
        """The start of the run [s]."""
        return min(0.0, float(self.grid[0]))

    @property
    def has_sigma(self) -> bool:
        """Whether the standard deviations of all measurements are given."""
        return all(self.deviation(name) is not None for name in self.values)

    def deviation(self, name: str) -> float | None:
        """The standard deviation of a measurement of a signal."""
        given = self.sigma
        if isinstance(given, Mapping):
            if name not in given:
                raise ParameterError(f"experiment: sigma has no value for {name}; give it for all signals or for none")
            given = given[name]
        if given is None:
            return None
        found = number(f"sigma of {name}", given)
        if not found > 0.0:
            raise ParameterError(f"experiment: sigma of {name} = {found:g} is not positive")
        return found


def read_experiment(path: str | Path, *names: str, time: str = "time", **options: Any) -> Experiment:
    """Read an experiment from a file.

    Parameters
    ----------
    path : str or Path
        A .csv with a column of times; or .mf4, .mdf and .dat, which require ``asammdf``.
    *names : str
        The signals to read; by default all columns except the time. Signals of a measurement file that were sampled at other times are
        nan where they were not measured.
    time : str
        The column of times [s].
    **options
        Other fields of ``Experiment``.

    Returns
    -------
    Experiment

    Raises
    ------
    ParameterError
        For other files, files that cannot be read, and missing columns.
    """
    path = Path(argument_path("path", path))
    if path.suffix.lower() == ".csv":
        import pandas as pd

        try:
            frame = pd.read_csv(path)
        except (OSError, ValueError) as error:
            raise ParameterError(f"{path} cannot be read: {error}") from None
    elif path.suffix.lower() in (".mf4", ".mdf", ".dat"):
        frame = _measurement(path, names, time)
    else:
        raise ParameterError(f"{path.name}: experiments are read from .csv, .mf4, .mdf and .dat")
    missing = [name for name in (time, *names) if name not in frame.columns]
    if missing:
        raise ParameterError(
            f"{path.name} has no column {missing[0]}; it has {', '.join(map(str, frame.columns[:12]))}"
        )
    chosen = names or [str(name) for name in frame.columns if name != time]
    return Experiment(frame[time].to_numpy(), {n: frame[n].to_numpy() for n in chosen}, **options)


def _measurement(path: Path, names: tuple[str, ...], time: str) -> pd.DataFrame:
    try:
        from asammdf import MDF  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise ParameterError(f"{path.name}: MDF files need asammdf: pip install 'powertrain[mdf]'") from None
    from asammdf.blocks.utils import MdfException  # pyright: ignore[reportMissingImports]

    try:
        with MDF(path) as measurement:
            known = [name for name in names if name in measurement.channels_db]
            frame: pd.DataFrame = measurement.to_dataframe(known or None, use_interpolation=False)
    except (MdfException, OSError, ValueError) as error:
        raise ParameterError(f"{path} cannot be read: {error}") from None
    return frame.rename_axis(time).reset_index()
