"""Which modes count as other solutions: those with another torque in any law."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from powertrain.modes.uniqueness import others


@pytest.mark.parametrize(
    ("one", "other", "several"),
    [
        ([5.0, 1.0], [5.0, 2.0], True),
        ([5.0, 1.0], [5.0, 1.0 + 1e-4], True),
        ([5.0, 1.0], [5.0, 1.0 + 1e-7], False),
        ([5.0, 1.0], [np.nan, 2.0], False),
        ([1e6, -3e-5], [1e6, 3e-5], False),  # round-off of a torque of 1e6 N.m
        ([1e6, -3e1], [1e6, 3e1], True),
    ],
)
def test_torques_of_the_other_side_of_a_mesh(one: list[float], other: list[float], several: bool) -> None:
    torques = {0.0: np.array(one), 1.0: np.array(other)}
    m = np.array([0.0, 3.0])
    fake: Any = SimpleNamespace(m=m, frictions=lambda _: SimpleNamespace(torque=torques[float(m[0])]))
    found = others(fake, [0], 0, lambda: True)
    assert [list(modes) for modes in found] == ([[1.0, 3.0]] if several else [])
    assert m.tolist() == [0.0, 3.0]
    assert others(fake, [0], 0, lambda: False) == []
