from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from powertrain.integration.samples import ROUGH, survey
from powertrain.numerics.buffers import CHECKS

PLACES = np.array([0.0, *CHECKS, 1.0])


def surveyed(samples: np.ndarray, noise: float = 0.0) -> tuple[bool, float]:
    """What the survey says about one indicator with these values at ``PLACES`` and this round-off."""
    dips, rough = survey([ca.SX(float(v)) for v in samples], ca.SX(noise))
    return bool(float(dips)), float(rough)


@pytest.mark.parametrize("least", [-0.01, 0.01])
@pytest.mark.parametrize("at", [0.03, 0.3, 0.4, 0.62, 0.7, 0.9])
def test_a_parabola_that_dips_below_zero_is_seen(at: float, least: float) -> None:
    """Above zero at all samples; its minimum, anywhere in the step, is below zero or not."""
    samples = 20.0 * (PLACES - at) ** 2 + least
    assert (samples > 0.0).all()
    dips, rough = surveyed(samples)
    assert dips == (least < 0.0)
    assert rough < 1e-6


@pytest.mark.parametrize("scale", [1.0, 0.2])
def test_a_sine_that_grazes_is_seen_in_this_step_or_in_the_next(scale: float) -> None:
    """Its trough is below zero by a millionth of the amplitude, where a parabola through samples may still be above; or well above zero."""

    def seen(trough: float, depth: float, length: float) -> bool:
        samples = 1 - depth - np.cos(2 * np.pi / 8 * (PLACES * length - trough))
        return surveyed(samples)[0] or bool(samples.min() <= 0.0)

    for trough in scale * np.linspace(0.3, 1.2, 91):
        now, then = [seen(trough, depth, scale) for depth in (1e-6, -1e-3)]
        assert not then
        assert now or seen(trough - scale, 1e-6, min(5 * scale, 1.0))


@pytest.mark.parametrize("length", [0.05, 0.1, 0.2, 0.3, 0.4, 0.5])
def test_the_trough_of_a_sine_is_seen_wherever_it_lies(length: float) -> None:
    """Steps of up to half a period; a trough that stays above zero by a fiftieth of the amplitude is none in steps of up to 0.4 periods."""
    shapes = [1 - np.cos(2 * np.pi * length * (PLACES - at)) for at in np.linspace(0.0, 1.0, 101)]
    for shape in shapes:
        for depth in (1e-6, 1e-4):
            samples = shape - depth
            assert samples.min() <= 0.0 or surveyed(samples)[0] or surveyed(samples)[1] > ROUGH
    assert length > 0.4 or not any(surveyed(shape + 0.02)[0] for shape in shapes)


@pytest.mark.parametrize("x", [4.0 * PLACES - 1.0, 3.0 - 4.0 * PLACES], ids=["first", "last"])
def test_a_parabola_is_as_uncertain_as_the_differences_about_its_middle_say(x: np.ndarray) -> None:
    """5 (x + 0.7)^2 + x^4 has no third difference about x = 0, but one of 24 a sample away: an error of 2.3 in place of 0.75."""
    shape = 5.0 * (x + 0.7) ** 2 + x**4
    assert surveyed(shape - 0.25)[0]
    assert not surveyed(shape + 0.6)[0]


@pytest.mark.parametrize("samples", [[0.05, 0.02, 0.01, 0.01, 0.1], [0.3, 0.1, 0.01, 0.01, 0.02]])
def test_either_parabola_may_dip_between_the_inner_samples(samples: list[float]) -> None:
    """0.01 - 0.045^2/0.18 by the steep one, 0.009 by the other."""
    assert surveyed(np.array(samples))[0]
    assert not surveyed(np.array([0.05, 0.02, 0.01, 0.01, 0.02]))[0]


@pytest.mark.parametrize("least", [-0.3, 0.3])
@pytest.mark.parametrize("at", [0.1, 0.12, 0.14])
def test_a_trough_before_the_first_sample_is_seen_where_the_curve_turns_straight(at: float, least: float) -> None:
    """A torque that reverses for a moment and then rises like a sine: no parabola through later samples comes near it."""
    samples = 10.0 * (1 - np.cos(3.5 * (PLACES - at))) + least
    assert (samples > 0.0).all()
    assert surveyed(samples)[0] == (least < 0.0)


@pytest.mark.parametrize("slope", [0.0, 0.1, 1.0])
@pytest.mark.parametrize("bend", [0.0, 1.0, 10.0])
@pytest.mark.parametrize("third", [0.0, 1.0, 10.0])
def test_what_has_just_left_zero_does_not_dip(slope: float, bend: float, third: float) -> None:
    assert not surveyed(slope * PLACES + bend * PLACES**2 + third * PLACES**3)[0]


@pytest.mark.parametrize("at", [-0.1, 1.2])
def test_a_minimum_well_outside_the_step_is_none(at: float) -> None:
    assert not surveyed(20.0 * (PLACES - at) ** 2 - 0.01)[0]


@pytest.mark.parametrize("samples", [np.ones(5), 1.0 - 0.9 * PLACES, 0.2 - 20.0 * (PLACES - 0.6) ** 2 + 4.0])
def test_what_does_not_bend_upwards_has_no_minimum(samples: np.ndarray) -> None:
    assert not surveyed(samples)[0]


@pytest.mark.parametrize("phase", np.linspace(0.0, np.pi, 13))
def test_a_sine_is_rough_at_any_phase(phase: float) -> None:
    """A single third difference vanishes about an extremum; a step that grew from there would skip periods."""
    assert surveyed(2.0 + np.sin(2 * np.pi * 0.4 * PLACES + phase))[1] > 0.02


def test_roughness_is_the_third_difference_over_the_largest_value() -> None:
    assert surveyed(PLACES**3)[1] == pytest.approx(6 * 0.25**3, rel=1e-5)
    assert surveyed(np.array([-1.0, 1.0, -1.0, 1.0, -1.0]))[1] == pytest.approx(8.0, rel=1e-5)


@pytest.mark.parametrize("seed", range(20))
def test_round_off_is_no_structure(seed: int) -> None:
    """Torques of laws at rest about their limit, in units of their round-off: neither rough nor dipping, whatever the samples."""
    samples = 2.0 + np.random.default_rng(seed).uniform(-1.0, 1.0, 5)
    dips, rough = surveyed(samples, noise=1.0)
    assert not dips
    assert rough <= 0.0
    assert surveyed(samples)[1] > 0.0


def test_structure_beyond_round_off_counts() -> None:
    alternating = np.array([-1.0, 1.0, -1.0, 1.0, -1.0])
    assert surveyed(alternating, noise=0.1)[1] == pytest.approx(8.0 - 0.8, rel=1e-5)
    dip = 20.0 * (PLACES - 0.3) ** 2 - 0.01
    assert surveyed(dip, noise=0.5)[0]  # second difference 2.5
    assert not surveyed(dip, noise=0.7)[0]


def test_below_a_millionth_indicators_need_not_be_smooth() -> None:
    """3, 1, 3, 1, 3 has a third difference of 8: 2.7 times its size, but 0.08 millionths at 1e-8."""
    jagged = np.array([3.0, 1.0, 3.0, 1.0, 3.0])
    assert surveyed(jagged)[1] == pytest.approx(8.0 / 3.0, rel=1e-5)
    assert surveyed(1e-8 * jagged)[1] == pytest.approx(0.08, rel=0.05)
