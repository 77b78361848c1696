"""The power-flow diagram: a branch that passes a column keeps clear of what stands there."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib.patches import FancyBboxPatch

import powertrain as pt
from powertrain.components.transmissions import SplitPathTransmission
from powertrain.design import SplitPathBench


def test_straight_branch_of_a_split_passes_the_variable_unit() -> None:
    mpl.use("agg")
    plant = pt.compile(SplitPathBench(transmission=SplitPathTransmission(layout="baH")))
    ax = pt.power_flow(plant, {"r": np.array([0.9]), "load": -10.0}).isel(r=0).plot()
    labels = {text.get_text(): text.get_position() for text in ax.texts}
    (x, y) = labels["641.5 W"]
    boxes = [patch for patch in ax.patches if isinstance(patch, FancyBboxPatch)]
    assert len(boxes) == 4
    for box in boxes:
        inside = box.get_x() <= x <= box.get_x() + box.get_width()
        assert not (inside and box.get_y() <= y <= box.get_y() + box.get_height())
