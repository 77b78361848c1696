"""Refuses jumps of what something with inertia follows exactly: their impulses would be lost without a word."""

from __future__ import annotations

import casadi as ca
import numpy as np

from powertrain.compiler.hybrid import HybridDae
from powertrain.errors import SimulationError
from powertrain.language.symbols import key
from powertrain.numerics.buffers import Array, Evaluated, Memory

_SAME = 1e-7
"""Changes below this share are the rounding of the instants at which signals turn."""


class Continuity:
    """Compares the variables that must not jump on both sides of an event."""

    def __init__(self, dae: HybridDae, memory: Memory) -> None:
        self.dae, self.memory = dae, memory
        values = ca.densify(ca.vertcat(*[s.value for s in dae.smooth]))
        self._function = Evaluated(ca.Function("powertrain_smooth", [dae.t, dae.x, dae.z, dae.m, dae.p], [values]))

    def before(self, side: int) -> tuple[Array, Array]:
        """What is kept of the left limit."""
        return self.memory.m.copy(), self.memory.y[side].copy()

    def check(self, kept: tuple[Array, Array], side: int, reset: bool) -> None:
        """SimulationError where held values made a variable jump; after a ``reset``, which may, its effect is left out."""
        m, y = self.memory.m.copy(), self.memory.y[side].copy()
        if np.array_equal(m, kept[0]):
            return
        left, right = self._values(kept[0], y if reset else kept[1]), self._values(m, y)
        jumps = np.flatnonzero(np.abs(right - left) > _SAME * (1.0 + np.abs(left) + np.abs(right)))
        if jumps.size:
            raise SimulationError(self._message(int(jumps[0]), left, right, np.flatnonzero(m != kept[0]).tolist()))

    def _values(self, m: Array, y: Array) -> Array:
        dae, memory, n = self.dae, self.memory, self.dae.x.numel()
        arguments = (memory.time[0], y[:n], y[n : n + dae.z.numel()], m[: dae.m.numel()], memory.p[: dae.p.numel()])
        return self._function(*arguments)[0].ravel()

    def _message(self, k: int, left: Array, right: Array, changed: list[int]) -> str:
        smooth, dae = self.dae.smooth[k], self.dae
        inside = {key(s) for s in ca.symvar(smooth.value)}
        names = {s.index + i: s.name for s in dae.schedules for i in range(3)}
        names |= {s.index: s.where for s in dae.switches} | {w.index: w.where for w in dae.whens}
        places = [i for i in changed if key(dae.m[i]) in inside]
        causes = list(dict.fromkeys(names.get(i, dae.m[i].name()) for i in places))
        said = " and ".join(causes[:3]) or "an event"
        return (
            f"at t = {self.memory.time[0]:.9g} s {said} makes {smooth.names} jump by {right[k] - left[k]:.6g} {smooth.unit}, "
            f"from {left[k]:.6g} to {right[k]:.6g} {smooth.unit}. Something with inertia (or a derivative) follows it exactly, which takes "
            "an infinite torque or force: let the signal change gradually, or use a source that is not exact."
        )
