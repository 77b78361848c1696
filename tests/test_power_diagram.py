"""The power-flow diagram: branches keep clear of the components they pass, and texts of each other, in axes of any size."""

from __future__ import annotations

from itertools import combinations

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.patches import FancyBboxPatch

import powertrain as pt
from powertrain.components.transmissions import SplitPathTransmission
from powertrain.design import SplitPathBench


@pytest.fixture(scope="module")
def flow() -> pt.PowerFlow:
    mpl.use("agg")
    plant = pt.compile(SplitPathBench(transmission=SplitPathTransmission(layout="baH")))
    return pt.power_flow(plant, {"r": np.array([0.3, 0.9]), "load": -10.0})


@pytest.mark.parametrize("size", [None, (6.4, 4.8), (2.0, 1.5)])
def test_texts_do_not_overlap_in_axes_of_any_size(flow: pt.PowerFlow, size: tuple[float, float] | None) -> None:
    ax = flow.isel(r=0).plot(ax=plt.subplots(figsize=size)[1] if size else None)
    ax.figure.canvas.draw()
    inside = ax.figure.bbox.padded(1)
    for text in ax.texts:
        assert all(inside.contains(*corner) for corner in text.get_window_extent().get_points()), text
    for one, other in combinations(ax.texts, 2):
        assert not one.get_window_extent().overlaps(other.get_window_extent()), (one, other)
    plt.close("all")


def test_straight_branch_of_a_split_passes_the_variable_unit(flow: pt.PowerFlow) -> None:
    ax = flow.isel(r=1).plot()
    labels = {text.get_text(): text.get_position() for text in ax.texts}
    (x, y) = labels["641.5 W"]
    boxes = [patch for patch in ax.patches if isinstance(patch, FancyBboxPatch)]
    assert len(boxes) == 4
    for box in boxes:
        inside = box.get_x() <= x <= box.get_x() + box.get_width()
        assert not (inside and box.get_y() <= y <= box.get_y() + box.get_height())
