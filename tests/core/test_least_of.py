"""The least of some numbers over many points: machine code, CasADi's function and numpy agree."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from powertrain.numerics.compiled import InC, compile_functions
from powertrain.numerics.least import least_of

COMPILER = pytest.mark.skipif(not (shutil.which("cc") or shutil.which("gcc")), reason="no C compiler on this machine")
ROWS = 3


def numbers(given: Sequence[ca.SX]) -> list[ca.SX]:
    """A scalar, a sum, and a truth value with its sign changed."""
    a, b = given
    return [a, 2 * b - a, -(a > b)]


def in_numpy(a: np.ndarray, b: np.ndarray) -> list[float]:
    return [np.fmin.reduce(a), np.fmin.reduce(2 * b - a), -float((a > b).any())]


@COMPILER
@pytest.mark.parametrize("wide", [True, False])
@pytest.mark.parametrize("points", [1, 3, 4, 5, 8, 23])
def test_least_of_all_points(points: int, wide: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first scalar is the second row of one matrix, the other the last row of another; both matrices have a column more."""
    monkeypatch.setenv("POWERTRAIN_CACHE", str(tmp_path))
    if not wide:
        monkeypatch.setattr("powertrain.numerics.vectorised._wide", lambda: False)
    end = ROWS * points
    places = [(0, slice(1, end, ROWS)), (1, slice(ROWS - 1, end, ROWS))]
    written = least_of("powertrain_least", [(ROWS, points + 1)] * 2, places, numbers, (0.0, 0.0, 0.0))
    assert isinstance(written, InC) == (points >= 4)
    compiled = compile_functions({"least": written})["least"]
    rng = np.random.default_rng(points)
    for lowest in range(points):  # each point in turn, and one that is no number
        first, second = rng.normal(size=(2, ROWS, points + 1))
        first[1, lowest] = -10.0
        if points > 1:
            first[1, lowest - 1] = np.nan
        expected = in_numpy(first[1, :points], second[-1, :points])
        for function in (compiled, written.function if isinstance(written, InC) else written):
            np.testing.assert_array_equal(np.array(function(first, second)).ravel(), expected)


def test_no_points() -> None:
    function = least_of("powertrain_least", [(ROWS, 2)], [(0, slice(0, 0, ROWS))] * 2, numbers, (1.0, 2.0, 3.0))
    assert isinstance(function, ca.Function)
    np.testing.assert_array_equal(np.array(function(np.zeros((ROWS, 2)))).ravel(), [1.0, 2.0, 3.0])
