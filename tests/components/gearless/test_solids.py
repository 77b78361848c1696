"""Geometry for the workshop: what is written is closed and has the volume of the part."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.gearless.circular_cam import TABLE_1, CircularCams
from powertrain.components.gearless.circular_cam.body import cam_solids, roller_solid
from powertrain.components.gearless.circular_cam.track import developed
from powertrain.components.gearless.solids import open_edges, volume, write_dxf, write_stl
from powertrain.components.gearless.spherical_cam import CamBody, SphericalCam

CAM = SphericalCam(4, 5)
BODIES = [
    CamBody(CAM, inner=(0.020, 0.029), outer=(0.030, 0.036), bore=0.006),
    CamBody(SphericalCam(3, 4), inner=(0.020, 0.029), outer=(0.030, 0.036)),
]


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("which", ["inner", "outer"])
def test_cams_are_closed_bodies(body: CamBody, which: Literal["inner", "outer"]) -> None:
    solid = body.cam_solid(which, 181)
    assert open_edges(solid) == 0
    low, high = getattr(body, which)
    assert volume(solid) == pytest.approx(body._moments(low, high)[0], rel=5e-3)
    assert np.linalg.norm(solid, axis=-1).max() == pytest.approx(high)
    assert open_edges(body.roller_solid(which)) == 0


@pytest.mark.parametrize("theta", [0.0, 0.13, 0.6])
def test_circular_cams_touch_their_rollers(theta: float) -> None:
    """Closed rings; the lower cam at -theta, the upper one turned over, on by one arc and at theta: both at r from every roller's axis."""
    n, width = TABLE_1.outer.n, (TABLE_1.outer.D - TABLE_1.inner.D) / 2
    for track, solid in zip((TABLE_1.outer, TABLE_1.inner), cam_solids(TABLE_1, points=1441), strict=True):
        assert open_edges(solid) == 0
        assert volume(solid) > 0
        roller = roller_solid(track, width)
        assert open_edges(roller) == 0
        assert volume(roller) == pytest.approx(np.pi * track.r**2 * width, rel=6e-3)
        for flip, turn in ((1.0, -theta), (-1.0, theta + 2 * np.pi / n)):
            points = solid.reshape(-1, 3) * [1.0, flip, flip]
            points = points[np.hypot(points[:, 0], points[:, 1]) > track.D / 2]
            arc = (np.arctan2(points[:, 1], points[:, 0]) + turn) * track.D / 2
            for k in range(n):
                x = np.remainder(arc - np.pi * track.D * (k / n - 0.5), np.pi * track.D) - np.pi * track.D / 2
                apart = np.hypot(x, points[:, 2] - track.axis(theta, k)).min()
                assert apart == pytest.approx(track.r, abs=2e-5)


def test_small_inner_tracks_have_a_hole() -> None:
    """Far from the outer track, the disk ends a roller's radius inside of the inner one, not beyond the axis."""
    cams = CircularCams.build(
        D_out=0.085, D_in=0.02, r_out=0.015, r_in=0.005, alpha_out=0.26, alpha_in=0.3, disk=TABLE_1.disk
    )
    outer, inner = cam_solids(cams, points=1441)
    for solid, low, high in ((outer, 0.02625, 0.0575), (inner, 0.005, 0.02625)):
        assert open_edges(solid) == 0
        radius = np.hypot(solid[..., 0], solid[..., 1])
        assert (radius.min(), radius.max()) == pytest.approx((low, high))
        middle = solid.mean(axis=1)[:, :2]
        normal = np.cross(solid[:, 1] - solid[:, 0], solid[:, 2] - solid[:, 0])
        inside = np.isclose(radius, low).all(axis=1)
        assert (
            np.einsum("ij,ij->i", normal[inside, :2], middle[inside]) <= 1e-15
        ).all()  # the bore's walls face the axis


def test_rollers_have_their_mass() -> None:
    total = sum(volume(BODIES[0].roller_solid(which, 241)) for which in ("inner", "outer"))
    assert 7850 * total == pytest.approx(BODIES[0].roller_mass, rel=5e-3)


