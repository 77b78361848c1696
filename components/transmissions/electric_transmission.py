"""A split-path transmission with two electric machines and one, two or three modes; either machine may pass standstill."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Self

import casadi as ca

from powertrain import (
    Equations,
    Parameter,
    ParameterError,
    Symbol,
    Variable,
    arguments_checked,
    connect,
    der,
    parameter,
    reinit,
    variable,
    when,
)
from powertrain.components.cvu.electric_pair import ElectricPair
from powertrain.components.limited import limited
from powertrain.components.rotational.clutch import Clutch
from powertrain.components.rotational.ideal_gear import IdealGear
from powertrain.components.transmissions.ranges import Span, TransmissionOfRanges

HYSTERESIS = 0.02
"""Relative drop of the demanded ratio below a shift at which the shift is undone."""
CLOSED = 0.1
"""Remaining share of a shift at which its lock begins to open."""
FOLLOW = 10.0
"""Inverse of the remaining share of a shift below which it slows down."""
REST = 0.01
"""Distance of ``place`` from a range below which only this range turns the unit's shafts."""
_LOCK = Clutch(fn_max=1.0, mue_pos=((0.0, 1.0),))


class ElectricTransmission(TransmissionOfRanges):
    """A split-path transmission with the gears of one or several ranges (modes), and a pair of electric machines between their shafts.

    ``ratio`` is the demanded overall ratio r = w_b/w_a. The machines' torques keep their speeds in the proportion

    n_a : n_b = (A_a + B_a r) : (A_b + B_b r),  with ``Network.speeds`` of the present range

    which is defined even where either shaft is at rest. Ranges may therefore contain the mechanical points of both shafts; two-mode
    transmissions pass that of shaft a. r keeps the engine at its operating speed; the engine supplies the losses of the machines through
    the bus (``ElectricPair``). The actual ratio differs from the demanded one by the slip of the speed control.

    A range changes up when the output passes the speed of the shift, w_b = shift w_a, if the demanded ratio is above it, and down when
    it falls below again, if the demanded ratio is 2 % below it. At the shift the clutches of both ranges are engaged, which is a fixed
    gear; a clutch between input and output with that ratio (``locks``) represents them, up to ``tau_lock`` at the output. In this gear
    ``place`` moves to the number of the new range in the time ``T_shift``, and with it change the machines' torques, which may be opposite
    in the new range:

    der(place) = rate/T_shift,  rate = 10 (range - place) within -1..1

    A run starts in the range of its speeds, above every shift with w_b > shift w_a.
    ``ElectricTransmission.of`` makes the component from the spans of a design: lower and upper r, and the network.
    Errors: ParameterError for ranges that do not follow each other or meet at different speeds of the machines.
    """

    T_shift: Parameter = parameter("s", "Time of a shift", default=0.1, above=0)
    tau_lock: Parameter = parameter(
        "N.m", "Torque of a closed lock at the output while it slips", default=500.0, above=0
    )
    place: Variable = variable(
        "1", "Range that the unit's shafts turn with; between two numbers during a shift", start=0.0
    )
    pair: ElectricPair = ElectricPair()
    fixed_gears: tuple[IdealGear, ...] = (IdealGear(ratio=1.0),)
    locks: tuple[Clutch, ...] = (_LOCK,)

    @classmethod
    @arguments_checked
    def of(cls, spans: Sequence[Span], pair: ElectricPair | None = None) -> Self:
        """The component from ranges, the lowest first. Errors: ParameterError for ranges that meet at standstill."""
        shifts = [high for _, high, _ in spans[:-1]]
        if 0.0 in shifts:
            raise ParameterError("two ranges meet at r = 0, where no fixed gear can hold both of them")
        others: dict[str, Any] = {} if pair is None else {"pair": pair}
        gears = tuple(IdealGear(ratio=1 / shift) for shift in shifts)
        return cls._made(spans, fixed_gears=gears, locks=(_LOCK,) * len(shifts), **others)

    def equations(self) -> Equations:
        """The machines at both elastic shafts, with their proportion in the present range."""
        yield from self._joined()
        yield connect(self.shaft_a.flange_a, self.pair.flange_a)
        yield connect(self.shaft_b.flange_a, self.pair.flange_b)
        yield der(self.place) == limited(FOLLOW * (self.range - self.place), -1, 1) / self.T_shift
        wanted = self.ratio.value
        for k, shift in enumerate(self.shifts):
            left = 1 - ca.fabs(
                self.range + self.place - 2 * k - 1
            )  # |range - place| if shift k is under way, else not above 0
            closed = limited((left - REST) / CLOSED)
            wanted = wanted + closed * (shift - wanted)
            yield from self._lock(k, closed)
        n_a, n_b = self._unit_speeds(wanted)
        yield self.pair.n_a.value == n_a
        yield self.pair.n_b.value == n_b

    def _lock(self, k: int, closed: Symbol) -> Equations:
        """Shift k: its start, and its fixed gear as far as it is ``closed``."""
        shift, gear, lock = self.shifts[k], self.fixed_gears[k], self.locks[k]
        over, wanted = self._over(shift), self.ratio.value
        up = ca.logic_and(over > 0, wanted > shift)
        down = ca.logic_and(over < 0, wanted < shift - HYSTERESIS * abs(shift))
        yield when(ca.logic_and(up, self.range < k + 0.5), reinit(self.range, k + 1))
        yield when(ca.logic_and(down, self.range > k + 0.5), reinit(self.range, k))
        yield connect(self.flange_a, gear.flange_a)
        yield connect(gear.flange_b, lock.flange_a)
        yield connect(lock.flange_b, self.flange_b)
        yield lock.fn_max == lock.force(self.tau_lock)
        yield lock.f_normalized.value == closed

    def _over(self, shift: float) -> Symbol:
        """Speed of the output above that in the fixed gear of a shift."""
        return der(self.flange_b.phi) - shift * der(self.flange_a.phi)

    def _above(self) -> list[Symbol]:
        """For every shift, how far the unit's shafts are above it, exactly 0 or 1 outside shifts, so that idle gears have no torque."""
        return [limited((1 + 2 * REST) * (self.place - k) - REST) for k, _ in enumerate(self.shifts)]

    def initial(self) -> Equations:
        """The range of the initial speeds, with its clutches engaged."""
        passed = [ca.if_else(self._over(shift) > 0, 1.0, 0.0) for shift in self.shifts]
        yield self.range == sum(passed, Symbol(0.0))
        yield self.place == self.range
