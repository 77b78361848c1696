"""Dogs with play: when they go in, how hard they strike, and how they come out."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from joined import joined, run

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import TimeTable

J, C, B, N = (0.2, 0.6), 1e5, 0.1, 6
REDUCED = J[0] * J[1] / (J[0] + J[1])


def closing(
    w: float, angle: float = 0.0, command: Any = ((0, 0), (1e-4, 0), (1e-4, 1)), stop: float = 0.2, **given: Any
) -> Any:
    """Two inertias with w rad/s between them at an angle of the dogs; the result."""
    dogs = rot.ElasticDogClutch(**{"c": C, "d": 0.0, "b": B, "n": N, "w_in": 5.0} | given)
    parts = dogs, rot.Inertia(J=J[0]), rot.Inertia(J=J[1]), TimeTable(table=command)
    wired = "0.flange_a=1.flange_a 0.flange_b=2.flange_a 3.y=0.engage"
    return run(
        joined(*parts, joints=wired), stop, {"0.w_rel": w, "1.w": 0.0, "0.phi_rel": angle}, rtol=1e-9, max_step=1e-3
    )


@pytest.mark.parametrize("k", [0, 3, -2])
def test_an_impact_has_the_torque_of_an_oscillator(k: int) -> None:
    """Through the gap at w, then a half wave of w sqrt(c J), then back through the gap: without damping it goes on for ever."""
    w = 3.0
    result = closing(w, 2 * math.pi * k / N)
    tau, half = result["parts[0].tau"], math.pi * math.sqrt(REDUCED / C)
    assert result["parts[0].gap"][-1] == k
    first = float(result.time[np.flatnonzero(tau)[0]])
    assert first == pytest.approx(B / 2 / w, abs=2e-3)
    fine = closing(w, 2 * math.pi * k / N, stop=B / 2 / w + half)
    assert fine["parts[0].tau"].max() == pytest.approx(w * math.sqrt(C * REDUCED), rel=1e-3)
    assert fine["parts[0].w_rel"][-1] == pytest.approx(-w, rel=1e-6)
    assert pt.energy_audit(result).closure < 1e-8


def test_damping_ends_the_rattle_and_its_loss_is_the_energy_of_the_difference() -> None:
    w = 3.0
    result = closing(w, d=40.0, stop=3.0)
    left = 0.5 * REDUCED * result["parts[0].w_rel"][-1] ** 2
    audit = pt.energy_audit(result)
    assert audit.closure < 1e-8
    assert audit.components.lost["parts[0]"] == pytest.approx(0.5 * REDUCED * w**2 - left, rel=1e-4)
    assert left < 1e-3 * 0.5 * REDUCED * w**2


def test_dogs_on_dogs_stay_out_until_a_gap_comes() -> None:
    """At rest beside the gap for ever; at 2 rad/s from the edge of a dog until the next gap, (2 pi/n - b)/w later."""
    assert closing(0.0, 0.8 * B)["parts[0].inside"].max() == 0
    result = closing(2.0, B / 2 + 1e-9, stop=0.6)
    at = result.time[np.flatnonzero(result["parts[0].inside"] > 0.5)[0]]
    assert at == pytest.approx((2 * math.pi / N - B) / 2.0, abs=2e-3)
    assert result["parts[0].gap"][-1] == 1


def test_fast_dogs_ratchet_and_loaded_ones_stay_in() -> None:
    assert closing(6.0)["parts[0].inside"].max() == 0
    # Asked out at 12 ms, in the middle of the first impact: out when it is over.
    w = 3.0
    result = closing(w, command=((0, 0), (1e-4, 0), (1e-4, 1), (0.0177, 1), (0.0177, 0)), stop=0.05)
    end = B / 2 / w + math.pi * math.sqrt(REDUCED / C)
    inside = result["parts[0].inside"]
    at = result.time[np.flatnonzero((inside[:-1] > 0.5) & (inside[1:] < 0.5))[0] + 1]
    assert at == pytest.approx(end, abs=1.1e-3)
    assert result["parts[0].tau"][-1] == 0


def test_dogs_stay_in_their_gap_under_load() -> None:
    """300 N.m press a dog 0.03 rad into its flank, where it faces the next gap: 40 gaps of 0.15 rad are 0.157 rad apart."""
    dogs = rot.ElasticDogClutch(n=40, b=0.15, c=1e4, d=20.0)
    parts = dogs, rot.Inertia(J=0.1), rot.Inertia(J=10), TimeTable(table=((0, 0), (0.01, 0), (0.01, 1))), rot.Torque()
    load = TimeTable(table=((0, 0), (0.1, 0), (1.1, 300)))
    wired = "0.flange_a=1.flange_a 0.flange_b=2.flange_a 3.y=0.engage 4.flange=1.flange_b 5.y=4.tau"
    result = run(joined(*parts, load, joints=wired), 1.1, rtol=1e-8)
    assert set(result["parts[0].gap"]) == {0.0}
    assert result["parts[0].tau"][-1] == pytest.approx(-300 * 10 / 10.1, rel=1e-2)
    assert pt.energy_audit(result).closure < 1e-8


@pytest.mark.parametrize("k", [0, 2])
@pytest.mark.parametrize(("w", "aside", "inside"), [(3.0, 0.0, 1), (6.0, 0.0, 0), (0.0, 0.4 * B, 1), (0.0, 0.8 * B, 0)])
def test_dogs_that_are_asked_in_at_the_start(k: int, w: float, aside: float, inside: int) -> None:
    result = closing(w, 2 * math.pi * k / N + aside, command=((0, 1), (1, 1)), stop=1e-3)
    assert set(result["parts[0].inside"]) == {inside}
    assert set(result["parts[0].gap"]) == {inside * k}


def test_gaps_that_overlap_or_have_no_play_are_refused() -> None:
    for b in (1.1, 0.0):
        with pytest.raises(pt.ParameterError):
            closing(1.0, b=b)


def test_half_a_dog_is_refused() -> None:
    with pytest.raises(pt.ParameterError, match=r"whole number of dogs.*\n.*n = 5.5"):
        closing(1.0, n=5.5)
