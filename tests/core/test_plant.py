"""One plant run many times: parameters, pickling, threads, processes, the same states in every build."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from core_models import ThreeClutches

import powertrain as pt

NAMES = ("J1.w", "J4.w", "clutch2.tau")


@pytest.fixture(scope="module")
def plant() -> pt.Plant[ThreeClutches]:
    return pt.compile(ThreeClutches())


def final(plant: pt.Plant[Any], inertia: float) -> list[float]:
    result = plant.simulate(1.5, parameters={"J1.J": inertia}, points=100)
    return [float(result[name][k]) for name in NAMES for k in (20, 60, -1)]


CASES = [0.8, 1.0, 1.2, 1.5, 2.0, 0.5]


def test_parameters_change_without_a_new_compilation(plant: pt.Plant[ThreeClutches]) -> None:
    fresh = pt.compile(pt.replace(ThreeClutches(), {"J1.J": 1.5}))
    np.testing.assert_array_equal(final(plant, 1.5), final(fresh, 1.5))
    assert plant.parameters["J1.J"] == 1.0
    assert plant.simulate(0.1, parameters={"J1.J": 1.5}).parameters["J1.J"] == 1.5
    assert final(plant, 1.0) != final(plant, 1.5)


def test_runs_do_not_depend_on_the_runs_before(plant: pt.Plant[ThreeClutches]) -> None:
    first = final(plant, 1.0)
    plant.simulate(0.7, starts={"J1.w": -20.0}, parameters={"clutch1.fn_max": 3.0}, method="rodas5p")
    np.testing.assert_array_equal(final(plant, 1.0), first)


def test_pickled_plant_gives_the_same(plant: pt.Plant[ThreeClutches]) -> None:
    again = pickle.loads(pickle.dumps(plant))
    assert again.compiled.states == plant.compiled.states
    np.testing.assert_array_equal(final(again, 1.2), final(plant, 1.2))


def test_threads_share_one_plant(plant: pt.Plant[ThreeClutches]) -> None:
    alone = [final(plant, J) for J in CASES]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda J: final(plant, J), CASES * 3))
    np.testing.assert_array_equal(together, alone * 3)


def test_processes_give_the_same(plant: pt.Plant[ThreeClutches]) -> None:
    with ProcessPoolExecutor(2) as pool:
        there = list(pool.map(final, [plant] * 2, CASES[:2]))
    np.testing.assert_array_equal(there, [final(plant, J) for J in CASES[:2]])


def test_result_pickles(plant: pt.Plant[ThreeClutches]) -> None:
    result = plant.simulate(0.5)
    again = pickle.loads(pickle.dumps(result))
    np.testing.assert_array_equal(again["clutch1.tau"], result["clutch1.tau"])


@pytest.mark.slow
def test_two_processes_build_the_same_states() -> None:
    code = "import powertrain as pt, core_models as c; p = pt.compile(c.ThreeClutches()); "
    code += "print(p.compiled.states, p.simulate(1.0)['J4.w'][-1])"
    here = Path(__file__).parent
    path = os.pathsep.join([str(here), str(here.parents[1])])
    said = []
    for seed in ("1", "2"):
        environment = {**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": path}
        done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
        said.append(done.stdout)
    assert said[0] == said[1]
    assert "clutch1.w_rel" in said[0]


def test_relative_motions_of_clutches_are_states(plant: pt.Plant[ThreeClutches]) -> None:
    wanted = {f"clutch{k}.{name}" for k in (1, 2, 3) for name in ("phi_rel", "w_rel")}
    assert wanted <= set(plant.compiled.states)
    assert len(plant.compiled.states) == 8


def test_method_is_free_to_choose(plant: pt.Plant[ThreeClutches]) -> None:
    runs = [plant.simulate(1.5, method=method, rtol=1e-8) for method in ("dopri5", "rodas5p")]
    assert len(runs[0].events) == len(runs[1].events)
    np.testing.assert_allclose([e.time for e in runs[0].events], [e.time for e in runs[1].events], atol=1e-7)


class TwoInputs(pt.Component):
    """x' = u + v, where v has a default."""

    u: pt.Input = pt.signal_input("m/s", "Speed")
    v: pt.Input = pt.signal_input("m/s", "Speed of the belt", default=0.0)
    x: pt.Variable = pt.variable("m", "Position")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.u.value + self.v.value


def test_an_input_without_value_and_default_is_named() -> None:
    plant = pt.compile(TwoInputs())
    assert plant.simulate(1.0).notes == ("the input u is 0 m/s, because it was given no value",)
    assert plant.simulate(1.0, inputs={"u": 0.0}).notes == ()
