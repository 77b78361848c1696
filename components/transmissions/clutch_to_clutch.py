"""Shifting from one clutch to another under load: the law by which two shift elements hand over the torque."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import casadi as ca

from powertrain import Equations, Map, Parameter, Symbol, Variable, der, parameter, variable
from powertrain.components.limited import limited
from powertrain.components.transmissions.gearbox import Shiftable


class ClutchToClutch(Shiftable):
    """Partial: gears by friction elements, of which one opens and one closes from gear to gear.

    Between gear k and k + 1 the lever goes through a torque phase, an inertia phase and a torque phase again, each with its part of the
    travel. hold of an element that both gears have is 1; of the one of gear k alone it falls from 1 to 0 in the first phase; of the one
    of gear k + 1 alone it rises from 0 to 1 in the last one. In between
      w_ref = i_ref w_out,  i_ref = ratio_k + (ratio_(k+1) - ratio_k) x^2 (3 - 2 x),  x from 0 to 1 in the inertia phase
      tau_law = tau_in + k_slip (w_in - w_ref),  T_in der(tau_in) = flange_a.tau - tau_in
      element of the higher gear: torque factor max(tau_law, 0);  of the lower gear: torque factor max(-tau_law, 0)

    A slipping element of the higher gear can only brake the input, one of the lower gear only drive it. So the sign of tau_law alone says
    which of the two has to carry: with power on it is that of the higher gear. An upshift then begins with the torque phase, a downshift
    ends with it; without power it is the other way round. In both phases the law is the same, and it depends on the position of the
    lever and not on the way it came from. tau_in is what a control can know: the filtered torque of the input.
    Source of the phases: H. Naunheimer et al., Automotive Transmissions, 2nd ed., Springer 2011, section 9.2 (powershifts).
    """

    torque_phase: float = 0.25
    k_slip: Parameter = parameter("N.m.s/rad", "Torque against deviations from the speed reference", default=8.0, min=0)
    T_in: Parameter = parameter("s", "Filter of the input torque", default=0.1, above=0)
    tau_in: Variable = variable("N.m", "Filtered torque of the input", start=0.0)
    tau_law: Variable = variable("N.m", "Torque by which the shift elements brake the input during a shift")
    w_in: Variable = variable("rad/s", "Speed of the input")
    w_ref: Variable = variable("rad/s", "Reference speed of the input")

    def friction_elements(self) -> dict[str, str]:
        """The paths in this component of its clutches and brakes, by name."""
        raise NotImplementedError(type(self).__name__)

    def _shift(self, ratios: Sequence[float | Symbol], w_in: Symbol, w_out: Symbol, begin: float = 0.0) -> Equations:
        """The reference and the torque law; ``begin``: part of the lever's travel before the first phase."""
        first, last = begin + self.torque_phase, 1 - self.torque_phase
        ratio = Symbol(ratios[0])
        for k, (one, other) in enumerate(pairwise(ratios), 1):
            gone = limited((self.lever.value - k - first) / (last - first))
            ratio += (other - one) * gone**2 * (3 - 2 * gone)
        yield self.w_in == w_in
        yield self.w_ref == ratio * w_out
        yield self.T_in * der(self.tau_in) == self.flange_a.tau - self.tau_in
        yield self.tau_law == self.tau_in + self.k_slip * (self.w_in - self.w_ref)

    def _torque(
        self, factors: Sequence[float | None], full: Symbol, begin: float = 0.0, reverse: bool = False
    ) -> Symbol:
        """What an element is pressed for, of ``factors`` over the gears (None: open) and a torque when ``full``."""
        hold, law = [(0.0, 0.0)], [(0.0, 0.0)]
        if reverse:
            hold, law = [(-1.0, 1.0), *hold], [(-1.0, 0.0), *law]
        first, last = begin + self.torque_phase, 1 - self.torque_phase
        hold.append((1.0, float(factors[0] is not None)))
        law.append((1.0, 0.0))
        for k, (one, other) in enumerate(pairwise(factors), 1):
            both = float(one is not None and other is not None)
            signed = 0.0 if both else (other or 0.0) - (one or 0.0)
            hold += [
                (k + begin, float(one is not None)),
                (k + first, both),
                (k + last, both),
                (k + 1, float(other is not None)),
            ]
            law += [(k + begin, 0.0), (k + first, signed), (k + last, signed), (k + 1, 0.0)]
        lever = self.lever.value
        shared = ca.fmax(_over_lever(law, "torque factor")(lever) * self.tau_law, 0)
        return _over_lever(hold, "hold")(lever) * full + shared


def _over_lever(rows: Sequence[tuple[float, float]], name: str) -> Map:
    """A line over the position of the lever; points that lie at one place count once."""
    kept = dict(rows)
    return Map.curve(list(kept), list(kept.values()), x="lever", unit="1", name=name, outside="clip")
