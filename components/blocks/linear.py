"""Linear systems between signals: state space and transfer functions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from powertrain import Component, Equations, Input, Output, ParameterError, Symbol, Variable, der, variable
from powertrain.components.blocks.basic import Filter

Matrix: TypeAlias = tuple[tuple[float, ...], ...]
InitType: TypeAlias = Literal["SteadyState", "InitialState"]


class _State(Output):
    """A state, whose size is also that of the derivative that it may stand for."""

    value: Variable = variable("1", "State", nominal=0.01)


class StateSpace(Component):
    """A linear system with any number of inputs and outputs: an observer, a controller, a reduced model.

    der(x) = A x + B u,  y = C x + D u

    ``u[0]``, ``y[0]`` and ``x[0]`` are the first input, output and state; the matrices give their numbers. Lists and arrays serve too, such
    as those of a ``control.StateSpace``. Without ``D`` the inputs do not act on the outputs directly. The matrices are structure: a model
    with others is compiled again.

    The start is steady, der(x) = 0, or with ``initType="InitialState"`` at x = x_start, which is zero if not given.
    Errors: ParameterError for matrices that do not fit together, and for a steady start where A is singular, as of an integrator.

    Source: Modelica Standard Library 4.0.0, Blocks.Continuous.StateSpace.
    """

    A: Matrix
    B: Matrix
    C: Matrix
    D: Matrix = ()
    initType: InitType = "SteadyState"
    x_start: tuple[float, ...] = ()
    u: tuple[Input, ...] = ()
    y: tuple[Output, ...] = ()
    x: tuple[Output, ...] = ()

    if not TYPE_CHECKING:

        def __init__(self, *unnamed: Any, **given: Any) -> None:
            ports = {
                "u": (Input(unit="1", doc="Input"),) * size_of(given.get("B"), 1),
                "y": (Output(unit="1", doc="Output"),) * size_of(given.get("C"), 0),
                "x": _states(size_of(given.get("A"), 0)),
            }
            super().__init__(*unnamed, **(given | ports))

    def check(self) -> Equations:
        """The sizes agree, and a steady start is determined."""
        n, inputs, outputs = len(self.x), len(self.u), len(self.y)
        matrices = {"A": (n, n), "B": (n, inputs), "C": (outputs, n)} | ({"D": (outputs, inputs)} if self.D else {})
        for name, (rows, columns) in matrices.items():
            if np.shape(getattr(self, name)) != (rows, columns):
                raise ParameterError(
                    f"StateSpace: with {n} states, {inputs} inputs and {outputs} outputs, {name} must have {rows} rows "
                    f"of {columns} numbers"
                )
        yield len(self.x_start) in (0, n)  # x_start has a value for each state
        if self.initType == "SteadyState":
            # in rows of size one, as states may differ by any factor in speed
            scaled = [np.array(row) / (np.abs(row).max() or 1.0) for row in self.A]
            yield np.linalg.matrix_rank(scaled) == n  # a steady start needs a regular A; else initType="InitialState"

    def equations(self) -> Equations:
        """A row each."""
        u, x = [port.value for port in self.u], [port.value for port in self.x]
        for state, a, b in zip(x, self.A, self.B, strict=True):
            yield der(state) == _product(a, x) + _product(b, u)
        direct = self.D or ((0.0,) * len(u),) * len(self.y)
        for port, c, d in zip(self.y, self.C, direct, strict=True):
            yield port.value == _product(c, x) + _product(d, u)

    def initial(self) -> Equations:
        """Steady, or given values."""
        for port, start in zip(self.x, self.x_start or (0.0,) * len(self.x), strict=True):
            yield der(port.value) == 0 if self.initType == "SteadyState" else port.value == start


class TransferFunction(Filter):
    """A rational transfer function: a filter, a compensator, an identified frequency response.

    y/u = (b[0] s^m + b[1] s^(m-1) + ... + b[m])/(a[0] s^n + a[1] s^(n-1) + ... + a[n]),  m <= n

    The highest power comes first, as in SciPy, python-control and Modelica. ``b, a = scipy.signal.butter(4, w, analog=True)`` gives a
    Butterworth low-pass of fourth order. With m = n the input acts on the output directly. The coefficients are structure: a model with
    others is compiled again.

    The states x are those of the controllable canonical form, in a unit of time in which they are of the size of u. At the start they are
    in their steady state, or zero with ``initType="InitialState"``.
    Errors: ParameterError for m > n, n = 0, a[0] = 0, and for a steady start with a[n] = 0: a function that integrates has none.

    Source: Modelica Standard Library 4.0.0, Blocks.Continuous.TransferFunction.
    """

    b: tuple[float, ...]
    a: tuple[float, ...]
    initType: InitType = "SteadyState"
    x: tuple[Output, ...] = ()

    if not TYPE_CHECKING:

        def __init__(self, *unnamed: Any, **given: Any) -> None:
            super().__init__(*unnamed, **(given | {"x": _states(size_of(given.get("a"), 0) - 1)}))

    def check(self) -> Equations:
        """It is proper, and a steady start is determined."""
        yield 1 <= len(self.b) <= len(self.a)  # the numerator is not of higher degree than the denominator
        yield len(self.a) > 1  # the denominator depends on s; a constant factor is a Gain
        yield self.a[0] != 0  # the highest power is there
        if self.initType == "SteadyState":
            yield self.a[-1] != 0  # a steady start needs a[n]; else initType="InitialState"

    def equations(self) -> Equations:
        """Controllable canonical form, in the unit of time 1/w."""
        w, numerator, denominator = _in_unit_of_time(self.b, self.a)
        u, x = self.u.value, [port.value for port in self.x]
        highest = u - _product(denominator[:-1], x)
        for state, rate in zip(x, [*x[1:], highest], strict=True):
            yield der(state) == w * rate
        yield self.y.value == _product(numerator, [*x, highest])

    def initial(self) -> Equations:
        """Steady, or zero."""
        for port in self.x:
            yield der(port.value) == 0 if self.initType == "SteadyState" else port.value == 0


def _states(n: int) -> tuple[Output, ...]:
    return (_State(unit="1", doc="State"),) * n


def size_of(values: Any, axis: int) -> int:
    """Rows (axis 0) or columns (1) of a matrix; 0 for a value that is none, which the check of its field refuses."""
    try:
        return int(np.shape(values)[axis])
    except (ValueError, IndexError):
        return 0


def _product(row: Sequence[float] | NDArray[np.float64], values: Sequence[Symbol]) -> Symbol:
    return sum((float(factor) * value for factor, value in zip(row, values, strict=True) if factor), Symbol(0))


def _in_unit_of_time(b: Sequence[float], a: Sequence[float]) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
    """A frequency w, and the coefficients of (s/w)^0, (s/w)^1, ... with 1 for the highest of the denominator.

    w is the geometric mean of the poles' absolute values, without those at zero; 1 if there are no others.
    """
    n = len(a) - 1
    denominator = np.array(a[::-1]) / a[0]
    numerator = np.pad(np.array(b[::-1]), (0, n + 1 - len(b))) / a[0]
    lowest = int(np.flatnonzero(denominator)[0])
    w = float(abs(denominator[lowest]) ** (1 / (n - lowest))) if lowest < n else 1.0
    scale = w ** (np.arange(n + 1.0) - n)
    return w, numerator * scale, denominator * scale
