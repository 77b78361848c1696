"""Random stacks of masses over floors that rise and fall in polygons, against Moreau's time stepping."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from cases import few
from moreau import Array, masses, project

import powertrain as pt

STOP = 2.0


@dataclass(frozen=True)
class Stack:
    """Masses on springs to the ground with dampers, pulled down; mass i may lie on its own floor, and on mass i - 1.

    ``floors``: heights at ``times``, by the number of the mass.
    """

    mass: Array
    damping: Array
    stiffness: Array
    pull: Array
    times: Array
    floors: dict[int, Array]

    @classmethod
    def random(cls, rng: np.random.Generator) -> Stack:
        n = int(rng.integers(1, 4))
        times = np.concatenate([[0.0], np.sort(rng.uniform(0.1, 1.9, 4)).round(3), [2.5]])
        floors = {i: rng.normal(0.0, 0.4, 6) for i in range(n) if i == 0 or rng.random() < 0.5}
        values = (
            rng.uniform(0.5, 2.0, n),
            rng.uniform(0.0, 0.5, n),
            rng.uniform(0.0, 3.0, n),
            rng.uniform(-5.0, -0.5, n),
        )
        return cls(*values, times, floors)

    @property
    def start(self) -> Array:
        """Every mass lies on what is below it."""
        lowest = [self.floors[i][0] if i in self.floors else -math.inf for i in range(self.mass.size)]
        return np.maximum.accumulate(lowest)

    @property
    def contacts(self) -> list[tuple[int, int]]:
        """The mass above, and that below or -1 for a floor."""
        return [(i, -1) for i in self.floors] + [(i, i - 1) for i in range(1, self.mass.size)]

    def below(self, t: Array) -> Array:
        """The heights of the floors, and 0 where another mass is below: a row for each time."""
        rows = [np.interp(t, self.times, self.floors[i]) if j < 0 else np.zeros_like(t) for i, j in self.contacts]
        return np.column_stack(rows)


def stepped(stack: Stack, h: float) -> Array:
    """The final places: impulses act in contacts that are closed in the middle of a step, and end their approach."""
    J = np.zeros((len(stack.contacts), stack.mass.size))
    for row, (i, j) in zip(J, stack.contacts, strict=True):
        row[i] = 1.0
        if j >= 0:
            row[j] = -1.0
    x, v, impulse = stack.start, np.zeros_like(stack.mass), np.zeros(len(J))
    inertia = stack.mass + h * stack.damping
    G = (J / inertia) @ J.T
    n = round(STOP / h)
    floors = stack.below(np.linspace(0.0, STOP, 2 * n + 1))
    for start, half, end in zip(floors[:-2:2], floors[1::2], floors[2::2], strict=True):
        middle = x + h / 2 * v
        free = (stack.mass * v + h * (stack.pull - stack.stiffness * middle)) / inertia
        closed = J @ middle <= half
        goal = J @ free - (end - start) / h
        project(impulse, -goal, G, np.zeros(len(J)), np.full(len(J), math.inf), closed)
        v = free + J.T @ impulse / inertia
        x = middle + h / 2 * v
    return x


def model(stack: Stack) -> pt.Component:
    """The same equations for powertrain."""

    def equations(self: Any) -> pt.Equations:
        every = range(stack.mass.size)
        x, v = ([getattr(self, f"{letter}{i}") for i in every] for letter in "xv")
        net = [stack.pull[i] - stack.damping[i] * v[i] - stack.stiffness[i] * x[i] for i in every]
        for n, (i, j) in enumerate(stack.contacts):
            force = getattr(self, f"f{n}")
            floor = pt.schedule(stack.times.tolist(), stack.floors[i].tolist()) if j < 0 else x[j]
            net[i] += force
            if j >= 0:
                net[j] -= force
            yield pt.unilateral(x[i] - floor, force, name=f"contact{n}")
        for i in every:
            yield pt.der(x[i]) == v[i]
            yield float(stack.mass[i]) * pt.der(v[i]) == net[i]

    return masses(stack.start.tolist(), len(stack.contacts), equations)


@pytest.mark.parametrize("seed", few(range(18)))
def test_a_stack_on_floors_with_kinks(seed: int) -> None:
    """Where a floor turns upward it strikes the masses on it, where it turns downward they fly. Time stepping converges to that."""
    stack = Stack.random(np.random.default_rng(seed))
    result = pt.simulate(model(stack), STOP)
    found = [result[f"x{i}"][-1] for i in range(stack.mass.size)]
    fine = float(np.abs(stepped(stack, 2e-4) - found).max())
    assert fine < 2e-3 or fine < 0.5 * float(np.abs(stepped(stack, 1e-3) - found).max())
