"""Class methods that build something, and records, given what they cannot use: an answer or a PowertrainError, nothing from inside."""

from __future__ import annotations

import contextlib
import dataclasses
import importlib
import inspect
import math
import pkgutil
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal

import numpy as np
import pytest
from numpy.typing import ArrayLike

import powertrain as pt
import powertrain.components
import powertrain.design
import powertrain.measured
import powertrain.vehicles
from powertrain.components.body import RoadProfile
from powertrain.components.cycles import DriveCycle
from powertrain.components.engines import PistonEngine
from powertrain.components.gearless.circular_cam import FrictionDisk, RollerContact, Track
from powertrain.components.gearless.linkage import JointFriction, Linkage, LinkageBody, LinkBody
from powertrain.components.gearless.spherical_cam import CamBody, CamFriction, CamGeometry, SphericalCam
from powertrain.components.rotational import Inertia
from powertrain.components.transmissions import Lever, UnitLoss
from powertrain.design import Efficiencies
from powertrain.trials import UtilityFactor
from powertrain.vehicles import ParallelHybrid

WEIRD = [
    None, True, -1, 0, 10.5, math.nan, math.inf, 1j, "text", "", b"x", (), [], {}, {1, 2}, range(3), np.array([1.0, 2.0]),
    np.array([1, 2]), np.array("a"), np.zeros((2, 2)), [1, "a"], [1, [2]], (1, 2, 3), [None], {"a": 1}, print, object(), Inertia,
    Inertia(J=1.0),
]  # fmt: skip
INNER = {"Drive.at", "EvaluatedLayout.of", "Curves.of", "TestCar.from_rows"}
"""Called by the library itself, with what it has computed."""


TRACK, CAM, LINKAGE = {"D": 0.1, "r": 0.01, "alpha_max": 0.4}, SphericalCam(4, 5), Linkage()
BODY = {"m": 1.0, "axial": 0.1, "transverse": 0.1}
FITTING: dict[Any, dict[str, Any]] = {
    Track: TRACK,
    RollerContact: {"r": 0.01, "R_x": 0.02, "R_y": 0.03},
    FrictionDisk: {"d_out": 0.1, "d_in": 0.05, "mu": 0.1},
    Linkage: {},
    LinkageBody: {"linkage": LINKAGE},
    JointFriction: {},
    LinkBody: BODY,
    CamBody: {"cam": CAM, "inner": (0.01, 0.02), "outer": (0.02, 0.03)},
    CamFriction: {},
    CamGeometry: {"M": 4, "N": 5},
    SphericalCam: {"M": 4, "N": 5},
    Lever: {"name": "set", "a": "a", "b": "b", "carrier": "c", "ratio": -2.0},
    UnitLoss: {},
    Efficiencies: {},
    UtilityFactor: {"coefficients": (1.0, 2.0), "normalized": 1.0},
}


def makers() -> Iterator[Any]:
    """The public class methods of all components, vehicles, designs and measured cars."""
    found: dict[str, Any] = {}
    for root in (powertrain.components, powertrain.vehicles, powertrain.design, powertrain.measured):
        for module in pkgutil.walk_packages(root.__path__, f"{root.__name__}."):
            for name, kind in inspect.getmembers(importlib.import_module(module.name), inspect.isclass):
                if kind.__module__.startswith(root.__name__.split(".")[0]) and not name.startswith("_"):
                    found |= {
                        f"{name}.{n}": getattr(kind, n) for n, v in vars(kind).items() if isinstance(v, classmethod)
                    }
    for name in sorted(found):
        if ".from_json" not in name and "._" not in name and name not in INNER and not name.startswith("Result."):
            yield pytest.param(found[name], id=name)


def calls(maker: Any, value: Any) -> Iterator[tuple[list[Any], dict[str, Any]]]:
    """The value for all arguments that are required, or for each of the others."""
    parameters = inspect.signature(maker).parameters.values()
    required = [p for p in parameters if p.default is p.empty and p.kind is not p.VAR_KEYWORD]
    if required:
        yield (
            [value for p in required if p.kind is not p.KEYWORD_ONLY],
            {p.name: value for p in required if p.kind is p.KEYWORD_ONLY},
        )
        return
    yield from (([], {p.name: value}) for p in parameters if p.kind is not p.VAR_KEYWORD)


@pytest.mark.parametrize("maker", list(makers()))
def test_wrong_arguments(maker: Any) -> None:
    for value in WEIRD:
        for given, named in calls(maker, value):
            with contextlib.suppress(pt.PowertrainError):
                maker(*given, **named)


