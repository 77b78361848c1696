"""A run that is cut in two, and a run at another time of day, move as the whole one does."""

from __future__ import annotations

import random
from typing import Any

import numpy as np
import pytest
from drivelines import Driveline, driveline
from mechanisms import simulated

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Constant

RTOL = 1e-7
STOP = 2.0


def drawn(seed: int) -> tuple[Driveline, pt.Plant[Any], pt.Result[Any]]:
    """A random driveline that simulates, and its run."""
    rng = random.Random(seed)
    for _ in range(100):
        model = driveline(rng.choice, rng.randint(3, 14), careless=rng.random() < 0.2)
        try:
            plant = pt.compile(model)
            return model, plant, plant.simulate(STOP, rtol=RTOL)
        except pt.PowertrainError:
            continue
    raise AssertionError("none of 100 drivelines simulates")


def speeds(model: Driveline, result: pt.Result[Any], times: Any) -> Any:
    inertias = [i for i, part in enumerate(model.parts) if isinstance(part, rot.Inertia)]
    return np.array([result.at(times, f"parts[{i}].w") for i in inertias])


def alike(one: Any, other: Any) -> None:
    np.testing.assert_allclose(other, one, rtol=0.0, atol=1e3 * RTOL * (1.0 + np.abs(one).max()))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(30))
def test_the_second_half_starts_at_the_end_of_the_first(seed: int) -> None:
    model, plant, whole = drawn(seed)
    cut = random.Random(seed).choice([0.2, 0.35, 0.5, 1.0, 1.7])
    first = plant.simulate(cut, rtol=RTOL)
    known = [*plant.compiled.states, *(name for name in plant.compiled.discretes if name in first)]
    starts = {name: float(first[name][-1]) for name in known}
    second = plant.simulate(STOP, start=cut, starts=starts, rtol=RTOL)
    times = np.linspace(cut, STOP, 60)[1:]
    alike(speeds(model, whole, times), speeds(model, second, times))


CUTS = (0.11, 0.27, 0.43, 0.61, 0.83)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(40))
def test_a_machine_cut_in_two_moves_as_the_whole_one(seed: int) -> None:
    """The second half starts with the states and discrete variables at the end of the first."""
    options: dict[str, Any] = {"rtol": 1e-8}
    plant, starts, whole = simulated(seed, **options)
    cut = CUTS[seed % len(CUTS)]
    first = plant.simulate(cut, starts=starts, **options)
    known = [*plant.compiled.states, *(name for name in plant.compiled.discretes if name in first)]
    starts = {name: float(first[name][-1]) for name in known}
    try:
        second = plant.simulate(1.0, start=cut, starts=starts, **options)
    except pt.InitializationError as error:
        if "nothing determines this torque" in str(error):
            pytest.skip("its state does not tell from which direction it came to rest")
        raise
    times = np.linspace(cut, 1.0, 60)[1:]
    for name in plant.compiled.states:
        size = 1.0 + np.abs(whole[name]).max()
        np.testing.assert_allclose(
            second.at(times, name), whole.at(times, name), rtol=0.0, atol=1e-4 * size, err_msg=name
        )


@pytest.mark.slow
@pytest.mark.parametrize("begin", [-500.0, 1000.0])
@pytest.mark.parametrize("seed", range(15))
def test_the_same_run_at_another_time(seed: int, begin: float) -> None:
    model, _, run = drawn(seed)
    signals = tuple(
        s if isinstance(s, Constant) else pt.replace(s, {"startTime": s.startTime + begin})  # type: ignore[attr-defined]
        for s in model.signals
    )
    later = Driveline(parts=model.parts, nodes=model.nodes, signals=signals, wires=model.wires)
    times = np.linspace(0.0, STOP, 60)
    again = pt.simulate(later, begin + STOP, start=begin, rtol=RTOL)
    alike(speeds(model, run, times), speeds(model, again, begin + times))


@pytest.mark.parametrize(("w", "starts"), [(-2.5e-10, 0.0), (-1e-7, 0.0), (1e-7, 1e-7)])
def test_a_freewheel_that_turns_backward_by_round_off_is_at_rest(w: float, starts: float) -> None:
    """What slides beside it keeps its speed."""
    bearing = rot.BearingFriction(tau_pos=((0.0, 1.0),))
    model = Driveline(
        parts=(rot.Inertia(J=1.0), rot.Freewheel(), rot.Inertia(J=1.0), bearing),
        nodes=(
            ((0, "flange_b"), (1, "flange_a")),
            ((1, "flange_b"), (2, "flange_a")),
            ((0, "flange_a"), (3, "flange_a")),
        ),
    )
    plant = pt.compile(model)
    run = plant.simulate(0.1, starts={"parts[0].w": 10.0, "parts[1].w_rel": w})
    assert run["parts[1].w_rel"][0] == starts
    assert run["parts[0].w"][0] == pytest.approx(10.0, abs=1e-6)
    with pytest.raises(pt.InitializationError, match="moves backward"):
        plant.simulate(0.1, starts={"parts[0].w": 10.0, "parts[1].w_rel": -1e-6})
