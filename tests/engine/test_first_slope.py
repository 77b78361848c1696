"""The slope with which a run begins, or goes on after an event."""

from __future__ import annotations

import numpy as np
import pytest

import powertrain as pt

BENT = pt.Map.curve([0.0, 1.0, 2.0], [0.0, 1.0, 4.0], x="lever", unit="1")


class Follower(pt.Component):
    """x moves as a table of time does, whose slope is 1 before t = 1 s and 3 after it."""

    x: pt.Variable = pt.variable("1", "Level", start=0.0)
    y: pt.Variable = pt.variable("1", "Value of the table")

    def equations(self) -> pt.Equations:
        yield self.y == BENT(pt.time)
        yield pt.der(self.x) == pt.der(self.y)


@pytest.mark.parametrize("start", [0.5, 1.0, 1.25])
def test_it_is_the_right_limit_where_a_table_bends(start: float) -> None:
    result = pt.simulate(Follower(), 1.75, start=start, rtol=1e-7)
    dense, size = result.trajectory.dense[0], result.trajectory.sizes[0]
    assert float(dense[1, 0]) / size == pytest.approx(1.0 if start < 1.0 else 3.0, rel=1e-6)
    exact = np.interp(1.75, [0, 1, 2], [0, 1, 4]) - np.interp(start, [0, 1, 2], [0, 1, 4])
    assert result["x"][-1] == pytest.approx(exact, rel=1e-6)
