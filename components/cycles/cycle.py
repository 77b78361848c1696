"""Drive cycles as data: the speed that a vehicle has to follow."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import as_file, files
from os import PathLike
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain import Map, ParameterError, arguments_checked, parameter
from powertrain.components.body.path import STEEPEST, RoadProfile
from powertrain.components.cycles.cyclefiles import one_of, read_columns

CYCLES = {
    "ftp-stabilized": "FTP-75, bags 2 and 4: the last 864 s of the UDDS, 40 CFR 86 App. I",
    "ftp-transient": "FTP-75, bags 1 (cold) and 3 (hot): the first 505 s of the UDDS, 40 CFR 86 App. I",
    "hwfet": "EPA Highway Fuel Economy Test, 40 CFR 600 App. I",
    "jc08": "JC08, Japan, Announcement on Details of Safety Regulations for Road Vehicles, attachment 42",
    "nedc": "New European Driving Cycle, UN Regulation No. 83 (4 x ECE-15 + EUDC)",
    "sc03": "EPA SC03 Supplemental FTP with air conditioning, 40 CFR 86 App. I (h)",
    "udds": "EPA Urban Dynamometer Driving Schedule (FTP-72), 40 CFR 86 App. I",
    "us06": "EPA US06 Supplemental FTP, aggressive driving, 40 CFR 86 App. I (g)",
    "wltc": "WLTC class 3b, UN Global Technical Regulation No. 15",
    "wmtc": "WMTC for motorcycles, parts 1 to 3, UN Global Technical Regulation No. 2",
    "wmtc-1": "WMTC, part 1: in town",
    "wmtc-2": "WMTC, part 2: on country roads",
    "wmtc-3": "WMTC, part 3: on motorways",
}
"""The cycles in the library, and the regulations that define them."""
PHASES = {
    "ftp-transient": ("udds", 0.0, 505.0),
    "ftp-stabilized": ("udds", 505.0, 1369.0),
    "wmtc-1": ("wmtc", 0.0, 600.0),
    "wmtc-2": ("wmtc", 600.0, 1200.0),
    "wmtc-3": ("wmtc", 1200.0, 1800.0),
}
"""Cycles that are a part of another one: its name, start and end [s]."""
CHANGE = 1.0
"""Distance [m] after a halt over which the slope of the road changes, if the cycle changes its grade during the halt."""
TIME = parameter("s", "time in the cycle")
"""Start and end of a part of a cycle."""


@dataclass(frozen=True)
class DriveCycle:
    """Speed over time: rows (time in s, speed in m/s) with linear interpolation; times increase; neither may be negative.

    ``named`` returns a legislated cycle, ``from_csv`` reads a file, ``from_distance`` takes speeds over distance. ``grades`` (optional)
    are the slopes tan(alpha) of the road at the rows, or ``heights`` its heights [m]; ``slope()`` is that road.
    Errors: ParameterError for invalid rows.

    >>> wltc = DriveCycle.named("wltc")
    >>> round(wltc.duration), round(wltc.distance / 1e3, 2), round(wltc.top_speed * 3.6, 1)
    (1800, 23.27, 131.3)
    """

    name: str
    table: tuple[tuple[float, float], ...]
    source: str = ""
    grades: tuple[float, ...] = ()
    heights: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Raise ParameterError with the invalid row."""
        try:
            rows: NDArray[np.float64] = np.asarray(self.table, float)
        except (TypeError, ValueError):
            rows = np.zeros(0)
        if rows.ndim != 2 or rows.shape[1] != 2:
            raise ParameterError(f"drive cycle {self.name}: the table needs rows (time in s, speed in m/s)")
        object.__setattr__(self, "table", tuple(map(tuple, rows.tolist())))
        if len(self.table) < 2:
            raise ParameterError(
                f"drive cycle {self.name}: {len(self.table)} rows are too few; at least two are needed"
            )
        before = -math.inf
        for row, (t, v) in enumerate(self.table, 1):
            if not (math.isfinite(t) and math.isfinite(v)):
                raise ParameterError(f"drive cycle {self.name}: row {row} is ({t:g} s, {v:g} m/s); both must be finite")
            if t < 0:
                raise ParameterError(
                    f"drive cycle {self.name}: row {row} is at {t:g} s; times must not be negative, because controls count from 0 s: "
                    f"add {-t:g} s to all of them"
                )
            if t <= before:
                raise ParameterError(
                    f"drive cycle {self.name}: row {row} is at {t:g} s, after {before:g} s; times must increase"
                )
            if v < 0:
                raise ParameterError(f"drive cycle {self.name}: row {row} has {v:g} m/s; speeds must not be negative")
            before = t
        for one in ("grade", "height"):
            self._check_road(f"{one}s", one)
        if self.grades and self.heights:
            raise ParameterError(f"drive cycle {self.name}: it has grades and heights of the road; give one of them")
        self._check_grades()
        self._check_heights()

    def _check_road(self, name: str, one: str) -> None:
        given = getattr(self, name)
        try:
            numbers = tuple(float(number) for number in given)
        except (TypeError, ValueError):
            raise ParameterError(f"drive cycle {self.name}: {name} = {given!r} is not a row of numbers") from None
        if numbers and len(numbers) != len(self.table):
            raise ParameterError(
                f"drive cycle {self.name}: {len(numbers)} {name} for {len(self.table)} rows; each row needs one"
            )
        if bad := [row for row, number in enumerate(numbers, 1) if not math.isfinite(number)]:
            raise ParameterError(f"drive cycle {self.name}: the {one} of row {bad[0]} is not finite")
        object.__setattr__(self, name, numbers)

    def _check_grades(self) -> None:
        if steep := [row for row, grade in enumerate(self.grades, 1) if abs(grade) > STEEPEST]:
            grade = self.grades[steep[0] - 1]
            raise ParameterError(
                f"drive cycle {self.name}: the grade of row {steep[0]} is {grade:g}, {grade:.0%}; no road is steeper than {STEEPEST:.0%}. "
                "Grades are the tangent of the slope, 0.06 for 6 %; the column of a file in percent is grade_percent"
            )

    def _check_heights(self) -> None:
        if not self.heights:
            return
        places, heights = self._points()
        steps, rises = np.diff(places), np.diff(heights)
        if (steep := np.abs(rises) > math.sin(math.atan(STEEPEST)) * steps).any():
            k = int(np.argmax(steep))
            raise ParameterError(
                f"drive cycle {self.name}: the height changes by {rises[k]:.3g} m from {places[k]:.4g} m to {places[k + 1]:.4g} m of the "
                f"way; no road is steeper than {STEEPEST:.0%}. Heights from a satellite receiver scatter: smooth them first"
            )

    def __repr__(self) -> str:
        return f"DriveCycle({self._about})"

    def _repr_html_(self) -> str:
        speeds = Map.curve(self.times, self.speeds * 3.6, x="t", x_unit="s", unit="km/h", name="speed")
        return f"<p><b>DriveCycle</b> {self._about}</p>{speeds._curve()}"

    @property
    def _about(self) -> str:
        return (
            f"{self.name}: {self.duration:.0f} s, {self.distance / 1e3:.2f} km, up to {self.top_speed * 3.6:.1f} km/h"
        )

    @classmethod
    @arguments_checked
    def named(cls, name: str) -> Self:
        """One of ``CYCLES``; case does not matter. Errors: ParameterError for another name."""
        if name.lower() not in CYCLES:
            raise ParameterError(f"unknown drive cycle {name!r}; choose from {', '.join(CYCLES)}, or give a CSV file")
        name = name.lower()
        if name in PHASES:
            whole, start, stop = PHASES[name]
            return cls(name, cls.named(whole).part(start, stop).table, CYCLES[name])
        with as_file(files("powertrain.components").joinpath("cycles", "data", f"{name}.csv")) as path:
            columns = read_columns(path)
        return cls(name, tuple(zip(columns["time"], columns["speed"], strict=True)), CYCLES[name])

    @classmethod
    @arguments_checked
    def of(cls, cycle: DriveCycle | str | PathLike[str]) -> DriveCycle:
        """A cycle from itself, from a name in ``CYCLES``, or from the path of a CSV file."""
        if not isinstance(cycle, (str, PathLike)):
            return cycle
        return cls.from_csv(Path(cycle)) if Path(cycle).suffix.lower() == ".csv" else cls.named(str(cycle))

    @classmethod
    @arguments_checked
    def from_csv(cls, path: str | Path) -> Self:
        """Read a file with a header, over time or over distance; lines with # are comments.

        Its columns are ``time_s`` or ``distance_m``; ``speed_km_h``, ``speed_m_s`` or ``speed_mph``; and optionally ``grade`` (tan of the
        slope), ``grade_percent`` or ``height_m``, and ``stop_s``, the time that a cycle over distance waits at a row. Units may stand in
        brackets, ``speed [km/h]``, and columns be separated as in ``pt.TextTable``. The headings of FASTSim's cycles are known, too.

        Errors: ParameterError for a file that cannot be read, for other columns, and for an entry that is not a number, with its line.
        """
        path = Path(path)
        columns = read_columns(path)
        at, speeds = one_of(columns, ("time", "distance"), path), columns[one_of(columns, ("speed",), path)]
        road = {"grades": tuple(columns.get("grade", ())), "heights": tuple(columns.get("height", ()))}
        waits = columns.get("stop", ())
        if at == "time":
            if waits:
                raise ParameterError(f"{path}: a cycle over time has no column for stops; give them as rows at 0 m/s")
            return cls(path.stem, tuple(zip(columns[at], speeds, strict=True)), str(path), **road)
        for row, (t, v) in enumerate(zip(waits, speeds, strict=False), 1):
            if t != 0 and v != 0:
                raise ParameterError(
                    f"{path}: row {row} has a stop_s of {t:g} s at {v:g} m/s; a vehicle waits at 0 m/s"
                )
        stops = [t for t, v in zip(waits, speeds, strict=False) if v == 0]
        return cls.from_distance(path.stem, columns[at], speeds, stops, str(path), **road)

    @classmethod
    @arguments_checked
    def from_distance(
        cls,
        name: str,
        distances: ArrayLike,
        speeds: ArrayLike,
        stops: Sequence[float] = (),
        source: str = "",
        grades: Sequence[float] = (),
        heights: Sequence[float] = (),
    ) -> Self:
        """A cycle over distance; between two places the acceleration is constant: dt = 2 ds/(v_1 + v_2).

        Parameters
        ----------
        name : str
            Name of the cycle.
        distances : array_like
            Places [m].
        speeds : array_like
            Speeds there [m/s].
        stops : sequence of float
            Waiting times [s] where the speed is zero, in order (none: it drives on at once).
        source : str
            Source of the data.
        grades : sequence of float
            Slopes there, tan(alpha) [1]; level by default.
        heights : sequence of float
            Heights there [m], instead of grades. The slope changes gradually at each place and is steeper between two, see ``slope``.

        Raises
        ------
        ParameterError
            If two neighbouring speeds are zero, because no distance would be covered; for a negative stop, and if the number of stops,
            grades or heights does not match the rows.
        """
        s, v = np.asarray(distances, float), np.asarray(speeds, float)
        if s.shape != v.shape or s.ndim != 1:
            raise ParameterError(f"drive cycle {name}: {s.size} distances but {v.size} speeds")
        halts, stops = np.flatnonzero(v == 0), tuple(stops)
        road = {"grades": tuple(grades), "heights": tuple(heights)}
        if stops and len(stops) != len(halts):
            raise ParameterError(
                f"drive cycle {name}: {len(stops)} stops are given, but the speed is zero at {len(halts)} rows"
            )
        for t in stops:
            if not (math.isfinite(t) and t >= 0):
                raise ParameterError(f"drive cycle {name}: a stop of {t:g} s; the time must be finite and not negative")
        for what, given in road.items():
            if given and len(given) != len(s):
                raise ParameterError(
                    f"drive cycle {name}: {len(given)} {what} for {len(s)} distances; each distance needs one"
                )
        for i in range(len(s) - 1):
            if not s[i + 1] > s[i] or v[i] + v[i + 1] <= 0:
                raise ParameterError(
                    f"drive cycle {name}: from {s[i]:g} m at {v[i]:g} m/s to {s[i + 1]:g} m at {v[i + 1]:g} m/s cannot be driven forward"
                )
        waits = dict(zip(halts.tolist(), stops, strict=False))
        rows, places, t = [], list[int](), 0.0
        for i, speed in enumerate(v.tolist()):
            if i:
                t += 2 * float(s[i] - s[i - 1]) / float(v[i] + v[i - 1])
            rows.append((t, speed))
            if waits.get(i, 0) > 0:
                t += waits[i]
                rows.append((t, speed))
            places += [i] * (len(rows) - len(places))
        at_rows = {what: tuple(given[i] for i in places) for what, given in road.items() if given}
        return cls(name, tuple(rows), source, **at_rows)

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
        """Length [m]: the integral of the speed."""
        return float(np.trapezoid(self.speeds, self.times))

    @property
    def top_speed(self) -> float:
        """Highest speed [m/s]."""
        return max(row[1] for row in self.table)

    def slope(self) -> Map:
        """The slope tan(alpha) of the road over the distance [m]; level if the cycle has neither grades nor heights.

        Grades are linear between rows. If the grade changes while the vehicle stands, the road has the first grade up to that place, and
        the last one from 1 m after it on. Heights become a road by ``RoadProfile.from_heights``; of those at the same place the first
        counts.
        """
        if self.heights and self.distance > 0:
            return RoadProfile.from_heights(*self._points()).profile
        places = self.places
        moved = np.diff(places) > 0
        if not self.grades or not moved.any():
            return Map.constant(self.grades[0] if self.grades else 0.0, x="s", x_unit="m", name="grade")
        grades, first, last = np.array(self.grades), np.append(True, moved), np.append(moved, True)
        points = _road(places[first], grades[first], grades[last])
        return Map.curve(points[:, 0], points[:, 1], x="s", x_unit="m", name="grade", outside="clip")

    @property
    def has_road(self) -> bool:
        """Whether it has grades or heights, so that its road replaces that of a vehicle."""
        return bool(self.grades or self.heights)

    @property
    def places(self) -> NDArray[np.float64]:
        """Distances [m] from the first row."""
        v = self.speeds
        return np.concatenate([[0.0], np.cumsum((v[1:] + v[:-1]) / 2 * np.diff(self.times))])

    def _points(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Places [m] that differ, and the heights there [m]."""
        moved = np.diff(self.places, prepend=-1.0) > 0
        return self.places[moved], np.array(self.heights)[moved]

    def part(self, start: float | str, stop: float | str) -> DriveCycle:
        """The part between two times [s], starting at zero again. Errors: ParameterError for times outside the cycle."""
        first, last = self.table[0][0], self.table[-1][0]
        begin: float = TIME.check(start, f"drive cycle {self.name}: part: start")
        end: float = TIME.check(stop, f"drive cycle {self.name}: part: stop")
        if not first <= begin < end <= last:
            raise ParameterError(
                f"drive cycle {self.name} has no part from {begin:g} s to {end:g} s; it goes from {first:g} s to {last:g} s"
            )
        if begin == first == 0.0 and end == last:
            return self
        times = np.array([begin, *(t for t, _ in self.table if begin < t < end), end])
        speeds = np.interp(times, self.times, self.speeds)
        row = np.searchsorted(self.times, times, side="right") - 1
        places = self.places[row] + (self.speeds[row] + speeds) / 2 * (times - self.times[row])
        grades = np.interp(times, self.times, self.grades) if self.grades else np.zeros(0)
        if self.grades:
            between = ~np.isin(times, self.times)
            grades[between] = self.slope()(places[between])
        heights = np.interp(places, *self._points()).tolist() if self.heights else ()
        rows = tuple(zip((times - begin).tolist(), speeds.tolist(), strict=True))
        return DriveCycle(f"{self.name} {begin:g}-{end:g} s", rows, self.source, tuple(grades.tolist()), tuple(heights))


def _road(places: NDArray[np.float64], before: NDArray[np.float64], behind: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (place, grade) of a road with a grade before and one after each place; the first has none before, the last none after."""
    before, behind = np.append(behind[0], before[1:]), behind[:-1]
    changes = np.flatnonzero(before[:-1] != behind)
    steps = np.diff(places)[changes]
    lengths = np.minimum(CHANGE, steps / 2)
    grades = behind[changes] + lengths / steps * (before[changes + 1] - behind[changes])
    points = np.vstack([np.column_stack([places, before]), np.column_stack([places[changes] + lengths, grades])])
    return points[np.argsort(points[:, 0])]
