"""Cone clutches and brakes and drum brakes against their closed forms and a textbook's numbers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from joined import joined, run
from scipy.integrate import quad

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Constant

CONE: dict[str, Any] = {
    "radius": 0.12,
    "angle": math.radians(12.5),
    "cones": 2.0,
    "mue_pos": ((0.0, 0.2),),
    "fn_max": 500.0,
}
TORQUE = 2 * 0.2 * 0.6 * 500 * 0.12 / math.sin(math.radians(12.5))
"""Two cones at 60 % of 500 N."""


def test_cone_clutch_synchronises_two_shafts() -> None:
    """0.3 and 0.7 kg.m2, 80 rad/s apart: stuck after dw/(T (1/J_1 + 1/J_2)), at the speed of the common momentum."""
    parts = rot.ConeClutch(**CONE), rot.Inertia(J=0.3), rot.Inertia(J=0.7), Constant(k=0.6)
    wired = "0.flange_a=1.flange_a 0.flange_b=2.flange_a 3.y=0.f_normalized"
    result = run(joined(*parts, joints=wired), 1.0, {"1.w": 80.0})
    stuck = next(e.time for e in result.events if e.name == "parts[0].mode" and e.new == 0)
    assert stuck == pytest.approx(80 / (TORQUE * (1 / 0.3 + 1 / 0.7)), rel=1e-9)
    assert result["parts[2].w"][-1] == pytest.approx(80 * 0.3, rel=1e-9)
    assert pt.energy_audit(result).closure < 1e-9


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_cone_brake_stops_a_shaft(sign: float) -> None:
    parts = rot.ConeBrake(**CONE), rot.Inertia(J=0.5), Constant(k=0.6)
    result = run(joined(*parts, joints="0.flange_a=1.flange_a 2.y=0.f_normalized"), 0.2, {"1.w": 90 * sign})
    assert result["parts[1].w"][-1] == pytest.approx(sign * (90 - TORQUE / 0.5 * 0.2), rel=1e-9)


def test_a_flat_cone_is_a_plate() -> None:
    parts = rot.ConeBrake(radius=0.1, angle=math.pi / 2, mue_pos=((0.0, 0.4),), fn_max=100), rot.Inertia(J=1)
    model = joined(*parts, Constant(k=1), joints="0.flange_a=1.flange_a 2.y=0.f_normalized")
    assert run(model, 1.0, {"1.w": 50.0})["parts[1].w"][-1] == pytest.approx(50 - 100 * 0.4 * 0.1, rel=1e-9)


def test_a_cone_that_would_stick_is_rejected() -> None:
    rot.ConeClutch(angle=math.atan(0.201), mue_pos=((0.0, 0.2),), fn_max=1)
    with pytest.raises(pt.ParameterError, match=r"angle = 0\.196"):
        rot.ConeClutch(angle=math.atan(0.199), mue_pos=((0.0, 0.2),), fn_max=1)
    with pytest.raises(pt.ParameterError, match=r"peak = 1\.2"):
        rot.ConeBrake(angle=math.atan(0.201), mue_pos=((0.0, 0.2),), peak=1.2, fn_max=1)


SHIGLEY: dict[str, Any] = {
    "radius": 0.150,
    "hinge": math.hypot(0.112, 0.050),
    "lever": 0.212,
    "theta_1": 0.0,
    "theta_2": math.radians(126),
    "mue": 0.32,
    "F_max": 2280.0,
}
"""Example 16-2 of Shigley's Mechanical Engineering Design, 9th ed."""


def shoes(**changes: Any) -> rot.DrumBrake:
    """Shigley's drum brake with other parameters."""
    return rot.DrumBrake(**{**SHIGLEY, **changes})


def test_drum_brake_of_shigley() -> None:
    """Printed: 366 N.m of the leading, 162 N.m of the trailing shoe, 528 N.m together."""
    lead, trail = shoes().torques()
    assert [round(lead), round(trail), round(lead + trail)] == [366, 162, 528]


@pytest.mark.parametrize(("leading", "sign"), [(1, 1.0), (1, -1.0), (2, 1.0), (2, -1.0), (0, 1.0)])
def test_shoes_by_integration(leading: Any, sign: float) -> None:
    """Moments of the pressure p ~ sin(theta) by quadrature; the shaft slows down by the sum of both shoes."""
    theta = 0.3, 2.2
    brake = shoes(theta_1=theta[0], theta_2=theta[1], leading=leading)
    r, a = 0.150, SHIGLEY["hinge"]
    normal = quad(lambda x: a * math.sin(x) ** 2, *theta)[0]
    moment = 0.32 * quad(lambda x: math.sin(x) * (r - a * math.cos(x)), *theta)[0]
    braking = 0.32 * r * quad(math.sin, *theta)[0]
    lead, trail = (2280 * 0.5 * 0.212 * braking / (normal - s * moment) for s in (1, -1))
    n = leading if sign > 0 else 2 - leading
    parts = brake, rot.Inertia(J=2), Constant(k=0.5)
    result = run(joined(*parts, joints="0.flange_a=1.flange_a 2.y=0.f_normalized"), 0.1, {"1.w": 100 * sign})
    assert result["parts[1].w"][-1] == pytest.approx(sign * (100 - (n * lead + (2 - n) * trail) / 2 * 0.1), rel=1e-9)
    assert pt.energy_audit(result).closure < 1e-9


def test_a_shoe_that_locks_itself_is_rejected() -> None:
    """The torque of the leading shoe grows without limit as mue comes to N/M."""
    span, normal, moment = shoes()._moments()
    limit = float(normal / moment)
    torques = [shoes(mue=share * limit).torques()[0] for share in (0.9, 0.99, 0.999)]
    assert np.all(np.array(torques[1:]) > 9 * np.array(torques[:-1]))
    with pytest.raises(pt.ParameterError, match=r"normal > self\.mue \* moment  # else a leading shoe locks itself"):
        shoes(mue=1.001 * limit)
    assert float(span) > 0


@pytest.mark.parametrize("hinge", [0.3, 0.2, 0.1])
def test_hinge_pins_outside_of_the_drum_are_rejected(hinge: float) -> None:
    """There the friction moment mue M may be negative: N + mue M < 0 is a trailing shoe that drives the drum."""
    with pytest.raises(pt.ParameterError, match=rf"(?s)DrumBrake: .*radius = 0\.1 m, hinge = {hinge:g} m"):
        rot.DrumBrake(theta_1=0.0, theta_2=0.5, hinge=hinge, radius=0.1, mue=0.1)


def test_shoes_inside_the_drum_brake() -> None:
    """Whatever the lining, a pin in the drum gives both shoes a torque above zero."""
    for one, two in ((0.0, 0.1), (0.0, 0.5), (0.3, 2.2), (1.5, 3.1)):
        lead, trail = shoes(theta_1=one, theta_2=two, hinge=0.149, mue=1e-2).torques()
        assert lead > trail > 0
