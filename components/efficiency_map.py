"""Efficiencies that depend on the operating point, of gears, meshes and variable units."""

from __future__ import annotations

from collections.abc import Mapping

from powertrain import Component, Map, ParameterError, Symbol
from powertrain.components.map_checks import check_coefficient


def mapped_efficiency(
    part: Component, name: str, constant: Symbol, axes: Mapping[str, str], values: Mapping[str, Symbol]
) -> Symbol:
    """The map in the field ``name`` of a part at the ``values`` of its arguments, or the ``constant`` if there is no map.

    ``axes``: the possible arguments with their units. Errors: ParameterError as for ``checked_efficiency``.
    """
    given: Map | None = getattr(part, name)
    if given is None:
        return constant
    checked_efficiency(given, f"{part._label}.{name}", axes)
    return given(*(Symbol(values[axis.name]) for axis in given.axes))


def checked_efficiency(given: Map, where: str, axes: Mapping[str, str]) -> None:
    """Reject a map whose values are not numbers in (0, 1] or whose axes are not among ``axes`` (name: unit)."""
    check_coefficient(given, where, "an efficiency", axes)
    low, high = float(given.values.min()), float(given.values.max())
    if not (low > 0 and high <= 1):
        raise ParameterError(
            f"{where}: an efficiency must be in (0, 1], but the values of this map are in [{low:g}, {high:g}]; in percent, the heading of "
            "its column is eta [%]"
        )
