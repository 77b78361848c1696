"""Vehicles by name or from a file: measured cars, the library's vehicles, and parameter files of one's own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import powertrain as pt
from powertrain.errors import suggestion
from powertrain.language.arguments import writing


def names() -> tuple[str, ...]:
    """The names that ``load`` takes: measured cars such as "toyota-rav4-automatic", and the library's vehicles."""
    from powertrain.presets.catalogue import vehicles

    return (*measured(), *(entry.name for entry in vehicles()))


def load(name: str | Path) -> Any:
    """A vehicle by one of ``names()``, a variant such as ``ParallelHybrid.at("P4")``, or a parameter file (.toml) that names either.

    Case does not matter in names. Measured cars are built from the data of the EPA's test-car list and the numbers of their technology.
    What a file leaves out is as in the class; names of files in it, also those in ``MappedEngine.from_csv(...)``, are relative to it.
    Errors: ParameterError for an unknown name, and those of the file.
    """
    if _is_file(name):
        return of_file(Path(name))[0]
    text = str(name)
    if text.lower() in measured():
        return _measured_car(text)
    from powertrain.presets.catalogue import is_named, vehicles
    from powertrain.presets.settings import model_named

    kind = text.partition("(")[0].partition(".")[0]
    if not (found := [entry for entry in vehicles() if is_named(entry.kind, kind)]):
        raise pt.ParameterError(
            f"there is no vehicle {text!r}; powertrain.vehicles.names() and `powertrain list vehicles` list them, and parameter "
            f"files end in .toml{suggestion(text, names())}"
        )
    return model_named(text, found)


def save(vehicle: pt.Component, path: str | Path) -> None:
    """Write all of a vehicle's parameters and parts to a file that ``load`` reads, with units, meaning and ranges.

    Errors: ParameterError for a file that does not end in .toml or cannot be written.
    """
    from powertrain.presets.files import written

    if not _is_file(path):
        raise pt.ParameterError(f"{path}: parameter files end in .toml")
    with writing(path):
        Path(path).write_text(written(vehicle, pt.compile(vehicle).parameters), encoding="utf-8")


def _is_file(name: str | Path) -> bool:
    return str(name).lower().endswith(".toml")


def of_file(path: Path) -> tuple[Any, list[str]]:
    """The vehicle of a parameter file, and the paths that the file sets."""
    from powertrain.presets.catalogue import assembled
    from powertrain.presets.files import CLASS, applied, naming, read
    from powertrain.presets.settings import model_named

    tables = read(path)
    if CLASS not in tables:
        raise pt.ParameterError(f'{path} does not say which vehicle it is: begin it with  class = "ManualCar"')
    name = str(tables.pop(CLASS))
    with naming(path):
        known = name.lower() in measured()
        model = _measured_car(name) if known else model_named(name, assembled(), path.parent)
        return applied(model, tables, path.parent)


def _measured_car(name: str) -> pt.Component:
    from powertrain.measured.building import build
    from powertrain.measured.technology import Technology

    car: pt.Component = build(measured()[name.lower()], Technology())
    return car


def measured() -> dict[str, Any]:
    """The records of the measured cars by name."""
    from powertrain.measured.record import TestCar

    return {f"{car.name} {car.transmission}".lower().replace(" ", "-"): car for car in TestCar.shipped()}
