"""The structure of a model as a picture: what is joined, where it stands, and that nothing lies upon another thing."""

from __future__ import annotations

from itertools import combinations

import matplotlib as mpl
import matplotlib.pyplot as plt
import pytest
from cases import few
from matplotlib.axes import Axes
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

import powertrain as pt
from powertrain.components.rotational import Inertia
from powertrain.vehicles.electric_car import ElectricCar
from powertrain.vehicles.flywheel_hybrid import FlywheelHybrid
from powertrain.vehicles.four_wheel_drive import FourWheelDriveCar
from powertrain.vehicles.manual_car import ManualCar
from powertrain.vehicles.power_split_hybrid import PowerSplitHybrid
from powertrain.vehicles.rear_drive import RearDriveCar
from powertrain.vehicles.split_path_car import SplitPathCar

mpl.use("Agg")
MODELS = {
    "split-path car": SplitPathCar(),
    "its transmission": SplitPathCar().transmission,
    "manual car": ManualCar(),
    "its gearbox": ManualCar().gearbox,
    "flywheel hybrid": FlywheelHybrid(),
    "power-split hybrid": PowerSplitHybrid(),
    "four-wheel drive": FourWheelDriveCar(),
    "rear drive": RearDriveCar(),
    "electric car": ElectricCar(),
}


def boxes(ax: Axes) -> dict[str, tuple[float, float]]:
    """The middle of each part's box, by the part's name."""
    return {
        text.get_text(): text.get_position()
        for text in ax.texts
        if text.get_zorder() == 4 and text.get_color() != "0.4"
    }


@pytest.mark.parametrize("name", few(MODELS, 3))
def test_boxes_stand_apart_and_within_the_picture(name: str) -> None:
    ax = pt.schematic(MODELS[name])
    found = [patch.get_bbox() for patch in ax.patches if isinstance(patch, FancyBboxPatch)]
    assert len(found) > 3
    for one, other in combinations(found, 2):
        assert not one.overlaps(other)
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    assert all(left <= box.x0 and box.x1 <= right and low <= box.y0 and box.y1 <= high for box in found)


@pytest.mark.parametrize("size", [None, (4.0, 3.0)])
def test_texts_fit_their_boxes_in_axes_of_any_size(size: tuple[float, float] | None) -> None:
    ax = pt.schematic(PowerSplitHybrid(), ax=plt.subplots(figsize=size)[1] if size else None)
    ax.figure.canvas.draw()
    boxes = [patch.get_window_extent() for patch in ax.patches if isinstance(patch, FancyBboxPatch)]
    for text in ax.texts:
        if text.get_zorder() == 4:
            low, high = text.get_window_extent().get_points()
            assert any(box.contains(*low) and box.contains(*high) for box in boxes), text
    plt.close("all")


def test_a_chain_is_a_straight_line_from_the_engine() -> None:
    places = boxes(pt.schematic(ManualCar()))
    chain = ["engine", "clutch", "gearbox", "transfer", "front", "body", "rear"]
    assert [name for name in sorted(places, key=lambda name: places[name][0]) if name in chain] == chain
    assert (
        len({round(places[name][1], 6) for name in chain[1:]}) == 1
    )  # the engine stands between clutch and accessories
    below = {name for name in places if name not in chain} - {"accessories"}
    assert below == {"cycle", "driver", "schedule", "start_stop", "road", "curvature", "cooling"}
    assert all(places[name][1] < places["engine"][1] for name in below)


@pytest.mark.parametrize("name", ["flywheel hybrid", "power-split hybrid", "electric car"])
def test_the_road_is_on_the_right(name: str) -> None:
    places = boxes(pt.schematic(MODELS[name]))
    wheels = [name for name in ("front", "body", "rear") if name in places]
    others = [name for name in ("battery", "machine", "engine", "flywheel", "transmission") if name in places]
    assert min(places[k][0] for k in wheels) > max(places[k][0] for k in others)


def test_sides_of_a_differential_stand_above_each_other() -> None:
    places = boxes(pt.schematic(RearDriveCar().rear))
    assert places["left"][0] == places["right"][0]
    middle = (places["left"][1] + places["right"][1]) / 2
    assert abs(middle - places["differential"][1]) < 1e-9


def test_a_whole_shows_its_ports_and_joins_of_three() -> None:
    ax = pt.schematic(SplitPathCar().transmission)
    assert set(boxes(ax)) == {"flange_a", "flange_b", "differential", "cvu", "ratio"}
    assert sum(line.get_marker() == "o" for line in ax.lines) == 1  # flange_a, the differential and the unit


def test_signals_may_be_left_out() -> None:
    ax = pt.schematic(ManualCar(), signals=False)
    assert "driver" not in boxes(ax)
    assert not any(isinstance(patch, FancyArrowPatch) for patch in ax.patches)


def test_nothing_to_draw() -> None:
    with pytest.raises(pt.ParameterError, match="Inertia has no connected parts"):
        pt.schematic(Inertia(J=1))
