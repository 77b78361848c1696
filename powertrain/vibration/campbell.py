"""Campbell diagrams: natural frequencies over speed or gear, and the speeds at which orders of excitation meet them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from reprlib import repr as short
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from powertrain.errors import ParameterError
from powertrain.language.arguments import row
from powertrain.language.component import Component
from powertrain.plant import Plant, plant_of
from powertrain.signals import Selector
from powertrain.vibration.eigenmodes import MEANINGS, properties, shapes_of, vibrations
from powertrain.vibration.energies import energies_of
from powertrain.vibration.operating_line import Line, operating_line
from powertrain.vibration.tracking import track

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


def campbell(
    plant: Plant[Any] | Component,
    over: Mapping[str, ArrayLike],
    shapes: Sequence[Selector] | None = None,
    *,
    at: Line | None = None,
    parameters: Mapping[str, float] | None = None,
) -> xr.Dataset:
    """The vibration modes of a model over speed, gear, or any other value: the data of a Campbell diagram.

    The modes at each operating point are those of ``pt.eigenmodes``; they are followed from point to point by their shapes (modal
    assurance criterion with left and right eigenvectors), so that they keep their number where frequencies cross.

    Parameters
    ----------
    over
        {name: values}: a parameter such as a ratio, a start value such as a speed, an input such as a gear; in its unit.
    shapes
        Signals of the mode shapes; by default the states.
    at
        The operating point, as for ``pt.linearize``; or a function that gives it for each value, for instance ``lambda w: (run, t(w))``
        for the instants of a run-up. ``over`` sets one value only: use a function such as ``lambda w: {"engine.w": w, "gearbox.w": w}``
        where the shafts behind a spring must turn as well.
    parameters
        Other values of parameters.

    Returns
    -------
    xarray.Dataset
        ``frequency`` [Hz], ``damped_frequency`` [Hz], ``damping`` [1], ``shape`` and ``energy`` as from ``pt.eigenmodes``, and ``mac``
        [1], what a mode shares with itself at the point before, over the named axis and ``mode``. Modes are numbered by
        frequency at the first point where they appear; where one does not exist, its values are nan.

    Raises
    ------
    ParameterError
        For unknown names, and a model that has no vibration modes at any of the points.

    Examples
    --------
    >>> import powertrain as pt
    >>> from powertrain.components.rotational import Inertia, Spring
    >>> class Shaft(pt.Component):
    ...     first: Inertia = Inertia(J=1.0)
    ...     spring: Spring = Spring(c=200.0)
    ...     second: Inertia = Inertia(J=1.0)
    ...
    ...     def equations(self):
    ...         yield pt.connect(self.first.flange_b, self.spring.flange_a)
    ...         yield pt.connect(self.spring.flange_b, self.second.flange_a)
    >>> pt.campbell(Shaft(), {"spring.c": [200.0, 800.0]})["frequency"].values.ravel().round(2).tolist()
    [3.18, 6.37]
    """
    import xarray as xr

    plant = plant_of(plant)
    line = operating_line(plant, over, at, parameters)
    wanted = shapes_of(plant, shapes)
    found = [vibrations(plant, wanted, point) for point in line.points]
    place, mac = track(found)
    if not place.shape[1]:
        raise ParameterError(f"{type(plant.model).__name__} has no vibration modes at any value of {line.name}")
    sides = {"signal": list(found[0].signals), "component": energies_of(plant).components}
    dims = {"shape": ("signal",), "energy": ("component",)}
    data: dict[str, Any] = {}
    rows = [properties(v) for v in found]
    for name, (unit, doc) in MEANINGS.items():
        side = dims.get(name, ())
        values = np.full((*place.shape, *(len(sides[d]) for d in side)), np.nan, rows[0][name].dtype)
        for k, here in enumerate(rows):
            there = place[k] >= 0
            values[k, there] = here[name][place[k, there]]
        data[name] = ((line.name, "mode", *side), values, {"units": unit, "long_name": doc})
    data["mac"] = ((line.name, "mode"), mac, {"units": "1", "long_name": "Modal assurance with the point before"})
    coordinates = {line.name: line.coordinate, "mode": np.arange(1, place.shape[1] + 1), **sides}
    return xr.Dataset(data, coordinates)


def critical_speeds(diagram: xr.Dataset, orders: ArrayLike) -> pd.DataFrame:
    """The speeds at which excitations of given orders meet natural frequencies, from a Campbell diagram over a speed in rad/s.

    The order n excites at the frequency n |w|/(2 pi). Between the points of the diagram frequencies are interpolated linearly.

    Parameters
    ----------
    diagram
        From ``pt.campbell`` over a speed, which may be negative but keeps its sign.
    orders
        Positive orders of the excitation: events per revolution, such as 2 and 4 for a four-stroke engine with four cylinders.

    Returns
    -------
    pandas.DataFrame
        Columns ``order`` [1], ``mode``, ``speed`` [rad/s], ``frequency`` [Hz] and ``damping`` [1], by speed.

    Raises
    ------
    ParameterError
        If the axis is not a speed in rad/s, or has both signs; for orders that are not positive.

    Examples
    --------
    >>> import powertrain as pt
    >>> pt.critical_speeds(pt.campbell("car", {"engine.w": [100.0]}), [2.0])
    Traceback (most recent call last):
    powertrain.errors.ParameterError: a model is a component, not 'car'
    """
    import pandas as pd

    if not {"frequency", "damping"} <= set(getattr(diagram, "data_vars", ())):
        raise ParameterError(f"pass a diagram of pt.campbell, not {short(diagram)}")
    axis = diagram["frequency"].dims[0]
    if diagram[axis].attrs.get("units") != "rad/s":
        raise ParameterError(f"the diagram is over {axis}, not over a speed in rad/s")
    speed, at = np.unique(np.asarray(diagram[axis].values, float), return_index=True)
    if speed[0] < 0.0 < speed[-1]:
        raise ParameterError(f"{axis} runs from {speed[0]:g} to {speed[-1]:g} rad/s; make a diagram for each direction")
    found = []
    for order in row("orders", orders).tolist():
        if order <= 0.0:
            raise ParameterError(f"orders: the order {order:g} is not positive")
        for k, mode in enumerate(diagram["mode"].values.tolist()):
            frequency, damping = (diagram[name].values[at, k] for name in ("frequency", "damping"))
            above = order * np.abs(speed) / (2 * np.pi) - frequency
            for i in np.flatnonzero(above[:-1] * above[1:] < 0.0):
                part = above[i] / (above[i] - above[i + 1])
                here = [float(v[i] + part * (v[i + 1] - v[i])) for v in (speed, frequency, damping)]
                found.append((order, mode, *here))
            found += [
                (order, mode, *map(float, (speed[i], frequency[i], damping[i]))) for i in np.flatnonzero(above == 0.0)
            ]
    table = pd.DataFrame(found, columns=["order", "mode", "speed", "frequency", "damping"])
    return table.sort_values(["speed", "order"], ignore_index=True)
