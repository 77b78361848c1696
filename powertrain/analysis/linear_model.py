"""What linearisation gives: python-control's state space with the names, units and modes it belongs to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import control
import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class Linearization:
    """What the matrices of a linear model do not say; see ``LinearModel``.

    ``states``, ``inputs`` and ``outputs`` are the names as in the model ('J1.w'), in the order of the matrices; python-control allows no
    dots, and names its signals with '_' instead. ``units`` are theirs. ``modes`` are the modes of all laws; ``removed`` are the states that
    closed contacts and stuck friction take away: they follow from the others. ``shifted``: states that stand for x - g u with the given
    gains g of each input, because the model contains derivatives of the input.
    """

    time: float
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    units: dict[str, str]
    values: dict[str, float]
    modes: dict[str, float]
    removed: tuple[str, ...]
    shifted: dict[str, dict[str, float]] = field(default_factory=dict)


class LinearModel(control.StateSpace):  # type: ignore[misc]
    """A ``control.StateSpace``; ``linearization`` says what it belongs to. What is computed from it is a plain StateSpace."""

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
        super().__init__(a, b, c, d, states=list(states), inputs=list(inputs), outputs=list(outputs), name=name)
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
