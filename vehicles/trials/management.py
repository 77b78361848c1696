"""Energy management of hybrids over whole cycles: by their own rules, by dynamic programming and by ECMS, all in the full model.

A plan is made on maps: the vehicle without driver and control (``pt.bench``) on a rolling road, at operating points (``pt.steady``) whose
store is held. It is then replayed by the complete vehicle, whose driver follows the cycle while engine switch and engine power are those
of the plan.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

import powertrain as pt
from powertrain.components.cycles import DriveCycle
from powertrain.vehicles.trials.anatomy import anatomy
from powertrain.vehicles.trials.charge import charge_corrected
from powertrain.vehicles.trials.cycle import CycleRun, drive_cycle, on_cycle

Array = NDArray[np.float64]
Method = Literal["dynamic programming", "ECMS"]
_DEAR = 3.0
"""Price of a store that ends short, over what its content is worth."""


@dataclass(frozen=True)
class Task:
    """The energy management of a vehicle over a cycle; see ``power_split`` and ``flywheel``, which make one.

    ``vehicle`` follows its own rules, ``planned`` is the same with an engine that does as ``inputs(schedule)`` say. ``stages`` have the
    fuel flow [kg/s] as cost and the rate of the store's state; ``start`` is the state at the start, ``worth`` the fuel [kg] that a unit of
    it is worth, ``gained`` the energy [J] between two states.
    """

    vehicle: pt.Component
    planned: pt.Component
    cycle: DriveCycle
    stages: pt.Stages
    start: float
    worth: float
    gained: Callable[[float, float], float]
    inputs: Callable[[pt.Schedule], dict[str, tuple[Array, Array]]]

    def plan(self, method: Method = "dynamic programming") -> pt.Schedule:
        """The schedule that ends with the charge of the start."""
        if method == "ECMS":
            return pt.ecms(self.stages, start=self.start, end=self.start)
        return pt.dynamic_programming(self.stages, start=self.start, end=self.start, price=_DEAR * self.worth)

    def replay(self, schedule: pt.Schedule, **options: Any) -> CycleRun:
        """The complete vehicle over the cycle with the engine of a schedule; ``options`` as for ``pt.simulate``."""
        return drive_cycle(self._planned, inputs=self.inputs(schedule), **options)

    @cached_property
    def _planned(self) -> pt.Plant[Any]:
        return pt.compile(on_cycle(self.planned, self.cycle))


def compare(task: Task) -> pd.DataFrame:
    """Consumption of the rules and of both plans, all simulated with the complete vehicle and corrected to equal charge.

    Returns
    -------
    DataFrame
        One row for the rules and each plan: ``planned`` and ``simulated`` [l/100 km], corrected to equal charge; ``gap`` between both [%];
        ``saved`` against the rules [%]; ``starts`` of the engine; ``outside``: time outside the speed tolerance [s].
    """
    rules = drive_cycle(task.vehicle, task.cycle)
    rows = {"rules": _row(rules, charge_corrected(rules), np.nan, rules)}
    for method in ("dynamic programming", "ECMS"):
        schedule = task.plan(method)
        run = task.replay(schedule)
        rows[method] = _row(run, charge_corrected(run), _planned_consumption(task, schedule, run), rules)
    return pd.DataFrame.from_dict(rows, orient="index")


def _planned_consumption(task: Task, schedule: pt.Schedule, run: CycleRun) -> float:
    """Consumption [l/100 km] of a schedule, corrected as that of its replay."""
    heat = schedule.cost * run.heat / run.fuel
    gained = task.gained(float(schedule.states[0]), float(schedule.states[-1]))
    return run.litres_per_100km * (heat - gained / run.marginal_efficiency) / run.heat


def _row(run: CycleRun, simulated: float, planned: float, rules: CycleRun) -> dict[str, float]:
    return {
        "planned": planned,
        "simulated": simulated,
        "gap": 100 * (simulated / planned - 1),
        "saved": 100 * (1 - simulated / charge_corrected(rules)),
        "starts": _starts(run),
        "outside": run.time_outside,
    }


def _starts(run: CycleRun) -> int:
    on = run.result[f"{anatomy(run.plant.model).the_engine()}.on"] > 0.5
    return int((np.diff(on.astype(int)) > 0).sum())


def steps(times: Array, values: Array) -> tuple[Array, Array]:
    """A signal that keeps a value from every time to the next, for ``inputs``."""
    return times.repeat(2)[1:-1], values.repeat(2)