def records() -> Iterator[Any]:
    """The records whose arguments are checked, with arguments that fit."""
    for kind, fitting in FITTING.items():
        yield pytest.param(kind, fitting, id=kind.__name__)


@pytest.mark.parametrize(("kind", "fitting"), list(records()))
def test_records_name_what_does_not_fit(kind: Any, fitting: dict[str, Any]) -> None:
    """Whatever is given for a field: a record or a PowertrainError, which for a text names class and field."""
    kind(**fitting)
    for field in dataclasses.fields(kind):
        for value in WEIRD:
            with contextlib.suppress(pt.PowertrainError):
                kind(**fitting | {field.name: value})
        if field.type not in ("str", str):
            with pytest.raises(pt.ParameterError, match=rf"^{kind.__name__}: {field.name} = 'text' is not "):
                kind(**fitting | {field.name: "text"})
        for value in (-math.inf, math.nan) if field.type == "float" else ():
            with pytest.raises(pt.ParameterError, match=r"nan|inf"):
                kind(**fitting | {field.name: value})


class Pair:
    """With an argument of every kind."""

    @classmethod
    @pt.arguments_checked
    def of(
        cls, *each: int, rows: Sequence[tuple[float, str]] = (), way: Literal["a", "b"] = "a", part: Inertia | None = None,
        names: Mapping[str, int] | None = None, values: ArrayLike = 0.0, **rest: Any,
    ) -> tuple[Any, ...]:  # fmt: skip
        """What it was given."""
        return each, rows, way, part, names, values, rest


@pytest.mark.parametrize(
    ("given", "named", "said"),
    [
        ((1, 2.5), {}, "Pair.of: each = 2.5 is not an integer"),
        ((True,), {}, "Pair.of: each = True is not an integer"),
        (
            (),
            {"rows": [(1, "x"), (2, 3)]},
            "rows = [(1, 'x'), (2, 3)] is not a sequence of rows (a number, a string)",
        ),
        ((), {"rows": [(1, "x", 2)]}, "is not a sequence of rows (a number, a string)"),
        ((), {"rows": "ab"}, "rows = 'ab' is not a sequence of rows"),
        ((), {"way": "c"}, "way = 'c' is not one of a, b"),
        ((), {"part": 3.0}, "part = 3.0 is not an Inertia or None"),
        ((), {"names": [1]}, "names = [1] is not a mapping or None"),
        ((), {"values": "ten"}, "values = 'ten' is not a sequence of numbers"),
    ],
)
def test_messages(given: Any, named: Any, said: str) -> None:
    with pytest.raises(pt.ParameterError) as caught:
        Pair.of(*given, **named)
    assert said in str(caught.value)


def test_fitting_arguments() -> None:
    part, numbers = Inertia(J=1.0), np.array([1.0, 2.0])
    two: Any = np.int64(2)
    order: Any = np.array([1, 3, 2])
    assert PistonEngine.inline(order).cylinders == PistonEngine.inline((1, 3, 2)).cylinders
    found = Pair.of(
        1,
        two,
        rows=[(1, "x"), (np.float64(2.0), "y")],
        way="b",
        part=part,
        names={"a": 1},
        values=numbers,
        more=3,
    )
    assert found[:5] == ((1, 2), [(1, "x"), (2.0, "y")], "b", part, {"a": 1})
    assert found[5] is numbers
    assert found[6] == {"more": 3}
    with pytest.raises(TypeError, match="missing 1 required positional argument: 'heights'") as caught:
        RoadProfile.from_heights([0, 1])  # type: ignore[call-arg]
    assert caught.value.__context__ is None


def test_makers_say_what_they_take() -> None:
    calls: list[tuple[Any, Any, str]] = [
        (
            RoadProfile.from_heights,
            ("road.csv", [0, 1]),
            "RoadProfile.from_heights: s = 'road.csv' is not a sequence of numbers",
        ),
        (PistonEngine.inline, (4,), "PistonEngine.inline: order = 4 is not a sequence of integers"),
        (DriveCycle.of, (5,), "DriveCycle.of: cycle = 5 is not a DriveCycle or a string or a PathLike"),
        (ParallelHybrid.at, ("P5",), "ParallelHybrid.at: position = 'P5' is not one of P0, P1, P2, P3, P4"),
    ]
    for maker, given, said in calls:
        with pytest.raises(pt.ParameterError) as caught:
            maker(*given)
        assert str(caught.value) == said
