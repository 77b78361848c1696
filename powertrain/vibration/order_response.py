"""Forced vibration at the orders of an engine: the steady response of the linear model over speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain.analysis.linearization import Selector, linear_at
from powertrain.errors import ModelError, ParameterError
from powertrain.language.arguments import by_name, listed, number
from powertrain.language.component import Component
from powertrain.plant import Plant, plant_of
from powertrain.signals import signals_of
from powertrain.vibration.eigenvectors import eigenvectors
from powertrain.vibration.operating_line import Line, OperatingLine, operating_line

if TYPE_CHECKING:
    import xarray as xr

Matrix = NDArray[np.complex128]
_RESONANCE = 1e-9
"""Distance of an eigenvalue from the excitation, over its frequency, below which round-off decides the amplitude."""


def order_response(
    plant: Plant[Any] | Component,
    over: Mapping[str, ArrayLike],
    excitation: Mapping[str, Mapping[float, ArrayLike]],
    outputs: Sequence[Selector],
    *,
    at: Line | None = None,
    parameters: Mapping[str, float] | None = None,
) -> xr.DataArray:
    """The steady vibration under excitations at multiples (orders) of a speed of rotation.

    At the speed w, an excitation u = Re(U exp(j n w t)) of the order n gives y = Re(Y exp(j n w t)) with
    Y = (C (j n w - A)^-1 B + D) U, where A, B, C and D are the linear model at that operating point. A ``PistonEngine`` has no such
    model, because its coefficients change with the crank angle: see ``pt.eigenmodes``.

    Parameters
    ----------
    over
        {name: speeds}: a speed in rad/s, to whose multiples the excitation is tied; see ``pt.campbell``.
    excitation
        {input: {order: amplitude}}; inputs as for ``pt.linearize``, so also external torques such as "engine.flange_a.tau", but no
        parameters, which are constant. Amplitudes in the input's unit, complex for a phase, one number or one for each speed.
    outputs
        Signals by name or selector.
    at, parameters
        The operating points; see ``pt.campbell``.

    Returns
    -------
    xarray.DataArray
        Complex amplitudes over the speed, ``order`` and ``signal`` (the outputs); ``units`` are theirs.

    Raises
    ------
    ParameterError
        For unknown names, parameters as inputs, speeds that are 0 or not in rad/s, orders that are not positive, and amplitudes that do
        not fit.
    ModelError
        If an undamped natural frequency is excited, to 1e-9 of it.

    Examples
    --------
    >>> import powertrain as pt
    >>> from powertrain.components.rotational import Fixed, Inertia, SpringDamper
    >>> class Swing(pt.Component):
    ...     inertia: Inertia = Inertia(J=1.0)
    ...     spring: SpringDamper = SpringDamper(c=100.0, d=1.0)
    ...     ground: Fixed = Fixed()
    ...
    ...     def equations(self):
    ...         yield pt.connect(self.inertia.flange_b, self.spring.flange_a)
    ...         yield pt.connect(self.spring.flange_b, self.ground.flange)
    >>> found = pt.order_response(Swing(), {"inertia.w": [5.0]}, {"inertia.flange_a.tau": {2.0: 3.0}}, ["inertia.phi"])
    >>> round(float(abs(found.item())), 6)  # at the resonance c = J (2 w)^2: 3/(d 2 w)
    0.3
    """
    import xarray as xr

    plant = plant_of(plant)
    line = operating_line(plant, over, at, parameters)
    if line.unit != "rad/s" or (line.values == 0.0).any():
        raise ParameterError(f"over: {line.name} must be a speed in rad/s, and not 0")
    inputs = list(by_name("excitation", excitation))
    for name in inputs:
        if name in plant.compiled.parameters:
            raise ParameterError(
                f"excitation: {name} is a parameter, which is constant; excite an input, a signal port or the flow of a port"
            )
    orders, amplitudes = _amplitudes(excitation, line)
    shown = listed("outputs", outputs)
    response = np.array(
        [_response(plant, inputs, shown, line, k, orders, amplitudes[k]) for k in range(len(line.values))]
    )
    picked = [signals_of(plant.compiled).pick(s) for s in shown]
    coordinates = {
        line.name: line.coordinate,
        "order": ("order", orders, {"units": "1", "long_name": "Order"}),
        "signal": [p.label for p in picked],
        "units": ("signal", [p.unit for p in picked]),
    }
    return xr.DataArray(response, coordinates, (line.name, "order", "signal"), "response")


def _amplitudes(excitation: Mapping[str, Any], line: OperatingLine) -> tuple[NDArray[np.float64], Matrix]:
    """All orders, and the amplitudes (speed, input, order)."""
    if not excitation:
        raise ParameterError('excitation: give at least one input with its orders, e.g. {"torque.tau": {2: 100.0}}')
    table: list[dict[float, Matrix]] = []
    for name, given in excitation.items():
        if not isinstance(given, Mapping) or not given:
            raise ParameterError(f"excitation: {name}: give {{order: amplitude}}")
        found: dict[float, Matrix] = {}
        for order, amplitude in given.items():
            if number(f"excitation: {name}: order", order) <= 0.0:
                raise ParameterError(f"excitation: {name}: the order {order:g} is not positive")
            values = np.asarray(amplitude)
            if (
                values.dtype.kind not in "iufc"
                or values.shape not in ((), line.values.shape)
                or not np.isfinite(values).all()
            ):
                raise ParameterError(
                    f"excitation: {name}: the amplitude of order {order:g} is not a finite number or one for each speed"
                )
            found[float(order)] = np.broadcast_to(values, line.values.shape).astype(complex)
        table.append(found)
    orders = sorted({order for found in table for order in found})
    silent = np.zeros(line.values.shape, complex)
    rows = [[found.get(order, silent) for order in orders] for found in table]
    return np.array(orders), np.moveaxis(np.array(rows), 2, 0)


def _response(
    plant: Plant[Any], inputs: list[str], outputs: list[Any], line: OperatingLine, k: int,
    orders: NDArray[np.float64], amplitudes: Matrix,
) -> Matrix:  # fmt: skip
    """The amplitudes (order, output) at one speed."""
    m = linear_at(plant, inputs, outputs, line.points[k]).matrices
    natural = eigenvectors(m.a).values
    found = np.empty((len(orders), len(outputs)), complex)
    for i, order in enumerate(orders):
        s = 1j * order * line.values[k]
        u = amplitudes[:, i]
        if np.abs(natural - s).min(initial=np.inf) < _RESONANCE * abs(s):
            raise ModelError(
                f"at {line.name} = {line.values[k]:g} rad/s the order {order:g} excites an undamped vibration"
            )
        found[i] = m.c @ np.linalg.solve(s * np.eye(len(m.a)) - m.a, m.b[0] @ u) + m.d[0] @ u
    return found
