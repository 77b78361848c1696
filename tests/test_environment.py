"""Learning environments: Gymnasium's own check, equal episodes, ends, and the result of a run in one piece."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import powertrain as pt
from powertrain.components.rotational import Brake, Inertia, Torque


class Braked(pt.Component):
    """An inertia with a torque and a brake from outside; it must not turn faster than ``fastest``."""

    fastest: float = 100.0  # rad/s

    torque: pt.Input = pt.signal_input("N.m", "Torque")
    press: pt.Input = pt.signal_input("1", "Press of the brake")
    source: Torque = Torque()
    rotor: Inertia = Inertia(J=0.5)
    brake: Brake = Brake(fn_max=10.0, mue_pos=((0.0, 1.0),))

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque, self.source.tau)
        yield pt.connect(self.press, self.brake.f_normalized)
        yield pt.connect(self.source.flange, self.rotor.flange_a)
        yield pt.connect(self.rotor.flange_b, self.brake.flange_a)
        pt.within(self.rotor.w, -self.fastest, self.fastest, name="speed of the rotor", unit="rad/s")


ACTIONS = {"torque": (-20.0, 20.0), "press": (0.0, 1.0)}
SEEN = {"rotor.w": (-np.inf, np.inf), "brake.mode": (-1.0, 2.0)}


def closer(before: Mapping[str, float], run: pt.Running[Any]) -> float:
    return abs(before["rotor.w"] - 5.0) - abs(run["rotor.w"] - 5.0)


def random_start(rng: np.random.Generator) -> dict[str, Any]:
    return {"starts": {"rotor.w": rng.uniform(-5.0, 5.0)}}


@pytest.fixture(scope="module")
def plant() -> pt.Plant[Braked]:
    return pt.compile(Braked())


def made(plant: pt.Plant[Braked], **options: Any) -> pt.Environment:
    options = dict[str, Any](reward=closer, dt=0.1, duration=1.0, begin=random_start) | options
    return pt.Environment(plant, ACTIONS, SEEN, **options)


def episode(env: Any, seed: int, actions: Any) -> list[Any]:
    return [env.reset(seed=seed)[0].tolist(), *[(s[0].tolist(), *s[1:4]) for s in map(env.step, actions)]]


@pytest.mark.filterwarnings("ignore:.*:UserWarning")  # infinite ranges are a remark of Gymnasium's
def test_gymnasium_accepts_it(plant: pt.Plant[Braked]) -> None:
    check_env(made(plant), skip_render_check=True)


def test_an_episode_is_the_run_with_these_inputs(plant: pt.Plant[Braked]) -> None:
    rng = np.random.default_rng(3)
    actions = np.column_stack([rng.uniform(-20, 20, 10), rng.uniform(0, 1, 10)])
    steps = episode(made(plant, begin=lambda _: {"starts": {"rotor.w": 2.0}}), 0, actions)
    w, dt = 2.0, 0.1
    for (torque, press), step in zip(actions, steps[1:], strict=True):  # one inertia and a brake, by hand
        limit, left, before = 10.0 * press, dt, w
        if w and abs(w) <= (decay := (limit - np.sign(w) * torque) / 0.5 * dt):
            left, w = dt * (1 - abs(w) / decay), 0.0
        if w == 0.0:
            w = np.sign(torque) * max(abs(torque) - limit, 0.0) / 0.5 * left
        else:
            w += (torque - np.sign(w) * limit) / 0.5 * left
        assert step[0][0] == pytest.approx(w, abs=1e-9)
        assert step[1] == pytest.approx(abs(before - 5) - abs(w - 5), abs=1e-9)
    assert [step[3] for step in steps[1:]] == [False] * 9 + [True]


def test_environments_on_one_plant_do_not_disturb_each_other(plant: pt.Plant[Braked]) -> None:
    rng = np.random.default_rng(0)
    actions = np.stack([rng.uniform(-20, 20, (9, 3)), rng.uniform(0, 1, (9, 3))], axis=-1)
    alone = [episode(made(plant), 7 + k, actions[:, k]) for k in range(3)]
    many = gymnasium.vector.SyncVectorEnv([lambda: made(plant)] * 3)
    seen = [many.reset(seed=7)[0], *[many.step(a)[0] for a in actions]]
    for k in range(3):
        assert [alone[k][0], *[s[0] for s in alone[k][1:]]] == [row[k].tolist() for row in seen]


def test_options_of_reset_override_single_values_of_begin(plant: pt.Plant[Braked]) -> None:
    """``starts`` of the options replaced all those of ``begin``, so that a speed that ``begin`` gave was lost silently."""
    begun = {"starts": {"rotor.w": 3.0}, "inputs": {"torque": 2.0}, "t": 1.0}
    env = made(plant, begin=lambda _: begun)
    for options, phi, w in (({"starts": {"rotor.phi": 7.0}}, 7.0, 3.0), ({"starts": {"rotor.w": 1.0}}, 0.0, 1.0)):
        env.reset(options=options)
        run = env._run
        assert run is not None
        assert (run["rotor.phi"], run["rotor.w"], run["torque"], run.time) == (phi, w, 2.0, 1.0)
    assert begun == {"starts": {"rotor.w": 3.0}, "inputs": {"torque": 2.0}, "t": 1.0}
    env.reset(options={"inputs": {"press": 1.0}, "t": 2.0})
    assert env._run is not None
    assert (env._run["torque"], env._run["press"], env._run.time) == (2.0, 1.0, 2.0)


def test_ends(plant: pt.Plant[Braked]) -> None:
    env = made(plant, terminated=lambda run: run["rotor.w"] > 3.0, begin=None)
    env.reset()
    ended = [env.step([20.0, 0.0])[2] for _ in range(2)]
    assert ended == [True, True]  # 4 rad/s after one period


@pytest.mark.parametrize(("t", "dt"), [(1e6, 0.1), (1e5, 0.01), (1e6, 0.02)])
def test_episodes_have_as_many_periods_as_they_last(plant: pt.Plant[Braked], t: float, dt: float) -> None:
    """The sum of the periods may differ from their duration of 1 s by round-off."""
    env = made(plant, dt=dt, begin=lambda _: {"t": t})
    env.reset()
    ends = [env.step([0.0, 0.0])[3] for _ in range(round(1.0 / dt))]
    assert ends.index(True) == len(ends) - 1


def test_a_failed_simulation_ends_the_episode() -> None:
    env = made(pt.compile(Braked(fastest=1.0)), begin=None)
    env.reset()
    seen, reward, ended, cut, info = env.step([20.0, 0.0])
    assert (seen.tolist(), reward, ended, cut) == ([0.0, 2.0], 0.0, True, False)  # at rest, the brake open
    assert "speed of the rotor" in info["error"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"actions": {"torqe": (0, 1)}}, "the model has no input torqe; it has torque, press"),
        ({"actions": {"torque": (1, 1)}}, "actions: the range of torque, 1 to 1, is empty"),
        ({"dt": 0.0}, "dt"),
        ({"observations": {"rotor.v": (0, 1)}}, r"rotor\.v"),
    ],
)
def test_refused(plant: pt.Plant[Braked], change: dict[str, Any], message: str) -> None:
    given = dict[str, Any](actions=ACTIONS, observations=SEEN, reward=closer, dt=0.1, duration=1.0) | change
    with pytest.raises(pt.ParameterError, match=message):
        pt.Environment(plant, **given).reset()


def test_actions_outside_their_ranges_are_refused(plant: pt.Plant[Braked]) -> None:
    env = made(plant)
    with pytest.raises(pt.ParameterError, match=r"call reset\(\) first"):
        env.step([0.0, 0.0])
    env.reset(seed=1)
    with pytest.raises(pt.ParameterError, match="not within the ranges of torque, press"):
        env.step([0.0, 1.5])
