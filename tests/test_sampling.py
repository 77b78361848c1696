"""Cases from distributions: slices, convergence, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import stats

import powertrain as pt
from powertrain.components.rotational import Inertia


def columns(cases: list[dict[str, dict[str, float]]]) -> dict[str, np.ndarray]:
    return {name: np.array([c["parameters"][name] for c in cases]) for name in cases[0]["parameters"]}


def test_a_latin_hypercube_has_one_value_in_every_slice() -> None:
    normal = stats.norm(10, 2)
    found = columns(pt.sample({"a": (2.0, 4.0), "b": normal}, 40, seed=3))
    assert sorted(((found["a"] - 2) / 2 * 40).astype(int)) == list(range(40))
    assert sorted((normal.cdf(found["b"]) * 40).astype(int)) == list(range(40))
    assert abs(np.corrcoef(found["a"], found["b"])[0, 1]) < 0.5


def test_sobol_points_converge_faster_than_chance() -> None:
    """The mean of a product of three uniform numbers is 1/8; by chance its error is sqrt((1/27 - 1/64)/n) = 0.0046 for n = 1024."""
    found = columns(pt.sample(dict.fromkeys("abc", (0.0, 1.0)), 1024, method="sobol"))
    assert abs((found["a"] * found["b"] * found["c"]).mean() - 1 / 8) < 5e-4


def test_cases_go_into_a_sweep_and_repeat() -> None:
    cases = pt.sample({"J": (1.0, 2.0)}, 3, seed=1)
    assert cases == pt.sample({"J": (1.0, 2.0)}, 3, seed=1)
    assert cases != pt.sample({"J": (1.0, 2.0)}, 3, seed=2)
    results = [r for r in pt.sweep(Inertia(J=1.0), cases, stop=1.0) if isinstance(r, pt.Result)]
    assert [r.parameters["J"] for r in results] == [c["parameters"]["J"] for c in cases]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (({"a": (2.0, 1.0)}, 4), "distributions: a"),
        (({}, 4), "give at least one parameter"),
        (({"a": (0.0, 1.0)}, 0), "number"),
        (({"a": (0.0, 1.0)}, 12, "sobol"), "12 is not a power of two.*take 16"),
        (({"a": (0.0, 1.0)}, 4, "halton"), "method='halton' must be one of"),
        (({"a": stats.norm(np.nan, 1)}, 4), "a gives values that are not finite"),
    ],
)
def test_what_is_refused(given: Any, said: str) -> None:
    options = {"method": given[2]} if len(given) > 2 else {}
    with pytest.raises(pt.ParameterError, match=said):
        pt.sample(*given[:2], **options)


@pytest.mark.parametrize("seed", [None, "abc", -1, 1.5])
def test_seeds_are_whole_numbers(seed: Any) -> None:
    with pytest.raises(pt.ParameterError, match=f"seed = {seed!r} must be"):
        pt.sample({"a": (0.0, 1.0)}, 4, seed=seed)
