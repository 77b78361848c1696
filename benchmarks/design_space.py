"""The search of split-path transmissions: candidates a minute over all common structures, with the duty and limits of a tractor."""

from __future__ import annotations

import time

import numpy as np

from benchmarks.timing import Row, duration
from powertrain.components.transmissions import UnitLoss
from powertrain.design import COMMON, Duty, Variator, split_path_space

NAME = "design space"
GOAL = 1e5
"""Candidates a minute on two cores, each rated over 15 points of a duty and 17 of every range."""
ROUNDS = 3


def run(candidates: int = 512) -> list[Row]:
    """All rows of this benchmark."""
    r = np.linspace(0.1, 1.5, 15)
    columns = {"r": r, "weight": np.ones(15), "torque": 300 / np.maximum(r, 0.3), "speed": np.full(15, 200.0)}
    duty, unit = Duty.over((0.1, 1.5), columns), Variator("electric", UnitLoss(0.85, 0.85), speed=800.0)
    split_path_space(duty, [unit], COMMON[:1], candidates=16, rounds=1, progress=False)
    clock, processor = time.perf_counter(), time.process_time()
    found = split_path_space(duty, [unit], candidates=candidates, rounds=ROUNDS, progress=False)
    clock, processor = time.perf_counter() - clock, time.process_time() - processor
    count = candidates * ROUNDS * len(COMMON)
    a_minute = 2 * 60 * count / processor
    begin = time.perf_counter()
    front = len(found.pareto)
    return [
        Row(
            NAME,
            f"{count} candidates of {len(COMMON)} structures",
            f"{duration(clock)}, {duration(processor)} of processor time",
        ),
        Row(
            NAME,
            "candidates in two minutes of processor time: one minute of two cores",
            f"{a_minute:.3g}",
            f">= {GOAL:.0e}",
            a_minute >= GOAL,
        ),
        Row(NAME, f"extrema of the fronts, {front} designs on the front of all", duration(time.perf_counter() - begin)),
    ]
