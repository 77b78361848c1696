"""Random machines either run, with closed energy and the same events in finer steps, or are refused with the names of their parts.

``POWERTRAIN_FUZZ=2000:12000`` examines these seeds in place of those of the slow suite.
"""

from __future__ import annotations

import os
from typing import Any

import casadi as ca
import numpy as np
import pytest
from mechanisms import mechanism, random_starts
from test_fuzz import bounded

import powertrain as pt
from powertrain.engine.trajectory import Instant

FIRST, _, LAST = os.environ.get("POWERTRAIN_FUZZ", "60:660").partition(":")
STOP = 1.0
FINE: dict[str, Any] = {"rtol": 1e-7, "atol": 1e-9}
NOTHING = 1e-9
"""Energy in J that is round-off."""
NOISE = 1e-6
"""Speeds (rad/s, m/s) and steps of torques (N.m, N) that are nothing: a hundred times what the integration may leave."""
NEAR = 1e-5
"""Events that lie closer (s) are one instant."""


class Laws:
    """Speeds, rates and torques of the friction laws of a plant."""

    def __init__(self, plant: pt.Plant[Any], result: pt.Result[Any]) -> None:
        dae = plant.compiled.dae
        self.names = [law.name for law in dae.frictions]
        self.shared = np.array([law.rests is not None for law in dae.frictions])
        self.p = np.array(list(result.parameters.values()))
        self.sizes = dae.x.numel(), dae.z.numel(), dae.m.numel()
        values = [ca.horzcat(law.w, law.rate, law.torque) for law in dae.frictions]
        self.function = ca.Function("laws", [dae.t, dae.x, dae.z, dae.m, dae.p], [ca.densify(ca.vertcat(*values))])

    def silent(self, instant: Instant) -> set[str]:
        """The laws at rest before and after an instant whose mode cannot be observed.

        Their torque stays the same; or other laws hold the same motion, and how these share the torque does not move anything.
        """
        n, nz, nm = self.sizes
        left, right = (
            np.array(self.function(instant.time, y[:n], y[n : n + nz], held[:nm], self.p)).reshape(-1, 3)
            for y, held in ((instant.left, instant.held_left), (instant.right, instant.held_right))
        )
        rest = np.abs(left[:, 0]) + np.abs(right[:, 0]) < NOISE
        same = np.abs(left[:, 2] - right[:, 2]) < NOISE * (1.0 + np.abs(left[:, 2]))
        held = self.shared & (np.abs(left[:, 1]) + np.abs(right[:, 1]) < NOISE)
        return {name for name, still in zip(self.names, rest & (same | held), strict=True) if still}


def happened(plant: pt.Plant[Any], result: pt.Result[Any]) -> list[tuple[float, str, float]]:
    """When what became what, in order; events of one instant by their names."""
    silent = {instant.time: Laws(plant, result).silent(instant) for instant in result.trajectory.instants}
    events = [
        (e.time, e.name, float(np.nan_to_num(e.new, nan=-9.0))) for e in result.events if e.name not in silent[e.time]
    ]
    return sorted(events, key=lambda event: (round(event[0] / NEAR), *event[1:]))


def examined(seed: int, careless: bool = False) -> bool:
    """Whether the machine of this seed runs; fails where it neither runs as it should nor is refused with names."""
    found = runs(seed, careless)
    if isinstance(found, pt.PowertrainError):
        assert "parts[" in str(found), f"{seed} names no component: {found}"
        return False
    plant, coarse, fine = found
    audit = pt.energy_audit(fine)
    assert audit.residual < 1e-5 * audit.turnover + NOTHING, (seed, audit)
    assert not (audit.violations.amount.abs() > NOISE * (1.0 + audit.turnover)).any(), (seed, audit)
    for result in (coarse, fine):
        assert np.isfinite(result.to_dataframe().to_numpy()).all(), seed
    assert [e[1:] for e in happened(plant, coarse)] == [e[1:] for e in happened(plant, fine)], seed
    return True


def runs(seed: int, careless: bool) -> tuple[pt.Plant[Any], pt.Result[Any], pt.Result[Any]] | pt.PowertrainError:
    """A run, and one with a fifth of the step size and a tenth of the tolerance; or the refusal."""
    try:
        with bounded():
            plant = pt.compile(mechanism(seed, careless))
            starts = random_starts(plant, seed)
            coarse = plant.simulate(STOP, starts=starts)
            step = STOP / max(coarse.statistics["steps"], 1.0) / 5
            return plant, coarse, plant.simulate(STOP, starts=starts, max_step=step, **FINE)
    except pt.PowertrainError as error:
        return error


@pytest.mark.parametrize("seed", range(60))
def test_mechanisms(seed: int) -> None:
    examined(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(int(FIRST), int(LAST)))
def test_many_mechanisms(seed: int) -> None:
    examined(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100))
def test_careless_mechanisms(seed: int) -> None:
    examined(seed, careless=True)
