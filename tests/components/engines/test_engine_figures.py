from __future__ import annotations

import numpy as np
import pytest

from powertrain.components.engines import MappedEngine, WillansEngine
from powertrain.components.engines.figures import plot_engine_map


@pytest.mark.parametrize("engine", [WillansEngine(), MappedEngine.diesel()], ids=["willans", "diesel"])
def test_engine_map(engine: WillansEngine | MappedEngine) -> None:
    ax = plot_engine_map(engine)
    labels = {line.get_label(): np.asarray(line.get_xydata(), float) for line in ax.lines}
    assert {"Full load", "Motored, no fuel", "Least fuel"} <= set(labels)
    rpm, torque = labels["Full load"][-1]
    assert torque == pytest.approx(float(engine.full_load(rpm * np.pi / 30)))
    assert "g/kWh" in ax.get_title()
    assert plot_engine_map(engine, ax=ax) is ax
