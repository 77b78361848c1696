"""``powertrain convert``: saved runs, maps and sweeps in the formats of other programs."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from powertrain.cli.options import Command, OutputFile

if TYPE_CHECKING:
    import xarray as xr


@click.command(
    "convert",
    cls=Command,
    short_help="A saved run, map or sweep as CSV, MATLAB file or interactive page.",
    examples=(
        "convert run.nc run.csv",
        "convert run.nc run.mat --signals 'engine.*' --signals body.v",
        "convert run.nc run.html",
    ),
)
@click.argument("source", metavar="FILE.nc", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.argument("target", type=OutputFile(".csv", ".mat", ".nc", ".html"))
@click.option(
    "--signals", multiple=True, metavar="PATTERN", help="Only these signals, such as 'engine.*'; may be repeated."
)
def command(source: Path, target: Path, signals: tuple[str, ...]) -> None:
    """Convert a netCDF file that powertrain wrote to CSV (.csv), MATLAB (.mat), netCDF with fewer signals (.nc), or a page (.html).

    In MATLAB files the names of signals have _ for every character that MATLAB does not allow; the struct `info` has their full names,
    units and descriptions.
    """
    import powertrain as pt

    if source.suffix.lower() != ".nc":
        raise click.UsageError(
            f"{source} is not a saved run, map or sweep (.nc); powertrain run VEHICLE --out {target} writes the run of a vehicle"
        )
    data = _chosen(pt.load(source), signals)
    ending = target.suffix.lower()
    if ending == ".csv":
        data.to_dataframe().to_csv(target)
    elif ending == ".mat":
        _write_matlab(data, target)
    elif ending == ".nc":
        from powertrain.export import save

        save(data, target)
    else:
        from powertrain.saved import Saved
        from powertrain.viewer.document import write
        from powertrain.viewer.recording import recorded

        write([recorded(Saved(data), source.stem)], target)
    click.echo(f"wrote {target}")


def _chosen(data: xr.Dataset, patterns: tuple[str, ...]) -> xr.Dataset:
    """The variables that fit. Errors: UsageError for a pattern that fits none."""
    from powertrain.errors import suggestion
    from powertrain.signals import fits_pattern

    names = [str(name) for name in data.data_vars]
    for pattern in patterns:
        if not any(fits_pattern(name, pattern) for name in names):
            raise click.UsageError(f"--signals: the file has no signal {pattern}{suggestion(pattern, names)}")
    return data[[n for n in names if any(fits_pattern(n, p) for p in patterns)]] if patterns else data


def _write_matlab(data: xr.Dataset, path: Path) -> None:
    """A MATLAB 5 file: one variable for every signal and coordinate, and their names, units and descriptions."""
    from scipy.io import savemat

    content: dict[str, Any] = {"info": {}}
    names: list[str] = []
    for name, values in {**data.coords, **data.data_vars}.items():
        plain = re.sub(r"\W", "_", str(name), flags=re.ASCII)[:63]
        key, count = plain, 1
        while key in content or not key[0].isalpha():
            key, count = f"s{count}_{plain}"[:63], count + 1
        content[key] = values.to_numpy()
        names.append(key)
    attributes = [values.attrs for values in {**data.coords, **data.data_vars}.values()]
    info = {
        "variable": names,
        "name": [str(name) for name in {**data.coords, **data.data_vars}],
        "unit": [str(a.get("units", "")) for a in attributes],
        "description": [str(a.get("long_name", "")) for a in attributes],
    }
    savemat(
        path,
        content | {"info": {key: _cells(texts) for key, texts in info.items()}},
        long_field_names=True,
        oned_as="column",
    )


def _cells(texts: list[str]) -> Any:
    import numpy as np

    return np.array(texts, dtype=object).reshape(-1, 1)
