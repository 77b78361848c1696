"""The rotational library against trajectories of the Modelica Standard Library 4.0.0."""

from __future__ import annotations

import numpy as np
import pytest
import rotational_examples as examples
from reference import Array, Reference, assert_close, assert_modes, load

import powertrain as pt

# Share of a signal's range, where the reference itself is further than 1e-4 from a converged solution.
OWN_ERROR = {
    "First": {"inertia3.w": 4e-4},
    "FirstGrounded": {"inertia3.w": 4e-4},
    "GenerationOfFMUs": {"inertia3a.w": 1.1e-3, "inertia3b.w": 6e-4},
}


def simulated(name: str, **options: float) -> tuple[pt.Result[pt.Component], Reference]:
    reference = load(f"Rotational/{name}")
    times: Array = np.unique(reference.time)
    return pt.simulate(getattr(examples, name)(), times[-1], times=times, **options), reference


@pytest.mark.parametrize(
    "name",
    [
        "CoupledClutches",
        "EddyCurrentBrake",
        "First",
        "FirstGrounded",
        "GenerationOfFMUs",
        "LossyGearDemo1",
        "LossyGearDemo3",
        "OneWayClutch",
        "RollingWheel",
        "SimpleGearShift",
    ],
)
def test_trajectory(name: str) -> None:
    result, reference = simulated(name)
    assert_close(result, reference, OWN_ERROR.get(name, {}))
    assert_modes(result, reference, atol=1e-5)


def test_clutches_switch_when_the_converged_solution_does() -> None:
    """The reference's own tolerance of 1e-6 moves its switch times by up to 4e-6 s."""
    result, reference = simulated("CoupledClutches", rtol=1e-9)
    assert_close(result, reference, {}, default=2e-5)
    assert_modes(result, reference, atol=1e-5)
