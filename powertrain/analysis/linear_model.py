"""The result of linearisation: a state space of python-control with names, units and modes."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import control
import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class Linearization:
    """Names, units and modes of a linear model; see ``LinearModel``.

    ``states``, ``inputs`` and ``outputs`` are the names in the model ('J1.w'), in the order of the matrices; python-control does not allow
    dots and names its signals with '_' instead. ``units`` are their units. ``modes`` are the modes of all laws; ``removed`` are the states
    that closed contacts and stuck friction remove: they follow from the others. ``one_sided``: laws that change their mode at this very
    point, such as the driving side of an unloaded gear; the derivatives are those of one side. ``shifted``: states that stand for
    x - g u with the given gains g of each input, because the model contains derivatives of the input. ``unseen``: states left out by
    ``reduced=True``, because nothing depends on them alone; ``relative``: states taken relative to these, x - g x_unseen with the given
    gains g.
    """

    time: float
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    units: dict[str, str]
    values: dict[str, float]
    modes: dict[str, float]
    removed: tuple[str, ...]
    one_sided: tuple[str, ...] = ()
    shifted: dict[str, dict[str, float]] = field(default_factory=dict)
    unseen: tuple[str, ...] = ()
    relative: dict[str, dict[str, float]] = field(default_factory=dict)


class LinearModel(control.StateSpace):  # type: ignore[misc]
    """A ``control.StateSpace`` with its ``linearization``. Operations on it return a plain StateSpace."""

    A: Matrix  # pyright: ignore[reportIncompatibleVariableOverride]
    B: Matrix  # pyright: ignore[reportIncompatibleVariableOverride]
    C: Matrix  # pyright: ignore[reportIncompatibleVariableOverride]
    D: Matrix  # pyright: ignore[reportIncompatibleVariableOverride]
    linearization: Linearization

    def __init__(
        self,
        a: Matrix,
        b: Matrix,
        c: Matrix,
        d: Matrix,
        linearization: Linearization,
        *,
        states: Sequence[str],
        inputs: Sequence[str],
        outputs: Sequence[str],
        name: str,
    ) -> None:
        names = {"states": _dotless(states), "inputs": _dotless(inputs), "outputs": _dotless(outputs), "name": name}
        with (
            warnings.catch_warnings()
        ):  # python-control sets the shapes of matrices without states, which NumPy 2.5 deprecates
            warnings.filterwarnings("ignore", "Setting the shape", DeprecationWarning)
            super().__init__(a, b, c, d, **names)
        self.linearization = linearization

    def __reduce__(self) -> tuple[Any, ...]:
        names = {
            "states": self.state_labels,
            "inputs": self.input_labels,
            "outputs": self.output_labels,
            "name": self.name,
        }
        return _rebuilt, (self.A, self.B, self.C, self.D, self.linearization, names)


def _rebuilt(
    a: Matrix, b: Matrix, c: Matrix, d: Matrix, linearization: Linearization, names: dict[str, Any]
) -> LinearModel:
    return LinearModel(a, b, c, d, linearization, **names)


def minus(relative: Mapping[str, float]) -> str:
    """The term subtracted from a state, as part of its name: '-J1.phi', '-0.25*J1.phi'."""
    return "".join(
        f"{'-' if gain > 0 else '+'}{abs(gain):.6g}*{name}".replace("-1*", "-").replace("+1*", "+")
        for name, gain in relative.items()
    )


def _dotless(names: Sequence[str]) -> list[str]:
    """Names without dots, which python-control does not allow; still distinct."""
    found: list[str] = []
    for name in names:
        plain = short = name.replace(".", "_")
        count = 1
        while short in found:
            count += 1
            short = f"{plain}_{count}"
        found.append(short)
    return found
