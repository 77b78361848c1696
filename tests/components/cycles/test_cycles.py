from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

import powertrain as pt
from powertrain.components.cycles import CYCLES, CycleSpeed, DriveCycle
from powertrain.language import texttable

# Duration in s, distance in km and top speed in km/h as the regulations state them.
STATED = {
    "hwfet": (765, 16.51, 96.4),
    "ftp-stabilized": (864, 6.21, 55.2),
    "ftp-transient": (505, 5.78, 91.3),
    "sc03": (600, 5.76, 88.2),
    "us06": (600, 12.89, 129.2),
    "jc08": (1204, 8.16, 81.6),
    "nedc": (1180, 11.01, 120.0),
    "udds": (1369, 11.99, 91.3),
    "wltc": (1800, 23.27, 131.3),
    "wmtc": (1800, 28.91, 125.3),
    "wmtc-1": (600, 4.07, 60.0),
    "wmtc-2": (600, 9.11, 94.9),
    "wmtc-3": (600, 15.74, 125.3),
}


@pytest.mark.parametrize("name", CYCLES)
def test_legislated_cycles(name: str) -> None:
    cycle = DriveCycle.named(name)
    duration, distance, top = STATED[name]
    assert cycle.duration == duration
    assert round(cycle.distance / 1e3, 2) == distance
    assert round(cycle.top_speed * 3.6, 1) == top
    assert cycle.speeds[0] == cycle.speeds[-1] == 0


# UN Regulation No. 83, Annex 4a, Tables A4a/1 and 2: the time [s] at which an operation ends, and the speed [km/h] then.
URBAN = "11 0 15 15 23 15 25 10 28 0 49 0 54 15 56 15 61 32 85 32 93 10 96 0 117 0 122 15 124 15 133 35 135 35 143 50 155 50 163 35 176 35"
URBAN_END = "178 32 185 10 188 0 195 0"
EXTRA = "20 0 25 15 27 15 36 35 38 35 46 50 48 50 61 70 111 70 119 50 188 50 201 70 251 70"
EXTRA_END = "286 100 316 100 336 120 346 120 362 80 370 50 380 0 400 0"


def test_operations_of_the_nedc() -> None:
    """Four urban cycles of 195 s, each beginning with 11 s at idle, and the extra-urban cycle."""
    cycle = DriveCycle.named("nedc")
    urban = np.array(f"{URBAN} {URBAN_END}".split(), float).reshape(-1, 2)
    extra = np.array(f"{EXTRA} {EXTRA_END}".split(), float).reshape(-1, 2)
    parts = [*(urban + np.array([195 * k, 0]) for k in range(4)), extra + np.array([780, 0])]
    for t, v in np.vstack(parts):
        assert cycle.speeds[cycle.times == t] * 3.6 == pytest.approx(v, abs=0.01), t
    corners = np.vstack([[0, 0], *parts])
    np.testing.assert_allclose(cycle.speeds * 3.6, np.interp(cycle.times, *corners.T), atol=0.6)


def test_checksum_of_the_wltc() -> None:
    assert round(float(DriveCycle.named("wltc").speeds.sum()) * 3.6, 1) == 83758.6


def test_distances_of_the_wmtc() -> None:
    """The lengths of the three parts [m] in UN GTR No. 2."""
    assert [int(DriveCycle.named(f"wmtc-{k}").distance) for k in (1, 2, 3)] == [4065, 9111, 15736]


def test_published_figures_of_jc08() -> None:
    """Mean speed and share of standstill; the distance is 8.17 km, and 8.16 km with speeds of one decimal, a tenth rounded down."""
    cycle = DriveCycle.named("jc08")
    assert round(cycle.distance / cycle.duration * 3.6, 1) == 24.4
    assert round(100 * float((cycle.speeds == 0).mean()), 1) == 29.7
    moving = float((cycle.speeds > 0).sum())
    assert 0 < 8171 - cycle.distance < 0.1 / 3.6 * moving


