"""Ranges of a split-path transmission: the gears of every range, and the clutches that connect the shafts of its unit to one of them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Self

from powertrain import (
    Component,
    Discrete,
    Equations,
    Input,
    ParameterError,
    Symbol,
    connect,
    der,
    discrete,
    port,
    signal_input,
)
from powertrain.components.rotational.interfaces import Flange
from powertrain.components.rotational.spring import SpringDamper
from powertrain.components.transmissions.interfaces import VariableTransmission
from powertrain.components.transmissions.network import HOUSING, Lever, Network
from powertrain.components.transmissions.network_transmission import NetworkGears
from powertrain.components.transmissions.ratio import factors_of_unit

Span = tuple[float, float, Network]
"""Lower and upper overall ratio r of a range, and its network."""
MEET = 1e-9
"""Relative difference allowed between the speeds of the unit's shafts in two ranges where these meet."""


def _hydromechanical() -> tuple[Span, ...]:
    """Type 4 with R_o = -1: V from -1 to 1 up to r = 1, and with other gears behind and beside the planetary back to -1 up to r = 3."""
    again = (
        Lever("planetary", "in", "inner", "last", -1.0, 0.98),
        Lever("behind", "last", "out", HOUSING, 0.25, 0.99),
        Lever("beside", "unit", "inner", HOUSING, -2.0, 0.99),
    )
    return (0.0, 1.0, Network.split_path("abH", "input", -1.0, 0.98)), (1.0, 3.0, Network(again, ("in", "unit")))


_SIMPLEST = _hydromechanical()


class RangeSelector(Component):
    """Two clutches that connect a shaft to one of two others at equal speeds: one opens while the other closes, instantaneously.

    high = 0: w_shaft = w_lower, lower.tau = -shaft.tau, upper.tau = 0;  high = 1: w_shaft = w_upper, upper.tau = -shaft.tau, lower.tau = 0

    It may change only at w_lower = w_upper; otherwise the speed of the shaft would have to jump, which ends a simulation with an error.
    """

    high: Input = signal_input("1", "0: the lower range, 1: the upper one")
    lower: Flange = port(Flange)
    upper: Flange = port(Flange)
    shaft: Flange = port(Flange)

    def equations(self) -> Equations:
        """Power is conserved: lower.tau w_lower + upper.tau w_upper + shaft.tau w_shaft = 0."""
        share = self.high.value
        yield der(self.shaft.phi) == share * der(self.upper.phi) + (1 - share) * der(self.lower.phi)
        yield self.upper.tau == -share * self.shaft.tau
        yield self.lower.tau == (share - 1) * self.shaft.tau


class TransmissionOfRanges(VariableTransmission):
    """Partial: gears of every range, clutches between them, and the elastic shafts to the unit. The signal ``ratio`` is the overall one.

    Where two ranges meet, both shafts of the unit have the same speeds in either range, so the clutches change without slip
    (``RangeSelector``); the unit may run back in the next range. Its torques differ, however: they change within the elastic shafts between
    unit and gears. The gears have no inertia, and a shift takes no other time.
    Errors: ParameterError for ranges that do not follow each other or meet at different speeds of the unit.
    """

    ratio: Input = signal_input("1", "Desired overall ratio")
    range: Discrete = discrete("1", "Number of the range, the lowest is 0")
    spans: tuple[Span, ...] = _SIMPLEST
    gears: tuple[NetworkGears, ...] = tuple(NetworkGears.of(network) for _, _, network in _SIMPLEST)
    selectors_a: tuple[RangeSelector, ...] = (RangeSelector(),)
    selectors_b: tuple[RangeSelector, ...] = (RangeSelector(),)
    shaft_a: SpringDamper = SpringDamper(c=5e3, d=20)
    shaft_b: SpringDamper = SpringDamper(c=5e3, d=20)

    @classmethod
    def _made(cls, spans: Sequence[Span], **others: Any) -> Self:
        """The component from ranges, the lowest first."""
        gears = tuple(NetworkGears.of(network) for _, _, network in spans)
        selectors = (RangeSelector(),) * (len(spans) - 1)
        return cls(spans=tuple(spans), gears=gears, selectors_a=selectors, selectors_b=selectors, **others)

    @property
    def shifts(self) -> list[float]:
        """The overall ratios at which ranges meet."""
        return [high for _, high, _ in self.spans[:-1]]

    def check(self) -> Equations:
        """Ranges must follow each other and meet."""
        where = self._label
        if not len(self.spans) == len(self.gears) == len(self.selectors_a) + 1 == len(self.selectors_b) + 1:
            raise ParameterError(
                f"{where}: its parts do not belong to {len(self.spans)} ranges; make it with {type(self).__name__}.of(spans)"
            )
        for (low, high, one), (start, _, other) in pairwise(self.spans):
            if not low < high or start != high:
                raise ParameterError(f"{where}: a range from r = {low:g} to {high:g} is followed by one from {start:g}")
            for k, side in enumerate("ab"):
                w, v = (float(factors_of_unit(network)[k] @ [1.0, high]) for network in (one, other))
                if abs(w - v) > MEET * max(abs(w), abs(v), 1.0):
                    raise ParameterError(
                        f"{where}: at r = {high:g} the unit's shaft {side} turns at {w:.6g} times the input in one range, at {v:.6g} times "
                        "in the next: the ranges do not meet"
                    )
        yield from ()

    def _joined(self) -> Equations:
        """Gears of all ranges between input and output; a row of selectors connects each elastic shaft to one range."""
        yield connect(self.flange_a, *(gears.input for gears in self.gears))
        yield connect(self.flange_b, *(gears.output for gears in self.gears))
        sides = (
            (self.selectors_a, [gears.unit_a for gears in self.gears], self.shaft_a),
            (self.selectors_b, [gears.unit_b for gears in self.gears], self.shaft_b),
        )
        for selectors, flanges, shaft in sides:
            lower = flanges[0]
            for selector, upper, high in zip(selectors, flanges[1:], self._above(), strict=True):
                yield selector.high.value == high
                yield connect(lower, selector.lower)
                yield connect(upper, selector.upper)
                lower = selector.shaft
            yield connect(lower, shaft.flange_b)

    def _above(self) -> list[Symbol]:
        """For every shift, whether the unit's shafts turn with the gears above it (1) or below (0)."""
        raise NotImplementedError

    def _unit_speeds(self, r: Symbol) -> tuple[Symbol, Symbol]:
        """Speeds of the unit's shafts over input speed for the overall ratio r in the present range."""
        shafts = [[A + B * r for A, B in factors_of_unit(network).tolist()] for _, _, network in self.spans]
        w_a, w_b = shafts[0]
        for high, (a, b) in zip(self._above(), shafts[1:], strict=True):
            w_a, w_b = w_a + high * (a - w_a), w_b + high * (b - w_b)
        return w_a, w_b
