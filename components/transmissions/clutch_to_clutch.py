"""Shifting from one clutch to another under load: the law by which two shift elements exchange the torque."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from itertools import pairwise
from typing import ClassVar

import casadi as ca

from powertrain import Equations, Parameter, Symbol, Variable, der, parameter, switch, variable
from powertrain.components.limited import smooth_step
from powertrain.components.transmissions.gearbox import Shiftable


class ClutchToClutch(Shiftable):
    """Partial: gears selected by friction elements, one of which opens and one of which closes between adjacent gears.

    From gear k to gear k + 1 the lever travels through a torque phase, an inertia phase, and a second torque phase. Elements of both gears
    stay closed. The element of gear k alone is pressed with full torque times 1 - S_1, that of gear k + 1 alone with full torque times S_3;
    S_n rises from 0 to 1 in the n-th phase, S = x^2 (3 - 2 x). Added to this, times S_1 (1 - S_3), is
      torque factor max(tau_law, 0) for the element of gear k + 1,  torque factor max(-tau_law, 0) for the element of gear k
      tau_law = tau_in + k_slip (w_in - w_ref),  T_in der(tau_in) = flange_a.tau - tau_in
      w_ref = (ratio_k + (ratio_(k+1) - ratio_k) S_2) w_out

    A slipping element of the higher gear can only brake the input, one of the lower gear can only drive it. So the sign of tau_law
    decides which of the two carries the torque: with power on, it is that of the higher gear. An upshift then begins with the exchange of
    torque and a downshift ends with it; without power it is the other way round. The law depends on the position of the lever, not on its
    history. tau_in is available to a real control: the filtered input torque.
    Source of the phases: H. Naunheimer et al., Automotive Transmissions, 2nd ed., Springer 2011, section 9.2 (powershifts).
    """

    begin: ClassVar[float] = 0.0
    """Share of the lever's travel between gears before the first phase."""
    torque_phase: Parameter = parameter(
        "1", "Share of the lever's travel between gears in each torque phase", default=0.25, above=0
    )
    k_slip: Parameter = parameter("N.m.s/rad", "Torque against deviations from the speed reference", default=8.0, min=0)
    T_in: Parameter = parameter("s", "Filter of the input torque", default=0.1, above=0)
    tau_in: Variable = variable("N.m", "Filtered torque of the input", start=0.0, nominal=100.0)
    tau_law: Variable = variable("N.m", "Torque by which the shift elements brake the input during a shift")
    w_in: Variable = variable("rad/s", "Speed of the input")
    w_ref: Variable = variable("rad/s", "Reference speed of the input")
    braking: Variable = variable("N.m", "Part of tau_law that brakes the input")

    def friction_elements(self) -> dict[str, str]:
        """The paths of the clutches and brakes in this component, by name."""
        raise NotImplementedError(type(self).__name__)

    def check(self) -> Equations:
        """The inertia phase lies between the torque phases."""
        yield self.begin + 2 * self.torque_phase < 1  # the inertia phase has a length

    def _shift(self, ratios: Sequence[float | Symbol], w_in: Symbol, w_out: Symbol) -> Equations:
        """The reference speed and the torque law."""
        ratio = Symbol(ratios[0])
        for k, (one, other) in enumerate(pairwise(ratios), 1):
            ratio += (other - one) * self._phase(k, 2)
        yield self.w_in == w_in
        yield self.w_ref == ratio * w_out
        yield self.T_in * der(self.tau_in) == self.flange_a.tau - self.tau_in
        yield self.tau_law == self.tau_in + self.k_slip * (self.w_in - self.w_ref)
        yield self.braking == switch(self.tau_law > 0, self.tau_law, 0.0, continuous=True)

    def _torque(
        self,
        factors: Sequence[float | None],
        full: Symbol,
        *,
        beside: Container[int] = (),
        pulling: Mapping[int, Symbol] | None = None,
    ) -> Symbol:
        """The torque for which an element is pressed, from its ``factors`` in the gears (None: open) and its ``full`` torque.

        In the gears ``beside``, counted from 0, it is pressed beside a freewheel: what brakes the input is left to others. ``pulling``:
        torques with which it pulls the input up in the inertia phase if it closes in that gear.
        """
        hold, law, driving = Symbol(float(factors[0] is not None)), Symbol(0.0), self.braking - self.tau_law
        for k, (one, other) in enumerate(pairwise(factors), 1):
            first, last = self._phase(k, 1), self._phase(k, 3)
            if one is None and other is not None:
                hold += last
                if k not in beside:
                    law += other * (self.braking * first + (pulling or {}).get(k, 0.0) * self._phase(k, 2)) * (1 - last)
            elif one is not None and other is None:
                hold -= first
                law += one * driving * first * (1 - last)
        return hold * full * smooth_step(self.lever.value) + law

    def _pulling(self, ratio: float | Symbol, w_out: Symbol) -> Symbol:
        """The torque that pulls an input up to the speed of a gear if a freewheel of the gear below has let it fall behind."""
        # where it ends, the friction of the element has an event
        behind = ca.fmax(ratio * w_out - self.w_in, 0)
        return self.k_slip * behind

    def _phase(self, k: int, number: int) -> Symbol:
        """S_n of the shift between gears k and k + 1."""
        marks = self.begin, self.begin + self.torque_phase, 1 - self.torque_phase, 1.0
        start, stop = marks[number - 1], marks[number]
        return smooth_step((self.lever.value - k - start) / (stop - start))