def test_cycle_with_grades_is_a_road_of_the_same_heights(tmp_path: Path) -> None:
    path = tmp_path / "hill.csv"
    path.write_text(
        "distance_m,speed_km_h,grade_percent,stop_s\n0,0,0,4\n100,36,5,0\n300,36,5,0\n400,0,-2,6\n", encoding="utf-8"
    )
    cycle = DriveCycle.from_csv(path)
    assert cycle.times.tolist() == pytest.approx([0, 4, 24, 44, 64, 70])
    assert cycle.grades == pytest.approx([0, 0, 0.05, 0.05, -0.02, -0.02])
    places = np.linspace(0, 400, 401)
    slope = np.asarray(cycle.slope()(places))
    np.testing.assert_allclose(slope, np.interp(places, [0, 100, 300, 400], [0, 0.05, 0.05, -0.02]), atol=1e-12)
    half = cycle.part(14, 34)
    # from rest with constant acceleration a quarter of the 100 m is behind it after half the 20 s
    assert half.grades == pytest.approx([0.0125, 0.05, 0.05])
    np.testing.assert_allclose(half.slope()(places[:176]), slope[25:201], atol=1e-12)


HEIGHTS = (0, 210), (5, 210), (20, 213), (60, 240), (90, 228), (110, 225), (115, 225)
"""Of a drive at 14 m/s between 20 s and 90 s that starts at 5 s and stops at 110 s: time [s], height [m]."""


def test_heights_of_a_recorded_drive_are_its_road(tmp_path: Path) -> None:
    """The integral of the sine of the slope over the way is the height at every row, also of a part, whose ends are interpolated."""
    rows = [f"{t},{14 if 20 <= t <= 90 else 0},{z / 0.3048}" for t, z in HEIGHTS]
    (tmp_path / "drive.csv").write_text("Time [s],GPS speed [m/s],Altitude [ft]\n" + "\n".join(rows), encoding="utf-8")
    drive = DriveCycle.from_csv(tmp_path / "drive.csv")
    for cycle in drive, drive.part(12.5, 100), drive.part(0, 4):
        fine = np.linspace(0, cycle.distance, 200_001)
        slope = np.broadcast_to(np.asarray(cycle.slope()(fine)), fine.shape)
        climbed = cumulative_trapezoid(slope / np.sqrt(1 + slope**2), fine, initial=0)
        way = cumulative_trapezoid(cycle.speeds, cycle.times, initial=0)
        np.testing.assert_allclose(np.interp(way, fine, climbed), np.array(cycle.heights) - cycle.heights[0], atol=1e-6)
    # from rest with constant acceleration a quarter of the 105 m is behind it after half the 15 s
    assert drive.part(12.5, 100).heights == pytest.approx([210.75, 213, 240, 228, 228 - 3 * 0.75])


def test_heights_over_distance() -> None:
    cycle = DriveCycle.from_distance("lap", [0, 50, 200], [0, 10, 0], stops=[3, 5], heights=[7, 9, 8])
    assert list(cycle.heights) == [7, 7, 9, 8, 8]
    with pytest.raises(pt.ParameterError, match="2 heights for 3 distances; each distance needs one"):
        DriveCycle.from_distance("lap", [0, 50, 200], [0, 10, 0], heights=[7, 9])


def test_grades_in_percent_are_not_taken_for_fractions(tmp_path: Path) -> None:
    path = tmp_path / "hill.csv"
    path.write_text("time_s,speed_km_h,grade\n0,0,0\n20,30,-6\n", encoding="utf-8")
    with pytest.raises(pt.ParameterError, match=r"grade of row 2 is -6, -600%.*100%.*grade_percent"):
        DriveCycle.from_csv(path)
    path.write_text("time_s,speed_km_h,grade_percent\n0,0,100\n20,30,-100\n", encoding="utf-8")
    assert DriveCycle.from_csv(path).grades == (1, -1)


