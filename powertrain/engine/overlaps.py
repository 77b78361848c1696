"""Rejects events that push the sides of a contact into each other: no force could move them apart again."""

from __future__ import annotations

import casadi as ca
import numpy as np

from powertrain.dae.hybrid import Contact, HybridDae
from powertrain.dae.tolerances import OVERLAP
from powertrain.errors import SimulationError
from powertrain.numerics.buffers import Array, Evaluated, Memory


def jumping_gaps(dae: HybridDae) -> list[Contact]:
    """The contacts whose gap may jump: by a held value in it (a signal that jumps), or by a reset."""
    resets = [r.index for w in dae.whens for r in w.resets if not r.discrete]
    jumping = ca.vertcat(dae.m, *(dae.x[i] for i in resets))
    return [contact for contact in dae.contacts if ca.depends_on(contact.gap, jumping)]


class Overlaps:
    """Compares the gaps on both sides of an event."""

    def __init__(self, dae: HybridDae, memory: Memory, contacts: list[Contact]) -> None:
        self._memory, self._contacts = memory, contacts
        gaps = ca.densify(ca.vertcat(*[contact.gap for contact in contacts]))
        self._function = Evaluated(ca.Function("powertrain_gaps", [dae.t, dae.x, dae.z, dae.m, dae.p], [gaps]))
        self._before = np.zeros(len(contacts))

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

    def _gaps(self, t: float, side: int) -> Array:
        (gaps,) = self._function(t, *self._memory.instant(side)[1:])
        return gaps.ravel()
