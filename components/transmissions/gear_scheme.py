"""Gear schemes: planetary sets, joined shafts, and the shift elements engaged in each gear."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Self

import numpy as np

from powertrain import ParameterError, arguments_checked
from powertrain.components.transmissions.network import HOUSING, Joint, Lever, Network
from powertrain.components.transmissions.shift_table import ARROW, SchemeGear, ShiftElement

SAME_SPEED = 1e-9
"""Speeds with a smaller difference, relative to the input, are equal."""


@dataclass(frozen=True)
class GearScheme:
    """A gearset: levers on named shafts, shift elements between shafts, and the elements that each gear engages.

    ``gears`` are the forward gears, lowest first, followed by the reverse gears. Adjacent forward gears differ in one element that opens
    and one that closes. Shafts in ``joints`` are joined in every gear. A freewheel is an element that is never pressed: it is listed in
    the gears that it holds with positive torque at the input; ``SchemeGear.coast`` can be pressed to hold them in overrun as well.
    ``of`` reads a scheme as drawn and tabulated:

    >>> from powertrain.components.transmissions import GearScheme, planetary
    >>> simpson = GearScheme.of(
    ...     planetary("front", "suns", "ring", "out", teeth=(33, 72)),
    ...     planetary("rear", "suns", "out", "carrier", teeth=(33, 72)),
    ...     elements={"forward": "in-ring", "direct": "in-suns", "band": "suns-housing", "low": "carrier-housing"},
    ...     gears={"1": "forward low", "2": "forward band", "3": "forward direct", "R": "direct low"},
    ... )
    >>> [round(simpson.ratio(gear.name), 2) for gear in simpson.gears]
    [2.46, 1.46, 1.0, -2.18]

    Errors: ParameterError for a gear whose elements do not leave one degree of freedom, for an element at a shaft that no other part has,
    for a freewheel in the wrong direction, and for forward gears that are not in order.
    Theory: H. L. Benford, M. B. Leising, The lever analogy, SAE 810102, 1981.
    """

    levers: tuple[Lever, ...]
    elements: tuple[ShiftElement, ...]
    gears: tuple[SchemeGear, ...]
    input: str = "in"
    output: str = "out"
    joints: tuple[Joint, ...] = ()

    def __post_init__(self) -> None:
        self._check_names()
        self._check_shafts()
        for gear in self.gears:
            try:
                self.network(gear.name).motion()
            except ParameterError as error:
                raise ParameterError(f"gear {gear.name} ({gear.listed}): {error}") from None
        self._check_direction()
        _check_freewheels(self)
        for one, other in pairwise(self.forward):
            self._check_step(one, other)

    @classmethod
    @arguments_checked
    def of(
        cls,
        *levers: Lever,
        elements: Mapping[str, str],
        gears: Mapping[str, str | Iterable[str]],
        input: str = "in",
        output: str = "out",
    ) -> Self:
        """A scheme from strings.

        Parameters
        ----------
        *levers : Lever
            Planetary sets, from ``planetary``, ``double_planetary`` and ``ravigneaux``, and pairs of gears.
        elements : mapping of str to str
            Name of each shift element, and the shafts that it connects: ``"shaft-shaft"``, or ``"shaft-housing"`` for a brake;
            ``"shaft->shaft"`` for a freewheel: the first shaft drives the second, which may run ahead.
        gears : mapping of str to str
            Name of each gear, and the elements engaged in it: a string of names separated by spaces, or a sequence of names. Elements in
            parentheses are pressed for overrun only, in place of freewheels: ``"forward sprag (low)"``.
        input, output : str
            Names of the input and the output shaft.

        Raises
        ------
        ParameterError
            If a gear does not have one degree of freedom, or if adjacent gears exchange more than one element.
        """
        made = tuple(ShiftElement.of(name, shafts) for name, shafts in elements.items())
        return cls(levers, made, tuple(SchemeGear.of(name, row) for name, row in gears.items()), input, output)

    @cached_property
    def shafts(self) -> tuple[str, ...]:
        """Names of the rotating shafts."""
        return tuple(name for name in self.free.shafts if name != HOUSING)

    @cached_property
    def free(self) -> Network:
        """The gearset with all elements open."""
        return self._joined(())

    @cached_property
    def forward(self) -> tuple[SchemeGear, ...]:
        """The gears that turn the output forward, in the order of the table."""
        return tuple(gear for gear in self.gears if self.ratio(gear.name) > 0)

    @cached_property
    def reverse(self) -> tuple[SchemeGear, ...]:
        """The gears that turn the output backward."""
        return tuple(gear for gear in self.gears if self.ratio(gear.name) < 0)

    def gear(self, name: str) -> SchemeGear:
        """The gear with a name. Errors: ParameterError if there is none."""
        for gear in self.gears:
            if gear.name == name:
                return gear
        raise ParameterError(f"there is no gear {name!r}; choose from {', '.join(gear.name for gear in self.gears)}")

    def network(self, name: str, without: Iterable[str] = (), *, coast: bool = False) -> Network:
        """The gearset in a gear, with the elements ``without`` open; ``coast``: with its overrun elements in place of freewheels."""
        gear = self.gear(name)
        closed = {*gear.engaged, *gear.coast}.difference(self.freewheels(name)) if coast else set(gear.engaged)
        closed -= set(without)
        return self._joined(element.joint for element in self.elements if element.name in closed)

    def freewheels(self, name: str) -> tuple[str, ...]:
        """The freewheels that carry torque in a gear. With any, only the elements of ``SchemeGear.coast`` let it carry overrun."""
        engaged = self.gear(name).engaged
        return tuple(
            x.name for x in self.elements if x.freewheel and x.name in engaged and self.slip_factor(name, x.name)
        )

    def ratio(self, name: str) -> float:
        """Speed of the input over speed of the output in a gear."""
        return self.network(name).fixed_ratio()

    def speeds(self, name: str) -> dict[str, float]:
        """Speed of every shaft in a gear for an input speed of 1."""
        network = self.network(name)
        motion = network.motion()
        return {shaft: float(motion[node]) if (node := network.nodes[shaft]) >= 0 else 0.0 for shaft in self.shafts}

    def torque_factor(self, name: str, element: str) -> float:
        """Torque of an element without losses in a gear, relative to the input torque: 1/|alpha| of ``slip_factor``.

        The torques do no net work while the element slips, so T_in + alpha T = 0. It is 0 for an element that holds an idle shaft.
        """
        alpha = self.slip_factor(name, element)
        return 1 / abs(alpha) if alpha else 0.0

    def slip_factor(self, name: str, element: str) -> float:
        """The alpha in the slip w_a - w_b = alpha (w_in - ratio w_out) of an engaged element that opens; 0 if it holds an idle shaft.

        An element for overrun opens while the gear's other elements for overrun hold in place of its freewheels.
        """
        network = self.network(name, (element,), coast=element not in self.gear(name).engaged)
        one, other = next(each.joint for each in self.elements if each.name == element)
        try:
            parts = network.speeds()
        except ParameterError:
            return 0.0
        at = network.nodes
        return float(sum(sign * parts[at[end], 0] for end, sign in ((one, 1), (other, -1)) if at[end] >= 0))

    def in_gear(self, name: str, *, coast: bool = False) -> GearScheme:
        """The scheme with one gear only: its elements are rigid joints, except freewheels that carry; the others are left out.

        A planetary set that turns as a block, or is held, is a joint, too. With ``coast`` the elements for overrun are joints, and no
        freewheel is left.
        """
        coast = coast and bool(self.gear(name).coast)
        kept = () if coast else self.freewheels(name)
        held = tuple(joint for joint in self.network(name, kept, coast=coast).joints if joint[0] != joint[1])
        elements = tuple(element for element in self.elements if element.name in kept)
        alone = replace(self, elements=elements, gears=(SchemeGear(name, kept),), joints=held)
        while (block := alone._block()) is not None:
            levers = tuple(lever for lever in alone.levers if lever is not block)
            joints = (*alone.joints, (block.a, block.carrier), (block.b, block.carrier))
            alone = replace(alone, levers=levers, joints=joints)
        return alone

    def _block(self) -> Lever | None:
        """A lever whose members have the same speed in every motion."""
        nodes = self.free.nodes
        motions = np.vstack([self.free.motions, np.zeros(self.free.freedom)])  # node -1, the last, is the housing
        for lever in self.levers:
            ends = motions[[nodes[lever.a], nodes[lever.b]]] - motions[nodes[lever.carrier]]
            if np.abs(ends).max() < SAME_SPEED:
                return lever
        return None

    def _joined(self, joints: Iterable[Joint]) -> Network:
        ends = self.input, self.output
        alone = tuple(
            (shaft, shaft) for element in self.elements for shaft in element.joint
        )  # shafts need not have a lever
        return Network(self.levers, ends, (*alone, *self.joints, *joints), *ends)

    def _check_names(self) -> None:
        """Names are unique, and gears engage elements that exist."""
        known, gears = [element.name for element in self.elements], [gear.name for gear in self.gears]
        for what, names in (("shift elements", known), ("gears", gears)):
            if twice := [name for name in names if names.count(name) > 1]:
                raise ParameterError(f"two {what} have the name {twice[0]!r}")
        for gear in self.gears:
            if unknown := [name for name in (*gear.engaged, *gear.coast) if name not in known]:
                raise ParameterError(
                    f"gear {gear.name} engages {unknown[0]!r}; the shift elements are {', '.join(known)}"
                )

    def _check_shafts(self) -> None:
        """Input, output and the shafts of elements must also belong to another part; otherwise a name is misspelt."""
        members = [shaft for x in self.levers for shaft in (x.a, x.b, x.carrier)]
        joined = [shaft for pair in self.joints for shaft in pair]
        at: dict[str, tuple[str, ...]] = {"input": (self.input,), "output": (self.output,)}
        at |= {f"shift element {element.name}": element.joint for element in self.elements}
        for what, shafts in at.items():
            if len(shafts) == 2 and shafts[0] == shafts[1]:
                raise ParameterError(f"the {what} is between the shaft {shafts[0]!r} and itself; it needs two shafts")
            met = [HOUSING, *members, *joined, *(shaft for name, pair in at.items() if name != what for shaft in pair)]
            if lone := [shaft for shaft in shafts if shaft not in met]:
                raise ParameterError(
                    f"the {what} is at the shaft {lone[0]!r}, where nothing else is; the shafts of the planetary sets are "
                    f"{', '.join(dict.fromkeys(members))}"
                )

    def _check_direction(self) -> None:
        """The first gear must be a forward one: with a reversed output, forward gears would be taken for reverse gears."""
        if not self.gears:
            raise ParameterError("the shift table has no gears")
        if self.gears[0] in self.reverse:
            raise ParameterError(
                f"gear {self.gears[0].name} has the ratio {self.ratio(self.gears[0].name):.4g}, it turns the output backward; list the "
                "forward gears first. A pair of transfer gears that turns the output round has a positive ratio here"
            )

    def _check_step(self, one: SchemeGear, other: SchemeGear) -> None:
        if self.ratio(one.name) <= self.ratio(other.name):
            raise ParameterError(
                f"gear {one.name} has the ratio {self.ratio(one.name):.4g}, gear {other.name} {self.ratio(other.name):.4g}; list the "
                "forward gears from the highest ratio to the lowest"
            )
        opens, closes = set(one.engaged) - set(other.engaged), set(other.engaged) - set(one.engaged)
        if len(opens) != 1 or len(closes) != 1:
            raise ParameterError(
                f"from gear {one.name} ({', '.join(one.engaged)}) to gear {other.name} ({', '.join(other.engaged)}) {len(opens)} elements "
                f"open and {len(closes)} close; a clutch-to-clutch shift exchanges one for one"
            )


def _check_freewheels(scheme: GearScheme) -> None:
    """The directions of the freewheels, and what replaces them in overrun.

    With a freewheel a -> b open, w_a - w_b = alpha (w_in - ratio w_out). Without losses the torque T on a balances the input's,
    T_in + alpha T = 0, and the freewheel can only brake a. In a gear that it holds, alpha must therefore be positive; in all others b
    must not fall behind a. A freewheel of gear k that gear k + 1 exchanges for another element overruns there, as w_in < ratio w_out;
    in gear k - 1 it would block. Freewheels open in upshifts and never close in them: the element that closes controls an upshift.
    Errors: ParameterError for a freewheel in the wrong direction or without purpose, and for overrun elements that hold another gear.
    """
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
