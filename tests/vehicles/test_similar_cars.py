"""Vehicles whose masses, torques and powers are all k times as large drive the same: nothing depends on the size of a newton metre."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.cycles import DriveCycle
from powertrain.language.dimensions import measure
from powertrain.presets.catalogue import vehicles
from powertrain.presets.places import Adjustable, places
from powertrain.trials import drive_cycle

CYCLE = DriveCycle.named("udds").part(0, 126)


def order(unit: str) -> int:
    """The power of k with which a quantity grows if masses and currents do, at unchanged lengths, times and voltages."""
    powers = dict(measure(unit)[1])
    return powers.get("kg", 0) + powers.get("A", 0)


def grown(found: Adjustable, k: float) -> Any:
    """What stands at a place, k times as large; None where it stays as it is."""
    value = found.value
    if found.spec is not None:
        return (
            float(value) * k ** order(found.spec.unit) if order(found.spec.unit) and np.isfinite(float(value)) else None
        )
    if found.path.endswith("converter.table"):  # speed ratio, K factor [rad/s/sqrt(N.m)], torque ratio
        return tuple((nu, K / np.sqrt(k), R) for nu, K, R in value)
    if found.path.endswith("tau_pos"):  # speed, torque [N.m]
        return tuple((w, k * tau) for w, tau in value)
    if isinstance(value, pt.Map) and order(value.unit):
        return pt.Map(value.axes, value.values * k ** order(value.unit), value.unit, value.name, value.method)
    return None


@pytest.mark.slow
@pytest.mark.parametrize("name", [entry.name for entry in vehicles()][::2])
def test_a_vehicle_k_times_as_heavy_and_strong_drives_the_same(name: str) -> None:
    car: Any = next(entry.kind for entry in vehicles() if entry.name == name)()
    instants, free = np.arange(0.0, 126.0, 0.5), pt.compile(car).parameters

    def driven(model: Any) -> tuple[Any, Any]:
        run = drive_cycle(model, CYCLE, rtol=1e-6)
        assert not run.message
        return np.interp(instants, run.result.time, run.result["body.v"]), run.fuel

    v, fuel = driven(car)
    for k in (1e3, 1e-3):
        own = [
            p for p in places(car) if p.spec is None or p.path in free
        ]  # others follow, such as the mass of the chassis
        values = {p.path: new for p in own if (new := grown(p, k)) is not None}
        assert len(values) > 5
        v_k, fuel_k = driven(pt.replace(car, values))
        assert v_k == pytest.approx(v, abs=1e-4)
        assert fuel_k / k == pytest.approx(fuel, rel=1e-5)
