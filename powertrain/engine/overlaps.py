"""Rejects starts and events that leave the sides of a contact in each other: no force could move them apart again."""

from __future__ import annotations

import casadi as ca

from powertrain.dae.hybrid import HybridDae
from powertrain.dae.tolerances import OVERLAP
from powertrain.errors import SimulationError
from powertrain.numerics.buffers import Evaluated, Memory


class Overlaps:
    """The gaps of all contacts, at a start and on both sides of an event."""

    def __init__(self, dae: HybridDae, memory: Memory) -> None:
        self._memory, self._contacts = memory, dae.contacts
        gaps = ca.vertcat(*[contact.gap for contact in dae.contacts])
        self._function = Evaluated(dae.function("gaps", gaps))
        self._before = list[float]()
        resets = [r.index for w in dae.whens for r in w.resets if not r.discrete]
        self.may_jump: bool = ca.depends_on(gaps, ca.vertcat(dae.m, *(dae.x[i] for i in resets)))
        """Whether a gap contains a held value, such as a signal that jumps, or a state that is reset."""

    def check_start(self, t: float, side: int) -> None:
        """Raise SimulationError if a gap is negative at a start."""
        for contact, gap in zip(self._contacts, self._gaps(t, side), strict=True):
            if gap < -OVERLAP:
                raise SimulationError(
                    f"the sides of {contact.name} ({contact.where}) overlap: the gap is {gap:.6g}, but may not be negative. Choose "
                    "other initial values."
                )

    def before(self, t: float, side: int) -> None:
        """Keep the left limit."""
        self._before = self._gaps(t, side)

    def check(self, t: float, side: int) -> None:
        """Raise SimulationError if a gap has become negative at this event."""
        for contact, before, now in zip(self._contacts, self._before, self._gaps(t, side), strict=True):
            if now < min(before, 0.0) - OVERLAP:
                raise SimulationError(
                    f"at t = {t:.9g} s a reset, or a signal that jumps, pushes the sides of {contact.name} "
                    f"({contact.where}) into each other: the gap changes from {before:.6g} to {now:.6g}, but may not be negative. "
                    "Choose another value, or let the signal change gradually."
                )

    def _gaps(self, t: float, side: int) -> list[float]:
        (gaps,) = self._function(*self._memory.values(t, self._memory.y[side], self._memory.m))
        return [float(gap) for gap in gaps.ravel()]
