"""Ordinary names lead to components that exist."""

from __future__ import annotations

from collections import Counter

import pytest

import powertrain as pt
from powertrain.presets.catalogue import components, find
from powertrain.presets.ordinary import ORDINARY, ordinary


def test_every_class_exists() -> None:
    known = {entry.name for entry in components()}
    assert {kind for kinds in ORDINARY.values() for kind in kinds} <= known


def test_no_name_stands_twice_or_is_that_of_a_class() -> None:
    names = Counter(name.lower() for row in ORDINARY for name in row.split(", "))
    assert max(names.values()) == 1
    called = {entry.name.lower() for entry in components()}
    assert not called & {name.replace(" ", "").replace("-", "") for name in names}


@pytest.mark.parametrize(
    "name", ["tire", "Tyre", "CV joint", "cv-joint", "hooke's joint", "overrunning-clutch", "Neutral idle control"]
)
def test_spelling_does_not_matter(name: str) -> None:
    assert ordinary(name)


def test_the_error_names_the_components_in_the_order_of_the_table() -> None:
    with pytest.raises(
        pt.ParameterError, match=r"unknown component 'tire'; see RigidWheel, SlipWheel, MagicFormulaWheel$"
    ):
        find("tire", components(), "component")
    with pytest.raises(pt.ParameterError, match=r"unknown component 'Clutsh'; did you mean Clutch"):
        find("Clutsh", components(), "component")


def test_spaces_in_a_class_name_do_not_matter() -> None:
    assert find("wet clutch", components(), "component").name == "WetClutch"
