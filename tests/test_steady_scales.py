"""Operating points of shafts with brakes and clutches whose sizes differ by many powers of ten.

The expected speeds are all solutions in all combinations of modes, found with rational numbers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from drivelines import Driveline, Flange
from small_models import Motor

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Constant

OK = 0
CONSTANT = ((0.0, 1.0),)


@dataclass(frozen=True)
class Shaft:
    """Inertia, torque at rest and its rise with speed, and limits of brakes."""

    J: float
    torque: float
    slope: float
    brakes: tuple[float, ...] = ()


def line(shafts: list[Shaft], clutches: list[tuple[int, int, float]]) -> tuple[Driveline, list[str]]:
    """Shafts, and clutches (one, other, limit) between them; names of the speeds of the shafts."""
    parts: list[pt.Component] = [Motor(torque=s.torque, slope=s.slope) for s in shafts]
    nodes: list[list[Flange]] = [[(k, "flange")] for k in range(len(shafts))]
    pressed = list[int]()
    for node, s in zip(nodes, shafts, strict=True):
        if s.J:
            node.append((len(parts), "flange_a"))
            parts.append(rot.Inertia(J=s.J))
        for limit in s.brakes:
            node.append((len(parts), "flange_a"))
            pressed.append(len(parts))
            parts.append(rot.Brake(fn_max=limit, mue_pos=CONSTANT))
    for one, other, limit in clutches:
        nodes[one].append((len(parts), "flange_a"))
        nodes[other].append((len(parts), "flange_b"))
        if limit:
            pressed.append(len(parts))
        parts.append(rot.Clutch(fn_max=limit or 1.0, mue_pos=CONSTANT))
    signals = tuple(
        Constant(k=float(k in pressed)) for k, part in enumerate(parts) if isinstance(part, rot.Brake | rot.Clutch)
    )
    needing = [k for k, part in enumerate(parts) if isinstance(part, rot.Brake | rot.Clutch)]
    wires = tuple((i, k, "f_normalized") for i, k in enumerate(needing))
    whole = Driveline(parts=tuple(parts), nodes=tuple(map(tuple, nodes)), signals=signals, wires=wires)
    return whole, [f"parts[{k}].w" for k in range(len(shafts))]


@pytest.mark.parametrize("slips", [[208.4], [104.2, 104.2], [100.0, 108.4]])
def test_a_clutch_that_slips_to_light_shafts(slips: list[float]) -> None:
    """The last shaft has no drag: 0.1 s of a torque of 1 N.m would give it 3,000 rad/s, the others 0.001 and 0.009 rad/s.

    Of several clutches in parallel, only these share a torque; that the others have no part in it is known but for round-off.
    """
    shafts = [Shaft(8.68e-5, 2962.0, -971.1), Shaft(1.866e-4, 0.0, -114.8), Shaft(3.057e-5, 0.0, 0.0, (379.8,))]
    model, speeds = line(shafts, [*((0, 1, limit) for limit in slips), (1, 2, 779.2)])
    found = pt.steady(model, {}, outputs=speeds)
    assert found.status == OK
    np.testing.assert_allclose([found[n] for n in speeds], [(2962.0 - 208.4) / 971.1, 0.0, 0.0], rtol=1e-9, atol=1e-9)


def test_laws_hold_light_shafts() -> None:
    """The torque on the last shaft would accelerate it by 27,000 rad/s2, of which the balance of the others leaves round-off."""
    shafts = [Shaft(37.14, -0.01441, 0.0), Shaft(0.0, -0.01478, -0.001345), Shaft(6.195e-4, -16.92, 0.0, (91.7,))]
    model, speeds = line(shafts, [(0, 1, 0.1004), (0, 1, 0.3994), (0, 2, 2.098)])
    found = pt.steady(model, {}, outputs=speeds)
    assert found.status == OK
    np.testing.assert_allclose([found[n] for n in speeds], 0.0, atol=1e-9)


@pytest.mark.parametrize("torque", [0.5, -0.6668, 1.5, -1.8, 2.0])
def test_brakes_that_hold_a_shaft_without_inertia_share_its_torque(torque: float) -> None:
    """A brake that is at its limit where it need not be is no other solution."""
    model, speeds = line([Shaft(0.0, torque, -0.041, (0.86, 1.013))], [])
    found = pt.steady(model, {}, outputs=[*speeds, "parts[1].tau", "parts[2].tau"])
    assert found.status == OK
    held = np.clip(torque, -1.873, 1.873)
    weak = np.clip(held / 2, -0.86, 0.86)
    np.testing.assert_allclose(found[speeds[0]], (torque - held) / 0.041, atol=1e-6)
    np.testing.assert_allclose([found[f"parts[{k}].tau"] for k in (1, 2)], [weak, held - weak], rtol=1e-6)


def test_an_open_clutch_between_shafts_without_inertia() -> None:
    """It is free, beside one that slips, though its speed is unknown while modes are sought."""
    shafts = [Shaft(0.0, 0.0, -0.05629, (0.9605, 0.615)), Shaft(0.0, -1.773, -0.05129)]
    model, speeds = line(shafts, [(0, 1, 1.653), (0, 1, 0.0)])
    found = pt.steady(model, {}, outputs=speeds)
    assert found.status == OK
    np.testing.assert_allclose([found[n] for n in speeds], [-0.0775 / 0.05629, -0.12 / 0.05129], rtol=1e-9)


@pytest.mark.parametrize("J", [1.0, 1e-6])
@pytest.mark.parametrize(("brakes", "shares"), [((1.0, 5.0), (1.0, 3.0)), ((3.0, 5.0), (2.0, 2.0))])
def test_brakes_share_a_load_at_a_given_rest(J: float, brakes: tuple[float, ...], shares: tuple[float, ...]) -> None:
    """Equal shares, as far as the limits allow; 4 N.m are held."""
    model, speeds = line([Shaft(J, 4.0, -0.1, brakes)], [])
    torques = [f"parts[{k}].tau" for k, part in enumerate(model.parts) if isinstance(part, rot.Brake)]
    found = pt.steady(model, {speeds[0]: 0.0}, outputs=torques)
    assert found.status == OK
    np.testing.assert_allclose([found[n] for n in torques], shares, rtol=1e-6)
