"""Consistent modes that are still rejected.

They are motion against an unlimited torque, rest where nothing determines the torque, and limits of a torque in the wrong order.
"""

from __future__ import annotations

from functools import cached_property
from typing import NoReturn

import casadi as ca

from powertrain.dae.friction import gives_way, rest_margin, undetermined
from powertrain.dae.hybrid import Friction, HybridDae
from powertrain.dae.tolerances import INTEGRATED, NO_WIDTH, ZONE
from powertrain.errors import SimulationError
from powertrain.modes.jam import SPEEDS, resting_note
from powertrain.modes.selflocking import SelfLocking
from powertrain.numerics.buffers import Evaluated, Memory


class Admissible:
    """Checks modes that have been found.

    A stuck friction law whose torque cannot move it may carry any torque between its bounds; no loss or energy depends on it. If its speed
    may change (a pause in a cycle), the smallest torque is used and a note says so. If its speed is constant, or if the torque affects
    other parts (through a sensor), the law is rejected.
    """

    def __init__(self, dae: HybridDae, memory: Memory, notes: list[str]) -> None:
        self.dae, self.memory, self.notes = dae, memory, notes
        self._noted: dict[int, str] = {}
        self._self_locking = SelfLocking(dae, memory)
        self._one_way = [(k, law, mode) for k, law in enumerate(dae.frictions) for mode in law.limitless]
        self.yielding = [law for law in dae.frictions if gives_way(law)]
        self._prescribed = [(k, law, undetermined(dae, law)) for k, law in enumerate(dae.frictions) if law.prescribed]

    @property
    def checks(self) -> bool:
        """Whether there are laws to check at every event."""
        return bool(self._one_way or self._prescribed)

    def check(self, side: int) -> None:
        """Reject inadmissible modes; note torques that are not unique."""
        self._self_locking.check(side)
        held = self.memory.m
        for k, law, mode in self._one_way:
            if held[law.index] == mode:
                self._refuse(law, mode, self.memory.frictions(side).w[k])
        for k, law, refused in self._prescribed:
            if held[law.index] == 0:
                self._rests(k, law, refused, side)

    def check_rest(self, side: int) -> None:
        """Reject a motion of stuck laws that only their compliance allows, at the end of a step."""
        if not self.yielding:
            return
        (found,) = self._rest(*self.memory.instant(side))
        for law, (margin, speed) in zip(self.yielding, found.tolist(), strict=True):
            if margin <= 0 and law.limitless:
                self._refuse(law, speed, speed)
            if margin <= 0:
                raise SimulationError(
                    f"at t = {self.memory.time[0]:.9g} s the torque of {law.name} ({law.where}) is not accurate: a part on which it "
                    "acts is lighter by a factor of about 1e6 than what is held through it, and other laws may hold the same motion. "
                    "Give that part a larger inertia or mass, or leave out one of the laws."
                )

    @cached_property
    def _rest(self) -> Evaluated:
        rows = ca.vertcat(*[ca.horzcat(rest_margin(self.dae, law), law.w) for law in self.yielding])
        return Evaluated(self.dae.function("rest_margins", rows))

    def check_speeds(self, side: int) -> None:
        """Reject speeds that no mode allows."""
        speeds = self.memory.frictions(side).w if self._one_way else ()
        for k, law, mode in self._one_way:
            if mode * speeds[k] > ZONE:
                self._refuse(law, mode, speeds[k])

    def barely_beyond(self, side: int) -> list[int]:
        """The places of the modes of one-way laws that move against their unlimited torque by no more than an integration leaves."""
        speeds = self.memory.frictions(side).w if self._one_way else ()
        return [law.index for k, law, mode in self._one_way if ZONE < mode * speeds[k] <= INTEGRATED]

    def _refuse(self, law: Friction, mode: float, speed: float) -> NoReturn:
        way = "forward" if mode > 0 else "backward"
        raise SimulationError(
            f"{law.name} ({law.where}) moves {way} at t = {self.memory.time[0]:.9g} s, where its torque has no limit: it cannot "
            f"slide that way (speed {speed:.3g} {SPEEDS.get(law.unit, '')}".rstrip()
            + "). Choose initial values, a reset or a prescribed motion with which it is at rest or moves the other way."
        )

    def _rests(self, k: int, law: Friction, refused: bool, side: int) -> None:
        if not refused and self._noted.get(k) in self.notes:
            return
        _, torque, lower, upper, _ = (values[k] for values in self.memory.frictions(side))
        room = upper - lower > NO_WIDTH
        unit, t = law.unit, self.memory.time[0]
        if refused and room:
            why = (
                "while the motion of other parts depends on its torque"
                if law.acts
                else "where nothing in the model can move it"
            )
            raise SimulationError(
                f"{law.name} ({law.where}) rests at t = {t:.9g} s {why}: nothing determines this torque, which may lie anywhere from "
                f"{lower:.6g} to {upper:.6g} {unit}. Remove the component, or add a shaft stiffness between it and what holds it."
            )
        if room:
            self._noted[k] = resting_note(law, torque, lower, upper, t)
            self.notes.append(self._noted[k])
