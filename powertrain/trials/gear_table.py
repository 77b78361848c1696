"""The table of a gearset: ratio, efficiency and the torques of its shift elements in every gear."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

import powertrain as pt
from powertrain.components.rotational import ConstantTorque, Inertia
from powertrain.components.transmissions import Automatic, Shiftable

FOUND = 0, 1
"""Statuses of ``steady`` with unique speeds and shaft torques; in a set that turns as a block only internal torques are undetermined."""
W_IN = 200.0
"""Speed of the input [rad/s]; mesh losses do not depend on it, drag does."""


class GearBench(pt.Component):
    """A gearbox between an input torque and an output torque, with a fixed lever position."""

    gearbox: Shiftable
    lever: pt.Parameter = pt.parameter("1", "Position of the lever", default=1.0)
    drive: ConstantTorque = ConstantTorque(tau_constant=0)
    input: Inertia = Inertia(J=0.1)
    load: ConstantTorque = ConstantTorque(tau_constant=0)

    def equations(self) -> pt.Equations:
        """Driven and braked."""
        yield pt.connect(self.drive.flange, self.input.flange_a)
        yield pt.connect(self.input.flange_b, self.gearbox.flange_a)
        yield pt.connect(self.gearbox.flange_b, self.load.flange)
        yield self.gearbox.lever.value == self.lever


def gear_table(gearbox: Automatic, torque: float = 100.0, speed: float = W_IN) -> pd.DataFrame:
    """Ratio, step to the next gear, efficiency and the torques of the engaged elements, for a torque [N.m] and speed [rad/s] at the input.

    These are operating points of the gearbox itself, including its drag. One row per gear, by name; "step" is the ratio over that of the
    next gear; a column per shift element has its torque [N.m], nan if it is open. A negative torque drives the input from the output; the
    efficiency is nan if neither end delivers power, because both drive the drag.
    Errors: ParameterError for a gearbox without a scheme, a speed of zero, and gears without an operating point at that torque.

    >>> from powertrain.components.transmissions import Automatic
    >>> table = gear_table(Automatic.simpson_three_speed())
    >>> table["ratio"].round(2).tolist()
    [2.46, 1.46, 1.0, -2.18]
    """
    if not isinstance(gearbox, Automatic):
        raise pt.ParameterError(
            f"gear_table needs a gearset by its scheme, an Automatic; {type(gearbox).__name__} has none"
        )
    if speed == 0:
        raise pt.ParameterError("gear_table: speed = 0 rad/s; a gearset at rest has no ratio and no efficiency")
    scheme = gearbox.scheme
    paths = {name: f"gearbox.{path}" for name, path in gearbox.friction_elements().items()}
    levers = {gear.name: float(k) for k, gear in enumerate(scheme.forward, 1)}
    levers |= {gear.name: -1.0 for gear in scheme.reverse[:1]}
    w_out = f"gearbox.shafts[{scheme.free.nodes[scheme.output]}].w"
    outputs = ["gearbox.flange_b.tau", w_out, *(f"{path}.tau" for path in paths.values())]
    grid: dict[str, Any] = {"lever": list(levers.values()), "input.w": speed, "drive.tau_constant": torque}
    found = pt.steady(GearBench(gearbox=gearbox), grid, outputs=outputs, free=["load.tau_constant"], first=True)
    jams = [name for name, status in zip(levers, found["status"].values, strict=True) if status not in FOUND]
    if jams:
        raise pt.ParameterError(
            f"no operating point at {torque:g} N.m in gear {', '.join(jams)}{_overload(gearbox, jams, torque)}"
        )
    w, tau = (found[name].values for name in (w_out, "gearbox.flange_b.tau"))
    table = pd.DataFrame({"ratio": speed / w, "efficiency": _efficiency(torque * speed, -tau * w)}, index=list(levers))
    ratios = table["ratio"].tolist()[: len(scheme.forward)]
    steps = [one / other for one, other in pairwise(ratios)]
    table.insert(1, "step", pd.Series(steps, index=table.index[: len(steps)]))
    for name, path in paths.items():
        engaged = [name in scheme.gear(gear).engaged for gear in levers]
        table[name] = found[f"{path}.tau"].where(engaged).values
    return table


def _efficiency(at_input: float, at_output: NDArray[np.float64]) -> NDArray[np.float64]:
    """Power delivered over power taken up, from the powers [W] into the input and out of the output; nan if both ends take up power."""
    none = np.full_like(at_output, np.nan)
    passed = np.divide(at_output, at_input, out=none, where=at_input * at_output > 0)
    return passed if at_input > 0 else 1 / passed


def _overload(gearbox: Automatic, gears: list[str], torque: float) -> str:
    """The capacity of the weakest element in these gears if it is below ``torque``; else empty."""
    scheme = gearbox.scheme
    capacity = {
        element.name: float(part.fn_max) * float(part.cgeo) * part.mue_pos[0][1] * float(part.peak)
        for element, part in zip(scheme.elements, gearbox.elements, strict=True)
    }
    held = {
        f"{name} in gear {gear}": capacity[name] / factor
        for gear in gears
        for name in scheme.gear(gear).engaged
        if (factor := scheme.torque_factor(gear, name))
    }
    weakest = min(held, key=held.__getitem__, default="")
    if not weakest or held[weakest] >= abs(torque):
        return ""
    return (
        f": element {weakest} holds {held[weakest]:.4g} N.m at the input, without losses; "
        "Automatic.of(scheme, torque=...) makes stronger ones"
    )
