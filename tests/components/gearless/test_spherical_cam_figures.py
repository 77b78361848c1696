"""The figures of the spherical cam differential: what they show is what was computed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from matplotlib.animation import FuncAnimation
from matplotlib.axes import Axes

from powertrain.components.gearless.spherical_cam import Cycle, SphericalCam
from powertrain.components.gearless.spherical_cam import figures as drawn
from powertrain.components.gearless.spherical_cam.animation import animation

CAM = SphericalCam(3, 4)


@pytest.mark.parametrize("draw", [drawn.flat_profile, drawn.pressure_angles, drawn.profile_on_sphere, drawn.mechanism])
def test_of_a_cam(draw: Callable[..., Axes]) -> None:
    ax = draw(CAM)
    assert isinstance(ax, Axes)
    assert ax.lines
    assert draw(CAM, ax=ax) is ax
    assert isinstance(draw(), Axes)


@pytest.mark.parametrize("draw", [drawn.load_sharing, drawn.efficiency])
@pytest.mark.parametrize("sharing", ["elastic", "single"])
def test_of_a_cycle(draw: Callable[..., Axes], sharing: str) -> None:
    cycle = Cycle(CAM, sharing=sharing)  # type: ignore[arg-type]
    ax = draw(cycle)
    assert draw(cycle, ax=ax) is ax
    y = np.asarray(ax.lines[0].get_ydata())
    assert ((y >= -1e-12) & (y <= 1 + 1e-12)).all()


def test_contact_pressures() -> None:
    ax = drawn.contact_pressures(torque=50.0)
    highest = max(float(np.max(np.asarray(line.get_ydata()))) for line in ax.lines)
    assert highest == pytest.approx(drawn.BODY.greatest_pressure(drawn.CYCLE, 50.0) / 1e9, rel=1e-4)


def test_minimum_of_the_drawn_pressure_angle() -> None:
    ax = drawn.pressure_angles(CAM)
    lowest = min(float(np.min(np.asarray(line.get_ydata()))) for line in ax.lines if line.get_color() == drawn.LEFT)
    assert lowest == pytest.approx(np.degrees(CAM.minimum_pressure_angle), abs=1e-3)


def test_cams_of_the_mechanism_turn_with_the_carriers() -> None:
    """After a pitch of the rollers it looks the same."""
    angles = 0.1, 0.1 + 2 * np.pi / CAM.N
    one, other = (drawn.mechanism_solids(CAM, theta)[0].mean(axis=1) for theta in angles)
    for point in one[::7]:
        assert np.linalg.norm(other - point, axis=1).min() < 1e-9
    apart, _ = drawn.mechanism_solids(CAM, 0.1, exploded=0.5)
    assert np.abs(apart).max() > np.abs(one).max() + 0.4
    first, second = (drawn.mechanism(CAM, theta) for theta in angles)
    assert first.get_title() != second.get_title()


@pytest.mark.slow
def test_animation(tmp_path: Path) -> None:
    moving = animation(CAM, frames=2)
    assert isinstance(moving, FuncAnimation)
    moving.save(tmp_path / "cams.gif", writer="pillow")
    assert (tmp_path / "cams.gif").stat().st_size > 1000


def test_drawn_cam_and_roller_touch_and_do_not_overlap(monkeypatch: pytest.MonkeyPatch) -> None:
    """The roller's cone lies outside of the cam's, whose corners are nowhere nearer to its axis than alpha_4."""
    bodies = []
    monkeypatch.setattr(drawn, "_add", lambda solid, parts: bodies.extend(parts))
    drawn.profile_on_sphere(CAM)
    (cam, _), _ = bodies
    outside = cam.reshape(-1, 3)
    outside = outside[np.linalg.norm(outside, axis=1) > 0.99]
    angle = np.arccos(np.clip(outside @ CAM.roller_axis(-0.7 * CAM.half), -1, 1)).min()
    assert angle == pytest.approx(CAM.alpha_4, abs=2e-3)
