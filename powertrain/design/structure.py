"""Structures of split-path transmissions with auxiliary gears and several ranges: the designer's choices and the resulting networks.

A unit's shaft on a planetary between input and output turns at w_x = sigma (w_out - m w_in); m is its mechanical point. A shaft geared to
the input turns at sigma w_in (its mechanical point is infinite), one geared to the output at sigma w_out (it is 0). Speeds, the share of
the unit, its torque and size depend only on m and sigma of both shafts. The basic ratio of the planetary determines how this is divided
between the gear behind the planetary, i = mu/m (w_last = i w_out), and the gear beside the unit, g = sigma (1 - mu)/i, where mu is the
planetary's own mechanical point, R of its layout. Where ranges meet, both shafts of the unit keep their speeds; this determines sigma of
the next range. If its mechanical point lies beyond the shift, the unit runs back.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

import powertrain as pt
from powertrain.components.transmissions import HOUSING, Layout, Lever, Network, members, relative_ratio
from powertrain.design.duty import Vector

Side = Literal["input", "output"] | Layout
"""The position of a unit's shaft: geared to input or output, or on a planetary with members at input, unit and output."""
Ends = tuple[Side, Side]
_PLAIN = ("input", "output")


@dataclass(frozen=True)
class Structure:
    """The sides of a unit's shafts a and b in every range, from the lowest up.

    ("input", "abH") is an input-coupled transmission of type 4, ("Hba", "output") an output-coupled one of type 2, two planetaries a
    compound split. Errors: ParameterError for other sides, and for ranges without a planetary.
    """

    ranges: tuple[Ends, ...]

    def __post_init__(self) -> None:
        if not self.ranges:
            raise pt.ParameterError("a structure needs a range")
        for ends in self.ranges:
            for side in ends:
                if side not in _PLAIN and side not in get_args(Layout):
                    raise pt.ParameterError(
                        f"the side {side!r} must be one of input, output, {', '.join(get_args(Layout))}"
                    )
            if all(side in _PLAIN for side in ends):
                raise pt.ParameterError(
                    f"the unit from {ends[0]} to {ends[1]} has no planetary beside it: no power is split"
                )

    def __str__(self) -> str:
        return " | ".join("-".join(ends) for ends in self.ranges)

    @cached_property
    def planetaries(self) -> tuple[tuple[int, int], ...]:
        """(range, shaft of the unit) of the planetaries."""
        return tuple((k, s) for k, ends in enumerate(self.ranges) for s, side in enumerate(ends) if side not in _PLAIN)

    @property
    def parameters(self) -> int:
        """The number of a design's parameters: mechanical point and basic ratio of every planetary, and the ratios at which ranges meet."""
        return 2 * len(self.planetaries) + len(self.ranges) - 1


@dataclass(frozen=True)
class Designs:
    """Designs of one structure: mechanical points and basic ratios (designs, planetaries), shifts (designs, ranges - 1), gears of the unit.

    ``scale``: sigma of the unit's shafts in the first range (designs, 2).
    """

    structure: Structure
    m: Vector
    R_o: Vector
    shifts: Vector
    scale: Vector

    def mechanical_point(self, k: int, side: int) -> Vector:
        """The mechanical point of one shaft in one range: infinite at the input, 0 at the output."""
        kind = self.structure.ranges[k][side]
        if kind in _PLAIN:
            return np.full(len(self.scale), np.inf if kind == "input" else 0.0)
        return np.asarray(self.m[:, self.structure.planetaries.index((k, side))], float)

    def _form(self, k: int, side: int, r: Vector) -> Vector:
        """w_x/(sigma w_in): 1, r or r - m."""
        m = self.mechanical_point(k, side)
        if self.structure.ranges[k][side] == "input":
            return np.ones(np.broadcast_shapes(r.shape, (len(m), 1)))
        return np.asarray(r - m[:, None], float)

    @cached_property
    def sigma(self) -> Vector:
        """The factors sigma of every range and shaft, (designs, ranges, 2), with which speeds are continuous at shifts, if possible."""
        found = [self.scale]
        for k in range(1, len(self.structure.ranges)):
            at = self.shifts[:, k - 1 : k]
            with np.errstate(divide="ignore", invalid="ignore"):
                step = [(self._form(k - 1, s, at) / self._form(k, s, at))[:, 0] for s in (0, 1)]
            found.append(found[-1] * np.stack(step, axis=1))
        return np.stack(found, axis=1)

    def unit_speeds(self, k: int, r: Vector) -> tuple[Vector, Vector]:
        """Speeds of the unit's shafts over input speed at r, (designs or 1, points), in a range."""
        a, b = (self.sigma[:, k, s, None] * self._form(k, s, r) for s in (0, 1))
        return a, b

    def scaled(self, a: Vector, b: Vector) -> Designs:
        """Other gears beside the unit: shaft a turns faster by the factor a, shaft b by b."""
        return Designs(self.structure, self.m, self.R_o, self.shifts, self.scale * np.stack([a, b], axis=1))

    def take(self, rows: Sequence[int] | NDArray[np.intp]) -> Designs:
        """Some of them."""
        chosen = np.asarray(rows, int)
        return Designs(self.structure, self.m[chosen], self.R_o[chosen], self.shifts[chosen], self.scale[chosen])

    def networks(self, k: int, eta: float, eta_pair: float) -> tuple[Network, Vector]:
        """The network of a range, with the ratios of the first feasible design, and the ratios of its levers for all designs."""
        levers, columns = [], []
        for s, side in enumerate(self.structure.ranges[k]):
            at = "ab"[s]
            sigma = self.sigma[:, k, s]
            if side in _PLAIN:
                levers.append(("beside " + at, f"unit {at}", "in" if side == "input" else "out", HOUSING, eta_pair))
                columns.append(sigma)
                continue
            R_o = self.R_o[:, self.structure.planetaries.index((k, s))]
            mu = np.array([relative_ratio(side, float(x)) for x in R_o])
            with np.errstate(divide="ignore", invalid="ignore"):
                i = mu / self.mechanical_point(k, s)
            place = dict(zip(members(side), ("in", f"inner {at}", f"last {at}"), strict=True))
            levers += [
                ("planetary " + at, place["a"], place["b"], place["carrier"], eta),
                ("behind " + at, f"last {at}", "out", HOUSING, eta_pair),
                ("beside " + at, f"unit {at}", f"inner {at}", HOUSING, eta_pair),
            ]
            columns += [R_o, i, sigma * (1 - mu) / i]
        ratios = np.stack(columns, axis=1)
        ratios[~np.isfinite(ratios).all(axis=1) | (ratios == 0).any(axis=1)] = np.nan
        sound = np.flatnonzero(np.isfinite(ratios[:, 0]))
        shown = ratios[sound[0]] if sound.size else np.full(len(levers), -1.0)
        made = [Lever(n, a, b, c, float(x), e) for (n, a, b, c, e), x in zip(levers, shown, strict=True)]
        return Network(tuple(made), ("unit a", "unit b")), ratios


def _common() -> Iterator[Structure]:
    for layout in get_args(Layout):
        behind: Ends = ("input", layout)
        before: Ends = (layout, "output")
        compound: Ends = (layout, layout)
        for ranges in ((behind,), (before,), (behind, behind), (before, compound), (before, compound, compound)):
            yield Structure(ranges)


COMMON = tuple(_common())
"""Common structures: input-coupled, output-coupled, input-coupled with two ranges, two-mode (output-coupled, then compound), three-mode."""
