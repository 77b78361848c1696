"""The friction disks between the cams and the cage, pressed by the axial force of the rollers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal, get_args

from powertrain import ParameterError, arguments_checked

Wear = Literal["pressure", "wear"]


@arguments_checked
@dataclass(frozen=True)
class FrictionDisk:
    """A friction disk on the back of each cam.

    Errors: ParameterError for diameters or a coefficient of friction out of range, or an unknown ``uniform``.
    """

    d_out: float
    """Outer diameter [m]."""
    d_in: float
    """Inner diameter [m]."""
    mu: float
    """Coefficient of friction [1]."""
    uniform: Wear = "pressure"
    """What is uniform over the disk: "pressure" (a new disk), or "wear" (a run-in disk)."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.d_out) and self.d_out > self.d_in >= 0):
            raise ParameterError(
                f"FrictionDisk: d_in = {self.d_in:g} m and d_out = {self.d_out:g} m: a ring needs 0 <= d_in < d_out"
            )
        if not 0 <= self.mu < math.inf:
            raise ParameterError(f"FrictionDisk: mu = {self.mu:g} must be zero or positive, and finite")

    @property
    def D_R(self) -> float:
        """Effective diameter of the friction force [m]."""
        return float(friction_diameter(self.d_out, self.d_in, self.uniform))

    def torque(self, force: float) -> float:
        """Friction torque [N.m] at an axial force [N], eq. (34)."""
        return self.mu * force * self.D_R / 2


def friction_diameter(d_out: Any, d_in: Any, uniform: Wear = "pressure") -> Any:
    """Effective friction diameter of a ring: eq. (35) for uniform pressure, the mean diameter for uniform wear.

    Uniform pressure weights each radius by its area; uniform wear (constant pressure times radius) weights all radii equally. Errors:
    ParameterError for an unknown ``uniform``.

    >>> round(1000 * friction_diameter(0.095, 0.045), 4), round(1000 * friction_diameter(0.095, 0.045, "wear"), 4)
    (72.9762, 70.0)
    """
    if uniform not in get_args(Wear):
        raise ParameterError(f"uniform = {uniform!r} is not one of {', '.join(get_args(Wear))}")
    if uniform == "wear":
        return (d_out + d_in) / 2
    return 2 / 3 * (d_out + d_in - d_out * d_in / (d_out + d_in))  # (35) without its 0/0 for a thin ring
