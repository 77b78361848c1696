"""Bounds that grow steeply with torques, where some modes are found only by trying all one by one: against brute force."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from opened import Piecewise, fits

import powertrain as pt
from powertrain.compiler.torques import COMPLIANCE
from powertrain.modes.resolve import ModeResolver

Matrix = np.ndarray[Any, Any]


def drawn(seed: int) -> Piecewise:
    """Three laws on motions that they share, whose bounds grow with the sizes of two combinations of their torques."""
    rng = np.random.default_rng(seed)
    root = np.round(rng.normal(size=(3, 3)), 1)
    G = np.round(root @ root.T + 0.2 * np.eye(3), 2)
    a, b = np.round(G @ rng.normal(size=3) * 4.0, 1), np.round(rng.uniform(0.5, 4.0, 3), 1)
    W, C = np.round(np.abs(rng.normal(size=(3, 2))) * 0.8, 1), np.round(rng.normal(size=(2, 3)), 1)
    return Piecewise(a, G, b, W=W, C=C, c=np.round(rng.normal(size=2) * (rng.random() < 0.5), 1))


def model(given: Piecewise) -> pt.Component:
    """The laws at rest, der(w) = a - G f, with the bounds -/+ (b + W |C f + c|)."""

    class Steep(pt.Component):
        w0: pt.Variable = pt.variable("rad/s", "Speed", start=0.0)
        w1: pt.Variable = pt.variable("rad/s", "Speed", start=0.0)
        w2: pt.Variable = pt.variable("rad/s", "Speed", start=0.0)
        f0: pt.Variable = pt.variable("N.m", "Torque")
        f1: pt.Variable = pt.variable("N.m", "Torque")
        f2: pt.Variable = pt.variable("N.m", "Torque")

        def equations(self) -> pt.Equations:
            w, f = (self.w0, self.w1, self.w2), (self.f0, self.f1, self.f2)
            conditions = [
                float(c) + sum(float(x) * y for x, y in zip(row, f, strict=True))
                for row, c in zip(given.C, given.c, strict=True)
            ]
            sizes = [pt.switch(pt.Symbol(g) > 0, g, -g) for g in conditions]
            for i in range(3):
                yield pt.der(w[i]) == float(given.a[i]) - sum(float(x) * y for x, y in zip(given.G[i], f, strict=True))
                bound = float(given.b[i]) + sum(float(x) * y for x, y in zip(given.W[i], sizes, strict=True))
                yield pt.friction(w[i], f[i], -bound, bound)

    return Steep()


@pytest.mark.parametrize("seed", [10, 17, 35, 50, 51, 54, 60, 62, 84, 103, 114, 127, 132, 183])
def test_modes_are_those_of_brute_force(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """All of these need the last resort."""
    asked, tried = list[int](), ModeResolver._tried

    def counted(self: ModeResolver, *given: Any) -> bool:
        asked.append(seed)
        return tried(self, *given)

    monkeypatch.setattr(ModeResolver, "_tried", counted)
    given = drawn(seed)
    result = pt.simulate(model(given), 0.01)
    found = [result[f"f{i}"][0] for i in range(3)]
    assert min(np.abs(fit.tau - found).max() for fit in fits(given, COMPLIANCE)) < 1e-5 * (1.0 + np.abs(found).max())
    assert asked


class Several(pt.Component):
    """Independent models side by side."""

    parts: tuple[pt.Component, ...] = ()

    def equations(self) -> pt.Equations:
        yield from ()


def test_more_conditions_than_can_be_tried() -> None:
    """Seven copies with two conditions each, 2^14 pieces: the problem is linearised again in the piece that its last solution reached."""
    given, count = drawn(234), 7
    result = pt.simulate(Several(parts=tuple(model(given) for _ in range(count))), 0.01)
    expected = fits(given, COMPLIANCE)
    for k in range(count):
        found = [result[f"parts[{k}].f{i}"][0] for i in range(3)]
        assert min(np.abs(fit.tau - found).max() for fit in expected) < 1e-5 * (1.0 + np.abs(found).max())


class Bearing(pt.Component):
    """A law that rests, whatever others do."""

    w: pt.Variable = pt.variable("rad/s", "Speed", start=0.0)
    f: pt.Variable = pt.variable("N.m", "Torque")

    def equations(self) -> pt.Equations:
        yield pt.der(self.w) == 0.5 - self.f
        yield pt.friction(self.w, self.f, -1.0, 1.0)


@pytest.mark.parametrize("seed", [10, 17, 35, 51, 54, 62, 117, 127, 132, 183])
def test_laws_that_contradict_nothing_are_not_varied(seed: int) -> None:
    """Beside eight bearings: with their modes there were 3^11 combinations in every piece, too many to try."""
    given = drawn(seed)
    result = pt.simulate(Several(parts=(model(given), *(Bearing() for _ in range(8)))), 0.01)
    found = [result[f"parts[0].f{i}"][0] for i in range(3)]
    assert min(np.abs(fit.tau - found).max() for fit in fits(given, COMPLIANCE)) < 1e-5 * (1.0 + np.abs(found).max())


@pytest.mark.parametrize("seed", [50, 103])
def test_what_cannot_be_tried_is_not_ruled_out(seed: int) -> None:
    """Beside eight bearings, where three laws that have modes contradict each other in those that are tried."""
    with pytest.raises(pt.PowertrainError, match="no consistent modes were found, though there may be some"):
        pt.simulate(Several(parts=(model(drawn(seed)), *(Bearing() for _ in range(8)))), 0.01)
