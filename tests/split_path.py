"""The closed form of the split-path transmission by Yu & Beachley 1986."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from powertrain.components.transmissions import members, relative_ratio


class Solution(NamedTuple):
    """Ratio of the unit, total efficiency, K by eq. (29), input torque, torques of a, b and carrier."""

    V: Any
    efficiency: Any
    K: Any
    tau: Any
    T: dict[str, Any]


def closed_form(layout: str, R_o: float, eta: float, eta_v: float, r: Any, load: Any) -> Solution:
    """Input-coupled, at positive input speed, output not on the carrier; eqs. (5)-(29)."""
    one, two, three = members(layout)
    R = relative_ratio(layout, R_o)
    V = (r - R) / (1 - R)
    speed = {one: 1.0, two: V, three: r}
    latent = load * (speed[three] - speed["carrier"])
    if three == "a":
        T_a = load
        T_b = -R_o * np.where(latent > 0, eta, 1 / eta) * T_a
    else:
        T_b = load
        T_a = -np.where(latent > 0, eta, 1 / eta) * T_b / R_o
    T = {"a": T_a, "b": T_b, "carrier": -T_a - T_b}
    P_2 = T[two] * V
    unit = P_2 * np.where(P_2 > 0, 1 / eta_v, eta_v)
    tau = T[one] + unit
    return Solution(V, -load * r / tau, np.where(P_2 > 0, unit, P_2) / tau, tau, T)
