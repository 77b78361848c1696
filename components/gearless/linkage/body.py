"""The parts of the linkage differential as solids, for drawings and manufacture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from powertrain import ParameterError, arguments_checked
from powertrain.components.gearless.linkage.kinematics import Linkage
from powertrain.components.gearless.solids import placed, revolved

Array = NDArray[np.float64]
Y = np.array([0.0, 1.0, 0.0])
_RINGS = 16
"""Rings along a bar: plots sort triangles by their centre, so parts behind would show through long triangles."""


@arguments_checked
@dataclass(frozen=True)
class LinkageBody:
    """Radii of the parts [m]: couplers and lever are round bars as in Table 5.1, with balls and eyes at their pairs.

    ``rod``: the cage's rod of the C-pair; ``shaft``: output shafts. Errors: ParameterError for a radius that is not positive, if a ball is
    not thicker than its bar, or if bars are too thick for their length.
    """

    linkage: Linkage
    bar: float = 0.006
    ball: float = 0.010
    rod: float = 0.007
    shaft: float = 0.009

    def __post_init__(self) -> None:
        for name, value in (("rod", self.rod), ("shaft", self.shaft)):
            if not 0 < value < np.inf:
                raise ParameterError(f"LinkageBody: {name} = {value:g} m must be positive and finite")
        if not 0 < self.bar < self.ball:
            raise ParameterError(f"a ball of {self.ball:g} m radius does not hold a bar of {self.bar:g} m radius")
        if not 2 * self.ball < min(self.linkage.a, self.linkage.b):
            raise ParameterError(
                f"balls of {self.ball:g} m radius touch each other on links of {min(self.linkage.a, self.linkage.b):g} m"
            )

    def solids(self, alpha: float = 0.6) -> dict[str, Array]:
        """Closed surfaces of the parts at an angle of the left shaft against the cage, triangles (n, 3, 3) [m], in axes of the cage.

        The parts are coupler left, coupler right, lever, rod, shaft left, shaft right, each for ``gearless.solids.write_stl``.
        """
        points = self.linkage.points(alpha)
        found: dict[str, Array] = {}
        for side, sense in (("left", -1.0), ("right", 1.0)):
            hinge, ball = points[f"R_{side}"], points[f"S_{side}"]
            found[f"coupler {side}"] = placed(self._dumbbell(self.linkage.a), hinge, ball - hinge)
            found[f"shaft {side}"] = placed(self._shaft(), hinge, np.array([sense, 0.0, 0.0]))
        ends = points["S_right"] - points["S_left"]
        found["lever"] = placed(self._dumbbell(2 * self.linkage.b, 1.35), points["S_left"], ends)
        reach = 1.3 * self.linkage.a + self.rod
        found["rod"] = placed(_cylinder(self.rod, 2 * reach), -reach * Y, Y)
        return found

    def _dumbbell(self, length: float, size: float = 1.0) -> Array:
        """A bar with a ball at either end, the first one at the origin."""
        ball, bar = size * self.ball, size * self.bar
        neck = float(np.arccos(bar / ball))
        low = np.linspace(-np.pi / 2, neck, 25)
        ends = ball * np.sin(low), length - ball * np.sin(low[::-1])
        between = np.linspace(ends[0][-1], ends[1][0], _RINGS)[1:-1]
        heights = np.concatenate([ends[0], between, ends[1]])
        radii = np.concatenate([ball * np.cos(low), np.full(between.size, bar), ball * np.cos(low[::-1])])
        return revolved(np.stack([heights, radii], axis=1))

    def _shaft(self) -> Array:
        """An output shaft with a head that carries the hinge."""
        head, length, r = 1.5 * self.ball, 1.2 * self.linkage.a, self.shaft
        gap = 0.6 * self.ball
        profile = [
            (gap, 0.0),
            (gap, head),
            (gap + self.ball, head),
            (gap + self.ball, r),
            (gap + length, r),
            (gap + length, 0.0),
        ]
        return revolved(np.array(profile))


def _cylinder(radius: float, length: float) -> Array:
    heights = np.linspace(0, length, _RINGS)
    return revolved(np.array([(0.0, 0.0), *((x, radius) for x in heights), (length, 0.0)]))
