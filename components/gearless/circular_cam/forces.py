"""Forces in a circular-cam differential under a cage torque: eqs. (16)-(27) and (32)-(36), for any number of rollers.

Half of the rollers of each track are wedged, two of four. Friction between rollers and cams or grooves is neglected, as in the paper.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from powertrain import ParameterError
from powertrain.components.gearless.circular_cam.design import CircularCams
from powertrain.components.gearless.circular_cam.locking_law import Sharing, check_sharing, outer_share
from powertrain.components.gearless.circular_cam.track import Array


@dataclass(frozen=True)
class Forces:
    """Magnitudes of the forces over the given phases. All are forces on one active roller, except ``F_ax`` and the torques."""

    alpha_out: Array
    """Contact angle of the outer track [rad]."""
    alpha_in: Array
    """Contact angle of the inner track [rad]."""
    share: Array
    """lambda: share of the torque that the outer track carries [1]."""
    F_u_out: Array
    """Circumferential force of the cage on an outer roller [N]; half of it goes to each cam, eq. (17)."""
    F_u_in: Array
    """Circumferential force of the cage on an inner roller [N]."""
    F_n_out: Array
    """Normal force of an outer roller on each cam [N], eq. (26)."""
    F_n_in: Array
    """Normal force of an inner roller on each cam [N], eq. (27)."""
    P_ax_out: Array
    """Axial force of an outer roller on each cam [N], eq. (17)."""
    P_ax_in: Array
    """Axial force of an inner roller on each cam [N], eq. (18)."""
    F_ax: Array
    """Axial force on each friction disk [N], eqs. (32) and (36)."""
    M_cam: Array
    """Torque of the rollers on each cam [N.m], eqs. (21) and (33)."""
    M_friction: Array
    """Torque that each friction disk can hold [N.m], the right side of eq. (34)."""


def forces_at(
    cams: CircularCams,
    alpha_out: ArrayLike,
    alpha_in: ArrayLike,
    torque: ArrayLike,
    sharing: Sharing = "elastic",
    stiffness: float = 1.0,
) -> Forces:
    """The forces at given contact angles, which need not belong to one phase: the paper's tables use the maxima of both.

    If a track with zero angle has to carry a torque by the rigid rule, the normal forces are infinite.

    Parameters
    ----------
    cams : CircularCams
        The design.
    alpha_out, alpha_in : array_like
        Contact angles of the outer and the inner track [rad], at least 0 and below pi/2.
    torque : array_like
        Torque of the cage [N.m].
    sharing : {"elastic", "rigid", "averaged"}
        How the tracks share the torque (``Sharing``).
    stiffness : float
        Stiffness of the inner contacts relative to the outer ones [1].

    Returns
    -------
    Forces
        Arrays in the shape of the arguments broadcast together.

    Raises
    ------
    ParameterError
        For an angle outside its range, or both zero: no torque could be transmitted; for a torque that is not finite.
    """
    check_sharing(sharing, stiffness)
    a_out, a_in, T = np.broadcast_arrays(*(np.asarray(v, float) for v in (alpha_out, alpha_in, np.abs(torque))))
    for name, angle in (("alpha_out", a_out), ("alpha_in", a_in)):
        if not np.all((angle >= 0) & (angle < np.pi / 2)):
            raise ParameterError(f"{name} = {np.degrees(angle).tolist()} degrees must lie in [0, 90)")
    if not np.isfinite(T).all():
        raise ParameterError(
            f"forces: the torque of the cage must be finite, not {T[~np.isfinite(T)].ravel()[0]:g} N.m"
        )
    if np.any((a_out == 0) & (a_in == 0)):
        raise ParameterError("alpha_out and alpha_in are both 0: tracks without inclination transmit no torque")
    n, D_out, D_in = cams.outer.n, cams.outer.D, cams.inner.D
    share = np.asarray(outer_share(sharing, np.sin(a_out), np.sin(a_in), cams.xi, stiffness), float)
    F_out, F_in = 4 * share * T / (n * D_out), 4 * (1 - share) * T / (n * D_in)
    N_out, N_in = _over(F_out, 2 * np.sin(a_out)), _over(F_in, 2 * np.sin(a_in))
    P_out, P_in = _over(F_out, 2 * np.tan(a_out)), _over(F_in, 2 * np.tan(a_in))
    F_ax = n / 2 * (P_out + P_in)
    friction = cams.disk.mu * F_ax * cams.disk.D_R / 2
    M_cam = n / 4 * (F_out * D_out + F_in * D_in) / 2
    return Forces(a_out, a_in, share, F_out, F_in, N_out, N_in, P_out, P_in, F_ax, M_cam, friction)


def forces(
    cams: CircularCams, theta: ArrayLike, torque: ArrayLike, sharing: Sharing = "elastic", stiffness: float = 1.0
) -> Forces:
    """The forces at given phases under the torque of the cage.

    Those of a simulation are ``forces(cams, result["differential.theta"], result["differential.crown.tau"])``.

    Parameters
    ----------
    cams : CircularCams
        The design.
    theta : array_like
        Phases [rad].
    torque : array_like
        Torque of the cage [N.m].
    sharing : {"elastic", "rigid", "averaged"}
        How the tracks share the torque (``Sharing``).
    stiffness : float
        Stiffness of the inner contacts relative to the outer ones [1].

    Returns
    -------
    Forces
        Arrays in the shape of ``theta`` and ``torque`` broadcast together.

    Raises
    ------
    ParameterError
        For an unknown rule or an impossible stiffness.
    """
    outer, inner = cams.sines(theta, sharing)
    return forces_at(cams, np.arcsin(outer), np.arcsin(inner), torque, sharing, stiffness)


def _over(force: Array, steepness: Array) -> Array:
    """force/steepness, with 0/0 = 0."""
    infinite = np.where(force > 0, np.inf, 0.0)
    return np.divide(force, steepness, out=infinite, where=steepness > 0)
