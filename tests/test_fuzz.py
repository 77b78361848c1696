"""Random drivelines either simulate with closed energy, or are refused with a message that names components."""

from __future__ import annotations

import random
from collections.abc import Sequence
from typing import Any

import pytest
from bounded import bounded
from drivelines import Balance, Driveline, balance, driveline
from hypothesis import HealthCheck, Phase, given, note, settings
from hypothesis import strategies as st

import powertrain as pt

WAYS = settings(
    derandomize=True,
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much],
    print_blob=False,
    phases=(Phase.explicit, Phase.generate),
)


def attempt(model: Driveline) -> Balance | pt.PowertrainError:
    """The energy balance of a run, or the error that refused it."""
    try:
        with bounded():
            return balance(pt.simulate(model, 1.0, rtol=1e-7, points=10))
    except pt.PowertrainError as error:
        return error


def simulates_or_is_refused(model: Driveline) -> bool:
    """Whether it simulates; fails where it does neither."""
    note(f"{model.nodes}\n{model.wires}\n" + "\n".join(map(repr, [*model.parts, *model.signals])))
    found = attempt(model)
    if isinstance(found, pt.PowertrainError):
        assert "parts[" in str(found), f"names no component: {found}"
        return False
    assert found.gap <= 1e-6 * (1e-3 + found.power), found
    assert abs(found.gained - found.supplied + found.lost) <= 1e-5 * (1e-3 + found.turnover), found
    return True


def drawn(data: st.DataObject, largest: int, careless: bool) -> Driveline:
    def pick(choices: Sequence[Any]) -> Any:
        return choices[data.draw(st.integers(0, len(choices) - 1))]

    return driveline(pick, data.draw(st.integers(2, largest)), careless)


@given(st.data())
@settings(WAYS, max_examples=12)
def test_drivelines(data: st.DataObject) -> None:
    simulates_or_is_refused(drawn(data, 12, careless=False))


@given(st.data())
@settings(WAYS, max_examples=12)
def test_careless_drivelines(data: st.DataObject) -> None:
    simulates_or_is_refused(drawn(data, 8, careless=True))


@pytest.mark.parametrize("seed", [5000693, 5000836, 5001047])
def test_one_way_laws_that_hold_in_the_end(seed: int) -> None:
    """For an instant, or in modes that are tried, one yields by its compliance until a law with a limit slips."""
    rng = random.Random(seed)
    model = driveline(lambda choices: choices[rng.randrange(len(choices))], rng.randint(2, 30), rng.random() < 0.5)
    assert isinstance(attempt(model), Balance)


@pytest.mark.slow
@given(st.data())
@settings(WAYS, max_examples=150)
def test_many_drivelines(data: st.DataObject) -> None:
    simulates_or_is_refused(drawn(data, 30, careless=data.draw(st.booleans())))
