"""Gearsets solved by hand: ratio, output torque and torques of shift elements, without library code."""

from __future__ import annotations

from itertools import product

import numpy as np

from powertrain.components.transmissions import HOUSING, GearScheme

Range = tuple[float, float]


def by_hand(scheme: GearScheme, gear: str, torque: float) -> tuple[float, float, dict[str, Range]]:
    """Ratio, output torque and torques of the engaged elements, from Willis' equations and balances at the shafts; no library code.

    Every lever may lose on either side; consistent choices are kept: the side assumed to drive has positive latent power. A lever that
    turns as a block is consistent with both, and the torques of elements have a range then.
    """
    shafts = sorted(
        {s for x in scheme.levers for s in (x.a, x.b, x.carrier)}
        | {s for e in scheme.elements for s in e.joint} - {HOUSING}
    )
    shafts = [s for s in shafts if s != HOUSING]
    n, at = len(shafts), {s: k for k, s in enumerate(shafts)}
    engaged = [e for e in scheme.elements if e.name in scheme.gear(gear).engaged]

    def row(**factors: float) -> np.ndarray:
        out = np.zeros(n)
        for shaft, factor in factors.items():
            if shaft != HOUSING:
                out[at[shaft]] += factor
        return out

    rows = [
        row(**{x.a: 1.0}) - x.ratio * row(**{x.b: 1.0}) + (x.ratio - 1) * row(**{x.carrier: 1.0}) for x in scheme.levers
    ]
    rows += [row(**{e.a: 1.0}) - row(**{e.b: 1.0}) for e in engaged]
    rows.append(row(**{scheme.input: 1.0}))
    speeds = np.linalg.solve(np.array(rows), np.append(np.zeros(n - 1), 1.0))
    w = {s: speeds[at[s]] for s in shafts} | {HOUSING: 0.0}
    found = []
    for sides in product((1, -1), repeat=len(scheme.levers)):
        columns = []
        for x, side in zip(scheme.levers, sides, strict=True):
            passed = x.ratio * (x.eta if side > 0 else 1 / x.eta)
            columns.append(-row(**{x.a: 1.0}) + passed * row(**{x.b: 1.0}) + (1 - passed) * row(**{x.carrier: 1.0}))
        columns += [row(**{e.b: 1.0}) - row(**{e.a: 1.0}) for e in engaged]
        columns.append(row(**{scheme.output: 1.0}))
        matrix = np.array(columns).T
        if np.linalg.matrix_rank(matrix) < n:
            continue
        x_ = np.linalg.solve(matrix, -torque * row(**{scheme.input: 1.0}))
        latent = [t * (w[x.a] - w[x.carrier]) for x, t in zip(scheme.levers, x_, strict=False)]
        if all(side * power >= -1e-9 for side, power in zip(sides, latent, strict=True)):
            found.append(x_)
    assert found
    values = np.array(found)
    np.testing.assert_allclose(values[:, -1], values[0, -1], rtol=1e-12)
    inner = np.abs(values[:, len(scheme.levers) : -1])
    ranges = zip(inner.min(axis=0).tolist(), inner.max(axis=0).tolist(), strict=True)
    return 1 / w[scheme.output], float(values[0, -1]), dict(zip((e.name for e in engaged), ranges, strict=True))
