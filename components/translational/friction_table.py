"""Friction characteristics over speed, sampled."""

from __future__ import annotations

import math

from powertrain import ParameterError
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
        Largest speed [m/s], above 0.
    rows : int
        Number of speeds, at least 2.

    Returns
    -------
    tuple of (float, float)
        Speeds [m/s] and forces [N].

    Raises
    ------
    ParameterError
        For less than two rows, or a largest speed that is not above 0 and finite.
    """
    if rows < 2 or not 0 < v_max < math.inf:
        raise ParameterError(
            f"stribeck_table: needs 2 rows or more and a finite v_max > 0 m/s, not {rows} and {v_max:g} m/s"
        )
    speeds = [v_max * i / (rows - 1) for i in range(rows)]
    return tuple((v, F_Coulomb + F_prop * v + F_Stribeck * math.exp(-fexp * v)) for v in speeds)
