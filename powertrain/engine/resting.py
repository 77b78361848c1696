"""Laws that slide in name only: without speed from one event to the next, since other laws that are stuck hold them.

Their torque is a limit of theirs, one of many with which nothing would move otherwise, as where two pairs of clutches hold the same shafts.
"""

from __future__ import annotations

import casadi as ca

from powertrain.compiler.hybrid import HybridDae
from powertrain.engine.buffers import Bound, Memory, view, zeros
from powertrain.engine.jam import held_note, law_values
from powertrain.engine.modes import ZONE
from powertrain.engine.redundancy import Redundancy
from powertrain.engine.steps import PREFIX

_WHILE = 1e-6
"""In this time [s] a law that has just broken loose has left the zone of zero speed."""
_WAY = 1e-8
"""A law whose acceleration gives it this speed [rad/s or m/s] between events has moved, although it may be back at rest."""


class Resting:
    """Looks for laws that slide without speed after modes were found, and before they are sought again; notes those that still do."""

    def __init__(self, dae: HybridDae, memory: Memory, redundancy: Redundancy) -> None:
        self._rows = [k for k, law in enumerate(dae.frictions) if not (law.algebraic or law.prescribed)]
        self._laws = [dae.frictions[k] for k in self._rows]
        self._dae, self._memory, self._redundancy = dae, memory, redundancy
        self._places, speeds = [law.index for law in self._laws], zeros(len(self._laws))
        self._time, self._m, self._w = view(memory.time), view(memory.m), view(speeds)
        n, time, y = dae.x.numel(), ca.SX.sym("time", 2), ca.SX.sym("y", dae.x.numel() + dae.z.numel())
        inner = ca.Function(
            PREFIX + "rest", [dae.t, dae.x, dae.z, dae.m, dae.p], [ca.vertcat(*(law.w for law in self._laws))]
        )
        found = inner.call([time[0], y[:n], y[n:], dae.m, dae.p])
        function = ca.Function(PREFIX + "resting", [time, y, dae.m, dae.p], [ca.densify(w) for w in found])
        self._bound = [Bound(function, [memory.time, y, memory.m, memory.p], [speeds]) for y in memory.y]
        self.forget()

    def forget(self) -> None:
        """Begin a run."""
        self._since: float = 0.0
        self._found: list[int] = []

    def look(self, side: int) -> None:
        """Keep which laws slide without speed now."""
        if self._laws:
            self._since, self._found = self._time[0], self._without_speed(side)

    def look_back(self, side: int) -> None:
        """Note which of them have not moved."""
        passed = self._time[0] - self._since
        if passed <= _WHILE or not self._found:
            return
        new = [k for k in self._found if not self._redundancy.noted([self._laws[k]])]
        still = set(self._without_speed(side)).intersection(new) if new else set()
        if still:
            rates = law_values(self._dae, self._memory, side)[:, 4].tolist()
            for k in sorted(still):
                if abs(rates[self._rows[k]]) * passed < _WAY:
                    self._redundancy.add([self._laws[k]], held_note(self._laws[k], self._since))

    def _without_speed(self, side: int) -> list[int]:
        self._bound[side].call()
        m, w = self._m, self._w
        return [k for k, place in enumerate(self._places) if -ZONE <= w[k] <= ZONE and abs(m[place]) == 1.0]
