"""A start that follows from zeros that nobody gave is said to be one of several."""

from __future__ import annotations

import pickle
from itertools import permutations

import numpy as np
import pytest
from joined import joined

import powertrain as pt
from powertrain.components import rotational as rot


def axle(
    order: tuple[int, ...] = (0, 1, 2), ratio: float = 1.0, J: tuple[float, ...] = (1.0, 1.0, 1.0)
) -> pt.Component:
    """An engine's inertia, two wheels and a differential; ``order`` is that in which the three inertias are drawn."""
    ports = ("carrier", "sun", "ring")
    wires = " ".join(f"{place}.flange_a=3.{ports[i]}" for place, i in enumerate(order))
    return joined(*(rot.Inertia(J=J[i]) for i in order), rot.IdealPlanetary(ratio=ratio), joints=wires)


def test_a_wheel_that_stands_because_it_was_drawn_first() -> None:
    plant = pt.compile(axle())
    run = plant.simulate(0.1, starts={"parts[0].w": 100.0})
    (note,) = run.notes
    assert str(run.report).endswith(note)
    assert note == (
        "the start is not unique: parts[2].w = 200 rad/s only because parts[1].w starts at 0 by default; "
        "give one of them in starts"
    )
    given = plant.simulate(0.1, starts={"parts[0].w": 100.0, "parts[1].w": 90.0})
    assert given.notes == ()
    assert given["parts[2].w"][0] == pytest.approx(110.0)
    assert plant.simulate(0.1).notes == ()


@pytest.mark.parametrize("given", [{}, {0: 30.0}, {1: 30.0}, {0: 30.0, 1: 30.0}, {0: 5.0, 2: -7.0}, {1: 1.0, 2: 1.0}])
@pytest.mark.parametrize("ratio", [1.0, 2.5, -2.0])
def test_it_is_said_if_another_drawing_starts_otherwise(ratio: float, given: dict[int, float]) -> None:
    """All orders of the same three inertias: they start alike if, and only if, nothing is said."""
    found, notes = [], []
    for order in permutations(range(3)):
        run = pt.simulate(axle(order, ratio), 0.1, starts={f"parts[{order.index(i)}].w": w for i, w in given.items()})
        found.append([run[f"parts[{order.index(i)}].w"][0] for i in range(3)])
        notes.append(len(run.notes))
    alike = bool(np.ptp(found, axis=0).max() < 1e-9)
    assert notes == [0 if alike else 1] * 6


def test_what_follows_from_given_starts_is_not_said() -> None:
    """A rigid row: one speed determines all others, and where a row is turned as a whole, its motion is the same."""
    row = joined(
        rot.Inertia(J=1.0), rot.IdealGear(ratio=2.0), rot.Inertia(J=1.0), rot.Disc(deltaPhi=0.5), rot.Inertia(J=1.0),
        joints="0.flange_b=1.flange_a 1.flange_b=2.flange_a 2.flange_b=3.flange_a 3.flange_b=4.flange_a",
    )  # fmt: skip
    run = pt.simulate(row, 0.1, starts={"parts[4].w": 10.0})
    assert run["parts[0].w"][0] == 20.0
    assert run.notes == ()


def test_a_shift_between_two_springs_is_said() -> None:
    """Two inertias, 0.1 rad apart, between two grounded springs: which of the springs is bent, nobody gave."""
    chain = (
        rot.Fixed(),
        rot.Spring(c=10.0),
        rot.Inertia(J=1.0),
        rot.Disc(deltaPhi=0.1),
        rot.Inertia(J=1.0),
        rot.Spring(c=9.0),
    )
    ends = " ".join(f"{i}.flange_b={i + 1}.flange_a" for i in range(1, 5))
    model = joined(*chain, rot.Fixed(), joints=f"0.flange=1.flange_a {ends} 5.flange_b=6.flange")
    (note,) = pt.simulate(model, 0.1).notes
    assert "parts[4].phi = 0.1 rad only because parts[2].phi starts at 0" in note


def test_a_refused_start_says_so_too() -> None:
    """A freewheel lets the second wheel turn backward only; the first one stands because nothing is said of it."""
    inertias = [rot.Inertia(J=1.0) for _ in range(3)]
    parts = [*inertias, rot.IdealPlanetary(ratio=1.0), rot.Freewheel(), rot.Fixed()]
    wires = "0.flange_a=3.carrier 1.flange_a=3.sun 2.flange_a=3.ring=4.flange_a 4.flange_b=5.flange"
    plant = pt.compile(joined(*parts, joints=wires))
    with pytest.raises(
        pt.InitializationError, match=r"moves backward(.|\n)*not unique: parts\[2\].w = 200 rad/s"
    ) as said:
        plant.simulate(0.1, starts={"parts[0].w": 100.0})
    with pytest.raises(pt.InitializationError, match=r"not unique") as again:
        plant.initialize(starts={"parts[0].w": 100.0})
    assert str(again.value) == str(said.value)
    given = plant.simulate(0.1, starts={"parts[0].w": 100.0, "parts[1].w": 200.0})
    assert given["parts[2].w"][0] == pytest.approx(0.0, abs=1e-12)
    with pytest.raises(pt.InitializationError) as alone:
        plant.simulate(0.1, starts={"parts[0].w": 100.0, "parts[1].w": 0.0})
    assert "not unique" not in str(alone.value)


def test_notes_are_pickled_with_their_result() -> None:
    run = pt.simulate(axle(), 0.1, starts={"parts[0].w": 100.0})
    assert pickle.loads(pickle.dumps(run)).notes == run.notes
    assert run.recorded("parts[0].w").notes == run.notes
