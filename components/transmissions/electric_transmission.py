"""A split-path transmission with two electric machines: one-, two- and three-mode, through standstill of either machine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import casadi as ca

from powertrain import Equations, Variable, connect, der, reinit, variable, when
from powertrain.components.cvu.electric_pair import ElectricPair
from powertrain.components.transmissions.ranges import Span, TransmissionOfRanges

SYNCHRONOUS = 0.5
"""How far the output falls below the speed of a shift before that is undone [rad/s]."""


class ElectricTransmission(TransmissionOfRanges):
    """A split-path transmission with the gears of one or several ranges (modes), and a pair of electric machines between their shafts.

    ``ratio`` is the overall ratio r = w_b/w_a that is wanted. The machines' torques keep their speeds in the proportion

    n_a : n_b = (A_a + B_a r) : (A_b + B_b r),  with ``Network.speeds`` of the present range

    which is defined where either shaft stands still, so that ranges may contain the mechanical points of both: two-mode
    transmissions pass shaft a's. The engine keeps its operating speed by r, and pays for the losses of the machines over the bus
    (``ElectricPair``). A range changes up where the output reaches the speed of the shift, w_b = shift w_a, and down 0.5 rad/s below it,
    so that clutches change at equal speeds; ``TransmissionOfRanges`` says how. The ratio differs from the wanted one by the slip of the
    speed control. ``ElectricTransmission.of`` makes the parts from the spans of a design: from which to which r, and the network.

    Errors: ParameterError for ranges that do not follow each other or meet at different speeds of the machines.
    """

    pair: ElectricPair = ElectricPair()
    ahead: Variable = variable("rad/s", "Speed of the output at the wanted ratio, minus its speed")

    @classmethod
    def of(cls, spans: Sequence[Span], pair: ElectricPair | None = None) -> Self:
        """The parts of ranges, the lowest first."""
        return cls._made(spans) if pair is None else cls._made(spans, pair=pair)

    def equations(self) -> Equations:
        """The machines at both elastic shafts, their proportion by the present range."""
        yield from self._joined()
        yield connect(self.shaft_a.flange_a, self.pair.flange_a)
        yield connect(self.shaft_b.flange_a, self.pair.flange_b)
        w_in, w_out = der(self.flange_a.phi), der(self.flange_b.phi)
        yield self.ahead == self.ratio.value * w_in - w_out
        for k, shift in enumerate(self.shifts):
            over = w_out - shift * w_in
            yield when(ca.logic_and(over > 0, self.range < k + 0.5), reinit(self.range, k + 1))
            yield when(ca.logic_and(over < -SYNCHRONOUS, self.range > k + 0.5), reinit(self.range, k))
        n_a, n_b = self._unit_speeds()
        yield self.pair.n_a.value == n_a
        yield self.pair.n_b.value == n_b
