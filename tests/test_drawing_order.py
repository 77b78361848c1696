"""A model moves the same however it is drawn: parts, joints and wires in any order, and symmetric parts turned round.

Only the start may depend on the drawing, where it is not unique, and then a note says so.
"""

from __future__ import annotations

import random
from typing import Any

import numpy as np
import pytest
from drivelines import Driveline, driveline

import powertrain as pt
from powertrain.components import rotational as rot

SYMMETRIC = (rot.Inertia, rot.Spring, rot.Damper, rot.SpringDamper, rot.Clutch)
OTHER = {"flange_a": "flange_b", "flange_b": "flange_a"}
GRID = np.linspace(0.0, 2.0, 101)
RTOL = 1e-7


def redrawn(model: Driveline, rng: random.Random) -> tuple[Driveline, list[int]]:
    """The same model, and the new place of every part."""
    places, signals = (rng.sample(range(len(each)), len(each)) for each in (model.parts, model.signals))
    turned = {i for i, part in enumerate(model.parts) if isinstance(part, SYMMETRIC) and rng.random() < 0.5}
    nodes = [[(places[i], OTHER[f] if i in turned else f) for i, f in node] for node in model.nodes]
    wires = [(signals[s], places[i], name) for s, i, name in model.wires]
    nodes = [rng.sample(node, len(node)) for node in rng.sample(nodes, len(nodes))]
    drawn = Driveline(
        parts=tuple(model.parts[places.index(k)] for k in range(len(places))),
        nodes=tuple(map(tuple, nodes)),
        signals=tuple(model.signals[signals.index(k)] for k in range(len(signals))),
        wires=tuple(rng.sample(wires, len(wires))),
    )
    return drawn, places


def run(model: Driveline) -> pt.Result[Any] | None:
    try:
        return pt.simulate(model, 2.0, times=GRID, rtol=RTOL)
    except pt.PowertrainError:
        return None


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(60))
def test_random_drivelines_in_another_drawing(seed: int) -> None:
    rng = random.Random(seed)
    model = driveline(rng.choice, rng.randint(3, 14), careless=rng.random() < 0.2)
    drawn, places = redrawn(model, rng)
    one, other = run(model), run(drawn)
    said = [note for result in (one, other) if result for note in result.notes if "the start is not unique" in note]
    if said or one is None or other is None:
        assert said or one is other, "one drawing is refused, the other simulates"
        return
    for i, part in enumerate(model.parts):
        if isinstance(part, rot.Inertia):
            w, again = one.at(GRID, f"parts[{i}].w"), other.at(GRID, f"parts[{places[i]}].w")
            np.testing.assert_allclose(again, w, rtol=0.0, atol=1e3 * RTOL * (1.0 + np.abs(w).max()))
