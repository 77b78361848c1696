"""Maps in the known combinations of modes: random laws against brute force over all their modes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import product
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from powertrain.dae.friction import BACKWARD, FORWARD
from powertrain.dae.hybrid import Friction, Guard, Switch
from powertrain.dae.switch import steady_margins
from powertrain.dae.tolerances import INFINITE
from powertrain.equilibrium.search import LawModes, order
from powertrain.numerics.batch import Common
from powertrain.steadystate.known_modes import KnownModes

Matrix = np.ndarray[Any, Any]
NONE = ca.SX(0)


@dataclass
class Affine:
    """Laws with conditions g = A (x, y, p) + C m + d; the first ``frictions`` slide forward where g > 0, else backward; others switch.

    Wanted: x + p + B m. The model is valid up to x + y = ``most``, and what it solves for is finite up to y = ``steep``. ``asked``: the
    points (from, to) that the last map left to the solver.
    """

    A: Matrix
    C: Matrix
    d: Matrix
    B: Matrix
    frictions: int
    most: float = np.inf
    steep: float = np.inf
    asked: list[tuple[int, int]] = field(default_factory=list)

    @property
    def modes(self) -> list[tuple[float, float]]:
        """Of each law: where its condition is positive, and where not."""
        n = len(self.d)
        return [(FORWARD, BACKWARD)] * self.frictions + [(1.0, 0.0)] * (n - self.frictions)

    def known(self) -> KnownModes:
        """Their known modes, none at first."""
        n, grid, p = len(self.d), [ca.SX.sym("x"), ca.SX.sym("y")], ca.SX.sym("p")
        m = [ca.SX.sym(f"m{k}") for k in range(n)]
        g = ca.DM(self.A) @ ca.vertcat(*grid, p) + ca.DM(self.C) @ ca.vertcat(*m) + ca.DM(self.d)
        choices = [self._choice(k, g[k], m[k]) for k in range(n)]
        laws = [choice.law for choice in choices]
        valid = Guard("guard", "hand", grid[0] + grid[1], ca.SX(-np.inf), ca.SX(self.most), "1", "error")
        outputs = [grid[0] + e + p for e in ca.vertsplit(ca.DM(self.B) @ ca.vertcat(*m))]
        problem: Any = SimpleNamespace(
            grid=grid, modes=m, common=Common(p), u=[], laws=laws, guards=[valid], outputs=outputs[:1], rates=outputs[1:],
            solved=[INFINITE * (1.0 + grid[1] - self.steep)] if np.isfinite(self.steep) else [],
        )  # fmt: skip
        solver: Any = SimpleNamespace(choices=choices, groups=order(problem, choices))
        return KnownModes(problem, solver)

    def _choice(self, k: int, g: ca.SX, m: ca.SX) -> LawModes:
        if k >= self.frictions:
            switch = Switch(f"switch {k}", "hand", k, g)
            return LawModes(switch, steady_margins(switch))
        return LawModes(Friction(f"law {k}", "hand", k, g, m, -NONE, NONE, NONE, NONE), {FORWARD: g, BACKWARD: -g})

    def brute_force(self, x: Matrix, y: Matrix, p: float) -> tuple[Matrix, Matrix]:
        """The wanted values, nan where no modes or several are consistent or the model is not valid; and these modes, point by point."""
        count, found = np.zeros(len(x)), np.full((len(self.d), len(x)), np.nan)
        known = self.A @ np.array([x, y, np.full(len(x), p)]) + self.d[:, None]
        for modes in product(*self.modes):
            g = known + (self.C @ np.array(modes))[:, None]
            ahead = np.array([m == FORWARD for m in modes])[:, None]
            fits = ((g > 0.0) == ahead).all(axis=0)
            count += fits
            found[:, fits] = np.array(modes)[:, None]
        found[:, (count != 1.0) | (x + y > self.most) | (y > self.steep)] = np.nan
        return x + self.B @ found + p, found

    def fill(self, known: KnownModes, x: Matrix, y: Matrix, p: float) -> Matrix:
        """The wanted values at all points of the map."""
        known.problem.common.set(np.array([p]))
        wanted, modes = self.brute_force(x, y, p)
        results = [np.full(len(x), np.nan) for _ in wanted]
        self.asked.clear()

        def careful(first: int, last: int) -> Matrix | None:
            self.asked.append((first, last))
            for row, values in zip(results, wanted, strict=True):
                row[first:last] = values[first:last]
            good = np.flatnonzero(np.isfinite(modes[0, first:last]))
            return modes[:, first + good[0]].copy() if good.size else None

        done = list[int]()
        known.fill(len(x), [x.copy(), y.copy()], results, careful, done.append)
        assert done == sorted(done)
        assert done[-1] == len(x)
        return np.array(results)


def drawn(rng: np.random.Generator, ring: bool) -> Affine:
    """Laws that follow those before them; ``ring``: the last ones also each other, so that at some points several or no modes hold."""
    n, frictions = int(rng.integers(2, 6)), int(rng.integers(0, 3))
    frictions = min(frictions, n - 1)
    C = np.tril(rng.normal(size=(n, n)) * (rng.random((n, n)) < 0.5), -1)
    if ring:
        C[n - 2, n - 1], C[n - 1, n - 2] = rng.normal(size=2)
    A, B = rng.normal(size=(n, 3)), rng.normal(size=(2, n)) * (rng.random((2, n)) < 0.7)
    most, steep = (1.6, 0.95) if ring else (np.inf, np.inf)
    return Affine(A, C, rng.normal(size=n) * 0.3, B, frictions, most, steep)


def scattered(points: Matrix) -> Matrix:
    return points


def in_lines(points: Matrix) -> Matrix:
    """On a few lines along y, where modes change rarely."""
    x, y = points
    return np.array([np.sort(np.round(2 * x)), y])[:, np.lexsort((y, np.sort(np.round(2 * x))))]


def in_turn(points: Matrix) -> Matrix:
    """Lines with scattered points between."""
    return np.hstack([in_lines(points[:, ::2]), points[:, 1::2], in_lines(points[:, ::2])])


@pytest.mark.parametrize("arrange", [scattered, in_lines, in_turn])
@pytest.mark.parametrize("ring", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_any_laws(seed: int, ring: bool, arrange: Callable[[Matrix], Matrix]) -> None:
    """Also with other values of what all points have in common. Few points with a unique solution are left to the solver: new modes."""
    rng = np.random.default_rng(seed)
    laws = drawn(rng, ring)
    known = laws.known()
    asked = 0
    for p in (0.2, -0.3):
        x, y = arrange(rng.uniform(-1.0, 1.0, (2, 10_000)))
        wanted, _ = laws.brute_force(x, y, p)
        for _ in range(4):
            np.testing.assert_allclose(laws.fill(known, x, y, p), wanted, rtol=1e-12, atol=1e-12)
            asked += sum(not np.isnan(wanted[0, first:last]).any() for first, last in laws.asked)
    assert asked <= 8 * len(known.keys)


def test_laws_with_too_many_combinations(monkeypatch: pytest.MonkeyPatch) -> None:
    """The solver gets all points, in blocks that grow."""
    monkeypatch.setattr("powertrain.steadystate.known_modes._ALTERNATIVES", 0)
    laws = drawn(np.random.default_rng(3), ring=True)
    x, y = np.random.default_rng(0).uniform(-1.0, 1.0, (2, 20_000))
    np.testing.assert_array_equal(laws.fill(laws.known(), x, y, 0.2), laws.brute_force(x, y, 0.2)[0])
    sizes = [last - first for first, last in laws.asked]
    assert sum(sizes) == 20_000
    assert max(sizes) >= 4096
