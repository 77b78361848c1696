"""Drivelines that differ in text alone move alike: mirrored, in other units, with an inertia in two parts, with gears that cancel."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from drivelines import Driveline, driveline

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Constant, Ramp, Sine, Step
from powertrain.language.dimensions import measure
from powertrain.presets.places import places

GRID = np.linspace(0.0, 2.0, 101)
RTOL = 1e-7
OTHER = {"flange_a": "flange_b", "flange_b": "flange_a"}
VALUES = {Constant: ("k",), Step: ("height",), Sine: ("amplitude", "offset"), Ramp: ("height",)}
"""What of a signal has the unit of the input that it is wired to."""


@dataclass(frozen=True)
class Same:
    """The same driveline written otherwise: its speeds are ``speed`` times as large, and it is ``rate`` times as fast."""

    model: Driveline
    speed: float = 1.0
    rate: float = 1.0


Rewrite = Callable[[Driveline, random.Random], Same]


def built(model: Driveline, **new: Any) -> Driveline:
    given = {name: getattr(model, name) for name in ("parts", "nodes", "signals", "wires")}
    return Driveline(**(given | new))


def signals(model: Driveline, factor: Callable[[pt.Component, str], float]) -> dict[str, float]:
    """The values of all signals, times ``factor(part, input)``, by their paths."""
    return {
        f"signals[{s}].{name}": factor(model.parts[i], given) * float(getattr(model.signals[s], name))
        for s, i, given in model.wires
        for name in VALUES[type(model.signals[s])]
    }


def mirrored(model: Driveline, _: random.Random) -> Same:
    one_way = {i for i, part in enumerate(model.parts) if isinstance(part, rot.OneWayClutch | rot.Freewheel)}
    nodes = tuple(tuple((i, OTHER[f] if i in one_way else f) for i, f in node) for node in model.nodes)
    turned: dict[type[pt.Component], str] = {rot.ConstantSpeed: "w_fixed", rot.Disc: "deltaPhi"}
    values = {
        f"parts[{i}].{turned[type(p)]}": -float(getattr(p, turned[type(p)]))
        for i, p in enumerate(model.parts)
        if type(p) in turned
    }
    values |= signals(model, lambda part, _: -1.0 if isinstance(part, rot.Torque | rot.Speed) else 1.0)
    return Same(pt.replace(built(model, nodes=nodes), values), speed=-1.0)


def in_units(mass: float, rate: float) -> Rewrite:
    """All masses, and torques with them, times ``mass``, and everything ``rate`` times as fast."""

    def factor(unit: str) -> float:
        powers = dict(measure(unit)[1])
        return mass ** powers.get("kg", 0) * rate ** -powers.get("s", 0)

    def table(rows: Any, *units: str) -> Any:
        return tuple(tuple(factor(unit) * value for unit, value in zip(units, row, strict=True)) for row in rows)

    def rewritten(model: Driveline, _: random.Random) -> Same:
        values: dict[str, Any] = {}
        for place in places(model):
            if place.spec is not None:
                values[place.path] = factor(place.spec.unit) * float(place.value)
            elif place.path.endswith("tau_pos"):
                values[place.path] = table(place.value, "rad/s", "N.m")
            elif place.path.endswith("lossTable"):
                values[place.path] = table(place.value, "rad/s", "1", "1", "N.m", "N.m")
        units = {"tau": "N.m", "w_ref": "rad/s", "f_normalized": "1"}
        return Same(pt.replace(model, values | signals(model, lambda _, name: factor(units[name]))), rate, rate)

    return rewritten


def divided(model: Driveline, rng: random.Random) -> Same:
    """One inertia becomes two on one shaft."""
    i, whole = rng.choice([(k, part) for k, part in enumerate(model.parts) if isinstance(part, rot.Inertia)])
    J, share = float(whole.J), rng.choice((0.5, 0.1, 0.9))
    parts = [*model.parts, rot.Inertia(J=(1 - share) * J)]
    parts[i] = rot.Inertia(J=share * J)
    nodes = list(model.nodes)
    k = next(k for k, node in enumerate(nodes) if i in dict(node))
    nodes[k] = (*nodes[k], (len(parts) - 1, rng.choice(("flange_a", "flange_b"))))
    return Same(built(model, parts=tuple(parts), nodes=tuple(nodes)))


def geared(model: Driveline, rng: random.Random) -> Same:
    """A part is connected through two gears whose ratios cancel."""
    nodes, ratio, n = list(model.nodes), rng.choice((2.0, -3.0, 0.25)), len(model.parts)
    k = rng.choice([k for k, node in enumerate(nodes) if len(node) > 1])
    moved = rng.choice(nodes[k])
    nodes[k] = (*(flange for flange in nodes[k] if flange != moved), (n, "flange_a"))
    nodes += [((n, "flange_b"), (n + 1, "flange_a")), ((n + 1, "flange_b"), moved)]
    parts = (*model.parts, rot.IdealGear(ratio=ratio), rot.IdealGear(ratio=1 / ratio))
    return Same(built(model, parts=parts, nodes=tuple(nodes)))


def run(same: Same) -> pt.Result[Any] | None:
    try:
        return pt.simulate(same.model, 2.0 / same.rate, times=GRID / same.rate, rtol=RTOL)
    except pt.PowertrainError:
        return None


REWRITES: dict[str, Rewrite] = {
    "mirrored": mirrored,
    "ten thousand times as heavy": in_units(1e4, 1.0),
    "ten thousand times as light": in_units(1e-4, 1.0),
    "twenty times as fast": in_units(1.0, 20.0),
    "an inertia in two": divided,
    "gears that cancel": geared,
}


@pytest.mark.slow
@pytest.mark.parametrize("name", REWRITES)
@pytest.mark.parametrize("seed", range(8))
def test_random_drivelines_written_otherwise(name: str, seed: int) -> None:
    rng = random.Random(seed)
    model = driveline(rng.choice, rng.randint(3, 12), careless=False)
    same = REWRITES[name](model, rng)
    one, other = run(Same(model)), run(same)
    if (one and one.notes) or (other and other.notes):
        return  # not unique, and said to be so
    if one is None or other is None:
        assert one is other, "one is refused, the other simulates"
        return
    for i, part in enumerate(model.parts):
        if isinstance(part, rot.Inertia):
            w, again = one.at(GRID, f"parts[{i}].w"), other.at(GRID / same.rate, f"parts[{i}].w") / same.speed
            np.testing.assert_allclose(again, w, rtol=0.0, atol=1e3 * RTOL * (1.0 + np.abs(w).max()))
