"""Synthetic engines: torque and fuel over the operating range from formulas, as tables for ``MappedEngine``.

``write_tables`` writes the CSV files in ``data``; no number in them is measured.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
ENRICHED = 6
"""Exponent of the load with which the efficiency falls near full load."""


@dataclass(frozen=True)
class SyntheticEngine:
    """A four-stroke engine in terms of mean effective pressures, torque = V p/(4 pi).

    motoring: p_0 + p_2 (w/w_ref)^2
    full load: p_max (1 - k (w/w_tau - 1)^2), k = k_slow below w_tau, k_fast above
    firing = share (full load + motoring), torque = firing - motoring
      share of throttle u: (1 - exp(-c u))/(1 - exp(-c)), c = c_throttle (1 - w/w_top) (none for c = 0: share = u)
    fuel rate heating_value = firing w/e,  e = e_0 (1 - k_e (w/w_e - 1)^2) (1 - k_rich load^6), load = firing over that at full load
    """

    name: str
    V: float
    heating_value: float
    p_0: float
    p_2: float
    p_max: float
    w_tau: float
    k_slow: float
    k_fast: float
    c_throttle: float
    e_0: float
    w_e: float
    k_e: float
    k_rich: float
    speeds: tuple[float, ...]
    throttles: tuple[float, ...]
    torques: tuple[float, ...]
    w_ref: float = 400.0

    def motoring(self, w: ArrayLike) -> Array:
        """Torque [N.m] that turns it without fuel at speed w [rad/s]."""
        return self._torque(self.p_0 + self.p_2 * (np.asarray(w, float) / self.w_ref) ** 2)

    def full_load(self, w: ArrayLike) -> Array:
        """Torque [N.m] with an open throttle."""
        v = np.asarray(w, float) / self.w_tau - 1
        return self._torque(self.p_max * (1 - np.where(v < 0, self.k_slow, self.k_fast) * v**2))

    def torque(self, w: ArrayLike, u: ArrayLike) -> Array:
        """Torque [N.m] at speed w [rad/s] with throttle u [1]."""
        c = np.maximum(self.c_throttle * (1 - np.asarray(w, float) / max(self.speeds)), 1e-9)
        share = np.expm1(-c * np.asarray(u, float)) / np.expm1(-c)
        return np.asarray(share * (self.full_load(w) + self.motoring(w)) - self.motoring(w))

    def fuel_rate(self, w: ArrayLike, tau: ArrayLike) -> Array:
        """Fuel flow [kg/s] at speed w [rad/s] and torque tau [N.m]; extrapolated linearly above full load."""
        w = np.asarray(w, float)
        full = self.full_load(w) + self.motoring(w)
        load = (np.asarray(tau, float) + self.motoring(w)) / full
        held = np.minimum(load, 1)
        rich = 1 - self.k_rich * held**ENRICHED
        slope = 1 / rich + ENRICHED * self.k_rich * held**ENRICHED / rich**2
        e = self.e_0 * (1 - self.k_e * (w / self.w_e - 1) ** 2)
        return np.asarray((held / rich + slope * (load - held)) * full * w / e / self.heating_value)

    def _torque(self, p: ArrayLike) -> Array:
        return np.asarray(self.V * np.asarray(p, float) / (4 * math.pi))


def _steps(start: float, stop: float, step: float) -> tuple[float, ...]:
    return tuple(np.arange(start, stop + step / 2, step).round(9).tolist())


GASOLINE = SyntheticEngine(
    name="gasoline_1600",
    V=1.6e-3,
    heating_value=43e6,
    p_0=1.4e5,
    p_2=0.6e5,
    p_max=12e5,
    w_tau=420,
    k_slow=0.35,
    k_fast=0.6,
    c_throttle=2.0,
    e_0=0.40,
    w_e=280,
    k_e=0.06,
    k_rich=0.13,
    speeds=_steps(0, 700, 50),
    throttles=_steps(0, 1, 0.1),
    torques=_steps(0, 160, 10),
)
DIESEL = SyntheticEngine(
    name="diesel_2000",
    V=2e-3,
    heating_value=42.7e6,
    p_0=1.4e5,
    p_2=0.9e5,
    p_max=20e5,
    w_tau=230,
    k_slow=0.9,
    k_fast=0.45,
    c_throttle=0.0,
    e_0=0.46,
    w_e=200,
    k_e=0.05,
    k_rich=0.05,
    speeds=_steps(0, 500, 25),
    throttles=_steps(0, 1, 0.1),
    torques=_steps(0, 320, 20),
)


def write_tables(engine: SyntheticEngine, folder: Path) -> None:
    """Write ``<name>_torque.csv`` and ``<name>_fuel.csv``."""
    note = f"# Synthetic: computed by powertrain.components.engines.synthetic, {engine.name}; no measured engine.\n"
    torque = [(w, u, float(engine.torque(w, u))) for w in engine.speeds for u in engine.throttles]
    fuel = [(w, tau, 1e3 * float(engine.fuel_rate(w, tau))) for w in engine.speeds for tau in engine.torques]
    for kind, head, rows in (
        ("torque", "speed [rad/s],throttle [1],torque [N.m]", torque),
        ("fuel", "speed [rad/s],torque [N.m],fuel rate [g/s]", fuel),
    ):
        text = "".join(f"{w:g},{x:g},{value:.5g}\n" for w, x, value in rows)
        (folder / f"{engine.name}_{kind}.csv").write_text(f"{note}{head}\n{text}", encoding="utf-8")
