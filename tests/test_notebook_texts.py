"""What a console and a notebook show: short, complete enough to make the thing again, and well-formed HTML."""

from __future__ import annotations

import re
from contextlib import suppress
from typing import Any
from xml.etree import ElementTree as ET

import pytest
from catalogue import concrete, made

import powertrain as pt
import powertrain.components as library
from powertrain.components import Clutch, DriveCycle, Inertia, MappedEngine
from powertrain.language import htmltext
from powertrain.language.component import LONGEST_TEXT
from powertrain.vehicles import ManualCar, PowerSplitHybrid, SplitPathCar

VEHICLES = ManualCar(), PowerSplitHybrid(), SplitPathCar(), ManualCar(engine=MappedEngine.gasoline())


def html(thing: Any) -> ET.Element:
    """The HTML of a thing, read as XML: every mark is closed."""
    return ET.fromstring(f"<div>{thing._repr_html_().replace('&nbsp;', ' ')}</div>")


def plain() -> list[pt.Component]:
    """Every component that numbers alone make."""
    found = []
    for kind in concrete():
        with suppress(pt.ParameterError):
            found.append(made(kind))
    assert len(found) > 150
    return found


@pytest.mark.parametrize(
    "part", plain(), ids=lambda part: f"{type(part).__module__.rpartition('.')[2]}.{type(part).__name__}"
)
def test_every_component_has_short_texts(part: pt.Component) -> None:
    kind = type(part)
    assert len(repr(part)) <= LONGEST_TEXT
    assert repr(part).startswith(f"{kind.__name__}(")
    shown = html(part)
    assert sum(1 for _ in shown.iter("tr")) <= 60
    for name, spec in kind._fields.items():
        if isinstance(spec, pt.Parameter):
            assert name in "".join(shown.itertext())


@pytest.mark.parametrize(
    "part",
    [
        Inertia(J=0.25),
        Clutch(fn_max=300, mue_pos=((0.0, 1.0), (10.0, 0.8))),
        pt.replace(ManualCar(), {"body.m": 1500.0, "engine.J": 0.2}),
        pt.replace(SplitPathCar(), {"transmission.layout": "abH"}),
        ManualCar(),
    ],
    ids=lambda part: type(part).__name__,
)
def test_the_text_makes_the_component_again(part: pt.Component) -> None:
    class Names(dict[str, Any]):
        def __missing__(self, name: str) -> Any:
            return {type(v).__name__: type(v) for v in VEHICLES}.get(name) or getattr(library, name)

    assert eval(repr(part), {}, Names()) == part


@pytest.mark.parametrize("car", VEHICLES, ids=lambda car: type(car).__name__)
def test_a_vehicle_is_a_line_and_a_table(car: pt.Component) -> None:
    assert len(repr(car)) <= LONGEST_TEXT
    text = "".join(html(car).itertext())
    assert len(car._repr_html_()) < 6000
    assert all(name in text for name in ("driver", "body", "VehicleBody", "Chassis" if "Chassis" in text else "front"))


def test_plants_runs_results_audits_maps_and_cycles() -> None:
    plant = pt.compile(pt.replace(ManualCar(), {"cycle.cycle": DriveCycle("hill", ((0.0, 0.0), (5.0, 3.0)))}))
    result = plant.simulate(1.0)
    run = plant.start()
    run.step(0.1)
    for thing, word in (
        (plant, "states"),
        (result, "signals"),
        (run, "at t = 0.1 s"),
        (pt.energy_audit(result), "supplied [kJ]"),
        (DriveCycle.named("wltc"), "1800 s"),
        (MappedEngine.gasoline().torque_map, "throttle"),
    ):
        shown = html(thing)
        assert word in "".join(shown.itertext())
        assert len(thing._repr_html_()) < 60_000, type(thing)
        assert len(repr(thing)) < 1500
    assert html(DriveCycle.named("wltc")).find(".//polyline") is not None
    energies = [cell.text or "" for cell in html(pt.energy_audit(result)).iter("td")]
    assert not any(re.search(r"\de[+-]", energy) for energy in energies), (
        "round-off is zero, in the digits of the largest energy"
    )


def test_a_curve_keeps_its_extremes() -> None:
    """A spike of one sample among ten thousand is drawn to the top."""
    values = [0.0] * 10_000
    values[4321] = 5.0
    svg = ET.fromstring(htmltext.curve(range(10_000), values))
    corners = [tuple(map(float, corner.split(","))) for corner in str(svg[0].get("points")).split()]
    assert min(y for _, y in corners) == 0.0
    assert len(corners) < 1000
    assert min(abs(x - htmltext.WIDE * 4321 / 9999) for x, y in corners if y == 0.0) < 0.1


def test_texts_are_escaped() -> None:
    assert htmltext.table(("<a>",), [("b&c",)]).count("&lt;a&gt;") == 1
    assert "b&amp;c" in htmltext.table(("a",), [("b&c",)])
