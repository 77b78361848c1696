"""Many runs of one plant: the same results in turn, in threads and in processes."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.rotational import Damper, Fixed, Inertia


class SpinDown(pt.Component):
    """An inertia that a damper brakes: w = w0 exp(-d t/J)."""

    inertia: Inertia = Inertia(J=2.0)
    damper: Damper = Damper(d=0.5)
    ground: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.inertia.flange_b, self.damper.flange_a)
        yield pt.connect(self.damper.flange_b, self.ground.flange)


class Shaped(pt.Component):
    """A part with a user's function in a structural field."""

    inertia: Inertia = Inertia(J=2.0)
    shape: Callable[[pt.Symbol], pt.Symbol] = abs
    shaped: pt.Variable = pt.variable("rad/s", "Speed through the function")

    def equations(self) -> pt.Equations:
        yield self.shaped == self.shape(self.inertia.w)


class Whole(pt.Component):
    part: Shaped = Shaped()

    def equations(self) -> pt.Equations:
        yield self.part.inertia.J == 3.0


CASES = [{"parameters": {"inertia.J": J}} for J in (1.0, 2.0, 4.0)]
EXACT = [10.0 * np.exp(-0.5 / J) for J in (1.0, 2.0, 4.0)]


def last_speeds(executor: Executor | None) -> list[float]:
    results = pt.sweep(SpinDown(), CASES, executor=executor, stop=1.0, starts={"inertia.w": 10.0})
    assert all(isinstance(r, pt.Result) for r in results)
    return [float(r["inertia.w"][-1]) for r in results if isinstance(r, pt.Result)]


def test_cases_in_turn_in_threads_and_in_processes() -> None:
    alone = last_speeds(None)
    np.testing.assert_allclose(alone, EXACT, rtol=1e-5)
    with ThreadPoolExecutor(2) as threads:
        assert last_speeds(threads) == alone
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as processes:
        assert last_speeds(processes) == alone


def test_a_failed_case_raises_or_is_kept() -> None:
    cases = [{"parameters": {"inertia.J": -1.0}}, {}]
    with pytest.raises(pt.ParameterError, match=r"inertia\.J = -1 kg\.m2"):
        pt.sweep(SpinDown(), cases, stop=1.0)
    failed, good = pt.sweep(SpinDown(), cases, stop=1.0, on_error="keep")
    assert isinstance(failed, pt.ParameterError)
    assert isinstance(good, pt.Result)


def test_a_function_that_does_not_pickle_is_named() -> None:
    model = Whole(part=Shaped(shape=lambda w: -w))
    with (
        ThreadPoolExecutor(1) as executor,
        pytest.raises(pt.ParameterError, match=r"Whole\.part\.shape = .*lambda.* top level"),
    ):
        pt.sweep(model, [{}], executor=executor, stop=1.0)


@pytest.mark.parametrize(
    ("case", "said"),
    [({"inertia.J": 2.0, "stop": 1.0}, r"case 1: inertia\.J is no option .*parameters"), ({}, r"case 1: stop \(s\)")],
)
def test_a_case_that_simulate_does_not_know_is_refused_before_any_run(case: dict[str, float], said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        pt.sweep(SpinDown(), [{"stop": 1.0}, case])
