"""Which switches count for a combination of modes in a map, and which of them depend on each other."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import casadi as ca
import pytest

from powertrain.dae.hybrid import Switch
from powertrain.steadystate.known_modes import KnownModes


def switches(conditions: list[ca.SX], modes: list[ca.SX], wanted: list[ca.SX]) -> Any:
    """As much of the known modes as questions about switches need."""
    laws = [Switch(f"switch {k}", "", k, g, None, True, ca.SX(0)) for k, g in enumerate(conditions)]
    choices = [SimpleNamespace(law=law, margins={}, modes=(0.0, 1.0)) for law in laws]
    problem = SimpleNamespace(modes=modes)
    return SimpleNamespace(
        problem=problem, choices=choices, _wanted=wanted, _guards=[], _switches=list(range(len(laws)))
    )


@pytest.mark.parametrize("length", [1, 2, 3, 5])
def test_switches_in_a_ring_depend_on_each_other(length: int) -> None:
    """The condition of each depends on the next; what hangs on the ring is not part of it."""
    modes = [ca.SX.sym(f"m{k}") for k in range(length + 1)]
    conditions = [1 - 2 * modes[(k + 1) % length] for k in range(length)]
    known = switches([*conditions, modes[0] - 0.5], modes, [])
    assert KnownModes._coupled(known, list(range(length + 1)), {}) == list(range(length))


def test_a_switch_counts_that_one_of_those_that_count_depends_on() -> None:
    """Wanted: m0 + m1. The condition of m0 depends on m2, that of m2 on m3, and nothing on m4."""
    modes = [ca.SX.sym(f"m{k}") for k in range(5)]
    known = switches([modes[2] - 0.5, ca.SX(1), modes[3] - 0.5, ca.SX(1), modes[0]], modes, [modes[0] + modes[1]])
    assert KnownModes._influential(known, {}) == [0, 1, 2, 3]
