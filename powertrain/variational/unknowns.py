"""With respect to what: parameters, starts and knots of inputs by name, and how they enter the equations."""

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
from powertrain.numerics.buffers import Array
from powertrain.result import Result
from powertrain.signals import fits_pattern


@dataclass(frozen=True)
class Knots:
    """An input of a run, linear between its knots (times in s); its running segment lies in ``m`` at ``index``."""

    name: str
    index: int
    times: Array
    values: Array


@dataclass(frozen=True)
class Unknowns:
    """Parameters (by place), starts (by the name of the variable) and all knots of some inputs, in this order."""

    parameters: tuple[int, ...]
    starts: tuple[str, ...]
    inputs: tuple[Knots, ...]
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: tuple[float, ...]

    @cached_property
    def segments(self) -> tuple[int, ...]:
        """The places in ``m`` of the segments of the inputs."""
        return tuple(knots.index + k for knots in self.inputs for k in range(3))

    @cached_property
    def plain(self) -> NDArray[np.float64]:
        """dq/d(unknowns) without inputs: q are the parameters."""
        return np.eye(len(self.parameters) + 3 * len(self.inputs), len(self.names))

    def chain(self, times: Array, after: bool) -> NDArray[np.float64]:
        """dq/d(unknowns) at the right (``after``) or left limits of times, one matrix per time."""
        if not self.inputs:
            return np.broadcast_to(self.plain, (len(times), *self.plain.shape))
        n, size = len(self.parameters), len(self.names)
        found = np.zeros((len(times), n + 3 * len(self.inputs), size))
        found[:, range(n), range(n)] = 1.0
        column = n + len(self.starts)
        for j, knots in enumerate(self.inputs):
            row, last = n + 3 * j, len(knots.times) - 1
            i = knots.times.searchsorted(times, side="right" if after else "left") - 1
            k, here = np.arange(len(times)), np.maximum(i, 0)
            found[k, row + 1, column + here] = 1.0
            sloped = (i >= 0) & (i < last)
            k, here = k[sloped], here[sloped]
            span = knots.times[here + 1] - knots.times[here]
            found[k, row + 2, column + here + 1] = 1.0 / span
            found[k, row + 2, column + here] = -1.0 / span
            column += last + 1
        return found


def unknowns(result: Result[Any], wrt: str | Sequence[str] | None) -> Unknowns:
    """The unknowns of the given names and patterns; all parameters for None. ParameterError for a name without any."""
    compiled = result.compiled
    parameters, starts = list(compiled.parameters), _starts(result)
    chosen: list[str] = []
    inputs: list[str] = []
    begun: list[str] = []
    for name in parameters if wrt is None else argument_names("wrt", wrt):
        fits = [name] if name in compiled.parameters else [p for p in parameters if fits_pattern(p, name)]
        if fits:
            chosen += fits
        elif name in compiled.inputs:
            inputs.append(name)
        elif name in starts:
            begun.append(name)
        else:
            _refuse(name, compiled, starts)
    chosen, inputs, begun = (list(dict.fromkeys(group)) for group in (chosen, inputs, begun))
    knots = [_knots(result, name) for name in inputs]
    labels = [f"{k.name}[{i}]" if len(k.times) > 1 else k.name for k in knots for i in range(len(k.times))]
    units = [compiled.parameters[n].unit for n in chosen] + [compiled.signals[n].unit for n in begun]
    units += [compiled.inputs[k.name].unit for k in knots for _ in k.times]
    values = [result.parameters[n] for n in chosen] + [starts[n] for n in begun]
    values += [float(v) for k in knots for v in k.values]
    places = tuple(parameters.index(n) for n in chosen)
    return Unknowns(places, tuple(begun), tuple(knots), (*chosen, *begun, *labels), tuple(units), tuple(values))


def _starts(result: Result[Any]) -> Mapping[str, float]:
    """The variables whose value at the start is a condition of its own, or that nothing else determines."""
    used = {c.label: c.value for c in result.report.used} if result.report is not None else {}
    first = {d.name: d for d in result.compiled.flat.discretes}
    held = result.trajectory.held[0] if len(result.trajectory.held) else result.trajectory.final_held
    m = [s.name() for s in _scalars(result.compiled)]
    found = {n: float(held[m.index(d.symbol.name())]) for n, d in first.items() if d.symbol.name() in m}
    return {name: value for name, value in used.items() if name in result.compiled.signals} | found


def _scalars(compiled: Compiled) -> list[Any]:
    m = compiled.dae.m
    return [m[i] for i in range(m.numel())]


def _refuse(name: str, compiled: Compiled, starts: Mapping[str, float]) -> None:
    if name in compiled.signals:
        raise ParameterError(
            f"wrt: {name} is neither a parameter nor an input, and its initial value follows from other conditions; "
            f"initial values that can be varied: {', '.join(starts) or 'none'}"
        )
    known = [*compiled.parameters, *compiled.inputs, *starts]
    raise ParameterError(f"wrt: the model has no parameter, input or initial value {name}{suggestion(name, known)}")


def _knots(result: Result[Any], name: str) -> Knots:
    schedule = next(s for s in result.compiled.dae.schedules if s.name == name)
    times, values = result.inputs.get(name, (schedule.times, schedule.values))
    return Knots(name, schedule.index, np.array(times, float), np.array(values, float))
