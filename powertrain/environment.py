"""A model as an environment of Gymnasium, for reinforcement learning."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, cast

import numpy as np

from powertrain.errors import ParameterError, PowertrainError, SimulationError
from powertrain.language.arguments import array, by_name, positive
from powertrain.language.reals import Array
from powertrain.plant import Plant
from powertrain.running import Running

try:
    import gymnasium
except ImportError as error:
    raise PowertrainError("learning environments need Gymnasium: pip install 'powertrain[learning]'") from error

Range = tuple[float, float]
_ROUNDING = 1e-9
"""Part of a period by which a duration may exceed whole periods through round-off."""


class Environment(gymnasium.Env[Array, Array]):
    """Episodes of a model: each action sets inputs for one period, each observation reads signals at its end.

    Parameters
    ----------
    plant
        The model, with inputs.
    actions
        Inputs with their ranges, in their units: ``{"throttle": (0, 1)}``.
    observations
        Signals with their ranges, in their units, which may be infinite: ``{"engine.w": (0, 700)}``. Ranges describe the space; signals may
        leave them.
    reward
        From the run before and after a step, ``reward(before, run)``: ``before`` holds the observed signals by name, ``run["engine.w"]`` is
        any present value. Returns a number.
    dt
        Period of the actions [s].
    duration
        After this time [s] an episode is truncated.
    terminated
        ``terminated(run)`` is true where an episode has ended by itself. An episode also ends where the simulation fails; ``info["error"]``
        is the message then.
    begin
        ``begin(rng)`` gives the arguments of ``plant.start`` for the next episode, such as ``{"starts": {"car.w": rng.uniform(0, 50)}}``;
        ``rng`` is the generator that ``reset(seed=...)`` seeds. By default all episodes begin alike.

    Raises
    ------
    PowertrainError
        Without Gymnasium: ``pip install 'powertrain[learning]'``.
    ParameterError
        For unknown inputs and signals, and for actions that are not finite or outside their ranges; ``gymnasium.wrappers.ClipAction`` clips
        them.

    Notes
    -----
    Several environments may share one plant in one process, as in ``gymnasium.vector.SyncVectorEnv``; each has a run of its own. With the
    same seed and actions an episode repeats to the last bit.

    Examples
    --------
    >>> import powertrain as pt
    >>> from powertrain.components.rotational import Inertia, Torque
    >>> class Shaft(pt.Component):
    ...     torque: pt.Input = pt.signal_input("N.m", "Torque")
    ...     source: Torque = Torque()
    ...     rotor: Inertia = Inertia(J=2.0)
    ...     def equations(self):
    ...         yield pt.connect(self.torque, self.source.tau)
    ...         yield pt.connect(self.source.flange, self.rotor.flange_a)
    >>> env = pt.Environment(
    ...     pt.compile(Shaft()), {"torque": (-10, 10)}, {"rotor.w": (-100, 100)}, dt=0.1, duration=5.0,
    ...     reward=lambda before, run: -abs(run["rotor.w"] - 20),
    ... )
    >>> _ = env.reset(seed=1)
    >>> observation, reward, ended, cut, _ = env.step([4.0])
    >>> print(observation.round(6), round(reward, 6), ended, cut)
    [0.2] -19.8 False False
    """

    def __init__(
        self,
        plant: Plant[Any],
        actions: Mapping[str, Range],
        observations: Mapping[str, Range],
        *,
        reward: Callable[[Mapping[str, float], Running[Any]], float],
        dt: float,
        duration: float,
        terminated: Callable[[Running[Any]], bool] | None = None,
        begin: Callable[[np.random.Generator], Mapping[str, Any]] | None = None,
    ) -> None:
        self.plant, self.dt, self.duration = plant, positive("dt", dt), positive("duration", duration)
        self._actions, self._observed = list(by_name("actions", actions)), list(by_name("observations", observations))
        unknown = [name for name in self._actions if name not in plant.compiled.inputs]
        if unknown:
            raise ParameterError(
                f"actions: the model has no input {unknown[0]}; it has {', '.join(plant.compiled.inputs)}"
            )
        self.action_space = _box("actions", actions)
        self.observation_space = _box("observations", observations)
        self._reward, self._terminated, self._begin = reward, terminated, begin
        self._run: Running[Any] | None = None

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """A new episode; ``options`` are further arguments of ``plant.start``, which override those of ``begin`` value by value.

        With ``begin`` giving ``{"starts": {"car.w": 5.0, "battery.soc": 0.6}}``, ``options={"starts": {"car.w": 0.0}}`` leaves the charge
        at 0.6.
        """
        super().reset(seed=seed)
        given: dict[str, Any] = {"record": False}
        if self._begin is not None:
            given |= self._begin(self.np_random)
        for name, value in (options or {}).items():
            both = isinstance(value, Mapping) and isinstance(given.get(name), Mapping)
            given[name] = {**given[name], **value} if both else value
        self._run = self.plant.start(**given)
        self._left = self.duration / self.dt - _ROUNDING
        return self._observe(self._run), {}

    def step(self, action: Any) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """One period with these inputs: observation, reward, terminated, truncated, info."""
        if self._run is None:
            raise ParameterError("the episode has not begun: call reset() first")
        run, values = self._run, array("action", action)
        if not self.action_space.contains(values):
            raise ParameterError(f"action {values} is not within the ranges of {', '.join(self._actions)}")
        before = dict(zip(self._observed, self._observe(run).tolist(), strict=True))
        try:
            run.step(self.dt, **dict(zip(self._actions, values.tolist(), strict=True)))
        except SimulationError as error:
            return self._observe(run), 0.0, True, False, {"error": str(error)}
        ended = self._terminated is not None and bool(self._terminated(run))
        self._left -= 1
        return self._observe(run), float(self._reward(before, run)), ended, self._left <= 0, {"time": run.time}

    def _observe(self, run: Running[Any]) -> Array:
        return np.array([run[name] for name in self._observed])


def _box(what: str, ranges: Mapping[str, Range]) -> gymnasium.Space[Array]:
    """The space of these ranges; ParameterError where one is empty."""
    for name, (low, high) in ranges.items():
        if not low < high:
            raise ParameterError(f"{what}: the range of {name}, {low:g} to {high:g}, is empty")
    low, high = np.array(list(ranges.values()), float).T
    return cast("gymnasium.Space[Array]", gymnasium.spaces.Box(low, high, dtype=np.float64))
