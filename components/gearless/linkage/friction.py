"""Friction in the joints of the linkage as a loss of its relative motion."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain import ParameterError, arguments_checked
from powertrain.components.gearless.linkage.kinematics import Linkage, Loop

Array = NDArray[np.float64]


@arguments_checked
@dataclass(frozen=True)
class JointFriction:
    """Coefficients of friction [1] and sizes [m] of the joints. With coefficients of 0 the differential has no loss.

    mu_shaft, r_shaft: output shaft in the cage;  mu_pin, r_pin, l_pin: R-pair of coupler and shaft, radius and length of its pin;
    mu_ball, r_ball: S-pair;  mu_rod, r_rod, l_rod: C-pair, radius of its rod and length of its bore.
    """

    mu_shaft: float = 0.0
    mu_pin: float = 0.0
    mu_ball: float = 0.0
    mu_rod: float = 0.0
    r_shaft: float = 0.0125
    r_pin: float = 0.0125
    l_pin: float = 0.04
    r_ball: float = 0.01
    r_rod: float = 0.0125
    l_rod: float = 0.06

    def __post_init__(self) -> None:
        """Checks the values."""
        for field in fields(self):
            value, length = getattr(self, field.name), field.name.startswith("l_")
            if not (np.isfinite(value) and (value > 0 if length else value >= 0)):
                unit = "" if field.name.startswith("mu_") else " m"
                raise ParameterError(
                    f"joint friction: {field.name} = {value:g}{unit} must be {'positive' if length else 'zero or positive'}"
                )

    def kappa(self, linkage: Linkage, alpha: ArrayLike) -> Array:
        """Locking number kappa over alpha: |T_right - T_left| = kappa |T_crown| while the sides turn against each other."""
        return np.asarray(kappa(linkage.loop(alpha), linkage.a, linkage.b, linkage.d, self))

    def eta_0(self, linkage: Linkage, alpha: ArrayLike) -> Array:
        """Efficiency from one side to the other with the cage held, (1 - kappa)/(1 + kappa); self-locking if it is not above 0."""
        locking = self.kappa(linkage, alpha)
        return (1 - locking) / (1 + locking)


def kappa(loop: Loop, a: Any, b: Any, d: Any, joints: Any, of: Any = np) -> Any:
    """Locking number from the joint forces without friction, to first order in the coefficients of friction.

    Without friction each side carries T_crown/2, which causes a force F = T_crown/(2 a cos_beta) perpendicular to each coupler (7.1), along
    the axis n of its R-pair. For a unit rotation of a shaft against the cage, friction does the following work; kappa T_crown is the sum:

    shaft in the cage: mu r F on either side (the bearing is longer than 2 a sin_beta, so its two reactions add up to F);
    pin: thrust F on a collar of the pin's radius, and the moment a F as two forces a F/l_pin: mu r F (1 + 2 a/l_pin) |beta'|;
    ball, loaded at the pole of F: coupler against lever turns by x + beta' n - theta' y, perpendicular to n by sqrt(1 + theta'^2 c^2);
    rod: force 2 F |c| and moment 2 b F |s| in planes that are nearly perpendicular, so at the two ends of the bore together at most
    2 F sqrt(c^2 + (2 b s/l_rod)^2) (exact at theta = 0), over the distance sqrt(S'^2 + r^2 theta'^2).

    The axial forces of couplers assembled under prestress are unknown and would add to this; inertia forces are neglected.
    """
    s, c, _, C, _, Q = loop
    shaft = joints.mu_shaft * joints.r_shaft
    pin = joints.mu_pin * joints.r_pin * (1 + 2 * a / joints.l_pin) * Q * of.fabs(s * c)
    ball = joints.mu_ball * joints.r_ball * of.sqrt(1 + (Q * c**2) ** 2)
    load, way = c**2 + (2 * b * s / joints.l_rod) ** 2, (d * s) ** 2 + (joints.r_rod * c) ** 2
    rod = joints.mu_rod * Q * of.sqrt(load * way)
    return (shaft + pin + ball + rod) / (a * C)
