"""Notes on a start: variables and torques that are not unique, tables that lack the values of the run, and time in coarse steps."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import casadi as ca
import numpy as np

from powertrain.compiler.assemble import Compiled
from powertrain.dae.hybrid import HybridDae, OperatingPoint
from powertrain.dae.switch import timed
from powertrain.dae.tolerances import MISSED, NOW
from powertrain.initialization.choice import Choice
from powertrain.initialization.conditions import DECLARED, StartEquation
from powertrain.initialization.outdated import listed, outdated
from powertrain.initialization.start_rows import StartRows
from powertrain.language.reals import Array
from powertrain.language.units import with_unit
from powertrain.modes.complementarity import Laws
from powertrain.modes.resting import SINGULAR

_SLIGHT = 1e-9
"""Change per unit of a start below which it is round-off."""
_COARSE = 1e-6
"""Resolution of time (s) from which a start is noted, far below the sampling periods and pulses of drivelines."""


class StartNotes:
    """The notes on starts from one set of conditions."""

    def __init__(self, compiled: Compiled, rows: StartRows, conditions: Sequence[StartEquation]) -> None:
        self.compiled, self.rows, self.conditions = compiled, rows, conditions
        self.zeros = np.array([c.source == DECLARED and c.value == 0.0 for c in conditions], bool)

    def at(self, point: OperatingPoint, choice: Choice) -> tuple[str, ...]:
        """The notes on the start at a point, found with these conditions."""
        return (
            *self._not_unique(point, choice),
            *self._tied(point),
            *outdated(self.compiled, dict(zip(self.compiled.parameters, point.p.tolist(), strict=True))),
            *_coarse_time(self.compiled.dae, point.t),
        )

    def _not_unique(self, point: OperatingPoint, choice: Choice) -> tuple[str, ...]:
        """A note on variables that do not start at zero, although nobody asked for another value, because others do.

        Every variable starts at zero unless a start is given or declared. Where equations forbid that for all of them, some keep their
        zeros, and the others follow. If one that follows depends on one that is kept, it might as well be the other way round: with an
        engine that starts at 100 rad/s and a differential, one wheel stands and the other turns at 200 rad/s. Where a driveline is turned
        as a whole, that changes nothing of its motion.
        """
        nz, y = self.rows.implicit, np.concatenate([point.x, point.z])
        reached, nonzeros = (np.array(each).ravel() for each in self.rows.function(point.t, y, point.m, point.p))
        left = choice.left[self.zeros[choice.left]]
        missed = left[np.abs(reached[nz + left]) > MISSED]
        kept = np.flatnonzero(np.isin(choice.chosen - nz, np.flatnonzero(self.zeros)))
        if not len(missed) or not len(kept):
            return ()
        solve, slopes = choice.factors(nonzeros[None]), self.rows.slopes(nz + missed, nonzeros)

        def moved(starts: Array) -> Array:
            """The changes of all unknowns with the starts that are kept: one column per set of changes."""
            right, found = np.zeros((1, len(choice.owned), starts.shape[1])), np.zeros((len(y), starts.shape[1]))
            right[0, kept] = starts
            found[choice.owned] = solve(right)[0]
            return found

        if not (np.abs(slopes @ moved(np.linspace(1.0, 2.0, len(kept))[:, None])) > _SLIGHT).any():
            return ()  # equal changes might cancel
        each = moved(np.eye(len(kept)))
        rates = np.array(self._rates(point.t, y, point.m, point.p) @ each)
        follows, moves = np.abs(slopes @ each) > _SLIGHT, np.abs(rates) > _SLIGHT
        decides = follows.any(axis=0) & moves.any(axis=0)
        rivals = [self.conditions[i].label for i in choice.chosen[kept[decides]] - nz]
        following = [self.conditions[i] for i in missed[follows @ decides]]
        if not following:
            return ()
        values = reached[nz + missed[follows @ decides]].tolist()
        said = [f"{c.label} = {with_unit(f'{value:.6g}', c.unit)}" for c, value in zip(following, values, strict=True)]
        return (
            f"the start is not unique: {listed(said)} only because {listed(rivals)} {'starts' if len(rivals) == 1 else 'start'} at 0 "
            "by default; give one of them in starts",
        )

    @cached_property
    def _rates(self) -> ca.Function:
        """The slopes of the rates: (t, y, m, p) -> matrix."""
        dae = self.compiled.dae
        y = ca.vertcat(dae.x, dae.z)
        return ca.Function("powertrain_start_rates", [dae.t, y, dae.m, dae.p], [ca.jacobian(dae.xdot, y)])

    def _tied(self, point: OperatingPoint) -> tuple[str, ...]:
        """A note on each friction law between parts that others tie to each other, as a clutch between two axles that roll on one road.

        Its torque acts on no motion (G_ii = 0, see ``powertrain.modes.complementarity``); its compliance makes it zero.
        """
        dae = self.compiled.dae
        if dae.opened is None:
            return ()
        near = self._laws.at(point, np.zeros(self._laws.count))
        still = np.abs(np.diag(near.rate_slope)) <= SINGULAR * near.reach
        return tuple(
            f"{law.name} ({law.where}): other parts tie what it connects, so nothing determines its torque while it is stuck: "
            "it may lie anywhere between its limits"
            for law, moves_nothing in zip(dae.frictions, still.tolist(), strict=False)
            if moves_nothing and not law.prescribed
        )

    @cached_property
    def _laws(self) -> Laws:
        return Laws(self.compiled.dae)


def _coarse_time(dae: HybridDae, t: float) -> tuple[str, ...]:
    """A note where a start is so late that short pulses are lost, such as at a time since 1970; none without signals of time."""
    resolution = NOW * abs(t)
    if resolution < _COARSE or not (dae.schedules or timed(dae)[1]):
        return ()
    return (
        f"at t = {t:.9g} s, events of time signals within {resolution:.2g} s count as one, so shorter pulses are lost; count time "
        "from the start of the run",
    )
