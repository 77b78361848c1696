"""Kinematics of the spatial linkage RRSCSRR: smooth closed forms for all angles of the shafts.

B. Madhavan, Systematic design of gearless differentials and analysis of a potential mechanism, M.S. 96-7, University of Maryland, 1996.

Axes of the cage, with the origin where the C axis meets the shaft axis: x along the shafts to the right, y along the C axis,
z = x x y. A coupler of length a turns with its shaft about x by alpha and against it by beta; its other end holds, in an S-pair, the
end of a lever of half length b, which turns by theta about y and slides by S along y. The R-pairs of the couplers are on the shaft
axis, at d = b - offset from the centre on both sides. A half-turn about y exchanges left and right; hence alpha_right = -alpha_left.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain import ParameterError, arguments_checked

Array = NDArray[np.float64]
HALF_TURN: Array = np.array([-1.0, 1.0, -1.0])
"""Factors of the coordinates in a half-turn about y."""


class Loop(NamedTuple):
    """The closed loop at one angle, as numbers or symbols: quantities that keep all other expressions short.

    s, c = sin alpha, cos alpha;  sin_beta, cos_beta;  R = d - a c^2 sin_beta;  Q = a cos_beta/R
    d beta/d alpha = Q s c,  d theta/d alpha = Q c,  d S/d alpha = -Q s d
    """

    s: Any
    c: Any
    sin_beta: Any
    cos_beta: Any
    R: Any
    Q: Any


def closed_loop(alpha: Any, a: Any, b: Any, d: Any, of: Any = np) -> Loop:
    """Solve the loop. ``of``: numpy, or casadi for symbols.

    Both halves must agree on the S-pair (5.21)-(5.23): a sin beta = d - b cos theta, a sin alpha cos beta = b sin theta, S = a cos
    alpha cos beta. Without theta: a^2 c^2 X^2 - 2 a d X + d^2 - b^2 + a^2 s^2 = 0 in X = sin beta, whose smaller root has the
    discriminant R^2 = d^2 - c^2 (d^2 - b^2 + a^2 s^2) and, free of 0/0, X = (d^2 - b^2 + a^2 s^2)/(a (d + R)). For d = b, k = a/b, D = R/b
    this is sin beta = k s^2/(1 + D). Near 90 and 0 degrees (5.38) and (5.30) lose all digits, and (5.39) is 0 times infinity.
    The derivatives in ``Loop`` follow from the same three equations by b^2 = (d - a X)^2 + a^2 s^2 cos_beta^2.
    """
    s, c = of.sin(alpha), of.cos(alpha)
    K = (d - b) * (d + b) + (a * s) ** 2
    R = of.sqrt(d**2 - c**2 * K)
    X = K / (a * (d + R))
    C = of.sqrt(1 - X**2)
    return Loop(s, c, X, C, R, a * C / R)


class Motion(NamedTuple):
    """Lever and couplers over alpha: angles [rad], slide [m], their first (1) and second (2) derivatives with respect to alpha."""

    alpha: Array
    theta: Array
    beta: Array
    S: Array
    theta1: Array
    beta1: Array
    S1: Array
    theta2: Array
    beta2: Array
    S2: Array


@arguments_checked
@dataclass(frozen=True)
class Linkage:
    """The lengths of the mechanism [m]: coupler a, half lever b, and the offset of the C axis towards the R-pairs (7.3).

    Errors: ParameterError if it cannot be assembled at every angle, which requires a triangle of a, b and d = b - offset:
    |offset| < a < 2 b - offset. Without offset this is (5.34), 0 < a/b < 2.
    """

    a: float = 0.03
    b: float = 0.06
    offset: float = 0.0

    def __post_init__(self) -> None:
        """Checks the lengths."""
        for name in "a", "b":
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise ParameterError(f"linkage: {name} = {value:g} m must be positive and finite")
        if not np.isfinite(self.offset):
            raise ParameterError(f"linkage: offset = {self.offset:g} m must be finite")
        if abs(self.offset) >= self.a:
            raise ParameterError(
                f"linkage: offset = {self.offset:g} m must be less than a = {self.a:g} m in size, "
                "or the coupler does not reach the lever's end at alpha = 0"
            )
        if self.a + self.offset >= 2 * self.b:
            limit = 2 - self.offset / self.b
            raise ParameterError(
                f"linkage: a/b = {self.a / self.b:g} is outside (0, {limit:g}) (a = {self.a:g} m, b = {self.b:g} m, offset = "
                f"{self.offset:g} m): the coupler does not reach the lever's end at alpha = 90 degrees"
            )

    @property
    def d(self) -> float:
        """Distance of the couplers' R-pairs from the C axis [m]."""
        return self.b - self.offset

    def loop(self, alpha: ArrayLike) -> Loop:
        """The closed loop at the angles ``alpha`` of the left shaft against the cage [rad]."""
        return closed_loop(np.asarray(alpha, float), self.a, self.b, self.d)

    def motion(self, alpha: ArrayLike) -> Motion:
        """Lever and couplers over ``alpha``, with derivatives.

        sin(theta) = (a/b) s cos_beta, cos(theta) = (d - a sin_beta)/b; without offset also sin(theta/2) = k s/sqrt(2 (1 + D)).
        """
        alpha = np.asarray(alpha, float)
        a, d = self.a, self.d
        s, c, X, C, R, Q = self.loop(alpha)
        theta, S = np.arctan2(a * s * C, d - a * X), a * c * C
        beta1 = Q * s * c
        Q1 = -a * beta1 * (3 * X - c**2 * C * Q) / R
        beta2, theta2, S2 = Q1 * s * c + Q * (c**2 - s**2), Q1 * c - Q * s, -d * (Q1 * s + Q * c)
        return Motion(alpha, theta, np.arcsin(X), S, Q * c, beta1, -Q * s * d, theta2, beta2, S2)

    @property
    def theta_max(self) -> float:
        """Maximum angle of the lever, at alpha = 90 degrees (5.32), (6.1) [rad]."""
        return float(self.motion(np.pi / 2).theta)

    @property
    def beta_range(self) -> tuple[float, float]:
        """Angles of the couplers at alpha = 0 and at 90 degrees, their minimum and maximum [rad]."""
        least, greatest = self.motion([0.0, np.pi / 2]).beta
        return float(least), float(greatest)

    def points(self, alpha: ArrayLike) -> dict[str, Array]:
        """Positions of the pairs in axes of the cage [m], as (..., 3): R_left, S_left, C, S_right, R_right."""
        m = self.motion(alpha)
        zero, b = np.zeros_like(m.alpha), self.b
        left = np.stack([-b * np.cos(m.theta), m.S, b * np.sin(m.theta)], axis=-1)
        hinge = np.stack([zero - self.d, zero, zero], axis=-1)
        centre = np.stack([zero, m.S, zero], axis=-1)
        return {
            "R_left": hinge,
            "S_left": left,
            "C": centre,
            "S_right": left * HALF_TURN,
            "R_right": hinge * HALF_TURN,
        }


def ratio_from_theta(theta_max: float) -> float:
    """a/b for a maximum angle of the lever, without offset (6.1) [rad]: 2 sin(theta_max/2). Errors: ParameterError outside (0, pi)."""
    if not 0 < theta_max < np.pi:
        raise ParameterError(
            f"theta_max = {theta_max:g} rad is outside (0, pi) rad: a/b = 2 sin(theta_max/2) must lie in (0, 2)"
        )
    return 2 * float(np.sin(theta_max / 2))
