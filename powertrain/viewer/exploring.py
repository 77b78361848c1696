"""The interactive page of a run."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from powertrain.result import Result
from powertrain.viewer.document import write
from powertrain.viewer.recording import RunLike, a_run, recorded

if TYPE_CHECKING:
    import xarray as xr


def explore(
    run: Result[Any] | RunLike | xr.Dataset, file: str | PathLike[str] | None = None, *signals: str, name: str = ""
) -> Path:
    """An interactive page of a run: one HTML file that any browser opens, without a server or a network.

    It shows the schematic with the power flowing through it, signals to pick, operating points in their maps, energies, events and
    parameters, with a slider for the time. Requires ``powertrain[viewer]``. ``result.explore()`` is the same.

    Parameters
    ----------
    run : Result, run of ``drive_cycle``, or dataset of ``load``
        The run. A saved run has signals, events and parameters, but no power flow.
    file : path, optional
        Name of the file, ending in .html. Without it the page is written to a temporary file and opened in the browser.
    *signals : str
        Names of the signals that are plotted first.
    name : str
        Title of the page, by default the class of the model.

    Returns
    -------
    pathlib.Path
        The file.

    Raises
    ------
    ParameterError
        For another file name extension, an unknown signal, and a result of ``simulate(record=...)``.
    PowertrainError
        If plotly is not installed.

    Examples
    --------
    >>> pt.explore(result, "clutch.html", "J1.w", "J2.w")  # doctest: +SKIP
    """
    return write([recorded(a_run(run, "explore"), name)], file, signals)
