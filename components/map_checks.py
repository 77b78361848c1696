"""What the maps of components give, and over what: checked where a component takes one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from powertrain import Map, ParameterError


def check_units(given: Map, where: str, unit: str, axes: Sequence[str], wanted: str) -> None:
    """ParameterError for a map with another unit, or over other axes, than those of what is ``wanted``."""
    if given.unit != unit or [axis.unit for axis in given.axes] != [*axes]:
        over = ", ".join(f"{axis.name} [{axis.unit}]" for axis in given.axes)
        raise ParameterError(f"{where} gives {given.name} [{given.unit}] over {over}; it must give {wanted}")


def check_coefficient(given: Map, where: str, what: str, axes: Mapping[str, str]) -> None:
    """ParameterError for a map that is not ``what`` [1] over any of the ``axes`` (name: unit)."""
    for axis in given.axes:
        if axes.get(axis.name) != axis.unit:
            known = ", ".join(f"{name} [{unit}]" for name, unit in axes.items())
            raise ParameterError(f"{where}: {what} cannot depend on {axis.name} [{axis.unit}], only on {known}")
    if given.unit != "1":
        raise ParameterError(f"{where}: {given.name} [{given.unit}] is not {what} [1]")
