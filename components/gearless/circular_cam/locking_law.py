"""Load-dependent friction in a circular-cam differential: shares of the tracks, locking coefficient.

All functions accept numbers, arrays or symbols; their arguments are sines of the contact angles, which avoids inverse functions.
"""

from __future__ import annotations

import math
from typing import Any, Literal, get_args

from powertrain import ParameterError

Sharing = Literal["elastic", "rigid", "averaged"]
"""How the tracks share the torque of the cage.

- "rigid": eq. (19), circumferential forces in proportion to the diameters at every phase, lambda = 1/(1 + xi^2). A track whose contact
  angle approaches zero would need an infinite normal force for its share, and the locking coefficient becomes infinite.
- "elastic": normal contacts of equal stiffness, or with the ratio ``stiffness`` of inner to outer. A small rotation e of the cage against
  fixed cams closes each contact of a track by e D/2 sin(alpha), so F_n is in proportion to D sin(alpha) and the torque to
  (D sin(alpha))^2. The share of a track goes smoothly to zero with its angle; forces and locking coefficient stay finite.
- "averaged": the equivalent inclined plane of Fig. 13. Each track has half its maximum angle at every phase and its rigid share, so
  the locking coefficient is constant.
"""


def check_sharing(sharing: str, stiffness: float = 1.0) -> None:
    """Errors: ParameterError for an unknown name, or an impossible ratio of stiffnesses."""
    if not (math.isfinite(stiffness) and stiffness > 0):
        raise ParameterError(f"stiffness = {stiffness:g}, inner over outer contact, must be positive and finite")
    if sharing not in get_args(Sharing):
        raise ParameterError(f"sharing = {sharing!r} is not one of {', '.join(get_args(Sharing))}")


def outer_share(sharing: Sharing, sin_out: Any, sin_in: Any, xi: Any, stiffness: Any = 1.0) -> Any:
    """lambda: the share of the cage's torque that the outer track carries. ``xi``: inner over outer diameter."""
    if sharing == "elastic":
        return sin_out**2 / (sin_out**2 + stiffness * xi**2 * sin_in**2)
    return 1 / (1 + xi**2) + 0 * (sin_out + sin_in)


def disk_coefficient(
    sharing: Sharing,
    sin_out: Any,
    sin_in: Any,
    D_out: Any,
    D_in: Any,
    friction: Any,
    *,
    stiffness: Any = 1.0,
    floor: float = 0.0,
) -> Any:
    """Locking coefficient of the friction disks, with ``friction`` = mu D_R.

    kappa = mu D_R (lambda/(D_out tan(alpha_out)) + (1 - lambda)/(D_in tan(alpha_in)))

    From eqs. (34) and (36): a track with the share lambda has n/2 active rollers with F_u = 4 lambda T/(n D), and presses each disk
    with lambda T/(D tan(alpha)), whatever n. ``floor`` bounds the rigid rule: sin(alpha) is replaced by sqrt(sin(alpha)^2 + floor^2).
    """
    cos_out, cos_in = (1 - sin_out**2) ** 0.5, (1 - sin_in**2) ** 0.5
    if sharing == "elastic":
        pressed = D_out * sin_out * cos_out + stiffness * D_in * sin_in * cos_in
        return friction * pressed / (D_out**2 * sin_out**2 + stiffness * D_in**2 * sin_in**2)
    share = outer_share(sharing, sin_out, sin_in, D_in / D_out)
    steep_out, steep_in = (sin_out**2 + floor**2) ** 0.5, (sin_in**2 + floor**2) ** 0.5
    return friction * (share / D_out * cos_out / steep_out + (1 - share) / D_in * cos_in / steep_in)


def groove_coefficient(
    sharing: Sharing, sin_out: Any, sin_in: Any, xi: Any, mu_groove: Any, *, stiffness: Any = 1.0
) -> Any:
    """Locking coefficient of the grooves, to be added to that of the disks.

    kappa = mu_g (lambda (1 + sin(alpha_out))/cos(alpha_out) + (1 - lambda) (1 + sin(alpha_in))/cos(alpha_in))

    The cage presses an active roller with F_u against a side of the groove that slides along it at omega r + V_b = V (1 +
    sin(alpha))/cos(alpha): spin and climb add up at a wedged roller in either direction. The power mu_g F_u (1 + sin(alpha))/cos(alpha) V
    of all active rollers equals the difference of the half shafts' torques times their speed. Tractions at the roller's two contacts
    balance the friction; if they are equal and opposite, the sum of the axial forces is unchanged. The two disks are then pressed
    unequally, and their friction turns the cage: T_C is larger by mu mu_g D_R (lambda/D_out + (1 - lambda)/D_in), which is neglected.
    """
    share = outer_share(sharing, sin_out, sin_in, xi, stiffness)
    cos_out, cos_in = (1 - sin_out**2) ** 0.5, (1 - sin_in**2) ** 0.5
    return mu_groove * (share * (1 + sin_out) / cos_out + (1 - share) * (1 + sin_in) / cos_in)
