"""Friction characteristics over speed, sampled."""

from __future__ import annotations

import math

from powertrain.components.friction_table import Table


def stribeck_table(
    F_prop: float, F_Coulomb: float, F_Stribeck: float, fexp: float, v_max: float, rows: int = 100
) -> Table:
    """Friction force F_Coulomb + F_prop v + F_Stribeck exp(-fexp v) at equally spaced speeds from 0 to v_max.

    Parameters
    ----------
    F_prop : float
        Viscous friction [N.s/m].
    F_Coulomb : float
        Coulomb friction [N].
    F_Stribeck : float
        Stribeck effect [N].
    fexp : float
        Exponential decay [s/m].
    v_max : float
        Largest speed [m/s].
    rows : int
        Number of speeds.

    Returns
    -------
    tuple of (float, float)
        Speeds [m/s] and forces [N].
    """
    speeds = [v_max * i / (rows - 1) for i in range(rows)]
    return tuple((v, F_Coulomb + F_prop * v + F_Stribeck * math.exp(-fexp * v)) for v in speeds)
