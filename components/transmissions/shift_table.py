"""Shift elements and the rows of a shift table."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self

from powertrain import ParameterError, arguments_checked
from powertrain.components.transmissions.network import HOUSING, Joint, joints

ARROW = "->"


@dataclass(frozen=True)
class SchemeGear:
    """A gear: its name, the shift elements engaged in it, and those that replace its freewheels in overrun if they are pressed."""

    name: str
    engaged: tuple[str, ...]
    coast: tuple[str, ...] = ()

    @classmethod
    @arguments_checked
    def of(cls, name: str, listed: str | Iterable[str]) -> Self:
        """A gear from a row of a shift table; elements in parentheses are those for overrun: ``"forward sprag (low)"``."""
        engaged: list[str] = []
        coast: list[str] = []
        inside = False
        for word in listed.split() if isinstance(listed, str) else listed:
            inside = inside or word.startswith("(")
            (coast if inside else engaged).append(word.removeprefix("(").removesuffix(")") if inside else word)
            inside = inside and not word.endswith(")")
        if inside:
            raise ParameterError(f"gear {name}: the parenthesis before {', '.join(coast)} is not closed")
        return cls(name, tuple(engaged), tuple(coast))

    @property
    def listed(self) -> str:
        """The row as messages quote it."""
        return ", ".join((*self.engaged, *(f"({name})" for name in self.coast)))


@arguments_checked
@dataclass(frozen=True)
class ShiftElement:
    """A clutch between two shafts, or a brake between a shaft and ``HOUSING``; or a ``freewheel``, whose b may run ahead of a."""

    name: str
    a: str
    b: str
    freewheel: bool = False

    @classmethod
    @arguments_checked
    def of(cls, name: str, shafts: str) -> Self:
        """``"shaft-shaft"``; ``"shaft->shaft"`` for a freewheel through which the first shaft drives the second."""
        ((a, b),) = joints(shafts.replace(ARROW, "-"))
        return cls(name, a, b, ARROW in shafts)

    @property
    def is_brake(self) -> bool:
        """Whether it holds a shaft."""
        return HOUSING in (self.a, self.b)

    @property
    def joint(self) -> Joint:
        """The joint that it makes when engaged."""
        return self.a, self.b
