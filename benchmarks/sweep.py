"""A second run with another parameter costs no compilation: 1,000 runs of CoupledClutches, and 1,000 fresh builds."""

from __future__ import annotations

import numpy as np

import powertrain as pt
from benchmarks.coupled_clutches import STOP, CoupledClutches
from benchmarks.timing import Row, duration, seconds
from powertrain.components.rotational import Inertia

NAME = "sweep"


def run(runs: int = 1000) -> list[Row]:
    """All rows of this benchmark; chunks of both sides take turns."""
    inertias = np.linspace(0.5, 2.0, runs).tolist()
    chunks = [inertias[i::10] for i in range(10)]
    once, fresh = 0.0, 0.0
    plant: pt.Plant[CoupledClutches] | None = None

    def reuse(values: list[float]) -> None:
        nonlocal plant
        plant = plant or pt.compile(CoupledClutches())
        for J in values:
            plant.simulate(STOP, parameters={"J4.J": J})["J1.w"]

    def rebuild(values: list[float]) -> None:
        for J in values:
            pt.compile(pt.replace(CoupledClutches(), J4=Inertia(J=J))).simulate(STOP)["J1.w"]

    for chunk in chunks:
        once += seconds(lambda chunk=chunk: reuse(chunk))  # type: ignore[misc]
        fresh += seconds(lambda chunk=chunk: rebuild(chunk))  # type: ignore[misc]
    return [
        Row(NAME, f"{runs} runs over a parameter, its one build included", duration(once)),
        Row(NAME, f"{runs} fresh builds, each run once", duration(fresh)),
        Row(NAME, "build once against build every time", f"{fresh / once:.3g} x faster"),
    ]
