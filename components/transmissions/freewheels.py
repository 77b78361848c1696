"""Freewheels in a gear scheme: where they carry torque, their direction, and what replaces them in overrun.

With a freewheel a -> b open, w_a - w_b = alpha (w_in - ratio w_out). Without losses the torque T on a balances the input's,
T_in + alpha T = 0, and the freewheel can only brake a. In a gear that it holds, alpha must therefore be positive; in all others b must not
fall behind a. A freewheel of gear k that gear k + 1 exchanges for another element overruns there, as w_in < ratio w_out; in gear k - 1 it
would block. Freewheels open in upshifts and never close in them, so an upshift is controlled by the element that closes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from powertrain import ParameterError
from powertrain.components.transmissions.network import HOUSING
from powertrain.components.transmissions.shift_table import ARROW, SchemeGear, ShiftElement

if TYPE_CHECKING:
    from powertrain.components.transmissions.gear_scheme import GearScheme

SAME_SPEED = 1e-9
"""Speeds with a smaller difference, relative to the input, are equal."""


def check_freewheels(scheme: GearScheme) -> None:
    """Errors: ParameterError for a freewheel in the wrong direction or without purpose, and for overrun elements that hold another gear."""
    for gear in scheme.gears:
        for element in scheme.elements:
            if element.freewheel and element.name in gear.engaged:
                _check_carries(scheme, gear, element)
            elif element.freewheel:
                _check_overruns(scheme, gear, element)
        if gear.coast:
            _check_coast(scheme, gear)


def _check_carries(scheme: GearScheme, gear: SchemeGear, element: ShiftElement) -> None:
    if scheme.network(gear.name, without=(element.name,)).freedom == 1:
        raise ParameterError(
            f"gear {gear.name} ({gear.listed}): the other elements hold the gear without the freewheel {element.name}; leave it out, or "
            "put those that are pressed for overrun only into parentheses"
        )
    if scheme.slip_factor(gear.name, element.name) < 0:
        raise ParameterError(
            f"gear {gear.name} ({gear.listed}): with positive torque at the input the freewheel {element.name} does not hold, "
            f"{_shaft(element.b)} runs ahead of {_shaft(element.a)}; reversed it is {element.b}{ARROW}{element.a}"
        )


def _check_overruns(scheme: GearScheme, gear: SchemeGear, element: ShiftElement) -> None:
    speeds = scheme.speeds(gear.name) | {HOUSING: 0.0}
    ahead = speeds[element.b] - speeds[element.a]
    if ahead < -SAME_SPEED:
        raise ParameterError(
            f"gear {gear.name} ({gear.listed}): the freewheel {element.name} blocks, because {_shaft(element.b)} would fall behind "
            f"{_shaft(element.a)} by {-ahead:.4g} times the speed of the input; reversed it is {element.b}{ARROW}{element.a}"
        )


def _check_coast(scheme: GearScheme, gear: SchemeGear) -> None:
    where = f"gear {gear.name} ({gear.listed})"
    if one_way := [each.name for each in scheme.elements if each.freewheel and each.name in gear.coast]:
        raise ParameterError(
            f"{where}: the freewheel {one_way[0]} cannot be pressed for overrun; write it without parentheses"
        )
    carrying = scheme.freewheels(gear.name)
    if not carrying:
        raise ParameterError(f"{where}: no freewheel carries torque, so nothing has to be pressed for overrun")
    network = scheme.network(gear.name, coast=True)
    in_place = f"{', '.join(gear.coast)} in place of {', '.join(carrying)}"
    if network.freedom != 1:
        raise ParameterError(f"{where}: with {in_place} the gear has {network.freedom} degrees of freedom, and not one")
    drive, motion = scheme.speeds(gear.name), network.motion()
    other = {
        s for s in scheme.shafts if abs(drive[s] - (motion[k] if (k := network.nodes[s]) >= 0 else 0)) > SAME_SPEED
    }
    if other:
        raise ParameterError(
            f"{where}: with {in_place} the speed of {_shaft(min(other))} is another one, so this is another gear"
        )


def _shaft(name: str) -> str:
    return f"the {name}" if name == HOUSING else f"shaft {name}"
