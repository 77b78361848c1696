"""What a train of rigid lossy gears costs before it runs: the torque of every mesh depends on those of all others."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import casadi as ca
import pytest

import powertrain as pt
from powertrain.components.rotational import Inertia, LossyGear


class Train(pt.Component):
    """Gears in series between two inertias."""

    gears: tuple[LossyGear, ...]
    first: Inertia = Inertia(J=1)
    last: Inertia = Inertia(J=1)

    def equations(self) -> pt.Equations:
        """Connections."""
        yield pt.connect(self.first.flange_b, self.gears[0].flange_a)
        for one, other in pairwise(self.gears):
            yield pt.connect(one.flange_b, other.flange_a)
        yield pt.connect(self.gears[-1].flange_b, self.last.flange_a)


def test_dependencies_cost_as_much_as_the_torques_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """The torques of n meshes grow with n^2; asking what each of them depends on would take n^3 and more."""
    asked: list[int] = []

    def counted(known: Any) -> Any:
        def call(expression: Any, *others: Any) -> Any:
            asked.append(ca.n_nodes(expression))
            return known(expression, *others)

        return call

    def nodes(n: int) -> int:
        asked.clear()
        train = Train(gears=(LossyGear(ratio=1.1, lossTable=((0.0, 0.97, 0.96, 0.1, 0.12),)),) * n)
        pt.compile(train).simulate(0.1, starts={"first.w": 10.0})
        return sum(asked)

    for name in ("depends_on", "which_depends", "symvar"):
        monkeypatch.setattr(ca, name, counted(getattr(ca, name)))
    assert nodes(10) < 4.2 * nodes(5)
