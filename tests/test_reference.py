"""The comparison with another tool's samples sees what it should, at jumps as well."""

from __future__ import annotations

import numpy as np
import pytest
from reference import FOLDER, Reference, assert_modes, deviation, load

# A ramp that falls from 1 to 0 at 0.5 s.
TIMES = np.array([0.0, 0.25, 0.5, 0.5, 0.75, 1.0])
RAMP = Reference("ramp", TIMES, {"x": np.array([0.0, 0.5, 1.0, 0.0, 0.5, 1.0])}, {"mode": [(0.0, 1), (0.5, 0)]})


class Run(dict):  # type: ignore[type-arg]
    """Signals over ``time``."""

    def __init__(self, at: float, offset: float = 0.0) -> None:
        self.time = np.sort(np.concatenate([np.unique(TIMES), [at, at]]))
        after = np.arange(len(self.time)) > np.searchsorted(self.time, at)
        super().__init__(x=2 * np.where(after, self.time - at, self.time) + offset, mode=np.where(after, 0.0, 1.0))


@pytest.mark.parametrize("at", [0.5, 0.5 - 5e-6, 0.5 + 5e-6])
def test_a_jump_may_come_a_little_sooner_or_later(at: float) -> None:
    assert deviation(Run(at), RAMP, "x") < 2e-5
    assert_modes(Run(at), RAMP, atol=1e-5)


@pytest.mark.parametrize("run", [Run(0.5 - 5e-5), Run(0.5 + 5e-5), Run(0.5, offset=0.01), Run(0.5, offset=-0.01)])
def test_a_late_jump_and_another_value_are_seen(run: Run) -> None:
    assert deviation(run, RAMP, "x") > 0.009


def test_other_modes_and_instants_are_seen() -> None:
    with pytest.raises(AssertionError):
        assert_modes(Run(0.5 + 5e-5), RAMP, atol=1e-5)
    with pytest.raises(AssertionError):
        assert_modes(Run(0.5), Reference("ramp", TIMES, {}, {"mode": [(0.0, 1), (0.5, -1)]}), atol=1e-5)


def test_the_samples_say_where_they_are_from() -> None:
    paths = sorted(FOLDER.glob("*/*.csv"))
    assert len(paths) == 19
    for path in paths:
        assert "MAP-LIB_ReferenceResults" in path.read_text(encoding="utf-8").splitlines()[1]
        assert len(load(f"{path.parent.name}/{path.stem}").time) >= 100
