"""The answer or a refusal: what is compiled has the value that its text has with numbers."""

from __future__ import annotations

import math

import pytest
from random_texts import Text, random_text

import powertrain as pt

pytestmark = [
    pytest.mark.filterwarnings("ignore:(?s).*numpy function was called on a casadi value:FutureWarning"),
    pytest.mark.filterwarnings("ignore::RuntimeWarning"),
]
PLACES = (-2.31, -1.0, -0.47, 0.0, 0.83, 2.0, 3.71)
LARGE = 1e6
"""Beyond it round-off decides, in a sine or a floor."""


def is_sound(model: Text) -> bool:
    """Whether it was compiled; fails where a value differs from the text's."""
    try:
        plant = pt.compile(model)
    except pt.PowertrainError:
        return False
    compared = 0
    for x in PLACES:
        expected = model.value(x=x, k=1.37, n=2.0)
        if not all(math.isfinite(v) and abs(v) < LARGE for v in expected.values()):
            continue
        try:
            result = plant.simulate(0.0, starts={"x": x})
        except pt.SimulationError as error:  # a comparison hides the nan of an argument outside its domain
            if "leaves its range" not in str(error):
                raise
            continue
        compared += 1
        for name in ("v", "y1", "y2", "y3"):
            found = result[name][-1]
            assert found == pytest.approx(expected[name], rel=1e-6, abs=1e-7), (model, name, x)
    return compared > 0


def soundness(seeds: range) -> float:
    """The share of texts that were compiled."""
    return sum(is_sound(random_text(seed)) for seed in seeds) / len(seeds)


def test_random_texts_are_computed_or_refused() -> None:
    assert soundness(range(15)) > 0.25


@pytest.mark.slow
def test_many_random_texts_are_computed_or_refused() -> None:
    assert soundness(range(40, 540)) > 0.25
