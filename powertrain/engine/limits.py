"""The tolerances and limits of the simulator, and the places of its flags, for its loop in C."""

from __future__ import annotations

from powertrain.dae.hybrid import JUMPED, START
from powertrain.dae.tolerances import EPS, JUMP, LEAST_TORQUE, NOW, SHORTEST
from powertrain.engine.location import AIM, CLOSE, ITERATIONS, LARGEST, MOST_IDLE
from powertrain.integration.step_control import (
    FAILED,
    FINEST,
    GROWTH,
    HALVINGS,
    LEAST_ORDER,
    ORDER,
    SAFETY,
    STIFF,
    STIFF_STEPS,
)
from powertrain.modes.resolve import PASSES
from powertrain.modes.resting import NOTHING, SINGULAR
from powertrain.numerics.buffers import CHANGES, CLOSING, EDGES, FLAGS, FORBIDDEN, IDLE, INFO, JUMPS

_LIMITS = {
    "EPS": EPS, "JUMP": JUMP, "NOW": NOW, "SHORTEST": SHORTEST, "AIM": AIM, "CLOSE": CLOSE, "LARGEST": LARGEST, "ITERATIONS": ITERATIONS,
    "MOST_IDLE": MOST_IDLE, "INFO": INFO, "FINEST": FINEST, "HALVINGS": HALVINGS, "ORDER": ORDER, "SAFETY": SAFETY, "GROWTH": GROWTH,
    "FAILED": FAILED, "LEAST_ORDER": LEAST_ORDER, "STIFF": STIFF, "STIFF_STEPS": STIFF_STEPS, "PASSES": PASSES, "SINGULAR": SINGULAR,
    "NOTHING": NOTHING, "LEAST_TORQUE": LEAST_TORQUE, "START": START, "JUMPED": JUMPED,
    "CHANGES": CHANGES, "EDGES": EDGES, "CLOSING": CLOSING, "IDLE": IDLE, "FORBIDDEN": FORBIDDEN, "JUMPS": JUMPS, "FLAGS": len(FLAGS),
}  # fmt: skip


def limits() -> str:
    """What the loop shares with the simulator in Python."""
    return "".join(f"#define PT_{name} {value!r}\n" for name, value in _LIMITS.items())
