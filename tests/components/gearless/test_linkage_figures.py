"""Every figure of the linkage draws what its computation gives."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.axes import Axes

from powertrain.components.gearless.linkage import Linkage, figures
from powertrain.components.gearless.linkage.animation import animate
from powertrain.components.gearless.linkage.design import pareto

mpl.use("Agg")
PLAIN: list[Callable[..., Axes]] = [
    figures.motion,
    figures.rates,
    figures.shaking_over_cycle,
    figures.shaking_path,
    figures.ball_forces,
    figures.rod_forces,
    figures.efficiency,
    figures.forces_over_length,
]


@pytest.mark.parametrize("draw", PLAIN, ids=lambda draw: draw.__name__)
def test_draws_into_what_is_given(draw: Callable[..., Axes]) -> None:
    """In axes that are given and in its own; named with units; something of finite size is seen."""
    given = plt.subplots()[1]
    for ax in draw(ax=given), draw():
        assert "[" in ax.get_xlabel()
        assert "[" in ax.get_ylabel()
        for line in ax.lines:
            assert np.isfinite(np.asarray(line.get_ydata(), float)).all()
        assert any(len(np.atleast_1d(line.get_xdata())) > 5 for line in ax.lines)
    assert draw(ax=given) is given


def test_motion_shows_the_extremes() -> None:
    theta, beta = figures.motion().lines[:2]
    assert np.max(theta.get_ydata()) == pytest.approx(np.degrees(Linkage().theta_max))
    assert np.max(beta.get_ydata()) == pytest.approx(np.degrees(Linkage().beta_range[1]))


def test_mechanism_in_space() -> None:
    """The lever's line ends where the kinematics have the S-pairs."""
    ax = figures.mechanism(Linkage(), 0.7)
    lever = next(line for line in ax.lines if line.get_label() == "lever (S-pairs)")
    drawn = np.array(lever.get_data_3d()).T  # type: ignore[attr-defined]
    points = Linkage().points(0.7)
    np.testing.assert_allclose(drawn[[0, 2]] / 100, [points["S_left"], points["S_right"]])
    turned = figures.mechanism(Linkage(), 0.7, np.pi / 2)
    lever = next(line for line in turned.lines if line.get_label() == "lever (S-pairs)")
    drawn = np.array(lever.get_data_3d()).T[1] / 100  # type: ignore[attr-defined]
    np.testing.assert_allclose(drawn, [0, 0, points["C"][1]], atol=1e-15)


def test_front_and_moment() -> None:
    found = pareto(points=3)
    ax = figures.front(found)
    np.testing.assert_array_equal(ax.lines[0].get_xdata(), found.values("shaking_force"))
    assert "moment" in figures.shaking_over_cycle(moment=True).get_ylabel()


@pytest.mark.slow
def test_animation(tmp_path: Path) -> None:
    """Its pictures are made and differ."""
    path = tmp_path / "linkage.gif"
    animate(frames=3).save(path, writer="pillow", dpi=40)
    assert path.stat().st_size > 3000
