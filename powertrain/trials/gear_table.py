"""The table of a gearset: ratio, efficiency and the torques of its shift elements in every gear."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

import powertrain as pt
from powertrain.components.rotational import ConstantSpeed, ConstantTorque, Inertia
from powertrain.components.transmissions import Automatic, SchemeGear, Shiftable

FOUND = 0, 1
"""Statuses of ``steady`` with unique speeds and shaft torques; in a set that turns as a block only internal torques are undetermined."""
SEVERAL = 2
"""Status of ``steady`` with several solutions."""
W_IN = 200.0
"""Speed of the input [rad/s]; mesh losses do not depend on it, drag does."""
SLIP = 1e-6
"""Slip of the input, relative to its speed, above which a gear does not hold."""


class GearBench(pt.Component):
    """A gearbox between an input torque and a load, with a fixed lever position."""

    gearbox: Shiftable
    lever: pt.Parameter = pt.parameter("1", "Position of the lever", default=1.0)
    drive: ConstantTorque = ConstantTorque(tau_constant=0)
    input: Inertia = Inertia(J=0.1)
    load: ConstantTorque | ConstantSpeed = ConstantTorque(tau_constant=0)

    def equations(self) -> pt.Equations:
        """Driven and braked."""
        yield pt.connect(self.drive.flange, self.input.flange_a)
        yield pt.connect(self.input.flange_b, self.gearbox.flange_a)
        yield pt.connect(self.gearbox.flange_b, self.load.flange)
        yield self.gearbox.lever.value == self.lever


def gear_table(gearbox: Automatic, torque: float = 100.0, speed: float = W_IN) -> pd.DataFrame:
    """Ratio, step to the next gear, efficiency and the torques of the engaged elements, for a torque [N.m] and speed [rad/s] at the input.

    These are operating points of the gearbox itself, including its drag, with the output at the speed of the gear. One row per gear, by
    name; "step" is the ratio over that of the next gear; a column per shift element has its torque [N.m], nan if it is open. A negative
    torque drives the input from the output; the efficiency is nan if neither end delivers power, because both drive the drag. A gear that
    freewheels hold does not carry such a torque, and its row is nan, unless ``gearbox.coast`` presses elements for it.
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
    levers = {gear.name: float(k) for k, gear in enumerate(scheme.forward, 1)}
    levers |= {gear.name: -1.0 for gear in scheme.reverse[:1]}
    ratios = np.array([scheme.ratio(name) for name in levers])
    found = _operating_points(gearbox, list(levers.values()), speed / ratios, torque)
    w_in, tau = (found[name].values for name in ("input.w", "gearbox.flange_b.tau"))
    idle = np.array([_has_idle_freewheel(gearbox, scheme.gear(name)) for name in levers])
    status = found["status"].values
    held = (np.isin(status, FOUND) | (idle & (status == SEVERAL))) & (np.abs(w_in - speed) <= SLIP * abs(speed))
    free = np.array([not _carries_overrun(gearbox, scheme.gear(name)) for name in levers])
    fine = held | (free & ((w_in < speed) | (torque <= 0)))
    if locking := [name for name, carried, n in zip(levers, fine, status, strict=True) if not carried and n == SEVERAL]:
        raise pt.ParameterError(
            f"several operating points at {torque:g} N.m in gear {', '.join(locking)}, which locks itself: the input drives it whether its "
            "load resists or pushes. pt.steady with the torque at the output tells them apart"
        )
    if jams := [name for name, carried in zip(levers, fine, strict=True) if not carried]:
        raise pt.ParameterError(
            f"no operating point at {torque:g} N.m in gear {', '.join(jams)}{_overload(gearbox, jams, torque)}"
        )
    values = {"ratio": w_in * ratios / speed, "efficiency": _efficiency(torque * speed, -tau * speed / ratios)}
    table = pd.DataFrame(values, index=list(levers))
    steps = [one / other for one, other in pairwise(ratios[: len(scheme.forward)].tolist())]
    table.insert(1, "step", pd.Series(steps, index=table.index[: len(steps)], dtype=float))
    for name, path in gearbox.friction_elements().items():
        closed = [name in _closed(gearbox, scheme.gear(gear)) for gear in levers]
        table[name] = found[f"gearbox.{path}.tau"].where(closed).values
    return table.where(pd.Series(held, index=table.index))


def _operating_points(gearbox: Automatic, levers: list[float], w_out: NDArray[np.float64], torque: float) -> xr.Dataset:
    """One per lever position, at a speed of the output and a torque of the input; the speed of the input shows whether the gear holds."""
    grid: dict[str, Any] = {
        "lever": xr.DataArray(levers, dims="gear"),
        "load.w_fixed": xr.DataArray(w_out, dims="gear"),
        "drive.tau_constant": torque,
    }
    elements = [f"gearbox.{path}.tau" for path in gearbox.friction_elements().values()]
    bench = GearBench(gearbox=gearbox, load=ConstantSpeed(w_fixed=1.0))
    return pt.steady(bench, grid, outputs=["gearbox.flange_b.tau", "input.w", *elements], first=True)


def _closed(gearbox: Automatic, gear: SchemeGear) -> tuple[str, ...]:
    """The elements that are closed in a gear."""
    return gear.engaged + (gear.coast if float(gearbox.coast) > 0 else ())


def _has_idle_freewheel(gearbox: Automatic, gear: SchemeGear) -> bool:
    """Whether a freewheel of a gear carries nothing: its race may run ahead at any speed, which changes no torque."""
    scheme = gearbox.scheme
    engaged = {element.name for element in scheme.elements if element.freewheel and element.name in gear.engaged}
    return bool(engaged.difference(scheme.freewheels(gear.name)))


def _carries_overrun(gearbox: Automatic, gear: SchemeGear) -> bool:
    """Whether a gear is held without freewheels, or by elements pressed beside them."""
    return not gearbox.scheme.freewheels(gear.name) or _closed(gearbox, gear) != gear.engaged


def _efficiency(at_input: float, at_output: NDArray[np.float64]) -> NDArray[np.float64]:
    """Power delivered over power taken up, from the powers [W] into the input and out of the output; nan if both ends take up power."""
    none = np.full_like(at_output, np.nan)
    passed = np.divide(at_output, at_input, out=none, where=at_input * at_output > 0)
    return passed if at_input > 0 else 1 / passed


def _overload(gearbox: Automatic, gears: list[str], torque: float) -> str:
    """The capacity of the weakest element in these gears if it is below ``torque``; else empty.

    Elements for overrun hold ``coast`` times their capacity, and beside freewheels that hold they are not needed.
    """
    scheme, coast = gearbox.scheme, float(gearbox.coast)
    capacity = {
        element.name: float(part.capacity) * float(part.peak)
        for element, part in zip(scheme.elements, gearbox.elements, strict=True)
        if not element.freewheel
    }
    held: dict[str, float] = {}
    for row in map(scheme.gear, gears):
        for name in row.engaged if torque > 0 else _closed(gearbox, row):
            if name in capacity and (factor := scheme.torque_factor(row.name, name)):
                beside = name in row.coast
                text = f"{name} in gear {row.name}" + f" with coast = {coast:g}" * beside
                held[text] = capacity[name] * (coast if beside else 1.0) / factor
    weakest = min(held, key=held.__getitem__, default="")
    if not weakest or held[weakest] >= abs(torque):
        return ""
    return (
        f": element {weakest} holds {held[weakest]:.4g} N.m at the input, without losses; "
        "Automatic.of(scheme, torque=...) makes stronger ones"
    )
