"""Forced vibration at the orders of an engine: the steady response of the linear model over speed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain.analysis.linearization import linear_at
from powertrain.errors import ModelError, ParameterError
from powertrain.language.arguments import by_name, listed, number
from powertrain.language.component import Component
from powertrain.plant import Plant, plant_of
from powertrain.signals import Selector, signals_of
from powertrain.vibration.eigenvectors import eigenvectors
from powertrain.vibration.operating_line import Along, Line, OperatingLine, operating_line

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
    parameters: Mapping[str, float | Callable[[float], float]] | None = None,
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
        The operating points; see ``pt.campbell``. A parameter may be a function of the frequency |n w| of the excitation in rad/s, such
        as the dynamic stiffness of rubber. ``{"spring.d": lambda f: eta * c / f}`` is a loss factor eta: c + j f d = c (1 + j eta).

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
    orders, inputs, shown = _orders(plant, excitation), list(excitation), listed("outputs", outputs)
    lines = _lines(plant, over, orders, at, by_name("parameters", parameters))
    line = lines[0]
    if line.unit != "rad/s" or (line.values == 0.0).any():
        raise _no_speed(line.name)
    amplitudes = _amplitudes(excitation, orders, line)
    models = {id(one): [linear_at(plant, inputs, shown, point).matrices for point in one.points] for one in lines}
    natural = {key: [eigenvectors(m.a).values for m in matrices] for key, matrices in models.items()}
    response = np.empty((len(line.values), len(orders), len(shown)), complex)
    for i, (order, one) in enumerate(zip(orders, lines, strict=True)):
        for k, m in enumerate(models[id(one)]):
            s = 1j * order * line.values[k]
            if np.abs(natural[id(one)][k] - s).min(initial=np.inf) < _RESONANCE * abs(s):
                where = f"{line.name} = {line.values[k]:g} rad/s"
                raise ModelError(f"at {where} the order {order:g} excites an undamped vibration")
            u = amplitudes[k, :, i]
            response[k, i] = m.c @ np.linalg.solve(s * np.eye(len(m.a)) - m.a, m.b[0] @ u) + m.d[0] @ u
    picked = [signals_of(plant.compiled).pick(s) for s in shown]
    coordinates = {
        line.name: line.coordinate,
        "order": ("order", orders, {"units": "1", "long_name": "Order"}),
        "signal": [p.label for p in picked],
        "units": ("signal", [p.unit for p in picked]),
    }
    return xr.DataArray(response, coordinates, (line.name, "order", "signal"), "response")


def _no_speed(name: str) -> ParameterError:
    return ParameterError(f"over: {name} must be a speed in rad/s, and not 0")


def _orders(plant: Plant[Any], excitation: Mapping[str, Any]) -> list[float]:
    """All orders of all inputs."""
    orders: set[float] = set()
    for name, given in by_name("excitation", excitation).items():
        if name in plant.compiled.parameters:
            raise ParameterError(
                f"excitation: {name} is a parameter, which is constant; excite an input, a signal port or the flow of a port"
            )
        if not isinstance(given, Mapping) or not given:
            raise ParameterError(f"excitation: {name}: give {{order: amplitude}}")
        for order in given:
            if number(f"excitation: {name}: order", order) <= 0.0:
                raise ParameterError(f"excitation: {name}: the order {order:g} is not positive")
            orders.add(float(order))
    if not orders:
        raise ParameterError('excitation: give at least one input with its orders, e.g. {"torque.tau": {2: 100.0}}')
    return sorted(orders)


def _lines(
    plant: Plant[Any],
    over: Mapping[str, ArrayLike],
    orders: list[float],
    at: Line | None,
    parameters: Mapping[str, Any],
) -> list[OperatingLine]:
    """The operating points for each order: the same for all of them, unless parameters depend on the frequency."""
    if not any(map(callable, parameters.values())):
        return [operating_line(plant, over, at, parameters or None)] * len(orders)

    def along(order: float) -> Along:
        def set_at(speed: float) -> dict[str, Any]:
            frequency = abs(order * speed)
            if frequency == 0.0:
                raise _no_speed(next(iter(over)))
            return {name: given(frequency) if callable(given) else given for name, given in parameters.items()}

        return set_at

    return [operating_line(plant, over, at, along(order)) for order in orders]


def _amplitudes(
    excitation: Mapping[str, Mapping[float, ArrayLike]], orders: list[float], line: OperatingLine
) -> Matrix:
    """The amplitudes (speed, input, order)."""
    table = np.zeros((len(line.values), len(excitation), len(orders)), complex)
    for j, (name, given) in enumerate(excitation.items()):
        for order, amplitude in given.items():
            values = np.asarray(amplitude)
            if (
                values.dtype.kind not in "iufc"
                or values.shape not in ((), line.values.shape)
                or not np.isfinite(values).all()
            ):
                raise ParameterError(
                    f"excitation: {name}: the amplitude of order {order:g} is not a finite number or one for each speed"
                )
            table[:, j, orders.index(float(order))] = values
    return table
