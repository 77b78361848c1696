"""Variables that must not jump, because something with inertia follows them: relative states keep them, or the run ends.

An impulse would otherwise be lost in silence.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from powertrain.dae.hybrid import HybridDae
from powertrain.dae.tolerances import JUMP
from powertrain.errors import SimulationError
from powertrain.language.reals import Array
from powertrain.language.symbols import key
from powertrain.language.units import with_unit
from powertrain.numerics.buffers import Evaluated, Memory


class Continuity:
    """Keeps and compares the variables that must not jump on both sides of an event."""

    def __init__(self, dae: HybridDae, memory: Memory) -> None:
        self.dae, self.memory = dae, memory
        self._y, self._m = np.zeros_like(memory.y[0]), np.zeros_like(memory.m)
        values = ca.densify(ca.vertcat(*[s.value for s in dae.smooth]))
        self._function = Evaluated(dae.function("smooth", values))
        self._jacobian = Evaluated(dae.function("relative", ca.jacobian(values, dae.x)[:, list(dae.relative)]))

    def before(self, side: int) -> None:
        """Keep the left limit."""
        self._m[:], self._y[:] = self.memory.m, self.memory.y[side]

    def carry(self, side: int) -> bool:
        """Give relative states the values with which no variable jumps that must not; False if none changes or that is impossible.

        S(x + d, m) = S(x, m before),  d = 0 except for relative states

        A speed against a source jumps with the source, so that what has inertia keeps its own speed.
        """
        memory, places = self.memory, list(self.dae.relative)
        if not places or self._m.tobytes() == memory.m.tobytes():
            return False
        y = memory.y[side]
        wanted, reached = self._values(self._m, y), self._values(memory.m, y)
        slopes = self._at(self._jacobian, memory.m, y)
        change = np.linalg.lstsq(slopes, wanted - reached, rcond=None)[0]
        moved = y.copy()
        moved[places] += change
        excess = np.abs(self._values(memory.m, moved) - wanted) - JUMP * (1 + np.abs(wanted))
        if (excess > 0).any():
            return False
        self._m[:] = memory.m
        if (np.abs(change) <= JUMP * (1 + np.abs(y[places]))).all():
            return False
        y[:] = moved
        return True

    def check(self, side: int, reset: bool) -> None:
        """Raise SimulationError if held values made a variable jump.

        Changes of states are no such jumps: what has come to rest loses the drift of its speed, and a ``reset`` may also change the
        unknowns that follow from states.
        """
        memory, states = self.memory, None if reset else self.dae.x.numel()
        if self._m.tobytes() == memory.m.tobytes():
            return
        self._y[:states] = memory.y[side][:states]
        left, right = self._values(self._m, self._y), self._values(memory.m, memory.y[side])
        excess = np.abs(right - left) - JUMP * (1 + np.abs(left) + np.abs(right))
        if (excess > 0).any():
            raise SimulationError(self._message(left, right, int(np.argmax(excess))))

    def _message(self, left: Array, right: Array, k: int) -> str:
        changed = np.flatnonzero(self.memory.m != self._m).tolist()
        smooth, dae = self.dae.smooth[k], self.dae
        inside = {key(s) for s in ca.symvar(smooth.value)}
        names = {s.index + i: s.name for s in dae.schedules for i in range(3)}
        names |= {s.index: s.where for s in dae.switches} | {w.index: w.where for w in dae.whens}
        places = [i for i in changed if key(dae.m[i]) in inside]
        causes = list(dict.fromkeys(names.get(i, dae.m[i].name()) for i in places))
        said = " and ".join(causes[:3]) or "an event"
        return (
            f"at t = {self.memory.time[0]:.9g} s {said} makes {smooth.names} jump by "
            f"{with_unit(f'{right[k] - left[k]:.6g}', smooth.unit)}, from {left[k]:.6g} to "
            f"{with_unit(f'{right[k]:.6g}', smooth.unit)}. Something with inertia (or a derivative) follows it exactly, which takes "
            "an infinite torque or force: let the signal change gradually, or use a source that is not exact."
        )

    def _values(self, m: Array, y: Array) -> Array:
        return self._at(self._function, m, y).ravel()

    def _at(self, function: Evaluated, m: Array, y: Array) -> Array:
        return function(*self.memory.values(self.memory.time[0], y, m))[0]
