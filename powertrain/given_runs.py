"""Checks of runs that are passed as arguments: a complete one, and an instant of a run of the same model."""

from __future__ import annotations

from reprlib import repr as short
from typing import Any

import numpy as np

from powertrain.compiler.assemble import Compiled
from powertrain.engine.trajectory import Samples
from powertrain.errors import ParameterError
from powertrain.language.arguments import number
from powertrain.result import Result


def complete(result: Any) -> Result[Any]:
    """A result of simulate that reached its end; ParameterError for anything else."""
    if not isinstance(result, Result):
        raise ParameterError(f"pass a result of simulate, not a {type(result).__name__}")
    if not result.ok:
        raise ParameterError(f"the run ended early and has no derivative: {result.message.splitlines()[0]}")
    return result


def instant_of_run(compiled: Compiled, at: tuple[Result[Any], float], what: str) -> Samples:
    """One sample: a run of this model at a time, at the instant of an event its right limit; ``what``: the name of the argument."""
    if len(at) != 2 or not isinstance(at[0], Result):
        raise ParameterError(f"{what} = {short(at)}: pass values by name, or (result, t) with a result of this model")
    result, t = at[0], number(f"{what}: t", at[1], "s")
    other = result.compiled
    if (other.states, list(other.parameters), list(other.signals)) != (
        compiled.states, list(compiled.parameters), list(compiled.signals),
    ):  # fmt: skip
        raise ParameterError(f"{what}: the result belongs to another model ({type(result.model).__name__})")
    return result.samples_at(result.trajectory.within(f"{what}: t = ", np.array([t])))
