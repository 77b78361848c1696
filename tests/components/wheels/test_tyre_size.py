"""The rolling radius from the size of a tyre."""

from __future__ import annotations

import math
from typing import Any

import pytest

import powertrain as pt
from powertrain.components.wheels import MagicFormulaWheel, RigidWheel, rolling_radius
from powertrain.presets.files import applied
from powertrain.vehicles import ManualCar


@pytest.mark.parametrize(
    "size", ["205/55R16", "205/55 R16 91V", "P205/55R16", "205 / 55 ZR 16", "205/55r16 XL", "205/55R16C"]
)
def test_the_radius_of_a_size(size: str) -> None:
    """406.4 mm of rim and twice 0.55 x 205 mm: 631.9 mm; one revolution is 3.05 times that, 1.927 m."""
    assert 2 * math.pi * rolling_radius(size) == pytest.approx(1.9273, rel=1e-4)


def test_wheels_take_tyre_sizes() -> None:
    """In Python, in files, and as a parameter of a run."""
    size: Any = "205/55R16"
    length: Any = "12 in"
    r = rolling_radius(size)
    assert float(RigidWheel(radius=size).radius) == r
    assert float(MagicFormulaWheel(radius=size).radius) == r
    car, _ = applied(ManualCar(), {"front": {"wheels": {"radius": "205/55R16"}}})
    assert car == pt.replace(ManualCar(), {"front.wheels.radius": "205/55R16"})
    assert float(car.front.wheels.radius) == r  # type: ignore[attr-defined]
    assert float(RigidWheel(radius=length).radius) == pytest.approx(0.3048)


@pytest.mark.parametrize("size", ["205/55", "205/55-16", "31x10.5R15", "205/55D16", "205/550R16", "205R16"])
def test_what_is_no_size_of_a_radial_tyre(size: Any) -> None:
    with pytest.raises(
        pt.ParameterError, match=rf"^RigidWheel.radius = '{size}' is not the size of a radial tyre, such as '205/55R16'"
    ):
        RigidWheel(radius=size)


@pytest.mark.parametrize("size", ["205/16R55", "205/55R40", "205/15R16", "205/55R06"])
def test_numbers_in_another_order_are_no_tyre_size(size: Any) -> None:
    """205/16R55, with height and rim exchanged, was a wheel of 0.71 m."""
    with pytest.raises(
        pt.ParameterError, match=f"^RigidWheel.radius = '{size}' has a height of .* in the order width/height R rim"
    ):
        RigidWheel(radius=size)


def test_a_number_is_no_tyre_size() -> None:
    size: Any = 205
    with pytest.raises(pt.ParameterError, match="tyre size = 205 is not the size of a radial tyre"):
        rolling_radius(size)
