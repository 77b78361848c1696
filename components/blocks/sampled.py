"""Sampled signals, as in a control unit: a hold and difference equations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import casadi as ca

from powertrain import Component, Discrete, Equations, Parameter, Symbol, discrete, parameter, reinit, time, when
from powertrain.components.blocks.basic import Filter
from powertrain.components.blocks.linear import InitType, size_of

EARLY = 1e-6
"""Share of a period by which a start may come before an instant of sampling through round-off."""


class _Sampled(Filter):
    """Partial: u is sampled at the start of a run and at period, 2 period, ... thereafter."""

    period: Parameter = parameter("s", "Sampling period", above=0)
    n: Discrete = discrete("1", "Number of the next sample")
    held: Discrete = discrete("1", "y since the last sample")

    def initial(self) -> Equations:
        """The start takes the place of the sample before it."""
        yield self.n == ca.floor(time / self.period + EARLY)


class ZeroOrderHold(_Sampled):
    """A signal sampled and held: y = u at 0, period, 2 period, ..., and constant between, as an analogue-to-digital converter reads it.

    The start of a run is a sample too, wherever it lies between two of these instants. A sample reads the values just before its instant,
    and time signals that jump there after the jump. Operating points and linear models hold y at 0, or at a given ``held``, as they hold
    all discrete variables.
    """

    def equations(self) -> Equations:
        """One value per sample."""
        due = time >= self.n * self.period
        yield when(due, reinit(self.n, self.n + 1), reinit(self.held, self.u.value), initially=True)
        yield self.y.value == self.held


class _Register(Component):
    """A value that is kept from one sample to the next."""

    kept: Discrete = discrete("1", "Value")

    def equations(self) -> Equations:
        """Its owner sets it."""
        yield from ()


class DiscreteTransferFunction(_Sampled):
    """A difference equation that is computed at 0, period, 2 period, ...: a digital filter or controller; y is held in between.

    y/u = (b[0] z^m + b[1] z^(m-1) + ... + b[m])/(a[0] z^n + a[1] z^(n-1) + ... + a[n]),  m <= n

    The highest power comes first, as in python-control, ``scipy.signal.dlti`` and Modelica; ``b=(1,), a=(1, 0)`` is a unit delay,
    ``b=(0.25,) * 4, a=(1, 0, 0, 0)`` the moving average of four samples. The coefficients are structure: a model with others is compiled
    again.

    The start of a run is a sample too. It is steady, as if u had been constant before; with ``initType="InitialState"``, u and y were zero
    before. A sample reads the values just before its instant, and time signals that jump there after the jump. Of two blocks that are
    sampled at the same instant each sees the previous output of the other: a chain of two has one period of delay more than the product of
    their transfer functions, which is a single block. Operating points and linear models hold y, as that of ``ZeroOrderHold``.

    Errors: ParameterError for m > n, a[0] = 0, and for a steady start where the sum of a is zero: a function that integrates has none.
    Source: Modelica Standard Library 4.0.0, Blocks.Discrete.TransferFunction.
    """

    b: tuple[float, ...]
    a: tuple[float, ...] = (1.0,)
    initType: InitType = "SteadyState"
    registers: tuple[_Register, ...] = ()
    begun: Discrete = discrete("1", "0 before the first sample, then 1")

    if not TYPE_CHECKING:

        def __init__(self, *unnamed: Any, **given: Any) -> None:
            super().__init__(*unnamed, **(given | {"registers": (_Register(),) * (size_of(given.get("a"), 0) - 1)}))

    def check(self) -> Equations:
        """It is proper, and a steady start is determined."""
        yield 1 <= len(self.b) <= len(self.a)  # the numerator is not of higher degree than the denominator
        yield self.a[0] != 0  # the highest power is there
        if self.initType == "SteadyState":
            yield sum(self.a) != 0  # a steady start needs a sum of a; else initType="InitialState"

    def equations(self) -> Equations:
        """Transposed direct form: every register holds what the samples so far add to a later y."""
        a = [value / self.a[0] for value in self.a]
        b = [0.0] * (len(a) - len(self.b)) + [value / self.a[0] for value in self.b]
        u = self.u.value
        steady = _steady(b, a) if self.initType == "SteadyState" else [0.0] * len(self.registers)
        kept = [r.kept + (1 - self.begun) * s * u for r, s in zip(self.registers, steady, strict=True)]
        y, *later = [*kept, Symbol(0)] if kept else [Symbol(0), Symbol(0)]
        y = b[0] * u + y
        values = [bk * u - ak * y + more for bk, ak, more in zip(b[1:], a[1:], later, strict=False)]
        yield when(
            time >= self.n * self.period,
            reinit(self.n, self.n + 1),
            reinit(self.begun, 1),
            reinit(self.held, y),
            *(reinit(r.kept, value) for r, value in zip(self.registers, values, strict=True)),
            initially=True,
        )
        yield self.y.value == self.held


def _steady(b: Sequence[float], a: Sequence[float]) -> list[float]:
    """The registers after many samples of u = 1."""
    y, more, found = sum(b) / sum(a), 0.0, list[float]()
    for bk, ak in zip(b[:0:-1], a[:0:-1], strict=True):
        more += bk - ak * y
        found.insert(0, more)
    return found
