"""Geometry for the workshop: closed surfaces of triangles as STL, plane curves as DXF, both in millimetres; lengths here are in metres."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from powertrain import ParameterError

Array = NDArray[np.float64]
LAMP = np.array([0.35, -0.75, 0.6]) / np.linalg.norm([0.35, -0.75, 0.6])
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def write_stl(path: str | PathLike[str], triangles: Array) -> Path:
    """Writes a closed surface as binary STL in millimetres; ``triangles`` (n, 3, 3) [m], their corners in right-handed order from outside.

    Errors: ParameterError where the surface is not closed, so that it bounds no body.
    """
    if (gaps := open_edges(triangles)) > 0:
        raise ParameterError(f"write_stl: {gaps} edges have a triangle on one side only: the surface is not closed")
    corners = 1e3 * np.asarray(triangles, float)
    facets = np.zeros(len(corners), _FACET)
    facets["corners"] = corners
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    facets["normal"] = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    target = Path(path)
    target.write_bytes(b"powertrain, millimetres".ljust(80) + np.uint32(len(corners)).tobytes() + facets.tobytes())
    return target


def write_dxf(path: str | PathLike[str], curves: dict[str, Array], *, closed: bool = True) -> Path:
    """Writes plane curves as DXF (R12) in millimetres, each a polyline on a layer of its name; points (n, 2) [m]."""
    lines = ["0", "SECTION", "2", "ENTITIES"]
    for layer, points in curves.items():
        lines += ["0", "POLYLINE", "8", layer, "66", "1", "70", str(int(closed))]
        for x, y in 1e3 * np.asarray(points, float):
            lines += ["0", "VERTEX", "8", layer, "10", f"{x:.9g}", "20", f"{y:.9g}"]
        lines += ["0", "SEQEND"]
    target = Path(path)
    target.write_text("\n".join([*lines, "0", "ENDSEC", "0", "EOF", ""]), encoding="ascii")
    return target


def volume(triangles: Array) -> float:
    """What a closed surface contains [m3]."""
    a, b, c = np.moveaxis(np.asarray(triangles, float), 1, 0)
    return float((a * np.cross(b, c)).sum() / 6)


def open_edges(triangles: Array) -> int:
    """Edges that do not belong to exactly two triangles, run through in opposite senses."""
    corners = np.asarray(triangles, float)
    scale = max(float(np.abs(corners).max()), 1e-300)
    _, index = np.unique(np.round(corners.reshape(-1, 3) / scale, 9), axis=0, return_inverse=True)
    ring = index.reshape(-1, 3)
    ring = ring[(ring[:, 0] != ring[:, 1]) & (ring[:, 1] != ring[:, 2]) & (ring[:, 2] != ring[:, 0])]
    edges = np.concatenate([ring[:, [0, 1]], ring[:, [1, 2]], ring[:, [2, 0]]])
    size = int(index.max()) + 1
    there, back = edges[:, 0] * size + edges[:, 1], edges[:, 1] * size + edges[:, 0]
    return int((~np.isin(there, back)).sum()) + int(there.size - np.unique(there).size)


def shell(rings: Array) -> Array:
    """Triangles of a closed tube: ``rings`` (m, n, 3), every ring a closed polygon, the last one joined to the first one."""
    a, b = rings, np.roll(rings, -1, axis=0)
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    lower, upper = np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)
    return np.concatenate([lower.reshape(-1, 3, 3), upper.reshape(-1, 3, 3)])


def shaded(triangles: Array, colors: Array) -> Array:
    """Colours (n, 3) of triangles in the light of a lamp over the spectator's shoulder."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(normal, axis=1)
    light = np.divide(normal @ LAMP, length, out=np.zeros_like(length), where=length > 0)
    return np.asarray(np.clip(colors * (0.55 + 0.45 * light)[:, None], 0.0, 1.0))


def revolved(profile: Array, points: int = 48) -> Array:
    """Triangles of a body of revolution about z.

    ``profile`` (n, 2): heights and radii [m] along a closed line, which may run on the axis.
    """
    angles = np.linspace(0, 2 * np.pi, points, endpoint=False)[:, None]
    height, radius = np.asarray(profile, float).T
    rings = np.stack(
        [radius * np.cos(angles), radius * np.sin(angles), np.broadcast_to(height, (points, height.size))], -1
    )
    found = shell(rings)
    return found if volume(found) > 0 else found[:, ::-1]


def placed(triangles: Array, foot: Array, axis: Array) -> Array:
    """A body whose axis is z, with its origin at ``foot`` and its axis along ``axis``."""
    z = np.asarray(axis, float) / np.linalg.norm(axis)
    x = np.cross(z, [1.0, 0.0, 0.0] if abs(z[0]) < 0.9 else [0.0, 1.0, 0.0])
    x /= np.linalg.norm(x)
    return np.asarray(triangles @ np.stack([x, np.cross(z, x), z]) + foot)
