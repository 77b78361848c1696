"""The figures of the circular-cam differential: what they show is what was computed."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.animation import FuncAnimation
from matplotlib.colors import to_rgb
from matplotlib.patches import Circle

from powertrain.components.gearless.circular_cam import TABLE_1, TORQUE, CircularCams, forces, track_contacts
from powertrain.components.gearless.circular_cam import figures as drawn


@pytest.mark.parametrize("drive", [1.0, -1.0])
def test_mechanism(drive: float) -> None:
    ax = drawn.mechanism(theta=0.4, drive=drive)
    circles = [patch for patch in ax.patches if isinstance(patch, Circle)]
    assert len(circles) == 8
    for circle, j in zip(circles[:4], range(4), strict=True):
        x, y = circle.center
        assert x == pytest.approx(1000 * j * np.pi * 0.085 / 4)
        assert y - circles[0].center[1] == pytest.approx(
            1000 * (TABLE_1.outer.axis(0.4, j) - TABLE_1.outer.axis(0.4, 0)), abs=1e-9
        )
    colours = [to_rgb(circle.get_facecolor()) for circle in circles]
    red = [colour[0] > 2 * colour[2] for colour in colours]
    assert red == [bool(t.active(0.4, j, drive)) for t in (TABLE_1.outer, TABLE_1.inner) for j in range(4)]
    assert len(ax.texts) == 2 + 4  # the tracks' names, and an arrow on each wedged roller


def test_rollers_touch_the_drawn_cams() -> None:
    """No drawn point of a cam lies inside a roller, and each roller has one of each cam at its rim."""
    for theta in (0.0, 0.3, 0.9, 2.5):
        ax = drawn.mechanism(theta=theta)
        outlines = [np.array(line.get_xydata()) for line in ax.lines if len(np.asarray(line.get_xdata())) > 100]
        circles = [patch for patch in ax.patches if isinstance(patch, Circle)]
        assert len(outlines) == 4
        for k, circle in enumerate(circles):
            for outline in outlines[:2] if k < 4 else outlines[2:]:
                distance = np.hypot(*(outline - circle.center).T)
                assert distance.min() == pytest.approx(circle.radius, rel=1e-3)


@pytest.mark.slow
def test_animation(tmp_path: Path) -> None:
    found = drawn.animation(frames=3)
    assert isinstance(found, FuncAnimation)
    found.save(tmp_path / "cams.gif", writer="pillow")
    assert (tmp_path / "cams.gif").stat().st_size > 1000
    assert "120.0" in plt.gcf().axes[0].get_title()


def test_curves() -> None:
    angles = drawn.contact_angles()
    assert [text.get_text() for text in angles.texts] == list("242424242")
    assert max(np.asarray(angles.lines[1].get_ydata())) == pytest.approx(27.25)
    kappa = drawn.locking_coefficient()
    assert min(np.asarray(kappa.lines[1].get_ydata())) == pytest.approx(0.399, abs=5e-4)
    normal = drawn.normal_forces()
    theta = np.radians(np.asarray(normal.lines[2].get_xdata(), float))
    np.testing.assert_allclose(
        np.asarray(normal.lines[2].get_ydata()) * 1e3, forces(TABLE_1, theta, TORQUE).F_n_out, rtol=1e-9
    )
    pressures = drawn.contact_pressures()
    theta = np.radians(np.asarray(pressures.lines[0].get_xdata(), float))
    convex = track_contacts(TABLE_1.outer)[1].pressure(forces(TABLE_1, theta, TORQUE).F_n_out)
    np.testing.assert_allclose(np.asarray(pressures.lines[0].get_ydata()) * 1e9, convex, rtol=1e-9)


def test_map_and_centrodes() -> None:
    limits = drawn.locking_limits()
    mu, alpha = np.asarray(limits.lines[0].get_xdata(), float), np.asarray(limits.lines[0].get_ydata(), float)
    assert np.interp(0.066, mu, alpha) == pytest.approx(3.243, abs=0.01)
    assert np.interp(0.066, mu, np.asarray(limits.lines[1].get_ydata(), float)) == pytest.approx(7.53, abs=0.01)
    given = plt.subplots()[1]
    assert drawn.centrodes(ax=given) is given
    pole = np.array(given.lines[3].get_xydata())
    ellipse = (pole[:, 0] / 15) ** 2 + (
        (pole[:, 1] / 1e3 - TABLE_1.outer.R_m * np.cos(TABLE_1.outer.alpha_max)) / TABLE_1.outer.R_m
    ) ** 2
    np.testing.assert_allclose(ellipse, 1, rtol=1e-9)


def test_map_of_tracks_that_cannot_be_steep() -> None:
    """Small rollers: cams steeper than 20.4 degrees would collide; the map ends there."""
    small = CircularCams.build(
        D_out=0.085, D_in=0.05, r_out=0.006, r_in=0.004, alpha_out=0.2, alpha_in=0.2, disk=TABLE_1.disk
    )
    assert drawn.locking_limits(small).get_ylim()[1] == pytest.approx(20.4, abs=0.1)


def test_disks_in_space() -> None:
    """Four rings and a roller of either track in each groove, above and below the middle."""
    from powertrain.components.gearless.circular_cam.figures import disks

    ax = disks(theta=0.2, apart=0.04)
    assert len(ax.collections) == 1
    assert "11.5" in ax.get_title()
    assert disks(ax=ax) is ax
