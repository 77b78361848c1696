"""A periodic coefficient as an expression: a few harmonics where it is smooth, a polynomial between jumps where it is not."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from powertrain import Symbol, switch
from powertrain.components.gearless.spherical_cam.cycle import Cycle
from powertrain.components.gearless.spherical_cam.profile import Array

HARMONICS = 12
DEGREE = 10
SAMPLES = 1024
NOTHING = 1e-13
"""A coefficient as small as this is zero."""


@dataclass(frozen=True)
class Wave:
    """The coefficient kappa over x = 2 M s, of period 2 pi.

    With ``edge`` it jumps at x = +-edge, and ``even``, ``odd`` are Chebyshev coefficients (even and
    odd in x) of the piece around 0 and of that around pi; without, they are those of cosines and sines.
    """

    edge: float | None
    even: tuple[tuple[float, ...], ...]
    odd: tuple[tuple[float, ...], ...]

    def __call__(self, x: Symbol) -> tuple[Symbol, Symbol]:
        """The coefficients for the cam turning forward, and backward: the same at -x."""
        if self.edge is None:
            cosines, sines = _harmonics(x, len(self.even[0]))
            even, odd = _sum(self.even[0], cosines), _sum(self.odd[0], sines)
        else:
            inner = ca.cos(x) >= math.cos(self.edge)
            pieces = [self._piece(i, x) for i in (0, 1)]
            even, odd = (switch(inner, *both) for both in zip(*pieces, strict=True))
        return Symbol(even + odd), Symbol(even - odd)

    def _piece(self, i: int, x: Symbol) -> tuple[Symbol, Symbol]:
        assert self.edge is not None
        sign, reach = (1, self.edge) if i == 0 else (-1, math.pi - self.edge)
        place = ca.atan2(sign * ca.sin(x), sign * ca.cos(x)) / reach
        powers = _chebyshev(ca.fmin(ca.fmax(place, -1.01), 1.01), len(self.even[i]))
        return _sum(self.even[i], powers), _sum(self.odd[i], powers)


@lru_cache(maxsize=64)
def kappa_wave(cycle: Cycle) -> Wave:
    """The locking coefficient of a cycle as a wave."""
    half = cycle.cam.half
    edge = None if cycle.sharing == "elastic" else 2 * math.pi * cycle.handover / half
    if edge is None:
        x = 2 * math.pi * np.arange(SAMPLES) / SAMPLES
        spectrum = np.fft.rfft(cycle.kappa(x * half / (2 * math.pi)))[: HARMONICS + 1] / SAMPLES
        spectrum[1:] *= 2
        return Wave(None, (_clean(spectrum.real),), (_clean(-spectrum.imag),))
    edge = min(edge, 2 * math.pi - edge)
    nodes = np.cos(math.pi * (np.arange(200) + 0.5) / 200)
    pieces = []
    for centre, reach in ((0.0, edge), (math.pi, math.pi - edge)):
        values = cycle.kappa((centre + reach * nodes) * half / (2 * math.pi))
        pieces.append(np.polynomial.chebyshev.chebfit(nodes, values, DEGREE))
    parity = np.arange(DEGREE + 1) % 2
    even, odd = ([_clean(piece * (parity == which)) for piece in pieces] for which in (0, 1))
    return Wave(edge, tuple(even), tuple(odd))


def _clean(values: Array) -> tuple[float, ...]:
    return tuple(float(v) if abs(v) > NOTHING else 0.0 for v in values)


def _harmonics(x: Symbol, n: int) -> tuple[list[Symbol], list[Symbol]]:
    """cos(k x) and sin(k x) by the addition theorem."""
    c, s = ca.cos(x), ca.sin(x)
    cosines, sines = [Symbol(1), c], [Symbol(0), s]
    for _ in range(n - 2):
        cosines.append(2 * c * cosines[-1] - cosines[-2])
        sines.append(2 * c * sines[-1] - sines[-2])
    return cosines, sines


def _chebyshev(x: Symbol, n: int) -> list[Symbol]:
    powers = [Symbol(1), x]
    for _ in range(n - 2):
        powers.append(2 * x * powers[-1] - powers[-2])
    return powers


def _sum(factors: tuple[float, ...], terms: list[Symbol]) -> Symbol:
    return Symbol(sum((f * term for f, term in zip(factors, terms, strict=True) if f), Symbol(0)))
