"""Tooth numbers: the basic speed ratio by eq. (3), and sets that cannot be put together."""

from __future__ import annotations

import cmath
from collections.abc import Callable
from itertools import combinations, product
from typing import Any

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.differentials import (
    CrownGear,
    DoublePinionPlanetaryGear,
    FundamentalDifferential,
    Pairs,
    PlanetaryGear,
    Planets,
    PlanetTrain,
    RavigneauxGear,
    Ring,
    SteppedPlanetaryGear,
    Sun,
    basic_ratio,
    train_value,
)


def ratio(part: pt.Component) -> float:
    return float(part.ratio)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("a", "b", "planets", "R_o"),
    [
        (Sun(90), Ring(153), Planets(31), -1.7),
        (Sun(30), Ring(90), Planets(30, n=4), -3.0),
        (Sun(20), Ring(100), Planets(50, 30, n=2), -(50 * 100) / (20 * 30)),
        (Sun(51), Sun(50), Planets(49, 50, n=1), 49 * 50 / (51 * 50)),
        (Ring(100), Ring(101), Planets(20, 21, n=1), (20 / 100) * (101 / 21)),
        (Sun(30), Ring(72), Pairs(18, 18), 72 / 30),
    ],
    ids=str,
)
def test_basic_ratio(a: Any, b: Any, planets: Any, R_o: float) -> None:
    assert basic_ratio(a, b, planets) == pytest.approx(R_o, rel=1e-15)
    assert ratio(FundamentalDifferential.from_teeth(a, b, planets)) == pytest.approx(R_o, rel=1e-15)


def test_eq_3_counts_the_external_pairs() -> None:
    assert train_value((10, 20, False)) == -2
    assert train_value((10, 20, False), (15, 30, False)) == 4
    assert train_value((10, 20, False), (15, 60, True)) == -8


def test_types_of_differentials() -> None:
    assert ratio(FundamentalDifferential.khv(planet=40, ring=42)) == pytest.approx(1.05)
    assert ratio(PlanetaryGear.from_teeth(sun=90, ring=153, planet=31)) == pytest.approx(1.7)
    stepped = SteppedPlanetaryGear.from_teeth(sun=20, ring=100, first=50, second=30, n=2)
    assert ratio(stepped) == pytest.approx(25 / 3)
    assert ratio(DoublePinionPlanetaryGear.from_teeth(sun=30, ring=72, inner=18, outer=18)) == pytest.approx(2.4)
    assert ratio(CrownGear.from_teeth(pinion=11, crown=41)) == pytest.approx(41 / 11)
    assert ratio(CrownGear.from_teeth(pinion=20, crown=20)) == 1
    assert ratio(PlanetaryGear.from_teeth(90, 153, 31, n=np.int64(3))) == pytest.approx(1.7)  # type: ignore[arg-type]
    train = PlanetTrain.from_teeth(sun=90, ring=153, first=31)
    assert float(train.sun_ratio * train.ring_ratio) == pytest.approx(1.7)


def wheels_of_pairs(sun: int, ring: int, inner: int, outer: int, n: int) -> list[tuple[complex, float]]:
    """Centre and tip radius of every planet, over the module: inner and outer planets, n pairs at equal distances."""
    r, R, d = (sun + inner) / 2, (ring - outer) / 2, (inner + outer) / 2
    between = np.arccos((r**2 + R**2 - d**2) / (2 * r * R))
    turns = [cmath.exp(2j * cmath.pi * k / n) for k in range(n)]
    lead = cmath.exp(1j * between)
    return [(r * t, inner / 2 + 1) for t in turns] + [(R * lead * t, outer / 2 + 1) for t in turns]


def pierced(sun: int, ring: int, inner: int, outer: int, n: int) -> bool:
    """Whether tips overlap where no teeth mesh, from the centres of all wheels."""
    planets = wheels_of_pairs(sun, ring, inner, outer, n)
    ring_hit = any(abs(z) + tip >= ring / 2 - 1 for z, tip in planets[:n])
    sun_hit = any(abs(z) - tip <= sun / 2 + 1 for z, tip in planets[n:])
    meshing = {(k, n + k) for k in range(n)}
    pairs = set(combinations(range(2 * n), 2)) - meshing
    return (
        ring_hit
        or sun_hit
        or any(abs(planets[i][0] - planets[j][0]) <= planets[i][1] + planets[j][1] + 1e-9 for i, j in pairs)
    )


