"""Decimated curves stay within their tolerance of all samples, and keep what cannot be left out."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from powertrain.viewer.decimation import kept_samples


def distance(t: np.ndarray, y: np.ndarray, kept: np.ndarray) -> float:
    """The largest distance of the samples from the lines, sample by sample."""
    worst = 0.0
    for k in range(len(t)):
        right = int(np.searchsorted(kept, k))
        if kept[right] == k:
            continue
        a, b = kept[right - 1], kept[right]
        line = y[a] + (y[b] - y[a]) * ((t[k] - t[a]) / (t[b] - t[a]) if t[b] > t[a] else 0.0)
        worst = max(worst, abs(y[k] - line))
    return worst


@settings(derandomize=True, deadline=None, max_examples=60)
@given(seed=st.integers(0, 10**6), size=st.integers(1, 400), tolerance=st.sampled_from([0.0, 0.01, 0.3, 10.0]))
def test_lines_stay_within_the_tolerance(seed: int, size: int, tolerance: float) -> None:
    rng = np.random.default_rng(seed)
    t = np.sort(rng.choice(np.round(rng.uniform(0, 10, size), 2), size))  # some instants twice and more
    y = np.cumsum(rng.normal(0, 0.1, size)) + rng.choice([0, 1], size, p=[0.97, 0.03])
    kept = kept_samples(t, y, tolerance)
    assert kept[0] == 0
    assert kept[-1] == size - 1
    assert (np.diff(kept) > 0).all()
    assert distance(t, y, kept) <= tolerance * (1 + 1e-12)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_signal_with_gaps_is_kept_whole(bad: float) -> None:
    t = np.linspace(0, 10, 11)
    assert kept_samples(t, np.where(t == 0.0, bad, 1.0), bad).tolist() == list(range(11))


def test_a_straight_line_needs_its_ends_and_a_kink_one_more() -> None:
    t = np.linspace(0, 10, 1001)
    assert kept_samples(t, 3 * t, 1e-9).tolist() == [0, 1000]
    assert kept_samples(t, np.abs(t - 4), 1e-9).tolist() == [0, 400, 1000]


def test_both_sides_of_a_jump_are_kept() -> None:
    t = np.array([0.0, 1.0, 2.0, 2.0, 3.0, 4.0])
    assert kept_samples(t, np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0]), 0.1).tolist() == [0, 2, 3, 5]


@pytest.mark.parametrize("size", [1, 2])
def test_few_samples_are_all_kept(size: int) -> None:
    assert kept_samples(np.arange(float(size)), np.ones(size), 0.0).tolist() == list(range(size))
