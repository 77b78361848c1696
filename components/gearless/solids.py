"""Geometry for manufacture: closed triangle surfaces as STL and plane curves as DXF, both in millimetres; lengths here are in metres."""

from __future__ import annotations

from importlib import import_module
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from powertrain import ParameterError

Array = NDArray[np.float64]
LAMP = np.array([0.35, -0.75, 0.6]) / np.linalg.norm([0.35, -0.75, 0.6])


def write_stl(path: str | PathLike[str], triangles: Array) -> Path:
    """Write a closed surface as binary STL in millimetres; ``triangles`` (n, 3, 3) [m], with corners counterclockwise from outside.

    By trimesh, ``pip install 'powertrain[cad]'``. Errors: ParameterError if the surface is not closed, and
    if trimesh is not installed.
    """
    if (gaps := open_edges(triangles)) > 0:
        raise ParameterError(f"write_stl: {gaps} edges have a triangle on one side only: the surface is not closed")
    corners = 1e3 * np.asarray(triangles, float).reshape(-1, 3)
    mesh = _library("trimesh", "write_stl").Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False)
    target = Path(path)
    mesh.export(target, file_type="stl")
    return target


def write_dxf(path: str | PathLike[str], curves: dict[str, Array], *, closed: bool = True) -> Path:
    """Write plane curves as DXF in millimetres, each a polyline on a layer of its name; points (n, 2) [m].

    By ezdxf, ``pip install 'powertrain[cad]'``. Errors: ParameterError if it is not installed.
    """
    ezdxf = _library("ezdxf", "write_dxf")
    drawing = ezdxf.new("R2000", units=ezdxf.units.MM)
    for layer, points in curves.items():
        drawing.layers.add(layer)
        drawing.modelspace().add_lwpolyline(1e3 * np.asarray(points, float), close=closed, dxfattribs={"layer": layer})
    target = Path(path)
    drawing.saveas(target)
    return target


def _library(name: str, what: str) -> Any:
    try:
        return import_module(name)
    except ImportError:
        raise ParameterError(f"{what}: {name} is not installed: pip install 'powertrain[cad]'") from None


def volume(triangles: Array) -> float:
    """Volume of a closed surface [m3]."""
    a, b, c = np.moveaxis(np.asarray(triangles, float), 1, 0)
    return float((a * np.cross(b, c)).sum() / 6)


def open_edges(triangles: Array) -> int:
    """Edges that do not belong to exactly two triangles with opposite directions."""
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
    """Triangles of a closed tube: ``rings`` (m, n, 3), every ring a closed polygon, the last joined to the first."""
    a, b = rings, np.roll(rings, -1, axis=0)
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    lower, upper = np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)
    return np.concatenate([lower.reshape(-1, 3, 3), upper.reshape(-1, 3, 3)])


def shaded(triangles: Array, colors: Array) -> Array:
    """Colours (n, 3) of triangles lit from behind the viewer's shoulder."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(normal, axis=1)
    light = np.divide(normal @ LAMP, length, out=np.zeros_like(length), where=length > 0)
    return np.asarray(np.clip(colors * (0.55 + 0.45 * light)[:, None], 0.0, 1.0))


def revolved(profile: Array, points: int = 48) -> Array:
    """Triangles of a body of revolution about z.

    ``profile`` (n, 2): heights and radii [m] along a closed line, which may touch the axis.
    """
    angles = np.linspace(0, 2 * np.pi, points, endpoint=False)[:, None]
    height, radius = np.asarray(profile, float).T
    rings = np.stack(
        [radius * np.cos(angles), radius * np.sin(angles), np.broadcast_to(height, (points, height.size))], -1
    )
    found = shell(rings)
    return found if volume(found) > 0 else found[:, ::-1]


def placed(triangles: Array, foot: Array, axis: Array) -> Array:
    """A body with axis z, moved so that its origin is at ``foot`` and its axis along ``axis``."""
    z = np.asarray(axis, float) / np.linalg.norm(axis)
    x = np.cross(z, [1.0, 0.0, 0.0] if abs(z[0]) < 0.9 else [0.0, 1.0, 0.0])
    x /= np.linalg.norm(x)
    return np.asarray(triangles @ np.stack([x, np.cross(z, x), z]) + foot)
