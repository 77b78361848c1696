"""A car that brakes down a slope, against its free bodies with the Magic Formula, written with NumPy and solved by SciPy."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from wheel_rigs import plain, tight

from powertrain.components.blocks import Constant
from powertrain.components.body import VehicleBody
from powertrain.components.wheels import MagicFormulaWheel, WheelBrake

G = 9.80665
M, WHEELBASE, H, SHARE, CD, A = 1620.0, 2.83, 0.61, 0.57, 0.29, 2.3
RADIUS, J, CR, STIFFNESS, MU = 0.317, 1.7, 0.011, 4e5, 0.85
TORQUES, GRADE = (2000.0, 800.0), -0.07
COSINE = 1 / np.hypot(1, GRADE)


def force(kappa: float, load: float) -> float:
    """The Magic Formula with C = 1.58, E = 0.2."""
    dfz = load / 4300 - 1
    D = MU * (1.06 - 0.08 * dfz) * load
    x = load * (24 - 1.5 * dfz) * np.exp(0.25 * dfz) / (1.58 * D) * kappa
    return float(D * np.sin(1.58 * np.arctan(x - 0.2 * (x - np.arctan(x)))))


def rates(t: float, y: NDArray[np.float64]) -> list[float]:
    """Speed, path, and for each axle wheel speed and force, which relaxes over the length K/c, about 24 load/c."""
    v, _, *axles = y
    push, weight = axles[1] + axles[3], M * G * COSINE
    front = weight * SHARE - H / WHEELBASE * push
    found = [(push - CD * A * 1.2 / 2 * v**2 - weight * GRADE) / M, v]
    for w, f, load, torque in zip(axles[::2], axles[1::2], (front, weight - front), TORQUES, strict=True):
        found.append((-RADIUS * f - CR * RADIUS * load - torque) / J)
        found.append((force((RADIUS * w - v) / v, load) - f) * v / (24 * load / STIFFNESS))
    return found


def test_braking_down_a_slope() -> None:
    """Time and distance from 100 to 20 km/h, speeds, forces and loads of both axles."""
    start, end = 100 / 3.6, 20 / 3.6
    y_0 = [start, 0.0, start / RADIUS, 0.0, start / RADIUS, 0.0]

    def slow(t: float, y: NDArray[np.float64]) -> float:
        return float(y[0] - end)

    slow.terminal = True  # type: ignore[attr-defined]
    other = solve_ivp(rates, (0, 20), y_0, method="LSODA", rtol=1e-8, atol=1e-8, events=slow)
    tyre: dict[str, Any] = {
        "pCx1": 1.58,
        "pEx1": 0.2,
        "pDx1": 1.06,
        "pDx2": -0.08,
        "pKx1": 24.0,
        "pKx2": -1.5,
        "pKx3": 0.25,
        "Fz0": 4300.0,
    }
    wheel = MagicFormulaWheel(radius=RADIUS, J=J, Cr=CR, c=STIFFNESS, mu=MU, **tyre)
    model = plain(
        wheel,
        demand=Constant(k=1),
        grade=Constant(k=GRADE),
        front_brake=WheelBrake(tau_max=TORQUES[0]),
        brake=WheelBrake(tau_max=TORQUES[1]),
        body=VehicleBody(m=M, wheelbase=WHEELBASE, h=H, front_share=SHARE, Cd=CD, A=A),
    )
    t = float(other.t[-1])
    found = tight(model, t, {"body.v": start})
    v, s, w_front, f_front, w_rear, f_rear = other.y[:, -1]
    np.testing.assert_allclose(found["body.v"][-1], v, atol=0.01)
    np.testing.assert_allclose(found["body.s"][-1], s, atol=0.02)
    np.testing.assert_allclose([found[f"{x}.w"][-1] for x in ("front", "rear")], [w_front, w_rear], rtol=2e-3)
    np.testing.assert_allclose([found[f"{x}.f"][-1] for x in ("front", "rear")], [f_front, f_rear], rtol=2e-3)
    np.testing.assert_allclose(
        found["front.fn"][-1], M * G * COSINE * SHARE - H / WHEELBASE * (f_front + f_rear), rtol=1e-3
    )
