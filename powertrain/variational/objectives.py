"""Objectives of derivatives: values, integrals, extremes and squares of signals, and their sums."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from powertrain.errors import ParameterError
from powertrain.language.arguments import number, row
from powertrain.language.reals import Array
from powertrain.signals import Selector


@dataclass(frozen=True)
class Term:
    """One term of an objective: ``kind`` is "at", "integral", "maximum", "minimum" or "squares"; ``times`` in s."""

    kind: str
    signal: Selector
    factor: float = 1.0
    times: tuple[float, ...] = ()
    values: tuple[float, ...] = ()
    sigma: float = 1.0


@dataclass(frozen=True)
class Objective:
    """A sum of terms, each with a factor. Objectives can be added, subtracted and multiplied by numbers."""

    terms: tuple[Term, ...]

    def __add__(self, other: Objective) -> Objective:
        return Objective((*self.terms, *other.terms))

    def __sub__(self, other: Objective) -> Objective:
        return self + -1.0 * other

    def __neg__(self) -> Objective:
        return -1.0 * self

    def __mul__(self, factor: float) -> Objective:
        by = number("the factor of an objective", factor)
        return Objective(tuple(replace(term, factor=by * term.factor) for term in self.terms))

    __rmul__ = __mul__


def final(signal: Selector) -> Objective:
    """The value of a signal at the end of the run."""
    return Objective((Term("at", signal),))


def at(signal: Selector, time: float) -> Objective:
    """The value of a signal at ``time`` (s); at an event its right limit."""
    return Objective((Term("at", signal, times=(number("time", time, "s"),)),))


def integral(signal: Selector) -> Objective:
    """The integral of a signal over the time of the run."""
    return Objective((Term("integral", signal),))


def maximum(signal: Selector) -> Objective:
    """The largest value of a signal in the run."""
    return Objective((Term("maximum", signal),))


def minimum(signal: Selector) -> Objective:
    """The smallest value of a signal in the run."""
    return Objective((Term("minimum", signal),))


def squares(signal: Selector, times: ArrayLike, values: ArrayLike, sigma: float = 1.0) -> Objective:
    """The sum of ((signal - value) / sigma)^2 over measured values.

    Parameters
    ----------
    signal : str or selector
        The signal that was measured.
    times : array_like
        Times [s] of the measurements.
    values : array_like
        Measured values, in the signal's unit.
    sigma : float
        Standard deviation of a measurement, in the signal's unit.

    Returns
    -------
    Objective
    """
    t, v = row("times", times), row("values", values)
    if t.shape != v.shape or not t.size:
        raise ParameterError(f"squares: {t.size} times and {v.size} values; the numbers must be equal and not zero")
    deviation = number("sigma", sigma)
    if not deviation > 0.0:
        raise ParameterError(f"squares: sigma = {deviation:g} is not positive")
    return Objective((Term("squares", signal, times=tuple(t.tolist()), values=tuple(v.tolist()), sigma=deviation),))


def objective(of: Any) -> Objective:
    """An objective; a name or a selector stands for its value at the end."""
    if isinstance(of, Objective):
        return of
    if isinstance(of, str) or callable(of):
        return final(of)
    raise ParameterError(
        f"of = {of!r}: pass a signal, or pt.at, pt.integral, pt.maximum, pt.minimum or pt.squares of one, or a sum of these"
    )


@dataclass(frozen=True)
class Reading:
    """``weight`` times expression ``signal`` at ``time`` (s); at event ``instant`` before (side -1) or after it (side 1).

    ``bend`` is the second derivative with respect to the value read; ``turning``: the signal has an extremum there between events, so
    the instant moves with the extremum.
    """

    time: float
    signal: int
    weight: float
    instant: int = -1
    side: int = 0
    bend: float = 0.0
    turning: bool = False


def weights_of(term: Term, values: Array) -> tuple[float, Array, float]:
    """The value of a term that reads a signal at its times, and its first and second derivatives with respect to the values read."""
    if term.kind == "squares":
        left = (values - np.array(term.values)) / term.sigma
        first, second = 2.0 * term.factor * left / term.sigma, 2.0 * term.factor / term.sigma**2
        return term.factor * float(left @ left), first, second
    return term.factor * float(values.sum()), np.full(len(values), term.factor), 0.0
