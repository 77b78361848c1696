"""One self-contained HTML page of one or two recordings: the numbers packed once, the plotting library beside them."""

from __future__ import annotations

import base64
import gzip
import html
import json
import re
import tempfile
import webbrowser
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from importlib.resources import files
from importlib.util import find_spec
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from powertrain.errors import ParameterError, PowertrainError, suggestion
from powertrain.events import MODES
from powertrain.figures.layout import BOX, HIGH, LINES, Layout, curve, signal_ends
from powertrain.language.arguments import path as argument_path
from powertrain.language.arguments import writing
from powertrain.viewer.operating_map import OperatingMap
from powertrain.viewer.recording import ERROR, Curve, Recording

FIRST_SHOWN = (("m/s", 2), ("rad/s", 3), ("m", 2), ("rad", 2), ("N.m", 2), ("W", 2), ("A", 2), ("1", 2))
"""Units and numbers of the signals that a page shows when nothing else is asked for."""
MOST_UNITS = 3
"""Different units among them."""
DIGITS = 4
"""Digits of coordinates and of maps."""


class _Store:
    """Arrays in one block of bytes; equal arrays are stored once. A reference is the offset in bytes and the number of values."""

    def __init__(self) -> None:
        self._bytes, self._places = bytearray(), dict[bytes, tuple[int, int]]()

    def add(self, values: NDArray[Any]) -> tuple[int, int]:
        data = values.tobytes()
        key = values.dtype.str.encode() + data
        if key not in self._places:
            self._bytes += bytes(-len(self._bytes) % 8)
            self._places[key] = len(self._bytes), len(values)
            self._bytes += data
        return self._places[key]

    def packed(self) -> str:
        return _packed(bytes(self._bytes))


def write(
    recordings: Sequence[Recording],
    file: str | PathLike[str] | None,
    show: Sequence[str] = (),
    title: str = "",
    differences: Mapping[str, Any] | None = None,
) -> Path:
    """Write the page of recordings to a file, or to a temporary file that is opened in the browser (``None``); gives its path.

    Errors: ParameterError for a file name that does not end in .html, a file that cannot be written, and for unknown signals;
    PowertrainError without plotly.
    """
    path = None if file is None else Path(argument_path("file", file))
    if path is not None and path.suffix.lower() not in (".html", ".htm"):
        raise ParameterError(f"{str(path)!r} must end in .html")
    text = page(recordings, show, title, differences)
    if path is not None:
        with writing(path):
            path.write_text(text, encoding="utf-8")
        return path
    path = temporary(recordings[0].name)
    path.write_text(text, encoding="utf-8")
    webbrowser.open(path.as_uri())
    return path


def temporary(name: str) -> Path:
    """A file for a page among the temporary files."""
    return Path(tempfile.mkdtemp(prefix="powertrain-")) / f"{re.sub(r'[^A-Za-z0-9_-]+', '-', name)}.html"


def page(
    recordings: Sequence[Recording],
    show: Sequence[str] = (),
    title: str = "",
    differences: Mapping[str, Any] | None = None,
) -> str:
    """The HTML text of the page. Errors as for ``write``."""
    from powertrain import __version__

    known = {name for recording in recordings for name in recording.curves}
    for name in show:
        if name not in known:
            raise ParameterError(f"explore: there is no signal {name}{suggestion(name, known)}")
    store = _Store()
    content = {
        "runs": [_run(recording, store) for recording in recordings],
        "show": list(show) or _first_shown(recordings[0]),
        "modes": MODES,
        "kinds": [[unit, name, colour] for unit, (name, colour) in LINES.items()],
        "box": [BOX, HIGH],
        "differences": dict(differences or {}),
    }
    footer = (
        f"powertrain {__version__}. Curves are straight lines between the samples drawn; they stay within {ERROR:.1%} of the signal's "
        "range of all samples of the run. Powers in the schematic and operating points are read from these curves."
    )
    parts = {
        "title": html.escape(title or " and ".join(recording.name for recording in recordings)),
        "version": __version__,
        "footer": html.escape(footer),
        "css": _resource("page.css"),
        "script": _resource("page.js"),
        "library": _library(),
        "numbers": store.packed(),
        "page": json.dumps(content, allow_nan=False, separators=(",", ":")).replace("</", "<\\/"),
    }
    return _filled(_resource("page.html"), parts)


def _filled(template: str, parts: Mapping[str, str]) -> str:
    """The template with its {{names}} replaced; what is put in is not looked at again."""
    first, *rest = template.split("{{")
    filled = [first]
    for piece in rest:
        name, _, after = piece.partition("}}")
        filled += [parts[name], after]
    return "".join(filled)


