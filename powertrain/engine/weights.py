"""What the error of a state is weighed against.

The relative tolerance refers to the size of a state, except for positions that others feel: a shaft that has turned ten thousand
radians still has a twist of a hundredth between its ends, so the error of an angle or position is weighed against a tenth of a
radian or metre at the most.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from powertrain.compiler.hybrid import HybridDae
from powertrain.engine.buffers import Array

LARGEST = 0.1


def largest_sizes(dae: HybridDae) -> Array:
    """For each unknown the largest size that its error is weighed against: LARGEST for such positions, infinity otherwise."""
    n, nz = dae.x.numel(), dae.z.numel()
    sizes = np.full(n + nz, np.inf)
    if not any(dae.positions):
        return sizes
    felt = set(ca.jacobian(ca.vertcat(dae.xdot, dae.residual), dae.x).sparsity().get_triplet()[1])
    for i, position in enumerate(dae.positions):
        if position and i in felt:
            sizes[i] = LARGEST
    return sizes
