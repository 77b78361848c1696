"""Detents that hold until a force lets them go, and the actuator of a shift."""

from __future__ import annotations

import math

import numpy as np
import pytest
from joined import joined, run

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components import translational as tr
from powertrain.components.blocks import TimeTable


@pytest.mark.parametrize(("force", "leaves"), [(49.0, False), (51.0, True)])
def test_a_rod_leaves_its_notch_at_f_max(force: float, leaves: bool) -> None:
    """A force that grows slowly: below 50 N the rod stays within a quarter of the pitch."""
    parts = (
        tr.Detent(),
        tr.Mass(m=0.5),
        tr.Damper(d=500.0),
        tr.Fixed(),
        tr.Force(),
        TimeTable(table=((0.0, 0.0), (2.0, force), (4.0, force))),
    )
    wired = "0.flange=1.flange_a=2.flange_a 2.flange_b=3.flange 1.flange_b=4.flange 5.y=4.f"
    result = run(joined(*parts, joints=wired), 4.0)
    assert bool(result["parts[1].s"][-1] > 9e-3 / 4) == leaves
    assert pt.energy_audit(result).closure < 1e-8


def test_small_swings_in_a_notch() -> None:
    """sqrt(tau_max notches/J) round the notch at phi_0, and the energy to leave it, 2 tau_max/notches."""
    parts = rot.Detent(tau_max=2.0, notches=8.0, phi_0=0.3), rot.Inertia(J=0.01)
    model = joined(*parts, joints="0.flange=1.flange_a")
    w = math.sqrt(2.0 * 8.0 / 0.01)
    result = run(model, 0.5, {"1.phi": 0.3 + 1e-4})
    np.testing.assert_allclose(result["parts[1].phi"] - 0.3, 1e-4 * np.cos(w * result.time), atol=2e-9)
    leave = math.sqrt(2 * (2 * 2.0 / 8.0) / 0.01)
    for share, passes in ((0.999, False), (1.001, True)):
        moved = run(model, 0.3, {"1.phi": 0.3, "1.w": share * leave})["parts[1].phi"].max() - 0.3
        assert bool(moved > math.pi / 8) == passes


def test_a_shift_actuator_moves_with_limited_force() -> None:
    """Against its damping alone: f_max/d after the start, and s_ref in the end."""
    parts = tr.ShiftActuator(f_max=400.0, d=2000.0), TimeTable(table=((0.0, 0.05),))
    result = run(joined(*parts, joints="1.y=0.s_ref"), 1.0)
    assert result.at([0.1], "parts[0].v")[0] == pytest.approx(0.2, rel=1e-6)
    assert result["parts[0].s"][-1] == pytest.approx(0.05, abs=1e-9)
    assert np.abs(result["parts[0].f"]).max() <= 400.0
    assert pt.energy_audit(result).closure < 1e-8
