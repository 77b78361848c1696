"""The resistance of a body on a level road."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import powertrain as pt
from powertrain.components.body import Body
from powertrain.components.translational import ConstantSpeed

Array = NDArray[np.float64]


class _Pulled(pt.Component):
    """A body that is pulled over a level road at a given speed."""

    body: Body
    pull: ConstantSpeed = ConstantSpeed(v_fixed=1)

    def equations(self) -> pt.Equations:
        """Pulled at the front; the rear axle exerts no force."""
        yield pt.connect(self.pull.flange, self.body.front)


def resistance(body: Body, v: Array) -> Array:
    """The force to pull a body at v; zero at rest, where its friction could hold any force up to its limit."""
    speeds, rows = np.unique(v, return_inverse=True)
    moves, taken = speeds > 0, np.zeros_like(speeds)
    if moves.any():
        pulled = pt.steady(_Pulled(body=body), {"pull.v_fixed": speeds[moves]}, outputs=["pull.flange.f"])
        taken[moves] = -pulled["pull.flange.f"].values
    return taken[rows]
