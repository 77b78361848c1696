"""Unknowns of derivatives: parameters, starts and knots of inputs by name, and how they enter the equations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.assemble import Compiled
from powertrain.errors import ParameterError, suggestion
from powertrain.language.arguments import names as argument_names
from powertrain.language.reals import Array
from powertrain.result import Result
from powertrain.signals import fits_pattern

TIMES = ".times"
"""Suffix of an input's name: the instants of its knots instead of their values."""


@dataclass(frozen=True)
class Knots:
    """An input of a run, linear between its knots (times in s); its current segment is in ``m`` at ``index``.

    ``values_wanted``, ``times_wanted``: which of the two are unknowns. Knots at one instant (a jump) share that instant.
    """

    name: str
    index: int
    times: Array
    values: Array
    values_wanted: bool
    times_wanted: bool

    @cached_property
    def instants(self) -> tuple[Array, NDArray[np.int64]]:
        """The distinct times, and the index of each knot's time among them."""
        times, place = np.unique(self.times, return_inverse=True)
        return times, np.asarray(place, np.int64)

    @property
    def size(self) -> int:
        """The number of unknowns."""
        return self.values_wanted * len(self.times) + self.times_wanted * len(self.instants[0])

    def labels(self) -> list[str]:
        """Their names."""
        many = len(self.times) > 1
        found = [f"{self.name}[{i}]" if many else self.name for i in range(len(self.times) * self.values_wanted)]
        return found + [f"{self.name}{TIMES}[{i}]" for i in range(len(self.instants[0]) * self.times_wanted)]

    def segment(self, times: Array, after: bool) -> NDArray[np.float64]:
        """d(t0, y0, slope, end of the segment)/d(unknowns) at the right (``after``) or left limits of times: (time, 4, unknown)."""
        last, count = len(self.times) - 1, np.arange(len(times))
        i = self.times.searchsorted(times, side="right" if after else "left") - 1
        here, following = np.maximum(i, 0), np.minimum(i + 1, last)
        span = np.where((i >= 0) & (i < last), self.times[following] - self.times[here], np.inf)
        slope = (self.values[following] - self.values[here]) / span
        by_value, by_time = np.zeros((len(times), 4, last + 1)), np.zeros((len(times), 4, len(self.instants[0])))
        by_value[count, 1, here] = 1.0
        by_value[count, 2, following] += 1.0 / span
        by_value[count, 2, here] -= 1.0 / span
        at = self.instants[1]
        by_time[count, 0, at[here]] = i >= 0
        by_time[count, 2, at[following]] -= slope / span
        by_time[count, 2, at[here]] += slope / span
        by_time[count, 3, at[following]] = i < last
        return np.concatenate(
            [
                by_value[:, :, : by_value.shape[2] * self.values_wanted],
                by_time[:, :, : by_time.shape[2] * self.times_wanted],
            ],
            axis=2,
        )


@dataclass(frozen=True)
class Unknowns:
    """Parameters (by index), starts (by the name of the variable), values and instants of the knots of some inputs, in this order."""

    parameters: tuple[int, ...]
    starts: tuple[str, ...]
    inputs: tuple[Knots, ...]
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: tuple[float, ...]

    @cached_property
    def segments(self) -> tuple[int, ...]:
        """The indices in ``m`` of the segments of the inputs."""
        return tuple(knots.index + k for knots in self.inputs for k in range(3))

    @cached_property
    def plain(self) -> NDArray[np.float64]:
        """dq/d(unknowns) without inputs: q are the parameters."""
        return np.eye(len(self.parameters) + 4 * len(self.inputs), len(self.names))

    def chain(self, times: Array, after: bool) -> NDArray[np.float64]:
        """dq/d(unknowns) at the right (``after``) or left limits of times, one matrix per time."""
        if not self.inputs:
            return np.broadcast_to(self.plain, (len(times), *self.plain.shape))
        n, count = len(self.parameters), len(self.inputs)
        found = np.zeros((len(times), n + 4 * count, len(self.names)))
        found[:, range(n), range(n)] = 1.0
        column = n + len(self.starts)
        for j, knots in enumerate(self.inputs):
            here = slice(column, column + knots.size)
            segment = knots.segment(times, after)
            found[:, n + 3 * j : n + 3 * j + 3, here], found[:, n + 3 * count + j, here] = segment[:, :3], segment[:, 3]
            column += knots.size
        return found


def unknowns(result: Result[Any], wrt: str | Sequence[str] | None) -> Unknowns:
    """The unknowns that match the names and patterns; all parameters for None. ParameterError for a name without a match."""
    compiled = result.compiled
    parameters, starts = list(compiled.parameters), _starts(result)
    chosen: list[str] = []
    inputs: list[str] = []
    begun: list[str] = []
    for name in parameters if wrt is None else argument_names("wrt", wrt):
        fits = [name] if name in compiled.parameters else [p for p in parameters if fits_pattern(p, name)]
        if fits:
            chosen += fits
        elif name.removesuffix(TIMES) in compiled.inputs:
            inputs.append(name)
        elif name in starts:
            begun.append(name)
        else:
            _refuse(name, compiled, starts)
    chosen, inputs, begun = (list(dict.fromkeys(group)) for group in (chosen, inputs, begun))
    knots = [_knots(result, name, inputs) for name in dict.fromkeys(n.removesuffix(TIMES) for n in inputs)]
    units = [compiled.parameters[n].unit for n in chosen] + [compiled.signals[n].unit for n in begun]
    values = [result.parameters[n] for n in chosen] + [starts[n] for n in begun]
    for k in knots:
        units += [compiled.inputs[k.name].unit] * (len(k.times) * k.values_wanted)
        units += ["s"] * (len(k.instants[0]) * k.times_wanted)
        values += [*(k.values.tolist() * k.values_wanted), *(k.instants[0].tolist() * k.times_wanted)]
    labels = [label for k in knots for label in k.labels()]
    places = tuple(parameters.index(n) for n in chosen)
    return Unknowns(places, tuple(begun), tuple(knots), (*chosen, *begun, *labels), tuple(units), tuple(values))


def _starts(result: Result[Any]) -> Mapping[str, float]:
    """The variables whose start value is a condition of its own, or that nothing else determines."""
    used = {c.label: c.value for c in result.report.used} if result.report is not None else {}
    held = result.trajectory.held[0] if len(result.trajectory.held) else result.trajectory.final_held
    found = {name: float(held[place]) for name, place in result.compiled.discretes.items()}
    return {name: value for name, value in used.items() if name in result.compiled.signals} | found


def _refuse(name: str, compiled: Compiled, starts: Mapping[str, float]) -> None:
    if name in compiled.signals:
        raise ParameterError(
            f"wrt: {name} is neither a parameter nor an input, and its initial value follows from other conditions; "
            f"initial values that can be varied: {', '.join(starts) or 'none'}"
        )
    known = [*compiled.parameters, *compiled.inputs, *starts]
    raise ParameterError(f"wrt: the model has no parameter, input or initial value {name}{suggestion(name, known)}")


def _knots(result: Result[Any], name: str, wanted: Sequence[str]) -> Knots:
    schedule = next(s for s in result.compiled.dae.schedules if s.name == name)
    times, values = (np.array(v, float) for v in result.inputs.get(name, (schedule.times, schedule.values)))
    return Knots(name, schedule.index, times, values, name in wanted, f"{name}{TIMES}" in wanted)