def test_stl_holds_what_was_written(tmp_path: Path) -> None:
    """Read by the layout of the format, in millimetres."""
    pytest.importorskip("trimesh")
    solid = BODIES[0].cam_solid("outer", 31)
    data = write_stl(tmp_path / "cam.stl", solid).read_bytes()
    count = int(np.frombuffer(data[80:84], "<u4")[0])
    assert count == len(solid)
    assert len(data) == 84 + 50 * count
    facets = np.frombuffer(data[84:], np.dtype([("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")]))
    np.testing.assert_allclose(facets["c"], 1e3 * solid, rtol=1e-6, atol=1e-5)
    assert volume(facets["c"].astype(float)) == pytest.approx(1e9 * volume(solid), rel=1e-4)
    with pytest.raises(pt.ParameterError, match="edges have a triangle on one side only"):
        write_stl(tmp_path / "torn.stl", solid[200:])


def test_dxf_of_a_track(tmp_path: Path) -> None:
    """The unrolled track comes back to its height after one turn; lengths are in millimetres."""
    ezdxf = pytest.importorskip("ezdxf")
    curves = developed(TABLE_1.outer)
    drawing = ezdxf.readfile(write_dxf(tmp_path / "track.dxf", curves, closed=False))
    assert drawing.units == ezdxf.units.MM
    found = {line.dxf.layer: np.array(line.get_points("xy")) for line in drawing.modelspace()}
    assert set(found) == {"axes", "cam"}
    for name, points in curves.items():
        np.testing.assert_allclose(found[name], 1e3 * points, rtol=1e-12, atol=1e-9)
        assert points[0, 1] == pytest.approx(points[-1, 1], abs=1e-12)
    assert found["axes"][:, 0].max() == pytest.approx(np.pi * 85)
    assert not drawing.audit().errors


def test_a_missing_library_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("trimesh", "ezdxf"):
        monkeypatch.setitem(sys.modules, name, None)
    writes: list[Callable[[], Path]] = [
        lambda: write_stl(tmp_path / "a.stl", BODIES[0].roller_solid("inner")),
        lambda: write_dxf(tmp_path / "a.dxf", developed(TABLE_1.outer)),
    ]
    for write in writes:
        with pytest.raises(pt.ParameterError, match=r"is not installed: pip install 'powertrain\[cad\]'"):
            write()


@pytest.mark.parametrize("alpha", [0.0, 0.6, 2.5])
def test_parts_of_the_linkage_are_closed_and_meet(alpha: float, tmp_path: Path) -> None:
    """Balls stand at the S-pairs in coupler and lever; volumes are those of bars and balls; STL is written."""
    from powertrain.components.gearless.linkage import Linkage, LinkageBody

    body = LinkageBody(Linkage(a=0.03, b=0.06))
    solids = body.solids(alpha)
    points = body.linkage.points(alpha)
    for name, solid in solids.items():
        assert open_edges(solid) == 0, name
        assert volume(solid) > 0
    ball, bar = body.ball, body.bar
    cap = ball - np.sqrt(ball**2 - bar**2)
    balls = 2 * (4 / 3 * np.pi * ball**3 - np.pi * cap**2 * (3 * ball - cap) / 3)
    wanted = balls + np.pi * bar**2 * (body.linkage.a - 2 * np.sqrt(ball**2 - bar**2))
    assert volume(solids["coupler left"]) == pytest.approx(wanted, rel=0.01)
    for side in ("left", "right"):
        corners = solids[f"coupler {side}"].reshape(-1, 3)
        assert np.linalg.norm(corners - points[f"S_{side}"], axis=1).min() == pytest.approx(ball, rel=0.02)
        assert np.linalg.norm(solids["lever"].reshape(-1, 3) - points[f"S_{side}"], axis=1).min() == pytest.approx(
            1.35 * ball, rel=0.02
        )
    pytest.importorskip("trimesh")
    assert write_stl(tmp_path / "lever.stl", solids["lever"]).stat().st_size > 1000
    with pytest.raises(pt.ParameterError, match="does not hold"):
        LinkageBody(Linkage(), bar=0.02)
