"""Order maps of simulated runs: the spectrum over the angle of a shaft, block by block as its speed changes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator

from powertrain.errors import ParameterError
from powertrain.given_runs import complete
from powertrain.language.arguments import count, limits, positive
from powertrain.language.reals import Array
from powertrain.result import Result
from powertrain.signals import Picked, Selector, signals_of

if TYPE_CHECKING:
    import xarray as xr

_OVERSAMPLING = 8
"""Samples per period of the highest order: what lies above seven times that order would appear as a lower one."""
_RESOLUTION = 128
"""Samples of the shaft's motion per revolution, at least: its irregularity has orders of its own, whichever are asked for."""
_OVERLAP = 4
"""Blocks that cover the same sample."""


def order_map(
    result: Result[Any],
    signal: Selector,
    shaft: Selector,
    *,
    orders: float = 10.0,
    revolutions: int = 8,
    span: tuple[float, float] | None = None,
) -> xr.DataArray:
    """The amplitudes of a signal over orders of a shaft's rotation, along a run-up or run-down.

    Computed order tracking: the dense output is sampled at equal increments of the angle of the shaft, and blocks of whole revolutions
    are weighted with a Hann window and transformed. A component that keeps its order stays in one line at any acceleration. The
    amplitude of a sinusoid with an order that is a multiple of 1/``revolutions`` is exact if it is constant over the block.

    Parameters
    ----------
    result
        A run with its trajectory.
    signal
        What is analysed: a name or selector.
    shaft
        The angle [rad] or the speed [rad/s] of the shaft; it must turn in one direction throughout.
    orders
        The highest order, in events per revolution. Sources of much higher orders (above seven times this one) are folded into the map.
    revolutions
        The length of a block. Orders are resolved in steps of 1/``revolutions``; the window's main lobe is four steps wide.
    span
        (start, end) in s; by default the whole run.

    Returns
    -------
    xarray.DataArray
        Amplitudes (single-sided, magnitude of the mean at order 0) in the signal's unit, over ``time`` [s] and ``order`` [1], with
        coordinates ``speed`` [rad/s], the mean of the block, and ``frequency`` [Hz] = order speed/(2 pi). Blocks overlap by three quarters.

    Raises
    ------
    ParameterError
        If the shaft stands still or reverses, or makes fewer revolutions than a block has; for other units.

    Examples
    --------
    >>> import casadi as ca, powertrain as pt
    >>> class Source(pt.Component):
    ...     w: pt.Variable = pt.variable("rad/s", "Speed", start=20.0)
    ...     phi: pt.Variable = pt.variable("rad", "Angle", start=0.0)
    ...     tau: pt.Variable = pt.variable("N.m", "Torque")
    ...
    ...     def equations(self):
    ...         yield pt.der(self.w) == 5.0
    ...         yield pt.der(self.phi) == self.w
    ...         yield self.tau == 10.0 + 3.0 * ca.cos(2.0 * self.phi)
    >>> found = pt.order_map(pt.simulate(Source(), 10.0), "tau", "phi", orders=4)
    >>> found.sel(order=[0.0, 2.0, 3.0]).mean("time").round(3).values.tolist()
    [10.0, 3.0, 0.0]
    """
    import xarray as xr

    signals = signals_of(complete(result).compiled)
    shown, turning = signals.pick(signal), signals.pick(shaft)
    highest, length = positive("orders", orders), count("revolutions", revolutions)
    per_turn = int(np.ceil(_OVERSAMPLING * highest))
    times, speeds = _equal_angles(result, turning, shaft, per_turn, _span(result, span))
    size = per_turn * length
    if len(times) < size:
        raise ParameterError(
            f"{turning.label} makes {len(times) / per_turn:.3g} revolutions, fewer than the {length} of a block"
        )
    values = result.at(times, signal)
    starts = np.arange(0, len(times) - size + 1, max(size // _OVERLAP, 1))
    window = np.hanning(size + 1)[:-1]
    blocks = values[starts[:, None] + np.arange(size)]
    # the window spreads the mean over the first order, too: it is taken out before
    swing = blocks - blocks.mean(axis=1, keepdims=True)
    spectrum = np.abs(np.fft.rfft(swing * window, axis=1)) * (2.0 / window.sum())
    spectrum[:, 0] = np.abs(blocks @ window) / window.sum()
    bins = np.arange(spectrum.shape[1]) / length
    kept = bins <= highest
    speed = speeds[starts[:, None] + np.arange(size)].mean(axis=1)
    coordinates = {
        "time": ("time", times[starts + size // 2], {"units": "s", "long_name": "Time"}),
        "order": ("order", bins[kept], {"units": "1", "long_name": "Order"}),
        "speed": ("time", speed, {"units": "rad/s", "long_name": "Speed"}),
        "frequency": (
            ("time", "order"),
            np.outer(speed, bins[kept]) / (2 * np.pi),
            {"units": "Hz", "long_name": "Frequency"},
        ),
    }
    said = {"units": shown.unit, "long_name": f"Amplitude of {shown.label}"}
    return xr.DataArray(spectrum[:, kept], coordinates, ("time", "order"), shown.label, said)


def _span(result: Result[Any], span: Any) -> tuple[float, float]:
    first, last = result.trajectory.start, result.trajectory.end
    if span is None:
        return first, last
    start, end = limits("span", span)
    if not first <= start < end <= last:
        raise ParameterError(f"span: {start:g} to {end:g} s lies outside the simulated {first:g} to {last:g} s")
    return start, end


def _equal_angles(
    result: Result[Any], turning: Picked, shaft: Selector, per_turn: int, span: tuple[float, float]
) -> tuple[Array, Array]:
    """The times at equal increments of the angle, ``per_turn`` a revolution, and the speed at them, both positive in its direction."""
    if turning.unit not in ("rad", "rad/s"):
        raise ParameterError(
            f"shaft: {turning.label} is in {turning.unit or '1'}; give an angle in rad or a speed in rad/s"
        )

    def sampled(points: int) -> tuple[Array, Array]:
        t = np.linspace(*span, points)
        return t, result.at(t, shaft)

    t, course = sampled(max(1000, len(result.time)))
    fastest = np.abs(course).max() if turning.unit == "rad/s" else np.abs(np.gradient(course, t)).max()
    turns = fastest * (span[1] - span[0]) / (2 * np.pi)
    t, course = sampled(max(1000, int(turns * max(per_turn, _RESOLUTION)) + 1))
    curve = CubicSpline(t, course)
    angle = course - course[0] if turning.unit == "rad" else curve.antiderivative()(t)
    sign = 1.0 if angle[-1] >= 0.0 else -1.0
    angle = sign * angle
    back = np.flatnonzero(np.diff(angle) <= 0.0)
    if back.size:
        raise ParameterError(
            f"{turning.label}: the shaft stands still or reverses at t = {t[back[0]]:.6g} s; choose a span without that"
        )
    steps = np.arange(0.0, angle[-1], 2 * np.pi / per_turn)
    times = np.clip(PchipInterpolator(angle, t)(steps), *span)
    rate = curve.derivative() if turning.unit == "rad" else curve
    return times, sign * np.asarray(rate(times), float)
