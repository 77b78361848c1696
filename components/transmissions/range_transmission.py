"""A split-path transmission with several ranges that shifts while driving."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import casadi as ca

from powertrain import Equations, ParameterError, Symbol, arguments_checked, connect, reinit, when
from powertrain.components.cvu.interfaces import VariableUnit
from powertrain.components.cvu.unit import CVU
from powertrain.components.rotational.inertia import Inertia
from powertrain.components.transmissions.ranges import Span, TransmissionOfRanges
from powertrain.components.transmissions.ratio import exact_ratio

HYSTERESIS = 1e-10
"""Drop of the demanded ratio below a shift at which the shift is undone."""


class RangeTransmission(TransmissionOfRanges):
    """A split-path transmission with several ranges: the gears of every range, one unit, and clutches between them.

    Here ``ratio`` is the demanded overall ratio r = w_b/w_a; it determines the range and V = w_b/w_a of the unit:

    V = (A_b + B_b r)/(A_a + B_a r),  with ``Network.speeds`` of the range that contains r

    Ranges change as in ``TransmissionOfRanges``, with the unit's inertia on shaft a. A run starts in the range that contains r. If V
    becomes infinite in a range, because shaft a passes rest, no unit with an exact ratio can follow; use ``ElectricTransmission`` for such
    ranges. ``RangeTransmission.of`` makes the component from the spans of a design: lower and upper r, and the network.

    Errors: ParameterError for a single range, and for ranges that do not follow each other or meet at different speeds of the unit.
    """

    cvu: VariableUnit = CVU(eta_ab=0.9, eta_ba=0.9)
    rotor: Inertia = Inertia(J=0.02)

    @classmethod
    @arguments_checked
    def of(cls, spans: Sequence[Span], cvu: VariableUnit | None = None) -> Self:
        """The component from ranges, the lowest first."""
        return cls._made(spans) if cvu is None else cls._made(spans, cvu=cvu)

    def check(self) -> Equations:
        """There must be more than one range."""
        if len(self.spans) < 2:
            where = self._label
            raise ParameterError(f"{where}: {len(self.spans)} range; one that does not shift is a NetworkTransmission")
        yield from super().check()

    def equations(self) -> Equations:
        """The unit between both elastic shafts, at the ratio for the present range."""
        yield from self._joined()
        yield connect(self.rotor.flange_a, self.cvu.flange_a)
        yield connect(self.shaft_a.flange_a, self.rotor.flange_b)
        yield connect(self.shaft_b.flange_a, self.cvu.flange_b)
        r = self.ratio.value
        for k, shift in enumerate(self.shifts):
            below, above = (ca.fabs(self.range - number) < 0.5 for number in (k, k + 1))
            yield when(ca.logic_and(r > shift, below), reinit(self.range, k + 1), initially=True)
            yield when(ca.logic_and(r < shift - HYSTERESIS, above), reinit(self.range, k), initially=True)
        yield self.cvu.ratio.value == exact_ratio(*self._unit_speeds(r))

    def _above(self) -> list[Symbol]:
        return [ca.if_else(self.range > k + 0.5, 1.0, 0.0) for k, _ in enumerate(self.shifts)]
