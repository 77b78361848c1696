"""Every vehicle drives the whole WLTC at every usual tolerance, and consumes the same."""

from __future__ import annotations

import pytest

import powertrain as pt
from powertrain.presets.catalogue import vehicles
from powertrain.trials.cycle import CycleRun, drive_cycle, on_cycle

KINDS = {entry.name: entry.kind for entry in vehicles()}


def consumed(run: CycleRun) -> float:
    """Energy [J] taken from tanks and batteries, with 42 MJ/kg."""
    return 42e6 * run.fuel + run.electricity


@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
def test_the_wltc_is_driven_at_every_tolerance(name: str) -> None:
    """Errors of a run grow with its tolerance: a decision of a controller that falls otherwise changes some tenths of a per cent."""
    plant = pt.compile(on_cycle(KINDS[name](), "wltc"))
    runs = {rtol: drive_cycle(plant, rtol=rtol) for rtol in (1e-4, 1e-5, 1e-6)}
    for rtol, run in runs.items():
        assert not run.message, (rtol, run.message)
        assert run.result.time[-1] == 1800.0
        assert run.time_outside == pytest.approx(runs[1e-6].time_outside, abs=0.01)
        assert consumed(run) == pytest.approx(consumed(runs[1e-6]), rel=1e-3), rtol
