"""The ratio of the variable unit for a given overall ratio of the transmission."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from powertrain import (
    Component,
    Equations,
    Input,
    Output,
    Parameter,
    Symbol,
    parameter,
    signal_input,
    signal_output,
    within,
)
from powertrain.components.limited import magnitude
from powertrain.components.transmissions.layout import Coupling, Layout, relative_ratio
from powertrain.components.transmissions.network import Network

STANDSTILL = 1e-6
"""Overall ratio below which the output of an output-coupled transmission counts as at rest."""


def turning(w: Symbol, name: str) -> None:
    """End a simulation where a speed over that of the input, by its ``name``, is zero."""
    within(magnitude(w), STANDSTILL, math.inf, name=name, unit="1")


def exact_ratio(w_a: Symbol, w_b: Symbol) -> Symbol:
    """V of a unit with shafts at these speeds over that of the input; a simulation ends where shaft a is at rest."""
    turning(w_a, "speed of the unit's shaft a over that of the input")
    return w_b / w_a


class RatioOfUnit(Component):
    """Partial: the ratio V of a variable unit for an overall ratio r."""

    r: Input = signal_input("1", "Overall speed ratio")
    V: Output = signal_output("1", "Speed ratio of the variable unit")


class UnitRatio(RatioOfUnit):
    """V of the variable unit of a split-path transmission from the overall ratio r.

    Input-coupled: V = (r - R)/(1 - R) (eq. 23);  output-coupled: V = (1 - R/r)/(1 - R);  R = (w_3 - w_2)/(w_1 - w_2) of the layout.
    For an output-coupled transmission with its output at rest there is no V; a simulation then ends with an error.
    Source: D. Yu, N. Beachley, Gear Technology, July/August 1986, p. 14.
    """

    layout: Layout = "bHa"
    coupling: Coupling = "input"
    basic_ratio: Parameter = parameter("1", "Basic speed ratio R_o of the differential", exclude=(0.0, 1.0))

    def equations(self) -> Equations:
        """Speeds on a straight line."""
        R = relative_ratio(self.layout, self.basic_ratio)
        r = self.r.value
        if self.coupling == "input":
            yield self.V.value == (r - R) / (1 - R)
        else:
            turning(r, "size of the overall ratio, output-coupled")
            yield self.V.value == (1 - R / r) / (1 - R)


class NetworkRatio(RatioOfUnit):
    """V = w_b/w_a of the variable unit in a network from the overall ratio r: V = (A_b + B_b r)/(A_a + B_a r), ``Network.speeds``.

    Where shaft a is at rest (its mechanical point) V is infinite; within 1e-6 of it a simulation ends with an error.
    """

    network: Network = Network.split_path("bHa", "input", -1.7)

    def equations(self) -> Equations:
        """Speeds of the unit's shafts."""
        (A_a, B_a), (A_b, B_b) = factors_of_unit(self.network).tolist()
        r = self.r.value
        yield self.V.value == exact_ratio(A_a + B_a * r, A_b + B_b * r)


class OverallRatio(RatioOfUnit):
    """V = r, for a transmission that determines the ratio of its unit itself, as ``RangeTransmission`` does."""

    def equations(self) -> Equations:
        """Handed on."""
        yield self.V.value == self.r.value


def factors_of_unit(network: Network) -> NDArray[np.float64]:
    """A and B of w = A w_in + B w_out, rows for the unit's shafts a and b. Errors as for ``Network.speeds``."""
    factors = network.speeds()
    return np.stack([factors[network.nodes[name]] for name in network.unit])
