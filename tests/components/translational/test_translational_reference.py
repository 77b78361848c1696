"""The translational library against trajectories of the Modelica Standard Library 4.0.0."""

from __future__ import annotations

import numpy as np
import pytest
import translational_examples as examples
from reference import Array, Reference, assert_close, assert_modes, load

import powertrain as pt

# Share of a signal's range, where the reference itself is further than 1e-4 from a converged solution: an undamped
# oscillation at resonance, 16 periods long, computed at a tolerance of 1e-6.
OWN_ERROR = {"Oscillator": {"mass1.s": 6e-4, "mass1.v": 6e-4, "damper1.s_rel": 2.5e-4, "damper1.v_rel": 2.5e-4}}
NAMES = [
    "Accelerate",
    "Brake",
    "Damper",
    "ElastoGap",
    "Oscillator",
    "Sensors",
    "SignConvention",
    "Vehicle",
    "WhyArrows",
]


def simulated(name: str, **options: float) -> tuple[pt.Result[pt.Component], Reference]:
    reference = load(f"Translational/{name}")
    times: Array = np.unique(reference.time)
    return pt.simulate(getattr(examples, name)(), times[-1], times=times, **options), reference


@pytest.mark.parametrize("name", NAMES)
def test_trajectory(name: str) -> None:
    result, reference = simulated(name)
    assert_close(result, reference, OWN_ERROR.get(name, {}), default=2e-5)
    assert_modes(result, reference, atol=1e-6)


def test_the_oscillators_distance_is_the_references_own() -> None:
    """mass1 under sin(w t) at w0 = 100 1/s: s'' + w0^2 (s + 1/2) = sin(w t), in closed form, against both."""
    result, reference = simulated("Oscillator", rtol=1e-10)
    w, w0, t = 2 * np.pi * 15.9155, 100.0, result.time
    exact = -0.5 + (np.sin(w * t) - w / w0 * np.sin(w0 * t)) / (w0**2 - w**2)
    scale = np.ptp(exact)
    assert np.abs(result["mass1.s"] - exact).max() < 1e-6 * scale
    at = -0.5 + (np.sin(w * reference.time) - w / w0 * np.sin(w0 * reference.time)) / (w0**2 - w**2)
    assert np.abs(reference.signals["mass1.s"] - at).max() > 1e-4 * scale