def _run(recording: Recording, store: _Store) -> dict[str, Any]:
    """A recording as JSON, its arrays in the store."""
    origin = recording.time[0] if len(recording.time) else 0.0
    return {
        "name": recording.name,
        "message": recording.message,
        "span": [float(origin), float(recording.time[-1]) if len(recording.time) else 0.0],
        "time": store.add(recording.time),
        "curves": {name: _curve(one, store) for name, one in recording.curves.items()},
        "events": [list(event) for event in recording.events],
        "parameters": [list(row) for row in recording.parameters],
        "results": [_finite(row) for row in recording.results],
        "energy": [list(row) for row in recording.energy],
        "closure": recording.closure,
        "layouts": {path: _layout(path, one, recording) for path, one in recording.layouts.items()},
        "maps": [_map(path, one) for path, one in recording.maps],
    }


def _curve(one: Curve, store: _Store) -> list[Any]:
    return [store.add(one.places.astype(np.uint32)), store.add(one.values), one.unit, one.meaning, one.mode]


def _layout(path: str, found: Layout, recording: Recording) -> dict[str, Any]:
    """Boxes, lines as points with the powers they carry, and signals as arrows; y points down."""
    left, right, low, high = found.limits
    prefix = f"{path}." if path else ""
    boxes = []
    for vertex in found.shown:
        if vertex.kind == "port" or not vertex.title:
            boxes.append([vertex.title, vertex.kind, vertex.x - left, high - vertex.y, None])
            continue
        name = f"{prefix}{vertex.title}"
        powers = [f"power({port})" for port in recording.ports.get(name, ()) if f"power({port})" in recording.curves]
        detail: dict[str, Any] = {
            "path": name,
            "powers": powers,
            "loss": f"loss({name})" if name in recording.ports else None,
        }
        detail |= {"source": vertex.source, "inside": name in recording.layouts}
        boxes.append([vertex.title, vertex.kind, vertex.x - left, high - vertex.y, detail])
    lines = []
    for line in found.lines:
        ends = found.vertices[line.a], found.vertices[line.b]
        points = curve(*ends)
        sign = line.sign if ends[0].x <= ends[1].x else -line.sign  # a curve runs to the right
        powers = [name for port in line.ports if (name := f"power({prefix}{port})") in recording.curves]
        lines.append([line.unit, sign, powers, [[round(x - left, DIGITS), round(high - y, DIGITS)] for x, y in points]])
    arrows = []
    for a, b in found.signals:
        start, end, bend = signal_ends(found.vertices[a], found.vertices[b])
        arrows.append([[start[0] - left, high - start[1]], [end[0] - left, high - end[1]], bend])
    return {"size": [right - left, high - low], "boxes": boxes, "lines": lines, "arrows": arrows}


def _map(path: str, one: OperatingMap) -> dict[str, Any]:
    rows = [
        [float(f"{v:.{DIGITS}g}") if np.isfinite(v) else None for v in row] for row in np.asarray(one.values).tolist()
    ]
    return {
        "path": path,
        "title": one.quantity,
        "reversed": one.low_is_best,
        "x": [f"{path}.{one.x}", one.x_label, one.x_scale, _short(one.x_values)],
        "y": [f"{path}.{one.y}", one.y_label, one.y_scale, _short(one.y_values)],
        "values": rows,
        "levels": list(one.levels),
        "limits": [[name, _short(x), _short(y)] for name, x, y in one.limits],
    }


def _short(values: NDArray[np.float64]) -> list[float]:
    return [float(f"{v:.{DIGITS + 2}g}") for v in np.asarray(values, float).tolist()]


def _finite(row: Iterable[Any]) -> list[Any]:
    """A row with None where a number is not finite."""
    return [None if isinstance(v, float) and not np.isfinite(v) else v for v in row]


def _first_shown(recording: Recording) -> list[str]:
    """A few varying signals of a few units: states first, then those nearest to the top of the model; equal signals count once."""
    found: list[str] = []
    units = 0
    order = sorted(recording.curves, key=lambda name: (name not in recording.states, name.count("."), "(" in name))
    for unit, count in FIRST_SHOWN:
        seen: set[bytes] = set()
        for name in order:
            one = recording.curves[name]
            data = one.values.tobytes()
            if one.unit == unit and not one.mode and len(one.values) > 2 and data not in seen and len(seen) < count:
                seen.add(data)
                found.append(name)
        units += bool(seen)
        if units == MOST_UNITS:
            break
    return found


@cache
def _library() -> str:
    """plotly.js, packed. PowertrainError where plotly is not installed."""
    if find_spec("plotly") is None:
        raise PowertrainError("interactive pages need plotly: pip install 'powertrain[viewer]'")
    from plotly.offline import get_plotlyjs

    return _packed(get_plotlyjs().encode())


def _resource(name: str) -> str:
    return files("powertrain.viewer").joinpath(name).read_text(encoding="utf-8")


def _packed(data: bytes) -> str:
    return base64.b64encode(gzip.compress(data, 9, mtime=0)).decode()