def test_grades_that_change_at_a_halt() -> None:
    """Up to the halt at 50 m the road rises to the first grade, a metre behind it begins the last; at both ends the driven one counts."""
    table = (
        (0.0, 0.0),
        (4.0, 0.0),
        (14.0, 10.0),
        (24.0, 0.0),
        (30.0, 0.0),
        (34.0, 0.0),
        (44.0, 10.0),
        (50.0, 0.0),
        (60.0, 0.0),
    )
    slope = DriveCycle("halt", table, "", (0.9, 0.0, 0.05, 0.1, 0.5, 0.2, 0.3, 0.4, -0.9)).slope()
    given = {0: 0.0, 25: 0.025, 50: 0.05, 75: 0.075, 100: 0.1, 101: 0.202, 125: 0.25, 150: 0.3, 180: 0.4}
    assert [slope(float(s)) for s in given] == pytest.approx(list(given.values()))


def test_distance_cycle_has_constant_acceleration_between_rows() -> None:
    cycle = DriveCycle.from_distance("lap", [0, 50, 150, 200], [0, 10, 10, 0], stops=[3, 5])
    assert cycle.distance == pytest.approx(200, rel=1e-14)
    assert cycle.times == pytest.approx([0, 3, 13, 23, 33, 38])
    with pytest.raises(pt.ParameterError, match=r"from 0 m at 0 m/s to 10 m at 0 m/s cannot be driven"):
        DriveCycle.from_distance("lap", [0, 10], [0, 0])
    with pytest.raises(pt.ParameterError, match=r"1 stops are given, but the speed is zero at 2 rows"):
        DriveCycle.from_distance("lap", [0, 50, 200], [0, 10, 0], stops=[1])
    with pytest.raises(pt.ParameterError, match=r"a stop of -3 s; the time must be finite and not negative"):
        DriveCycle.from_distance("lap", [0, 50, 200], [0, 10, 0], stops=[-3, 1])
    for grades in ([0, 0.1], [0, 0.1, 0, 0]):
        with pytest.raises(pt.ParameterError, match=rf"{len(grades)} grades for 3 distances"):
            DriveCycle.from_distance("lap", [0, 50, 200], [5, 5, 5], grades=grades)


def test_grades_and_stops_may_be_arrays() -> None:
    rows = ((0.0, 0.0), (10.0, 5.0))
    assert DriveCycle("hill", rows, grades=np.array([0.0, 0.1])) == DriveCycle("hill", rows, grades=(0.0, 0.1))  # type: ignore[arg-type]
    slopes, waits = np.array([0.0, 0.1, 0.0]), np.array([2.0, 3.0])
    lap = DriveCycle.from_distance("lap", [0, 50, 100], [0, 10, 0], waits, grades=slopes)  # type: ignore[arg-type]
    assert lap == DriveCycle.from_distance("lap", [0, 50, 100], [0, 10, 0], [2.0, 3.0], grades=[0.0, 0.1, 0.0])
    for wrong in 0.05, ("a", "b"), None:
        with pytest.raises(pt.ParameterError, match=r"drive cycle hill: grades = .* is not a row of numbers"):
            DriveCycle("hill", rows, grades=wrong)  # type: ignore[arg-type]


