"""Numbers of teeth: the resulting basic speed ratio, and whether such a gear set can be assembled and can turn.

D. Yu, N. Beachley, Mechanical efficiency of differential gearing, Gear Technology (July/August 1986), eq. (3), p. 11.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from powertrain import ParameterError

FEWEST = 5
"""Fewest teeth of a wheel; below that no involute pair works, whatever its profile shift."""
SHIFT = 2
"""Difference of two centre distances, in teeth, that profile shift can compensate."""


@dataclass(frozen=True)
class Sun:
    """A central wheel with external teeth."""

    teeth: int

    def __post_init__(self) -> None:
        _check(self.teeth, "sun")


@dataclass(frozen=True)
class Ring:
    """A central wheel with internal teeth."""

    teeth: int

    def __post_init__(self) -> None:
        _check(self.teeth, "ring")


@dataclass(frozen=True)
class Planets:
    """n equally spaced planets, each one wheel (``second`` not given) or two on one shaft: ``first`` meshes with a, ``second`` with b."""

    first: int
    second: int | None = None
    n: int = 3

    def __post_init__(self) -> None:
        _check(self.first, "planet")
        if self.second is not None:
            _check(self.second, "planet")
        _check_number(self.n)

    @property
    def at_b(self) -> int:
        """Teeth that mesh with b."""
        return self.first if self.second is None else self.second


@dataclass(frozen=True)
class Pairs:
    """n equally spaced pairs of planets that mesh with each other: ``inner`` with the sun, ``outer`` with the ring."""

    inner: int
    outer: int
    n: int = 3

    def __post_init__(self) -> None:
        _check(self.inner, "inner planet")
        _check(self.outer, "outer planet")
        _check_number(self.n)


Central = Sun | Ring


def train_value(*pairs: tuple[int, int, bool]) -> float:
    """R_o by eq. (3): the product of driven over driving teeth, negative for each external pair; pairs (driving, driven, internal).

    Errors: ParameterError for numbers of teeth that no wheel has.
    """
    value = 1.0
    for driving, driven, internal in pairs:
        value *= pair_ratio(driving, driven) * (1 if internal else -1)
    return value


def basic_ratio(a: Central, b: Central, planets: Planets | Pairs) -> float:
    """R_o of a fundamental differential. Errors: ParameterError if these wheels cannot be assembled, or are mere numbers.

    >>> basic_ratio(Sun(90), Ring(153), Planets(31))
    -1.7
    """
    for what, given, kind in (("a", a, Central), ("b", b, Central), ("planets", planets, Planets | Pairs)):
        if not isinstance(given, kind):
            raise ParameterError(
                f"basic_ratio: {what} = {given!r} must be a wheel, as in basic_ratio(Sun(90), Ring(153), Planets(31))"
            )
    if isinstance(planets, Pairs):
        _check_pairs(a, b, planets)
        return b.teeth / a.teeth
    for wheel, planet in ((a, planets.first), (b, planets.at_b)):
        check_pair(wheel, planet)
        _check_neighbours(wheel, planet, planets.n)
    if planets.second is None:
        _check_coaxial(a, b, planets.first)
    _check_assembly(a, b, planets)
    first = (a.teeth, planets.first, isinstance(a, Ring))
    return train_value(first, (planets.at_b, b.teeth, isinstance(b, Ring)))


def eccentric_ratio(planet: int, ring: int) -> float:
    """R_o of a KHV gear: a single planet in a ring, whose rotation is transmitted by an angular velocity mechanism."""
    _check(planet, "planet")
    check_pair(Ring(ring), planet)
    return ring / planet


def check_pair(wheel: Central, planet: int) -> None:
    """A planet within a ring must be smaller than the ring."""
    if isinstance(wheel, Ring) and wheel.teeth <= planet:
        raise ParameterError(
            f"a ring of {wheel.teeth} teeth cannot hold a planet of {planet}: it needs more teeth than the planet"
        )


def check_room(sun: Sun, ring: Ring) -> None:
    """A planet fits between them: Z_ring - Z_sun = 2 Z_planet, within what profile shift compensates."""
    least = 2 * FEWEST - SHIFT
    if ring.teeth - sun.teeth < least:
        raise ParameterError(
            f"no planet fits between a sun of {sun.teeth} and a ring of {ring.teeth} teeth; the ring needs at least {least} teeth more "
            "than the sun"
        )


def pair_ratio(driving: int, driven: int) -> float:
    """Teeth of the driven over teeth of the driving wheel, both checked."""
    _check(driving, "driving wheel")
    _check(driven, "driven wheel")
    return driven / driving


def _check(teeth: int, what: str) -> None:
    if isinstance(teeth, bool) or not isinstance(teeth, int | np.integer):
        raise ParameterError(f"a {what} of {teeth!r} teeth: the number of teeth must be an integer")
    if teeth < FEWEST:
        raise ParameterError(f"a {what} of {teeth} teeth: no wheel has fewer than {FEWEST}")


def _check_number(n: int) -> None:
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 1:
        raise ParameterError(f"{n!r} planets: their number must be an integer of at least 1")


def _check_coaxial(a: Central, b: Central, planet: int) -> None:
    """Both pairs have the same centre distance: Z_a + Z_g = Z_b - Z_g, within what profile shift compensates."""
    if isinstance(a, type(b)):
        raise ParameterError(
            f"two {'suns' if isinstance(a, Sun) else 'rings'} of {a.teeth} and {b.teeth} teeth on the same planet of "
            f"{planet} are one wheel; "
            "a planet with two wheels, Planets(first, second), is needed"
        )
    sun, ring = (a, b) if isinstance(a, Sun) else (b, a)
    off = ring.teeth - sun.teeth - 2 * planet
    if abs(off) > SHIFT:
        raise ParameterError(
            f"a planet of {planet} teeth does not fit between a sun of {sun.teeth} and a ring of {ring.teeth}: ring "
            f"- sun - 2 planet = {off}, "
            f"and profile shift compensates {SHIFT} at most; use a planet of {(ring.teeth - sun.teeth) // 2}"
        )


def _check_neighbours(wheel: Central, planet: int, n: int) -> None:
    """The tips of neighbouring planets are apart: 2 axis distance sin(pi/n) > tip diameter, in modules."""
    axes = wheel.teeth + planet if isinstance(wheel, Sun) else wheel.teeth - planet
    if n > 1 and axes * math.sin(math.pi / n) <= planet + 2:
        most = max(k for k in range(1, n) if k == 1 or axes * math.sin(math.pi / k) > planet + 2)
        raise ParameterError(f"{n} planets of {planet} teeth touch each other on {wheel}: there is room for {most}")


def _check_assembly(a: Central, b: Central, planets: Planets) -> None:
    """Equal spacing: with R_o = -s Z_b Z_g/(Z_a Z_f), (Z_a Z_f + s Z_b Z_g)/n must be a multiple of gcd(Z_g, Z_f).

    Turn the carrier by 2 pi/n, so the next planet takes the place of the last. It fits if a and b are then in equivalent positions, moved
    by i and j teeth: (1 - R_o)/n = i/Z_a - R_o j/Z_b for some integers i, j.
    """
    g, f = planets.first, planets.at_b
    sign = 1 if isinstance(a, Sun) is not isinstance(b, Sun) else -1
    teeth = (a.teeth * f + sign * b.teeth * g) // math.gcd(g, f)
    if teeth % planets.n:
        named = "-".join(map(str, dict.fromkeys((g, f))))
        fit = ", ".join(str(k) for k in range(1, 13) if teeth % k == 0)
        raise ParameterError(
            f"{planets.n} planets of {named} teeth cannot be assembled between {a} and {b} at equal spacing: "
            f"{teeth} is not divisible by {planets.n}; possible numbers: {fit}"
        )


def _check_pairs(a: Central, b: Central, planets: Pairs) -> None:
    """A sun, a ring, and planets that bridge the gap between them."""
    if not isinstance(a, Sun) or not isinstance(b, Ring):
        raise ParameterError(f"pairs of planets run between a sun and a ring, not {a} and {b}")
    check_pair(b, planets.outer)
    inner, outer, across = a.teeth + planets.inner, b.teeth - planets.outer, planets.inner + planets.outer
    if not abs(inner - outer) < across < inner + outer:
        raise ParameterError(
            f"planets of {planets.inner} and {planets.outer} teeth cannot mesh with each other, a sun of {a.teeth} "
            f"and a ring of {b.teeth}: their axes, "
            f"{inner} and {outer} from the centre and {across} apart, do not form a triangle"
        )
    if (b.teeth - a.teeth) % planets.n:
        raise ParameterError(
            f"{planets.n} pairs of planets cannot be assembled between {a} and {b} at equal spacing: "
            f"{b.teeth} - {a.teeth} is not divisible by {planets.n}"
        )
    _check_neighbours(a, planets.inner, planets.n)
    _check_neighbours(b, planets.outer, planets.n)
    _check_clearance(a, b, planets)
    _check_next_pair(inner, outer, planets)


def _check_clearance(a: Central, b: Central, planets: Pairs) -> None:
    """Inner planets clear the tips of the ring, outer ones those of the sun; tips reach one module beyond the pitch circle."""
    if a.teeth + 2 * planets.inner + 2 >= b.teeth - 2:
        raise ParameterError(
            f"inner planets of {planets.inner} teeth reach into {b}: over the module, {a.teeth} + 2 {planets.inner} + 2 across their tips "
            f"must be less than {b.teeth} - 2 across the tips of the ring; use inner planets of {_most(b.teeth - a.teeth)} teeth at most"
        )
    if b.teeth - 2 * planets.outer - 2 <= a.teeth + 2:
        raise ParameterError(
            f"outer planets of {planets.outer} teeth reach into {a}: over the module, {b.teeth} - 2 {planets.outer} - 2 between their tips "
            f"must be more than {a.teeth} + 2 across the tips of the sun; use outer planets of {_most(b.teeth - a.teeth)} teeth at most"
        )


def _most(gap: int) -> int:
    """The largest planet that meshes with one of two central wheels and clears the other."""
    return (gap - 5) // 2


def _check_next_pair(inner: int, outer: int, planets: Pairs) -> None:
    """The tips of an inner planet stay clear of those of the next pair's outer one; ``inner`` and ``outer`` are twice the axes' radii."""
    if planets.n == 1:
        return
    across = planets.inner + planets.outer
    within = math.acos((inner**2 + outer**2 - across**2) / (2 * inner * outer))
    apart = math.sqrt(inner**2 + outer**2 - 2 * inner * outer * math.cos(2 * math.pi / planets.n - within))
    if apart <= across + 4:
        raise ParameterError(
            f"an inner planet of {planets.inner} teeth touches the outer one of {planets.outer} teeth of the next of {planets.n} pairs: "
            f"their axes are {apart / 2:.3g} modules apart, and their tips need more than {across / 2 + 2:g}; "
            "take fewer pairs or smaller planets"
        )
