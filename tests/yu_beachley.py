"""The formulas of Yu & Beachley 1986 in closed form, eqs. (1)-(29), with nothing of the library.

D. Yu, N. Beachley, Mechanical efficiency of differential gearing, Gear Technology (July/August 1986) 9-16, 48.
Output-coupled transmissions, which the paper leaves to the reader, follow from the same equations with the unit between 3 and 2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

CONNECTIONS = {1: "bHa", 2: "Hba", 3: "baH", 4: "abH", 5: "Hab", 6: "aHb"}
"""Members at 1, 2, 3 of the six types, p. 14-16."""
SPLIT, POSITIVE, NEGATIVE = "split", "positive recirculation", "negative recirculation"


def basic_ratio(driving: tuple[int, ...], driven: tuple[int, ...], external: int) -> float:
    """Eq. (3): teeth of driving and driven gears from a to b, number of external pairs."""
    return math.copysign(math.prod(driven) / math.prod(driving), 0.5 - external % 2)


def relative_ratio(connection: str, R_o: float) -> float:
    """R = (N_3 - N_2)/(N_1 - N_2), by eqs. (1) and (2), as p. 16 writes the six cases."""
    r_ab = R_o
    return {
        "bHa": r_ab,
        "Hba": 1 - r_ab,
        "baH": 1 / (1 - 1 / r_ab),
        "abH": 1 / (1 - r_ab),
        "Hab": 1 - 1 / r_ab,
        "aHb": 1 / r_ab,
    }[connection]


def unit_ratio(connection: str, R_o: float, r: float, coupling: str = "input") -> float:
    """V = N_2/N_1, eq. (23); output-coupled V = N_2/N_3."""
    R = relative_ratio(connection, R_o)
    V = (r - R) / (1 - R)
    return V if coupling == "input" else V / r


def mesh_torques(R_o: float, eta: float, a_drives: bool) -> dict[str, float]:
    """T_a = 1; eq. (12) where a drives, eq. (18) where b drives; T_H by eq. (21)."""
    T_b = -eta * R_o if a_drives else -R_o / eta
    return {"a": 1.0, "b": T_b, "H": -1.0 - T_b}


@dataclass(frozen=True)
class Point:
    """Powers over the output power, signed as in the paper: power into the differential (or the system) is positive, P_out = -1."""

    V: float
    P: dict[int, float]
    P_f: float
    P_fv: float
    P_in: float
    K: float
    torque: dict[str, float]
    regime: str

    @property
    def efficiency(self) -> float:
        """Eq. (28)."""
        return 1 / self.P_in


def solutions(
    connection: str, R_o: float, r: float, eta: float, eta_v: float, coupling: str = "input", forward: bool = True
) -> list[Point]:
    """All consistent operating points at N_1 = 1 with unit output power (``forward``) or unit power into the output shaft.

    Both directions of the latent power and of the unit's power are tried; those that agree with the signs they lead to remain.
    """
    V = unit_ratio(connection, R_o, r, coupling)
    one, two, three = tuple(connection)
    N = {one: 1.0, two: V if coupling == "input" else V * r, three: r}
    found: list[Point] = []
    for a_drives, to_2 in product((True, False), repeat=2):
        T = mesh_torques(R_o, eta, a_drives)
        through = 1 / eta_v if to_2 else eta_v  # eq. (25): power at the other side of the unit over P_2
        P = {m: T[m] * N[m] for m in "abH"}
        at_output = P[three] + (P[two] * through if coupling == "output" else 0.0)
        if at_output == 0:
            continue
        scale = (-1.0 if forward else 1.0) / at_output
        latent, P_2 = scale * T["a"] * (N["a"] - N["H"]), scale * P[two]
        if latent * (1 if a_drives else -1) < 0 or P_2 * (1 if to_2 else -1) < 0:
            continue
        P_1, P_3 = scale * P[one], scale * P[three]
        P_in = P_1 + (P_2 * through if coupling == "input" else 0.0)
        P_f = -(P_1 + P_2 + P_3)
        if coupling == "input":
            K = P_2 * through / P_in if to_2 else P_2 / P_in  # eq. (29)
            regime = _input_regime(P_1, P_2)
        else:
            K = -P_2 * through / P_in if to_2 else -P_2 / P_in
            regime = _output_regime(P_2, P_3)
        torque = {m: scale * T[m] for m in "abH"}
        point = Point(V, {1: P_1, 2: P_2, 3: P_3}, P_f, P_2 - P_2 * through, P_in, K, torque, regime)
        if not any(math.isclose(point.P_in, other.P_in, rel_tol=1e-12) for other in found):
            found.append(point)
    return found


def only(points: list[Point]) -> Point:
    """The solution, which has to be the only one."""
    assert len(points) == 1, points
    return points[0]


def lossless_fraction(connection: str, R_o: float, r: float) -> float:
    """K_o of an input-coupled transmission from eqs. (21)-(24) without friction: V (1 - R)/r."""
    R = relative_ratio(connection, R_o)
    return (r - R) / r


def _input_regime(P_1: float, P_2: float) -> str:
    """Fig. 8 a, b, c."""
    if P_2 < 0:
        return NEGATIVE
    return POSITIVE if P_1 < 0 else SPLIT


def _output_regime(P_2: float, P_3: float) -> str:
    """The same with the unit at the output: power comes back from the output through the unit, or past it through the differential."""
    if P_2 > 0:
        return NEGATIVE
    return POSITIVE if P_3 > 0 else SPLIT