def test_files(tmp_path: Path) -> None:
    file = tmp_path / "town.csv"
    file.write_text("# a town\ntime_s,speed_km_h\n0,0\n10,36\n20,0\n", encoding="utf-8")
    town = DriveCycle.from_csv(file)
    assert town.name == "town"
    assert town.distance == pytest.approx(100)
    for text, said in {
        "t,v\n0,0\n": "'t': a time needs a unit; write time_s or time [s]",
        "time_s,speed_knots\n0,0\n": "the unit 'knots' of a speed is not known; write speed_km_h",
        "time_s,speed_m_s,slopes\n0,0,0\n": "unknown column 'slopes'; columns are time_s",
        "time_s,speed_m_s,height\n0,0,0\n": "'height': a height needs a unit; write height_m",
        "time_s,speed_m_s,height_m,grade\n0,0,5,0\n1,9,5,0\n": "it has grades and heights of the road; give one",
        "time_s,speed_m_s,height_m\n0,0,5\n1,9,5\n2,9,nan\n": "the height of row 3 is not finite",
        "time_s,speed_m_s,height_m\n0,2,5\n1,2,8\n": "changes by 3 m from 0 m to 2 m of the way; .* smooth them first",
        "speed_m_s\n0\n": "gives neither of time .* and distance .*; it must give one",
        "time_s,grade\n0,0\n": "gives no column of speed",
        "time_s,speed_m_s,stop_s\n0,0,0\n": "a cycle over time has no column for stops",
        "time_s,speed_m_s\n0,0\n1,fast\n": "town.csv:3: speed_m_s: 'fast' is not a number",
        "time_s,speed_m_s\n0,0\n1,\n": "town.csv:3: speed_m_s: the cell is empty",
        "time_s,speed_m_s\n0,0\n1,1\n1,2\n": "row 3 is at 1 s, after 1 s",
        "time_s,speed_m_s\n0,0\n1,-1\n": "row 2 has -1 m/s",
        "time_s,speed_m_s\n-20,0\n1,1\n": "row 1 is at -20 s; times must not be negative.*: add 20 s",
        "time_s,speed_m_s,speed_m_s\n0,0,5\n1,1,5\n": "both 'speed_m_s' and 'speed_m_s' give the speed",
        "distance_m,speed_m_s,stop_s\n0,0,0\n9,5,3\n": "row 2 has a stop_s of 3 s at 5 m/s",
        "time_s,speed_m_s\n0,0\n1,nan\n": "both must be finite",
        "time_s,speed_m_s\n0,0\n": "1 rows are too few",
    }.items():
        file.write_text(text, encoding="utf-8")
        with pytest.raises(pt.ParameterError, match=said.replace("(", r"\(").replace("[", r"\[")):
            DriveCycle.from_csv(file)
    times_and_speeds: Any = np.array([0.0, 10, 20]), np.array([0.0, 10, 0])
    with pytest.raises(pt.ParameterError, match=r"the table needs rows \(time in s, speed in m/s\)"):
        DriveCycle("two arrays", times_and_speeds)
    assert DriveCycle("one array", np.array([[0.0, 0], [10, 10], [20, 0]])).distance == pytest.approx(100)  # type: ignore[arg-type]
    with pytest.raises(
        pt.ParameterError,
        match="unknown drive cycle 'ftp'; choose from ftp-stabilized, ftp-transient, hwfet, jc08, nedc, sc03, udds, us06, wltc, wmtc, ",
    ):
        DriveCycle.named("ftp")
    assert DriveCycle.named("WLTC") == DriveCycle.named("wltc")


@pytest.mark.parametrize(
    ("header", "top"),
    [
        ("time [s],speed [km/h]", 1 / 3.6),
        ("Time (s),Vehicle speed (km/h)", 1 / 3.6),
        ("time_s,speed_kmh", 1 / 3.6),
        ("time_s,speed_mph", 0.44704),
        ("Time (s),Speed (mph)", 0.44704),
        ("t [min],v [m/s]", 1.0),
        ("cycSecs,cycMps", 1.0),
        ("time_seconds,speed_meters_per_second", 1.0),
    ],
)
def test_headings_that_people_have(tmp_path: Path, header: str, top: float) -> None:
    file = tmp_path / "lap.csv"
    file.write_text(f"{header}\n0,0\n10,30\n20,0\n", encoding="utf-8")
    cycle = DriveCycle.from_csv(file)
    assert cycle.top_speed == pytest.approx(30 * top, rel=1e-12)
    assert cycle.duration == 20 * (60 if "min" in header else 1)


def test_a_cycle_of_fastsim_and_one_with_decimal_commas(tmp_path: Path) -> None:
    file = tmp_path / "lap.csv"
    file.write_text("cycSecs,cycMps,cycGrade,cycRoadType\n0,0,0.01,0\n10,30,0.02,0\n", encoding="utf-8")
    assert DriveCycle.from_csv(file).grades == (0.01, 0.02)
    file.write_text("time_s;speed_km_h;grade_percent\n0;0;1,5\n10;28,8;-3\n", encoding="utf-8")
    cycle = DriveCycle.from_csv(file)
    assert cycle.top_speed == pytest.approx(8)
    assert cycle.grades == pytest.approx((0.015, -0.03))


