"""Modes and unknowns in turns, as at an event of a simulation: one solution of a group with too many combinations to try them all."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from powertrain.compiler.hybrid import Friction
from powertrain.modes.tolerances import ZONE
from powertrain.steadystate.choices import BACKWARD, FORWARD, FREE, STUCK
from powertrain.steadystate.lanes import Rows
from powertrain.steadystate.newton import SINGULAR
from powertrain.steadystate.points import Mask, Trials
from powertrain.steadystate.stage import Stage

_PASSES = 30
_SPEED = 10.0


def turns(stage: Stage, trials: Trials, side: Rows, options: Sequence[Sequence[float]]) -> Trials:
    """The first solution that is found from several beginnings, for those trials that have one."""
    found = [trials.some(np.zeros(0, np.intp))]
    for begin in _beginnings(stage, options):
        here = trials.some(np.arange(trials.point.size))
        here.values[stage.places] = np.array(begin)[:, None]
        settled = _settle(stage, here, side)
        here.alone = np.ones(settled.size, bool)
        found.append(here.some(settled))
        trials = trials.some(~settled)
        if not trials.point.size:
            break
    return Trials.joined(found)


def _beginnings(stage: Stage, options: Sequence[Sequence[float]]) -> Iterator[list[float]]:
    """Modes to begin with: the first of all, and all friction sliding."""
    yield [modes[0] for modes in options]
    for mode in (FORWARD, BACKWARD):
        yield [
            mode if isinstance(choice.law, Friction) and mode in modes else modes[0]
            for choice, modes in zip(stage.choices, options, strict=True)
        ]


def _settle(stage: Stage, trials: Trials, side: Rows) -> Mask:
    """Takes turns until no mode changes; where that is so, and unknowns were found."""
    settled, active = np.zeros(trials.point.size, bool), np.arange(trials.point.size)
    for _ in range(_PASSES):
        here, usable = trials.some(active), np.ones(active.size, bool)
        if stage.unknowns is not None:
            u, outcome, _ = stage.unknowns.solve(here.values, stage.unknowns.sides(here.values), _SPEED)
            usable = outcome <= SINGULAR
            here.loose = here.loose | (outcome == SINGULAR)
            here.values[stage.unknowns.places] = np.where(usable, u, here.values[stage.unknowns.places])
        modes = _next(stage, here, side)
        same = (modes == here.values[stage.places]).all(axis=0)
        here.values[stage.places] = modes
        trials.put(active, here)
        settled[active] = same & usable
        active = active[~same]
        if not active.size:
            break
    return settled


def _next(stage: Stage, trials: Trials, side: Rows) -> Rows:
    """The modes by the rules of the simulation, for all laws together. Notes the laws that rest under a prescribed motion."""
    table = stage.table.evaluate(trials.values)
    new = trials.values[stage.places]
    for i, (k, choice) in enumerate(zip(stage.group.laws, stage.choices, strict=True)):
        margins, values = stage.table.margins(table, i), np.array(choice.modes)
        place = (new[i][None, :] == values[:, None]).argmax(axis=0)
        fine = np.take_along_axis(margins, place[None, :], 0)[0] >= 0.0
        other = values[(margins >= 0.0).argmax(axis=0)]
        if choice.rest is not None:
            trials.rest[k] = ~(margins >= 0.0).any(axis=0) & (stage.table.rest(table, i) >= 0.0)
            other = np.where(trials.rest[k], side[k, trials.point], other)
        elif isinstance(choice.law, Friction):
            speed, breaks = stage.table.motion(table, i)
            sign = np.where(np.abs(speed) <= ZONE, STUCK, np.sign(np.nan_to_num(speed)))
            other = np.where(new[i] == STUCK, np.where(breaks != 0.0, breaks, sign), sign)
            if choice.law.algebraic:
                other = np.where(new[i] == STUCK, breaks, STUCK)
            if choice.law.may_free:
                other = np.where(margins[-1] >= 0.0, FREE, other)
        new[i] = np.where(fine, new[i], other)
    return new
