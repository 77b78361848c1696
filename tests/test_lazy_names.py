"""``from powertrain.components import Clutch`` and ``from powertrain.vehicles import ManualCar``: complete, typed, and light."""

from __future__ import annotations

import importlib
import inspect
import subprocess
import sys
from collections import Counter

import pytest

import powertrain as pt
import powertrain.components
import powertrain.vehicles
from powertrain.components import rotational, translational
from powertrain.lazy import modules_of
from powertrain.presets.catalogue import components, vehicles


def listed(package: str) -> dict[str, str]:
    return modules_of(str(sys.modules[package].__file__).replace(".py", ".pyi"))


def test_every_component_of_one_family_is_listed() -> None:
    names = Counter(entry.name for entry in components())
    public = {n for m in set(listed("powertrain.components").values()) for n in importlib.import_module(m).__all__}
    missing = {n for n, count in names.items() if count == 1} & public - set(listed("powertrain.components"))
    assert not missing, "add a line for each to components/__init__.pyi"


def test_every_vehicle_is_listed() -> None:
    assert {entry.name for entry in vehicles()} | {"load", "names", "save"} == set(listed("powertrain.vehicles"))


@pytest.mark.parametrize("package", ["powertrain.components", "powertrain.vehicles"])
def test_names_are_what_their_modules_hold(package: str) -> None:
    for name, module in listed(package).items():
        found = getattr(sys.modules[package], name)
        assert found is getattr(importlib.import_module(module), name)
        assert inspect.isclass(found) or callable(found)


@pytest.mark.parametrize("package", ["powertrain.components", "powertrain.vehicles"])
def test_consoles_and_stars_see_the_names(package: str) -> None:
    assert set(listed(package)) <= set(dir(sys.modules[package]))
    found: dict[str, object] = {}
    exec(f"from {package} import *", found)
    assert set(found) - {"__builtins__"} == set(listed(package))


def test_names_of_two_families_say_where_they_are() -> None:
    both = set(rotational.__all__) & set(translational.__all__)
    assert both == set(vars(powertrain.components)["_BOTH"].split())
    with pytest.raises(ImportError, match=r"powertrain\.components\.rotational import Brake, or from .*translational"):
        exec("from powertrain.components import Brake")
    with pytest.raises(ImportError, match="cannot import name 'Clutsch'"):
        exec("from powertrain.components import Clutsch")
    assert not hasattr(pt.components, "nothing")


def test_one_name_imports_one_family() -> None:
    program = (
        "from powertrain.components import Battery; import sys; print('powertrain.components.engines' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False"]
