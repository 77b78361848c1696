"""The map in which the operating point of a component moves."""

from __future__ import annotations

from dataclasses import dataclass

from powertrain.language.reals import Array


@dataclass(frozen=True)
class OperatingMap:
    """A map over two signals of a component.

    ``result.explore()`` shows the maps of all components that have a method ``operating_map()`` which returns one.

    Parameters
    ----------
    quantity : str
        What the map gives, with its unit: "Specific fuel consumption [g/kWh]".
    x, y : str
        The signals of the component across and up, such as "w" and "tau".
    x_label, y_label : str
        Titles of the axes with the units shown.
    x_values, y_values : array
        Grid in the units shown, shapes (m,) and (n,).
    values : array
        The map, shape (n, m), NaN where the component cannot run.
    levels : tuple of float
        Where contour lines are drawn.
    limits : tuple of (str, array, array)
        Lines in the map, such as full load: name, x and y in the units shown.
    x_scale, y_scale : float
        Units shown per unit of the signal: 30/pi for a speed in rpm.
    low_is_best : bool
        Whether small values are good (a consumption), which turns the colours round.
    """

    quantity: str
    x: str
    y: str
    x_label: str
    y_label: str
    x_values: Array
    y_values: Array
    values: Array
    levels: tuple[float, ...]
    limits: tuple[tuple[str, Array, Array], ...] = ()
    x_scale: float = 1.0
    y_scale: float = 1.0
    low_is_best: bool = False
