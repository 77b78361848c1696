"""The result of an optimal control problem: what is planned, and its simulation with the complete model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from powertrain.language.reals import Array
from powertrain.result import Result


@dataclass(frozen=True)
class Plan:
    """The result of ``pt.optimal_control``.

    ``cost``: the cost of the plan; ``result``: a simulation of the complete model with the inputs of the plan, ``replayed``: its cost;
    ``same_modes``: whether that simulation went through the planned modes. ``inputs``: times (s) and values for ``simulate``;
    ``starts`` and ``parameters`` likewise; ``times``, ``states``: the planned states at the nodes by name; ``durations``: of the
    phases, in s; ``ok``: whether the solver converged, ``message``: its message; ``iterations``: their number; ``notes``: phases that
    would become shorter still, and the parameters whose effect on tables and limits, computed when the model was compiled, the optimum
    does not contain.
    """

    cost: float
    replayed: float
    result: Result[Any]
    same_modes: bool
    inputs: dict[str, tuple[Array, Array]]
    starts: dict[str, float]
    parameters: dict[str, float]
    times: Array
    states: dict[str, Array]
    durations: tuple[float, ...]
    ok: bool
    message: str
    iterations: int
    notes: tuple[str, ...] = ()

    def __str__(self) -> str:
        gap = f" ({100 * (self.replayed / self.cost - 1):+.2g} %)" if self.cost else ""
        phases = ", ".join(f"{d:.4g} s" for d in self.durations)
        lines = [
            f"cost {self.cost:.6g}, simulated {self.replayed:.6g}{gap}, {'the planned' if self.same_modes else 'OTHER'} modes",
            f"phases: {phases}; {'' if self.ok else 'NOT CONVERGED: '}{self.message} after {self.iterations} iterations",
        ]
        lines += [f"{name} = {value:.6g}" for name, value in self.parameters.items()]
        return "\n".join([*lines, *self.notes])

    __repr__ = __str__
