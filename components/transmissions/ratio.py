"""The ratio that the variable unit has to take for a ratio of the whole transmission."""

from __future__ import annotations

import math

from powertrain import (
    Component,
    Equations,
    Input,
    Output,
    Parameter,
    parameter,
    signal_input,
    signal_output,
    switch,
    within,
)
from powertrain.components.transmissions.layout import Coupling, Layout, checked, relative_ratio

STANDSTILL = 1e-6
"""An output-coupled transmission with a smaller ratio stands still at its output."""


class UnitRatio(Component):
    """V of the variable unit of a split-path transmission from the overall ratio r.

    Input-coupled: V = (r - R)/(1 - R) (eq. 23);  output-coupled: V = (1 - R/r)/(1 - R);  R = (w_3 - w_2)/(w_1 - w_2) of the layout.
    No V belongs to an output-coupled transmission whose output stands still: r there ends a simulation with an error.
    Source: D. Yu, N. Beachley, Gear Technology, July/August 1986, p. 14.
    """

    layout: Layout = "bHa"
    coupling: Coupling = "input"
    basic_ratio: Parameter = parameter("1", "Basic speed ratio R_o of the differential", exclude=(0.0, 1.0))
    r: Input = signal_input("1", "Overall speed ratio")
    V: Output = signal_output("1", "Speed ratio of the variable unit")

    def equations(self) -> Equations:
        """Speeds on a straight line."""
        R = relative_ratio(self.layout, self.basic_ratio)
        r = self.r.value
        if checked(self.coupling) == "input":
            yield self.V.value == (r - R) / (1 - R)
        else:
            size = switch(r >= 0, r, -r, continuous=True)
            within(size, STANDSTILL, math.inf, name="size of the overall ratio, output-coupled", unit="1")
            yield self.V.value == (1 - R / r) / (1 - R)
