"""A split-path transmission of several ranges that shifts while it drives."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Self

import casadi as ca

from powertrain import (
    Component,
    Discrete,
    Equations,
    Input,
    Parameter,
    ParameterError,
    Symbol,
    connect,
    der,
    discrete,
    parameter,
    port,
    reinit,
    replace,
    signal_input,
    switch,
    when,
    within,
)
from powertrain.components.cvu.interfaces import VariableUnit
from powertrain.components.rotational.inertia import Inertia
from powertrain.components.rotational.interfaces import Flange
from powertrain.components.rotational.spring import SpringDamper
from powertrain.components.transmissions.interfaces import VariableTransmission
from powertrain.components.transmissions.network import HOUSING, Lever, Network
from powertrain.components.transmissions.network_transmission import NetworkGears
from powertrain.components.transmissions.ratio import STANDSTILL, factors_of_unit

Span = tuple[float, float, Network]
"""From which to which overall ratio r a range is driven, and its network."""
HYSTERESIS = 1e-10
"""How far below a shift the wanted ratio falls before it is undone."""
MEET = 1e-9
"""By how much, relatively, the speeds of the unit's shafts in two ranges may differ where these meet."""


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
    """Two clutches that join a shaft with one of two others where all turn alike: one opens while the other closes, at once.

    high = 0: w_shaft = w_lower, lower.tau = -shaft.tau, upper.tau = 0;  high = 1: w_shaft = w_upper, upper.tau = -shaft.tau, lower.tau = 0

    It may change only where w_lower = w_upper; otherwise the speed of the shaft would have to jump, which ends a simulation with an error.
    """

    high: Input = signal_input("1", "0: the lower range, 1: the upper one")
    lower: Flange = port(Flange)
    upper: Flange = port(Flange)
    shaft: Flange = port(Flange)

    def equations(self) -> Equations:
        """Power is kept: lower.tau w_lower + upper.tau w_upper + shaft.tau w_shaft = 0."""
        share = self.high.value
        yield der(self.shaft.phi) == share * der(self.upper.phi) + (1 - share) * der(self.lower.phi)
        yield self.upper.tau == -share * self.shaft.tau
        yield self.lower.tau == (share - 1) * self.shaft.tau


class RangeTransmission(VariableTransmission):
    """A split-path transmission with several ranges: the gears of every range, one unit, and clutches between them.

    ``ratio`` is here the overall ratio r = w_b/w_a that is wanted; range and V = w_b/w_a of the unit follow from it:

    V = (A_b + B_b r)/(A_a + B_a r),  with ``Network.speeds`` of the range in which r lies

    Where two ranges meet, both shafts of the unit have the same speeds in either one, so that clutches change without slip
    (``RangeSelector``); the unit may run back in the next range. Its torques differ, though: they change over within the shafts between
    unit and gears, which are elastic, with the unit's inertia on shaft a. The gears have no inertia, and a shift takes no time besides.
    It starts in the range ``range_start``. ``RangeTransmission.of`` makes the parts from the spans of a design: from which to which r,
    and the network.

    Errors: ParameterError for a single range, and for ranges that do not follow each other or meet at different speeds of the unit.
    """

    ratio: Input = signal_input("1", "Overall ratio that is wanted")
    range: Discrete = discrete("1", "Number of the range, the lowest is 0")
    range_start: Parameter = parameter("1", "Number of the range at the start", default=0.0, min=0)
    spans: tuple[Span, ...] = _SIMPLEST
    gears: tuple[NetworkGears, ...] = tuple(NetworkGears.of(network) for _, _, network in _SIMPLEST)
    selectors_a: tuple[RangeSelector, ...] = (RangeSelector(),)
    selectors_b: tuple[RangeSelector, ...] = (RangeSelector(),)
    rotor: Inertia = Inertia(J=0.02)
    shaft_a: SpringDamper = SpringDamper(c=5e3, d=20)
    shaft_b: SpringDamper = SpringDamper(c=5e3, d=20)

    @classmethod
    def of(cls, spans: Sequence[Span], cvu: VariableUnit | None = None) -> Self:
        """The parts of ranges, the lowest first."""
        gears = tuple(NetworkGears.of(network) for _, _, network in spans)
        selectors = (RangeSelector(),) * (len(spans) - 1)
        made = cls(spans=tuple(spans), gears=gears, selectors_a=selectors, selectors_b=selectors)
        return made if cvu is None else replace(made, cvu=cvu)

    @property
    def shifts(self) -> list[float]:
        """The overall ratios at which ranges meet."""
        return [high for _, high, _ in self.spans[:-1]]

    def check(self) -> Equations:
        """Ranges follow each other and meet."""
        where = self._path or type(self).__name__
        if len(self.spans) < 2:
            raise ParameterError(f"{where}: {len(self.spans)} range; one that does not shift is a NetworkTransmission")
        if not len(self.spans) == len(self.gears) == len(self.selectors_a) + 1 == len(self.selectors_b) + 1:
            raise ParameterError(
                f"{where}: its parts do not belong to {len(self.spans)} ranges; make it with RangeTransmission.of(spans)"
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

    def equations(self) -> Equations:
        """Gears of all ranges between the shafts; the unit joined to those of one range by a row of selectors on either side."""
        yield connect(self.flange_a, *(gears.input for gears in self.gears))
        yield connect(self.flange_b, *(gears.output for gears in self.gears))
        yield from self._shift()
        above = [ca.if_else(self.range > k + 0.5, 1.0, 0.0) for k, _ in enumerate(self.shifts)]
        sides = (
            (self.selectors_a, [gears.unit_a for gears in self.gears], self.shaft_a, self.rotor.flange_b),
            (self.selectors_b, [gears.unit_b for gears in self.gears], self.shaft_b, self.cvu.flange_b),
        )
        yield connect(self.rotor.flange_a, self.cvu.flange_a)
        for selectors, flanges, shaft, unit in sides:
            lower = flanges[0]
            for selector, upper, high in zip(selectors, flanges[1:], above, strict=True):
                yield selector.high.value == high
                yield connect(lower, selector.lower)
                yield connect(upper, selector.upper)
                lower = selector.shaft
            yield connect(lower, shaft.flange_b)
            yield connect(shaft.flange_a, unit)
        yield self.cvu.ratio.value == self._unit_ratio(above)

    def _shift(self) -> Equations:
        """Up where the wanted ratio passes a shift, down where it falls below again."""
        r = self.ratio.value
        for k, shift in enumerate(self.shifts):
            yield when(ca.logic_and(r > shift, self.range < k + 0.5), reinit(self.range, k + 1))
            yield when(ca.logic_and(r < shift - HYSTERESIS, self.range > k + 0.5), reinit(self.range, k))

    def initial(self) -> Equations:
        """The range of the start."""
        yield self.range == self.range_start

    def _unit_ratio(self, above: list[Symbol]) -> Symbol:
        """V, by the network of the range."""
        r = self.ratio.value
        shafts = [[A + B * r for A, B in factors_of_unit(network).tolist()] for _, _, network in self.spans]
        w_a, w_b = shafts[0]
        for high, (a, b) in zip(above, shafts[1:], strict=True):
            w_a, w_b = w_a + high * (a - w_a), w_b + high * (b - w_b)
        size = switch(w_a >= 0, w_a, -w_a, continuous=True)
        within(size, STANDSTILL, math.inf, name="speed of the unit's shaft a over that of the input", unit="1")
        return Symbol(w_b / w_a)
