"""Errors fall with the tolerance, event times included."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import pytest
from core_models import ThreeClutches, row

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Constant, Sine

TOLERANCES = (1e-4, 1e-6, 1e-8)


def errors(
    plant: pt.Plant[Any], stop: float, names: list[str], method: Literal["dopri5", "rodas5p"]
) -> tuple[list[float], list[float]]:
    times = np.linspace(0, stop, 61)
    exact = plant.simulate(stop, times=times, rtol=1e-12, atol=1e-13, method="dopri5")
    when = np.array([e.time for e in exact.events])
    found: tuple[list[float], list[float]] = ([], [])
    for rtol in TOLERANCES:
        result = plant.simulate(stop, times=times, rtol=rtol, atol=rtol * 1e-2, method=method)
        assert [e.name for e in result.events] == [e.name for e in exact.events]
        found[0].append(max(float(np.abs(result.at(times, n) - exact.at(times, n)).max()) for n in names))
        found[1].append(float(np.abs(np.array([e.time for e in result.events]) - when).max(initial=0.0)))
    return found


@pytest.mark.parametrize("method", ["dopri5", "rodas5p"])
def test_clutches(method: Literal["dopri5", "rodas5p"]) -> None:
    size, when = errors(pt.compile(ThreeClutches()), 1.45, ["J1.w", "J2.w", "J3.w", "J4.w"], method)
    assert size[2] < size[0] / 10  # the steps of the coarse runs are bounded by the period of the torque
    assert size[2] < 1e-6
    assert when[2] < when[0] / 10
    assert when[2] < 1e-7


@pytest.mark.parametrize("method", ["dopri5", "rodas5p"])
def test_sprung_brake(method: Literal["dopri5", "rodas5p"]) -> None:
    model = row(
        rot.Torque(), rot.Inertia(J=1.0), rot.SpringDamper(c=200.0, d=0.5), rot.Inertia(J=0.5), rot.Brake(fn_max=20.0),
        Sine(amplitude=20.0, f=1.3), Constant(k=1.0), joints=(("5.y", "0.tau"), ("6.y", "4.f_normalized")),
    )  # fmt: skip
    size, when = errors(pt.compile(model), 2.0, ["parts[1].w", "parts[3].w"], method)
    assert size[2] < size[0] / 100
    assert when[2] < when[0] / 100
    assert size[2] < 1e-5
