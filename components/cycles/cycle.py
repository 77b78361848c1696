"""Drive cycles as data: the speed that a vehicle has to follow."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain import ParameterError

KM_H = 1 / 3.6
"""One km/h in m/s."""
CYCLES = {
    "hwfet": "EPA Highway Fuel Economy Test, 40 CFR 600 App. I",
    "nedc": "New European Driving Cycle, UN Regulation No. 83 (4 x ECE-15 + EUDC)",
    "udds": "EPA Urban Dynamometer Driving Schedule (FTP-72), 40 CFR 86 App. I",
    "wltc": "WLTC class 3b, UN Global Technical Regulation No. 15",
}
"""The cycles that come with the library, and the regulation in which each stands."""


@dataclass(frozen=True)
class DriveCycle:
    """Speed over time: rows (time in s, speed in m/s), joined by straight lines; times increase and speeds are not negative.

    ``named`` takes one of the legislated cycles, ``from_csv`` a file, ``from_distance`` speeds over distance.

    >>> wltc = DriveCycle.named("wltc")
    >>> round(wltc.duration), round(wltc.distance / 1e3, 2), round(wltc.top_speed * 3.6, 1)
    (1800, 23.27, 131.3)
    """

    name: str
    table: tuple[tuple[float, float], ...]
    source: str = ""

    def __post_init__(self) -> None:
        """Errors: ParameterError, which names the row."""
        if len(self.table) < 2:
            raise ParameterError(f"drive cycle {self.name}: {len(self.table)} rows are none; it needs at least two")
        before = -math.inf
        for row, (t, v) in enumerate(self.table, 1):
            if not (math.isfinite(t) and math.isfinite(v)):
                raise ParameterError(f"drive cycle {self.name}: row {row} is ({t:g} s, {v:g} m/s); both must be finite")
            if t <= before:
                raise ParameterError(
                    f"drive cycle {self.name}: row {row} is at {t:g} s, after {before:g} s; times increase"
                )
            if v < 0:
                raise ParameterError(f"drive cycle {self.name}: row {row} asks for {v:g} m/s; a cycle drives forward")
            before = t

    @classmethod
    def named(cls, name: str) -> Self:
        """One of ``CYCLES``. Errors: ParameterError for another name."""
        if name not in CYCLES:
            raise ParameterError(f"there is no drive cycle {name!r}; there are {', '.join(CYCLES)}, and CSV files")
        path = files("powertrain.components").joinpath("cycles", "data", f"{name}.csv")
        return cls(name, _rows(path.read_text(encoding="utf-8").splitlines(), name, KM_H), CYCLES[name])

    @classmethod
    def from_csv(cls, path: str | Path) -> Self:
        """A file of two columns with the header ``time_s,speed_km_h`` or ``time_s,speed_m_s``; lines with # are comments.

        Errors: ParameterError for a file that cannot be read, for another header and for a value that is no number, with its line.
        """
        path = Path(path)
        try:
            lines = path.read_text(encoding="utf-8-sig").splitlines()
        except OSError as error:
            raise ParameterError(f"{path}: cannot be read: {error.strerror}") from None
        except UnicodeDecodeError as error:
            raise ParameterError(
                f"{path}: byte {error.start} is not text in UTF-8; save the file in that encoding"
            ) from None
        header = next((line for line in lines if line.strip() and not line.startswith("#")), "").replace(" ", "")
        units = {"time_s,speed_km_h": KM_H, "time_s,speed_m_s": 1.0}
        if header not in units:
            raise ParameterError(f"{path}: the header is {header!r}; it must be one of {', '.join(units)}")
        return cls(path.stem, _rows(lines, str(path), units[header]), str(path))

    @classmethod
    def from_distance(
        cls, name: str, distances: ArrayLike, speeds: ArrayLike, stops: Sequence[float] = (), source: str = ""
    ) -> Self:
        """Speeds [m/s] at distances [m], between which the acceleration is constant: dt = 2 ds/(v_1 + v_2).

        ``stops`` are the times [s] that the vehicle waits where the speed is zero, in order (none: it drives on at once).
        Errors: ParameterError where two neighbouring speeds are zero, since no time passes any distance then.
        """
        s, v = np.asarray(distances, float), np.asarray(speeds, float)
        if s.shape != v.shape or s.ndim != 1:
            raise ParameterError(f"drive cycle {name}: {s.size} distances and {v.size} speeds do not go together")
        halts = np.flatnonzero(v == 0)
        if stops and len(stops) != len(halts):
            raise ParameterError(
                f"drive cycle {name}: {len(stops)} stops are given, but the speed is zero at {len(halts)} rows"
            )
        for i in range(len(s) - 1):
            if not s[i + 1] > s[i] or v[i] + v[i + 1] <= 0:
                raise ParameterError(
                    f"drive cycle {name}: from {s[i]:g} m at {v[i]:g} m/s to {s[i + 1]:g} m at {v[i + 1]:g} m/s cannot be driven forward"
                )
        waits = dict(zip(halts.tolist(), stops, strict=False))
        rows, t = [], 0.0
        for i, speed in enumerate(v.tolist()):
            if i:
                t += 2 * float(s[i] - s[i - 1]) / float(v[i] + v[i - 1])
            rows.append((t, speed))
            if waits.get(i, 0) > 0:
                t += waits[i]
                rows.append((t, speed))
        return cls(name, tuple(rows), source)

    @property
    def times(self) -> NDArray[np.float64]:
        """Times [s]."""
        return np.array([row[0] for row in self.table])

    @property
    def speeds(self) -> NDArray[np.float64]:
        """Speeds [m/s]."""
        return np.array([row[1] for row in self.table])

    @property
    def duration(self) -> float:
        """From the first to the last row [s]."""
        return self.table[-1][0] - self.table[0][0]

    @property
    def distance(self) -> float:
        """Length [m]: the area under the straight lines."""
        return float(np.trapezoid(self.speeds, self.times))

    @property
    def top_speed(self) -> float:
        """Highest speed [m/s]."""
        return max(row[1] for row in self.table)

    def part(self, start: float, stop: float) -> DriveCycle:
        """What lies between two times [s], which start at zero again."""
        inside = [row for row in self.table if start < row[0] < stop]
        ends = np.interp([start, stop], self.times, self.speeds).tolist()
        rows = [(start, ends[0]), *inside, (stop, ends[1])]
        return DriveCycle(f"{self.name} {start:g}-{stop:g} s", tuple((t - start, v) for t, v in rows), self.source)


def _rows(lines: Sequence[str], said: str, unit: float) -> tuple[tuple[float, float], ...]:
    found, header = [], True
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.startswith("#"):
            continue
        if header:
            header = False
            continue
        try:
            t, v = (float(text) for text in next(csv.reader([line])))
        except ValueError:
            raise ParameterError(f"{said}, line {number}: {line!r} is not a time and a speed") from None
        found.append((t, v * unit))
    return tuple(found)
