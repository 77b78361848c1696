"""When an indicator that falls through zero counts as only touching it, against the parabola through its last step."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from powertrain.dae.tolerances import EPS
from powertrain.variational.instants import grazing

LAW: Any = SimpleNamespace(name="law", where="here")


def grazes(slope: float, fallen: float, h: float) -> bool:
    return grazing(LAW, 1.0, slope, fallen, h) is not None


@pytest.mark.parametrize("h", [0.1, 2.0])
@pytest.mark.parametrize(("share", "grazing"), [(0.9, True), (1.1, False)])
def test_how_deep_it_would_fall(h: float, share: float, grazing: bool) -> None:
    """slope t + k t^2 falls to its least value at t > 0, found on a fine grid; it counts from 100 times the hysteresis on."""
    fallen = 1e-4
    slopes = -np.geomspace(1e-9, 1e-3, 4001) * fallen**0.5 / h
    bends = (fallen + slopes * h) / h**2
    times = np.linspace(0.0, 1.0, 2001) * h
    depths = np.array([-(s * times + k * times**2).min() for s, k in zip(slopes, bends, strict=True)])
    slope = float(slopes[np.searchsorted(depths, share * 100 * EPS)])
    assert grazes(slope, fallen, h) == grazing


def test_a_share_of_the_mean_slope() -> None:
    """An indicator that falls by 1 in 1 s and arrives with less than 1e-3 1/s, or rising, grazes however deep it would fall."""
    assert grazes(-0.9e-3, 1.0, 1.0)
    assert not grazes(-1.1e-3, 1.0, 1.0)
    assert grazes(1.0, 1.0, 1.0)


def test_one_that_falls_ever_faster_does_not_graze() -> None:
    assert not grazes(-3.0, 1.0, 1.0)