def test_no_planet_pierces_another_wheel() -> None:
    """Every set of pairs among many is accepted exactly where no two tips overlap but those that mesh."""
    seen = {True: 0, False: 0}
    for sun, ring, inner, outer, n in product(
        range(20, 50, 6), range(62, 122, 12), range(11, 33, 3), range(11, 33, 3), (2, 3, 4)
    ):
        r, R, d = sun + inner, ring - outer, inner + outer
        if (ring - sun) % n or not abs(r - R) < d < r + R:
            continue
        bad = pierced(sun, ring, inner, outer, n)
        seen[bad] += 1
        try:
            DoublePinionPlanetaryGear.from_teeth(sun, ring, inner, outer, n)
            assert not bad, (sun, ring, inner, outer, n)
        except pt.ParameterError:
            assert bad, (sun, ring, inner, outer, n)
    assert min(seen.values()) > 50


BAD: list[tuple[Callable[[], Any], str]] = [
    (lambda: Sun(20.5), "20.5 teeth: the number of teeth must be an integer"),  # type: ignore[arg-type]
    (lambda: Sun(4), "4 teeth: no wheel has fewer than 5"),
    (lambda: train_value((10, 20, False), (0, 20, False)), "a driving wheel of 0 teeth: no wheel has fewer than 5"),
    (lambda: Planets(20, n=0), "0 planets: their number"),
    (lambda: basic_ratio(90, Ring(153), Planets(31)), r"basic_ratio: a = 90 must be a wheel"),  # type: ignore[arg-type]
    (lambda: basic_ratio(Sun(90), Ring(153), 31), r"basic_ratio: planets = 31 must be a wheel"),  # type: ignore[arg-type]
    (lambda: Planets(20, 2), "2 teeth: no wheel has fewer"),
    (lambda: basic_ratio(Sun(30), Ring(90), Planets(20)), r"ring - sun - 2 planet = 20, .* use a planet of 30"),
    (lambda: basic_ratio(Sun(30), Ring(90), Planets(30, n=7)), "7 planets of 30 teeth touch each other .* room for 5"),
    (lambda: basic_ratio(Sun(31), Ring(91), Planets(30, n=3)), "122 is not divisible by 3; possible numbers: 1, 2"),
    (lambda: basic_ratio(Sun(60), Ring(24), Planets(30, 28)), "a ring of 24 teeth cannot hold a planet of 28"),
    (lambda: basic_ratio(Sun(30), Sun(40), Planets(20)), "on the same planet of 20 are one wheel"),
    (lambda: basic_ratio(Sun(20), Ring(100), Planets(50, 31, n=3)), "cannot be assembled .* at equal spacing"),
    (lambda: basic_ratio(Sun(30), Sun(72), Pairs(18, 20)), "pairs of planets run between a sun and a ring"),
    (lambda: basic_ratio(Sun(30), Ring(150), Pairs(18, 20)), "do not form a triangle"),
    (lambda: basic_ratio(Sun(30), Ring(73), Pairs(18, 20)), "73 - 30 is not divisible by 3"),
    (lambda: FundamentalDifferential.khv(planet=42, ring=40), "a ring of 40 teeth cannot hold a planet of 42"),
    (
        lambda: basic_ratio(Sun(30), Ring(72), Pairs(19, 17)),
        "inner planets of 19 teeth reach into .* inner planets of 18 teeth",
    ),
    (
        lambda: basic_ratio(Sun(30), Ring(72), Pairs(18, 20)),
        "outer planets of 20 teeth reach into .* outer planets of 18 teeth",
    ),
    (lambda: basic_ratio(Sun(30), Ring(72), Pairs(14, 18, n=6)), "axes are .* take fewer pairs or smaller planets"),
    (lambda: DoublePinionPlanetaryGear.from_teeth(44, 60, 29, 23, 4), "inner planets of 29 teeth reach into"),
    (lambda: RavigneauxGear.from_teeth(24, 20, 88, 32, 33, 4), "inner planets of 33 teeth reach into"),
    (lambda: CrownGear.from_teeth(pinion=41, crown=11), "smaller than its pinion of 41"),
    (lambda: RavigneauxGear.from_teeth(large=38, small=20, ring=98, long=30, short=5, n=2), "do not form a triangle"),
]


@pytest.mark.parametrize(("make", "message"), BAD, ids=[message for _, message in BAD])
def test_wheels_that_cannot_mesh_are_refused(make: Callable[[], Any], message: str) -> None:
    with pytest.raises(pt.ParameterError, match=message.replace("(", r"\(")):
        make()
