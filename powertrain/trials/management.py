"""Energy management of hybrids over whole cycles: by their own rules, by dynamic programming and by ECMS, all in the full model.

A plan is made on maps: operating points (``pt.steady``) of the vehicle without driver and control (``pt.bench``) on a rolling road, with
the store held. The complete vehicle then replays it: the driver follows the cycle, and the plan sets engine switch and engine power.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, TypeVar, get_args

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

import powertrain as pt
from powertrain.components.cycles import DriveCycle
from powertrain.language.arguments import one_of
from powertrain.language.reals import Array
from powertrain.trials.charge import charge_corrected
from powertrain.trials.cycle import drive_cycle, on_cycle
from powertrain.trials.cycle_run import RATE, CycleRun
from powertrain.trials.standing import ON

C = TypeVar("C", bound=pt.Component)
Method = Literal["dynamic programming", "ECMS"]
_DEAR = 3.0
"""Price of a store that ends below the required state, relative to the worth of its content."""


@dataclass(frozen=True)
class Management:
    """The energy management of a vehicle over a cycle; made by ``power_split_management`` or ``flywheel_management``.

    ``vehicle`` follows its own rules; in ``planned`` the engine follows ``inputs(mode, control)``. ``stages`` have the fuel flow
    [kg/s] as cost and the rate of the store's state. ``store`` is the signal of that state, ``start`` its initial value, ``worth`` the fuel
    [kg] equivalent to a unit of it, ``gained`` the energy [J] between two states. ``dwell``: see ``pt.ecms``.
    """

    vehicle: pt.Component
    planned: pt.Component
    cycle: DriveCycle
    stages: pt.Stages
    start: float
    worth: float
    gained: Callable[[float, float], float]
    inputs: Callable[[int, int], dict[str, float]]
    store: str | Callable[[Any], Any]
    dwell: float = 10.0

    def plan(self, method: Method = "dynamic programming") -> pt.Schedule:
        """The schedule that ends with the charge of the start. Errors: ParameterError for an unknown method."""
        one_of("method", method, get_args(Method))
        if method == "ECMS":
            return pt.ecms(self.stages, start=self.start, end=self.start, dwell=self.dwell)
        return pt.dynamic_programming(self.stages, start=self.start, end=self.start, price=_DEAR * self.worth)

    def replay(self, schedule: pt.Schedule) -> CycleRun:
        """The complete vehicle on the cycle; a schedule's policy decides about the engine, from the actual state of the store."""
        plant, mode, times = self._planned, 0, self.cycle.times
        run = plant.start(float(times[0]))
        for k, h in enumerate(np.diff(times)):
            mode, control = schedule.policy.decide(k, run[self.store], mode)
            run.step(float(h), **self.inputs(mode, control))
        points = round(self.cycle.duration * RATE) + 1
        return CycleRun(self.cycle, plant, run.result(np.linspace(times[0], times[-1], points)), {})

    def compare(self) -> MethodComparison:
        """Compare the rules with dynamic programming and ECMS on equal terms."""
        rules = drive_cycle(self.vehicle, self.cycle)
        runs, schedules, rows = {"rules": rules}, {}, {"rules": _row(rules, rules, math.nan)}
        for method in get_args(Method):
            schedules[method] = self.plan(method)
            runs[method] = self.replay(schedules[method])
            rows[method] = _row(runs[method], rules, self._planned_consumption(schedules[method], runs[method]))
        return MethodComparison(runs, schedules, pd.DataFrame.from_dict(rows, orient="index"))

    def _planned_consumption(self, schedule: pt.Schedule, run: CycleRun) -> float:
        """Consumption [l/100 km] of a schedule, corrected like its replay."""
        heat = schedule.cost * run.heat / run.fuel
        gained = self.gained(float(schedule.states[0]), float(schedule.states[-1]))
        return run.litres_per_100km * (heat - gained / run.marginal_efficiency) / run.heat

    @cached_property
    def _planned(self) -> pt.Plant[Any]:
        return pt.compile(on_cycle(self.planned, self.cycle))


@dataclass(frozen=True)
class MethodComparison:
    """Results of the rules and of both plans, all simulated with the complete vehicle.

    ``runs`` and ``schedules`` by "rules", "dynamic programming" and "ECMS". ``table``: one row for each, with the consumption corrected to
    equal charge, ``planned`` and ``simulated`` [l/100 km]; their difference ``gap`` [%]; the fuel ``saved`` compared with the rules [%];
    the ``starts`` of the engine; ``outside``, the time outside the speed tolerance [s].
    """

    runs: dict[str, CycleRun]
    schedules: dict[str, pt.Schedule]
    table: pd.DataFrame

    def __str__(self) -> str:
        return self.table.to_string(float_format="%.3f", na_rep="")


def _row(run: CycleRun, rules: CycleRun, planned: float) -> dict[str, float]:
    simulated = charge_corrected(run)
    on = run.result[f"{run.anatomy.the_engine()}.on"] > ON
    return {
        "planned": planned,
        "simulated": simulated,
        "gap": 100 * (simulated / planned - 1),
        "saved": 100 * (1 - simulated / charge_corrected(rules)),
        "starts": int((np.diff(on.astype(int)) > 0).sum()),
        "outside": run.time_outside,
    }


def with_parameters_of(control: pt.Component, planned: C, kind: type[pt.Component]) -> C:
    """The planned control, with the parameters that both inherit from their partial class."""
    shared = [n for n, spec in kind._fields.items() if isinstance(spec, pt.Parameter)]
    return pt.replace(planned, {n: float(getattr(control, n)) for n in shared})


def along_cycle(
    speeds: Array, off: xr.Dataset, on: xr.Dataset, names: Sequence[str], dims: Sequence[str], v: Array, force: Array
) -> NDArray[np.float64]:
    """Cost and rate in every row of a cycle, of shape (2, rows, 2, controls, stores), from maps with the engine off and on.

    ``names``: of force, cost and rate in the maps; ``dims``: their dimensions (speed, level, control, store), ``off`` without control.
    """
    found = np.full((2, v.size, 2, *(on.sizes[name] for name in dims[2:])), np.nan)
    for mode, one in enumerate((off.expand_dims({dims[2]: 1}), on)):
        pushed, *tables = (one[name].transpose(*dims).values for name in names)
        found[:, :, mode, : pushed.shape[2]] = looked_up(speeds, pushed, tables, v, force)
    return found


def looked_up(
    speeds: Array, pushed: NDArray[np.float64], tables: Sequence[NDArray[np.float64]], v: Array, force: Array
) -> list[NDArray[np.float64]]:
    """Tables over (speed, level, ...) at speeds ``v``, at the level that gives ``force``: of shape (rows, ...).

    ``pushed`` is the force [N] at every point. Below the smallest force the brakes supply the rest, and the values are those at the
    smallest force; above the largest force they are nan.
    """
    found = [np.empty((v.size, *pushed.shape[2:])) for _ in tables]
    for k in range(v.size):
        i = int(np.clip(speeds.searchsorted(v[k]) - 1, 0, speeds.size - 2))
        part = np.clip((v[k] - speeds[i]) / (speeds[i + 1] - speeds[i]), 0, 1)
        here, *others = ((1 - part) * table[i] + part * table[i + 1] for table in (pushed, *tables))
        for place in np.ndindex(*here.shape[1:]):
            column = (slice(None), *place)
            for values, given in zip(found, others, strict=True):
                values[(k, *place)] = np.interp(force[k], here[column], given[column], right=np.nan)
    return found
