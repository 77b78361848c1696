"""A run that was saved to a netCDF file, with the methods of a ``Result`` by which runs are shown and compared."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from powertrain.errors import ParameterError, suggestion
from powertrain.events import MODES
from powertrain.language.arguments import array
from powertrain.language.reals import Array
from powertrain.signals import fits_pattern

if TYPE_CHECKING:
    import xarray as xr


class Saved:
    """The samples, events and parameters of ``pt.load(file)``. Between the samples signals are linear."""

    def __init__(self, data: xr.Dataset) -> None:
        if "time" not in data.coords or not data.sizes.get("time", 0):
            raise ParameterError("the dataset is not a saved run: it has no samples over time")
        self._data = data
        variables = data.variables  # data[name] would build a DataArray with all coordinates each time
        self._signals = {str(name): None for name in data.data_vars if variables[name].dims == ("time",)}
        self.time: Array = np.asarray(data["time"].values, float)
        self.name = str(data.attrs.get("model", "run"))
        self.message = str(data.attrs.get("message", ""))
        try:
            self.parameters: dict[str, float] = dict(json.loads(data.attrs.get("parameters", "{}")))
            listed = [(float(t), str(law), str(said)) for t, law, said in json.loads(data.attrs.get("events", "[]"))]
        except (TypeError, ValueError):
            raise ParameterError(
                "the dataset is not a saved run: its attributes parameters and events are not those that save writes; save the run again"
            ) from None
        self.events = listed

    def __iter__(self) -> Iterator[str]:
        return iter(self._signals)

    def __contains__(self, name: object) -> bool:
        return name in self._signals

    def __getitem__(self, name: str) -> Array:
        if name not in self:
            raise ParameterError(f"the saved run has no signal {name}{suggestion(str(name), list(self))}")
        return np.asarray(self._data.variables[name].values, float)

    @property
    def modes(self) -> dict[str, str]:
        """The kind of law of every signal that is a mode."""
        kinds = {" ".join(named.values()): kind for kind, named in MODES.items()}
        flags = {name: str(self._data.variables[name].attrs.get("flag_meanings", "")) for name in self}
        return {name: kinds[said] for name, said in flags.items() if said in kinds}

    def names(self, pattern: str = "*") -> list[str]:
        """Signals whose names match."""
        return [name for name in self if fits_pattern(name, pattern)]

    def label(self, name: str) -> str:
        """The name."""
        return name

    def unit(self, name: str) -> str:
        """The unit of a signal; '' for a parameter."""
        return str(self._data.variables[name].attrs.get("units", "")) if name in self else ""

    def description(self, name: str) -> str:
        """The description of a signal; '' for a parameter."""
        return str(self._data.variables[name].attrs.get("long_name", "")) if name in self else ""

    def at(self, t: ArrayLike, what: Sequence[str]) -> dict[str, Any]:
        """Values at times within the run; at an event its right limit."""
        times = array("t", t)
        left = np.maximum(np.searchsorted(self.time, times, side="right") - 1, 0)
        right = np.minimum(left + 1, len(self.time) - 1)
        duration = self.time[right] - self.time[left]
        share = np.divide(times - self.time[left], duration, out=np.zeros(times.shape), where=duration > 0)
        return {n: self[n][left] + share * (self[n][right] - self[n][left]) for n in what}
