"""Manual gearboxes with synchronisers moved by shift rails."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import casadi as ca

from powertrain import Equations, ParameterError, Symbol, connect, replace
from powertrain.components.rotational.synchroniser import Synchroniser
from powertrain.components.translational.shift_actuator import ShiftActuator
from powertrain.components.transmissions.gearbox import SynchronisedGears, ratios_decrease


def _both_sides(synchroniser: Synchroniser, count: int) -> tuple[Synchroniser, ...]:
    """One per gear: odd gears on the positive side of their rail, even gears on the negative side."""
    return tuple(replace(synchroniser, direction=(-1.0) ** k) for k in range(count))


class SynchronisedGearbox(SynchronisedGears):
    """A gearbox with n gear pairs in constant mesh, whose synchronisers are shifted in pairs by rails.

    gear k: w_loose = w_a/ratio_k,  ``Synchroniser`` between the loose wheel and the output shaft
      rail p of gears 2p - 1 and 2p: s_ref = s_end (e_(2p-1) - e_(2p)),  e_k = 1 - 2 |lever - k|, at least 0

    The lever sets positions; the rails follow with the force of their actuators, and wait at the blocking rings. Cones, inertias and drag
    determine how long a shift takes, and whether it succeeds: if the lever moves too fast, or a clutch closes too early, the gear does
    not engage. ``ManualGearbox`` is the simpler alternative, with cones only. ``of_ratios`` makes gears, synchronisers and rails;
    inertias and drag are those of ``ManualGearbox``.
    Errors: ParameterError if the numbers of gears, synchronisers and rails do not match.
    """

    synchronisers: tuple[Synchroniser, ...] = _both_sides(Synchroniser(cones=2.0), 6)
    rails: tuple[ShiftActuator, ...] = (ShiftActuator(),) * 3

    @classmethod
    def of_ratios(
        cls,
        *ratios: float | Sequence[float],
        synchroniser: Synchroniser | None = None,
        rail: ShiftActuator | None = None,
    ) -> Self:
        """Gears with these ratios, speed at flange_a over speed at flange_b, first gear first; each with this synchroniser and rail.

        The ratios are separate numbers or one sequence.
        """
        one, actuator = synchroniser or Synchroniser(cones=2.0), rail or ShiftActuator()
        gears = cls._pairs(ratios)
        return cls(gears=gears, synchronisers=_both_sides(one, len(gears)), rails=(actuator,) * ((len(gears) + 1) // 2))

    def equations(self) -> Equations:
        """The gears; two synchronisers share a rail."""
        self._check()
        yield from self._meshed(self.synchronisers)
        for p, rail in enumerate(self.rails):
            pair = self.synchronisers[2 * p : 2 * p + 2]
            yield connect(rail.flange, *(synchroniser.sleeve for synchroniser in pair))
            ways = [each.direction * each.s_end * self._share(2 * p + 1 + i) for i, each in enumerate(pair)]
            yield rail.s_ref.value == sum(ways, Symbol(0))

    def _share(self, k: int) -> Symbol:
        return ca.fmax(0, 1 - 2 * ca.fabs(self.lever.value - k))

    def check(self) -> Equations:
        """Ratios must decrease; odd gears are on the positive side of their rail, even gears on the negative side."""
        yield from ratios_decrease(self.gears)
        for k, synchroniser in enumerate(self.synchronisers):
            yield synchroniser.direction == (-1.0) ** k  # odd gears at 1, even gears at -1

    def _check(self) -> None:
        n, synchronisers, rails = len(self.gears), len(self.synchronisers), len(self.rails)
        if not n or (synchronisers, rails) != (n, (n + 1) // 2):
            raise ParameterError(
                f"{self._label}: {n} gears have {synchronisers} synchronisers on {rails} rails; each gear needs a "
                "synchroniser and every two gears a rail: make it with SynchronisedGearbox.of_ratios"
            )
