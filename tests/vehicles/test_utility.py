"""Utility factors against published tables, and the weighting of both tests against the mean consumption of many days."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest

import powertrain as pt
from powertrain.trials import (
    FLEET_FACTOR,
    INDIVIDUAL_FACTOR,
    WLTP_FACTOR,
    ChargeSustaining,
    UtilityFactor,
    utility_weighted,
)

MILE = 1.609344  # km
FASTSIM = {9: 0.2044, 19: 0.38194, 39: 0.61347, 99: 0.86348, 199: 0.95408, 299: 0.98106}  # miles: its table uf_array


def test_the_fleet_factor_is_that_of_fastsim() -> None:
    """FASTSim 3.1.0 interpolates a table of the survey; the fit differs from it by up to 0.0043 between 1 and 1201 miles."""
    for miles, share in FASTSIM.items():
        assert FLEET_FACTOR(miles * MILE) == pytest.approx(share, abs=5e-3)


@pytest.mark.parametrize("factor", [WLTP_FACTOR, FLEET_FACTOR, INDIVIDUAL_FACTOR])
def test_a_utility_factor_is_the_mean_of_a_distribution_cut_off(factor: UtilityFactor) -> None:
    """E[min(D, d)]/E[D] begins at 0, increases, is concave and tends to 1; a fit is concave only within its error."""
    d = np.linspace(0.0, 3000.0, 3001)
    share = np.array([factor(x) for x in d])
    assert share[0] == 0
    assert share[-1] == pytest.approx(1.0, abs=1e-9)
    assert (np.diff(share) >= 0).all()
    assert np.diff(share, 2).max() < 1e-4


def test_the_european_factor_is_that_of_the_study_behind_it() -> None:
    """The technical report on utility factors for the regulation has two more digits (github.com/Phalacrocorax-gaimardi/phevmicrosimr)."""
    digits = (26.25, -38.94, -631.05, 5964.83, -25094.6, 60380.21, -87517.16, 75513.77, -35748.77, 7154.94)
    for d in np.linspace(0.0, 400.0, 41):
        exponent = sum(c * (d / 800.0) ** i for i, c in enumerate(digits, 1))
        assert WLTP_FACTOR(d) == pytest.approx(1 - np.exp(-exponent), abs=1e-4)


def test_one_term_is_exponential() -> None:
    assert UtilityFactor((2.0,), 100.0)(50.0) == pytest.approx(1 - np.exp(-1), rel=1e-14)
    assert replace(WLTP_FACTOR, normalized=1600.0)(100.0) == pytest.approx(WLTP_FACTOR(50.0), rel=1e-14)


@pytest.mark.parametrize(
    ("distance", "said"),
    [
        (-1.0, "the distance must be 0 or more; it is -1 km"),
        (np.nan, "not a finite number"),
        (np.inf, "not a finite number"),
    ],
)
def test_distances_that_are_none(distance: float, said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        WLTP_FACTOR(distance)


@pytest.mark.parametrize(
    ("coefficients", "said"), [((), "at least one coefficient"), ((1.0, np.nan), "coefficient 2 of the utility factor")]
)
def test_coefficients_that_are_none(coefficients: tuple[float, ...], said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        UtilityFactor(coefficients, 100.0)


def test_coefficients_that_give_no_share() -> None:
    with pytest.raises(pt.ParameterError, match="the coefficients give a share below 0 at 10 km"):
        UtilityFactor((-1.0,), 100.0)(10.0)


def test_a_normalized_distance_is_positive() -> None:
    with pytest.raises(pt.ParameterError, match="normalized"):
        UtilityFactor((1.0,), 0.0)


def depleted(last: float = 0.01) -> pd.DataFrame:
    """Two cycles on the battery, one of transition, one that confirms."""
    return pd.DataFrame(
        {
            "distance": [20.0, 40.0, 60.0, 80.0],
            "from the battery": [180.0, 175.0, 60.0, 1.0],
            "consumption": [0.0, 0.4, 3.0, 5.1],
            "carbon dioxide": [0.0, 9.0, 70.0, 118.0],
            "relative change": [1.2, 1.1, 0.4, last],
        }
    )


def sustained() -> ChargeSustaining:
    """Consumption 5.0 l/100 km and 116 g/km at equal charge."""
    tests = pd.DataFrame(
        {
            "soc": [0.2, 0.25],
            "charge": [0.0, -10.0],
            "consumption": [5.0, 4.8],
            "carbon dioxide": [116.0, 112.0],
            "net energy change": [0.0, -0.05],
        }
    )
    return ChargeSustaining(tests, 0.02, 0.4)


@pytest.mark.parametrize("mean", [10.0, 45.0, 300.0])
def test_the_weighted_consumption_is_what_a_fleet_consumes(mean: float) -> None:
    """Daily distances of an exponential distribution have the factor 1 - exp(-d/mean); each day begins with a full battery."""
    table, count = depleted(), 400_000
    days = -mean * np.log1p(-(np.arange(count) + 0.5) / count)  # quantiles of equal probability
    ends = np.array([0.0, 20.0, 40.0, 60.0])
    for name, beyond in (("from the battery", 0.0), ("consumption", 5.0), ("carbon dioxide", 116.0)):
        used = sum(
            rate * (np.clip(days, low, high) - low)
            for rate, low, high in zip(table[name].to_numpy()[:3], ends[:-1], ends[1:], strict=True)
        ) + beyond * np.maximum(days - ends[-1], 0.0)
        found = utility_weighted(table, sustained(), UtilityFactor((1.0,), mean))
        assert found[name] == pytest.approx(float(np.sum(used) / days.sum()), rel=1e-4)
        assert found["utility factor"] == pytest.approx(1 - np.exp(-60.0 / mean), rel=1e-12)


def test_an_empty_battery_at_the_start_leaves_the_charge_sustaining_consumption() -> None:
    found = utility_weighted(depleted().iloc[-1:], sustained())
    assert found.to_dict() == {
        "utility factor": 0.0,
        "from the battery": 0.0,
        "consumption": 5.0,
        "carbon dioxide": 116.0,
    }


def test_a_test_that_ended_early_is_refused() -> None:
    with pytest.raises(
        pt.ParameterError, match=r"ended after 80\.0 km, before the battery was empty.* 30% of the energy demand"
    ):
        utility_weighted(depleted(last=0.3), sustained())


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((depleted(), depleted()), r"utility_weighted\(\) takes the result of charge_sustaining\(\)"),
        ((depleted(), sustained(), 0.5), r"utility_weighted\(\) takes a UtilityFactor, such as WLTP_FACTOR, not 0.5"),
        ((sustained().tests, sustained()), r"utility_weighted\(\) takes the table of charge_depleting\(\)"),
        ((depleted().iloc[:0], sustained()), r"utility_weighted\(\) takes the table of charge_depleting\(\)"),
    ],
)
def test_other_arguments_are_named(arguments: tuple[Any, ...], said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        utility_weighted(*arguments)