def test_part_starts_at_zero() -> None:
    part = DriveCycle.named("wltc").part(11.5, 20)
    assert part.times[0] == 0
    assert part.duration == 8.5
    whole = DriveCycle.named("wltc")
    assert np.interp(3.0, part.times, part.speeds) == pytest.approx(np.interp(14.5, whole.times, whole.speeds))


@pytest.mark.parametrize(("start", "stop"), [(0, 900), (-10, 5), (5, 3), (5, 5)])
def test_a_part_lies_within_its_cycle(start: float, stop: float) -> None:
    with pytest.raises(
        pt.ParameterError, match=rf"hwfet has no part from {start} s to {stop} s; it goes from 0 s to 765 s"
    ):
        DriveCycle.named("hwfet").part(start, stop)


def test_times_of_a_part_as_texts() -> None:
    cycle = DriveCycle.named("hwfet")
    assert cycle.part(60, "2 min") == cycle.part(60, 120)
    with pytest.raises(pt.ParameterError, match="hwfet: part: start = 'a' is not a number"):
        cycle.part("a", 3)
    with pytest.raises(pt.ParameterError, match="hwfet: part: stop = '3' is a text without a unit; write 3"):
        cycle.part(0, "3")


def test_signal_shows_the_cycle_and_what_comes() -> None:
    ramp = DriveCycle("ramp", ((0, 0), (10, 0), (20, 20), (30, 20)))
    result = pt.simulate(CycleSpeed(cycle=ramp, preview=2.0), stop=30, times=np.linspace(0, 30, 301))
    t = result.time
    assert result["v_ref"] == pytest.approx(np.interp(t, ramp.times, ramp.speeds), abs=1e-12)
    later = np.interp(t + 2, ramp.times, ramp.speeds)
    assert result["a_ref"] == pytest.approx((later - result["v_ref"]) / 2, abs=1e-12)
    with pytest.raises(pt.ParameterError, match=r"preview of 0 s"):
        pt.compile(CycleSpeed(preview=0.0))
    assert math.isclose(ramp.distance, 300)


def test_files_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    (tmp_path / "latin.csv").write_bytes("# Öl\ntime_s,speed_km_h\n0,0\n".encode("latin-1"))
    with pytest.raises(pt.ParameterError, match=r"latin\.csv: byte 2 is not text in UTF-8"):
        DriveCycle.from_csv(tmp_path / "latin.csv")
    with pytest.raises(pt.ParameterError, match=r"none\.csv: cannot be read: No such file"):
        DriveCycle.from_csv(tmp_path / "none.csv")


def test_a_cycle_by_itself_its_name_or_its_file(tmp_path: Path) -> None:
    file = tmp_path / "lap.csv"
    file.write_text("time_s,speed_mph\n0,0\n10,30\n", encoding="utf-8")
    wltc = DriveCycle.named("wltc")
    assert DriveCycle.of(wltc) is wltc
    assert DriveCycle.of("WLTC") == wltc
    assert DriveCycle.of(file) == DriveCycle.of(str(file)) == DriveCycle.from_csv(file)


def test_long_tables_are_read_in_linear_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The width of a table is found once, not again for each of its rows: 20,000 of them took minutes."""
    calls: list[int] = []
    width = texttable._width

    def counted(rows: list[texttable.Row]) -> int:
        calls.append(len(rows))
        return width(rows)

    monkeypatch.setattr(texttable, "_width", counted)
    file = tmp_path / "logger.csv"
    file.write_text("time_s,speed_m_s\n" + "".join(f"{t},{t % 7}\n" for t in range(200)), encoding="utf-8")
    assert DriveCycle.from_csv(file).duration == 199
    assert calls == [201]


def test_the_whole_of_a_cycle_is_itself() -> None:
    """A part that was written to a file and read again was called 'wltc 0-20 s 0-20 s'."""
    part = DriveCycle.named("wltc").part(0, 20)
    assert part.part(0, 20) is part
