"""Signals on their way out: xarray, pandas and netCDF files."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Mapping
from importlib.util import find_spec
from io import BytesIO
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from powertrain.errors import ParameterError, PowertrainError
from powertrain.events import MODES, EventTable, change
from powertrain.language.arguments import path as argument_path
from powertrain.language.reals import Array

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

SUFFIXES = (".nc", ".csv")
LONGEST = 256
"""Bytes of a name in a netCDF file."""
Columns = Mapping[str, tuple[Array, str, str]]
"""Name -> values, unit, meaning."""


def dataset(time: Array, columns: Columns, modes: Mapping[str, str], attributes: Mapping[str, Any]) -> xr.Dataset:
    """One variable per signal over ``time``, with ``units`` and ``long_name``.

    ``modes`` gives the kind of law of signals that are modes, which become integers with the CF convention's flags.
    """
    import xarray as xr

    variables = _variables(columns, modes)
    axis = ("time", time.copy(), {"units": "s", "long_name": "Time"})
    return xr.Dataset(variables, coords={"time": axis}, attrs=dict(attributes))


def _variables(columns: Columns, modes: Mapping[str, str]) -> dict[str, tuple[str, Any, dict[str, Any]]]:
    _refuse_time(columns)
    return {name: _mode(*c, MODES[modes[name]]) if name in modes else _variable(*c) for name, c in columns.items()}


def _refuse_time(names: Collection[str]) -> None:
    if "time" in names:
        raise ParameterError(
            "the model has a variable called time, which is the name of the axis here; select signals without it, or rename it"
        )


def _refuse_long_names(names: Iterable[Any]) -> None:
    for name in names:
        if len(str(name).encode()) > LONGEST:
            raise ParameterError(
                f"netCDF allows names of {LONGEST} bytes; {name} is longer. Leave this signal out, or write CSV"
            )


def _variable(values: Array, unit: str, doc: str) -> tuple[str, Any, dict[str, Any]]:
    return "time", values.copy(), {"units": unit, "long_name": doc}


def _mode(values: Array, unit: str, doc: str, named: Mapping[int, str]) -> tuple[str, Any, dict[str, Any]]:
    flags = np.array(list(named), np.int8)
    texts = {"units": unit, "long_name": doc, "flag_meanings": " ".join(named.values())}
    return "time", values.astype(np.int8), {**texts, "flag_values": flags}


def attributes(model: str, parameters: Mapping[str, float], events: EventTable, message: str) -> dict[str, str]:
    """What a dataset says about its origin; parameters and events are JSON texts."""
    from powertrain import __version__

    listed = [[event.time, event.name, change(event)] for event in events]
    known = {"model": model, "powertrain_version": __version__}
    known |= {"parameters": json.dumps(dict(parameters)), "events": json.dumps(listed)}
    return known | ({"message": message} if message else {})


def frame(time: Array, columns: Columns) -> pd.DataFrame:
    """One column per signal, indexed by time; ``frame.attrs["units"]`` are the units."""
    import pandas as pd

    _refuse_time(columns)
    table = pd.DataFrame({name: values for name, (values, _, _) in columns.items()}, index=pd.Index(time, name="time"))
    table.attrs["units"] = {name: unit for name, (_, unit, _) in columns.items()}
    return table


def classic(time: Array, columns: Columns, modes: Mapping[str, str], attributes: Mapping[str, str]) -> bytes:
    """The content of a netCDF-3 file of ``dataset`` with these arguments; written with SciPy, in a tenth of the time of netCDF-4."""
    from scipy.io import netcdf_file

    variables = _variables(columns, modes)
    _refuse_long_names(variables)
    axis = ("time", time, {"units": "s", "long_name": "Time"})
    content = BytesIO()
    file = netcdf_file(content, "w", version=2)
    if len(time):
        file.createDimension("time", len(time))
    for name, (_, values, texts) in (("time", axis), *variables.items()) if len(time) else ():
        utf8 = name.encode().decode("latin1")  # SciPy writes names in Latin-1
        variable = file.createVariable(utf8, values.dtype.newbyteorder(">"), ("time",))
        variable[:] = values
        for text, value in texts.items():
            setattr(variable, text, value.encode() if isinstance(value, str) else value)
    for text, value in attributes.items():
        setattr(file, text, value.encode())
    file.flush()
    return content.getvalue()


def read_classic(path: str | PathLike[str], attributes_only: bool = False) -> tuple[xr.Dataset | None, dict[str, str]]:
    """The signals (None where there are none) and the attributes of what ``classic`` wrote."""
    from scipy.io import netcdf_file

    with netcdf_file(fspath(path), "r", mmap=False) as file:
        attributes = {name: value.decode() for name, value in file._attributes.items()}  # type: ignore[attr-defined]
        empty = not file.variables
    if empty or attributes_only:
        return None, attributes
    import xarray as xr

    return xr.load_dataset(fspath(path), engine="scipy", decode_times=False), attributes


def suffix(path: str | PathLike[str]) -> str:
    """The ending of a file that signals can be written to. ParameterError for another one."""
    ending = Path(argument_path("path", path)).suffix.lower()
    if ending not in SUFFIXES:
        raise ParameterError(
            f"{fspath(path)!r} must end in {' or '.join(SUFFIXES)}; for other formats use to_dataframe() or to_xarray()"
        )
    return ending


def save(data: xr.Dataset, path: str | PathLike[str]) -> None:
    """Writes a netCDF-4 file. PowertrainError where no netCDF library is installed, ParameterError for names that it does not allow."""
    _refuse_long_names(data.variables)
    data.to_netcdf(fspath(path), engine=engine("save"))


def load(path: str | PathLike[str]) -> xr.Dataset:
    """Read a netCDF file written by ``Result.save`` or by a sweep.

    PowertrainError if no netCDF library is installed, ParameterError for a file that cannot be read.
    """
    ending = Path(argument_path("path", path)).suffix.lower()
    if ending == ".csv":
        raise ParameterError(f'load reads netCDF; pandas.read_csv({fspath(path)!r}, index_col="time") reads this file')
    if ending != ".nc":
        raise ParameterError(f"load reads the netCDF files (.nc) of runs, maps and sweeps; {fspath(path)!r} is none")
    reader = engine("load")
    import xarray as xr

    try:
        return xr.load_dataset(fspath(path), engine=reader, decode_times=False)
    except (OSError, ValueError) as error:
        raise ParameterError(f"{fspath(path)} cannot be read: {error}") from None


def engine(what: str) -> Literal["netcdf4", "h5netcdf"]:
    """The library that reads and writes netCDF-4. PowertrainError where there is none."""
    if find_spec("netCDF4"):
        return "netcdf4"
    if find_spec("h5netcdf") and find_spec("h5py"):
        return "h5netcdf"
    raise PowertrainError(f"{what}: netCDF4 is not installed: pip install 'powertrain[netcdf]'")
