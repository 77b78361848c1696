"""Engine maps from files: one map in many layouts is one engine; what is ambiguous or incomplete is refused by name."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.engines import MappedEngine, read_fuel_map, read_torque_map

RPM, V = math.pi / 30, 1.5e-3
SPEEDS, TORQUES = (900.0, 1500.0, 2600.0, 4200.0), (15.0, 40.0, 85.0, 130.0)
BMEP = 4 * math.pi / V / 1e5
"""One N.m in bar."""


def flow(rpm: float, torque: float) -> float:
    """Fuel flow [g/s]."""
    return (0.05 + 2.1e-4 * torque + 1e-6 * torque**2) * rpm / 300


def specific(rpm: float, torque: float) -> float:
    """In g/kWh."""
    return flow(rpm, torque) * 3.6e6 / (rpm * RPM * torque)


def rows(*columns: Callable[[float, float], object], separator: str = ",") -> str:
    return "".join(separator.join(str(c(n, tau)) for c in columns) + "\n" for n in SPEEDS for tau in TORQUES)


def wide(values: Callable[[float, float], object], corner: str = "", x: float = 1.0, separator: str = ",") -> str:
    lines = [[corner, *(str(tau * x) for tau in TORQUES)]]
    lines += [[str(n), *(str(values(n, tau)) for tau in TORQUES)] for n in SPEEDS]
    return "\n".join(separator.join(line) for line in lines)


def n(rpm: float, _: float) -> float:
    return rpm


def tau(_: float, torque: float) -> float:
    return torque


def air(_: float, torque: float) -> float:
    return 0.9 + torque / 1e3


def comma(text: str) -> str:
    return text.replace(".", ",")


LBF_FT, HP, LB = 1.3558179483314004, 745.6998715822702, 453.59237
ALPHA = "Engine Speed (RPM),Torque (Nm),BMEP (bar),Fuel Flow (g/s),BSFC (g/kW-hr),Lambda\n"
TEXTS: dict[str, tuple[str, dict[str, object]]] = {
    "own": ("# bench 3\nspeed [rpm], torque [N.m], fuel [g/s]\n\n" + rows(n, tau, flow), {}),
    "ALPHA": (ALPHA + rows(n, tau, lambda n, t: t * BMEP, flow, specific, air), {}),
    "reversed": ("fuel [g/s],torque [N.m],speed [rad/s]\n" + rows(flow, tau, lambda n, t: n * RPM), {}),
    "VECTO": (
        "engine speed [1/min],engine torque [Nm],Fuel Consumption [g/h]\n" + rows(n, tau, lambda n, t: 3600 * flow(n, t)),
        {},
    ),
    "BMEP": (
        "RPM,BMEP_bar,Fuel_kg/h\n" + rows(n, lambda n, t: t * BMEP, lambda n, t: 3.6 * flow(n, t)),
        {"displacement": V},
    ),
    "two strokes": (
        "Speed [min-1],PME [kPa],be [g/(kW.h)]\n" + rows(n, lambda n, t: t * 50 * BMEP, specific),
        {"displacement": V, "strokes": 2},
    ),
    "US": (
        "speed_rpm,load (ft-lb),bsfc (lb/hp-hr)\n"
        + rows(n, lambda n, t: t / LBF_FT, lambda n, t: specific(n, t) * HP / LB / 1e3),
        {},
    ),
    "pounds per hour": (
        "EngSpeed_rpm,EngTrq_Nm,FuelFlow (lb/hr)\n" + rows(n, tau, lambda n, t: flow(n, t) * 3600 / LB),
        {},
    ),
    "unit row": (
        "N\tMd\tT_oil\tNOx\tBSFC\n[min⁻¹]\t[Nm]\t[degC]\t[g/kWh]\t[g/kWh]\n"
        + rows(n, tau, lambda n, t: 90, lambda n, t: 3.1, specific, separator="\t"),
        {},
    ),
    "decimal commas": (
        "\ufeffDrehzahl;Drehmoment;Verbrauch;\nU/min;Nm;g/kWh;\n" + comma(rows(n, tau, specific, separator=";")),
        {},
    ),
    "named": (
        "Nmot,M_1 [Nm],M_2 [Nm],be\n" + rows(n, lambda n, t: 0, tau, specific),
        {"speed": "Nmot [rpm]", "load": "m_2", "fuel": "be [g/kWh]"},
    ),
    "power": (
        "speed [rpm], power [kW], fuel [g/s]\n" + rows(n, lambda n, t: n * RPM * t / 1e3, flow),
        {},
    ),
    "wide": (wide(specific), {"speed": "[rpm]", "load": "[Nm]", "fuel": "[g/kWh]"}),
    "wide with corner": (
        wide(flow, "speed [rpm] \\ BMEP [bar]", BMEP, "\t"),
        {"fuel": "fuel [g/s]", "displacement": V},
    ),
    "wide of loads": (
        "torque [Nm] \\ RPM;" + ";".join(map(str, SPEEDS)) + "\n"
        + "\n".join(f"{t};" + ";".join(str(specific(n, t)) for n in SPEEDS) for t in TORQUES),
        {"fuel": "[g/kWh]"},
    ),
}  # fmt: skip


def engine(fuel_map: pt.Map) -> MappedEngine:
    axes = pt.Axis("speed", "rad/s", [0.0, 500.0], "clip"), pt.Axis("throttle", "1", [0.0, 1.0], "clip")
    torque_map = pt.Map(axes, [[-10, 140], [-20, 130]], "N.m", "torque")
    return MappedEngine(torque_map=torque_map, fuel_map=fuel_map, w_limit=500)


def read(tmp_path: Path, text: str, **options: object) -> pt.Map:
    path = tmp_path / "fuel.csv"
    path.write_text(text, encoding="utf-8")
    return read_fuel_map(path, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("layout", TEXTS)
def test_one_map_in_every_layout(tmp_path: Path, layout: str) -> None:
    text, options = TEXTS[layout]
    expected = engine(read(tmp_path, TEXTS["own"][0]))
    found = engine(read(tmp_path, text, **options))
    w, torque = np.array([95.0, 133.7, 222.2, 401.0, 439.0]), np.array([[16.0], [47.1], [99.9], [129.0]])
    np.testing.assert_allclose(found.fuel_flow(w, torque), expected.fuel_flow(w, torque), rtol=1e-9)
    assert float(expected.fuel_flow(2600 * RPM, 85.0)) == pytest.approx(flow(2600, 85) / 1e3, rel=1e-12)


def ragged(full: Callable[[float], float], *columns: Callable[[float, float], object]) -> str:
    """Rows at the torques up to full load, and at full load."""
    points = [(n, t) for n in SPEEDS for t in (*(t for t in TORQUES if t < full(n)), full(n))]
    return "".join(",".join(str(c(*point)) for c in columns) + "\n" for point in points)


@pytest.mark.parametrize("values", ["flow", "specific"])
def test_speeds_with_torques_of_their_own(tmp_path: Path, values: str) -> None:
    """A fuel flow that is linear in torque is reproduced everywhere, also by a grid of powers."""

    def linear(n: float, t: float) -> float:
        rate = (0.05 + 2.1e-4 * t) * n / 300
        return rate if values == "flow" else rate * 3.6e6 / (n * RPM * t)

    unit = {"flow": "g/s", "specific": "g/kWh"}[values]
    text = f"speed [rpm], torque [N.m], fuel [{unit}]\n" + ragged(lambda n: 60 + n / 60, n, tau, linear)
    with pytest.raises(pt.ParameterError, match=r"no value at 900 rpm and torque 8\d.* N.m: .* fill=True continues"):
        read(tmp_path, text)
    torques = np.array([[16.0], [77.0], [129.0]])
    found = engine(read(tmp_path, text, fill=True)).fuel_flow(2600 * RPM, torques)
    np.testing.assert_allclose(found, (0.05 + 2.1e-4 * torques) * 2.6 / 300, rtol=1e-9)
    powers = "".join(f"{n},{p},{linear(n, p * 1e3 / n / RPM)}\n" for n in SPEEDS for p in (2, 5, 14))
    filled = read(tmp_path, f"RPM,Power (kW),Fuel ({unit})\n{powers}", fill=True)
    np.testing.assert_allclose(engine(filled).fuel_flow(2600 * RPM, torques), found, rtol=1e-7)


def test_empty_cells_of_a_wide_table_are_no_points(tmp_path: Path) -> None:
    text = wide(lambda n, t: "" if t == 130 and n == 900 else flow(n, t), "RPM \\ torque [Nm]")
    with pytest.raises(
        pt.ParameterError,
        match=r"no value at 900 rpm and torque 130 N\.m: 1 of 16 points are missing \(4 speeds by 4 values of torque\)",
    ):
        read(tmp_path, text, fuel="[g/s]")
    filled = engine(read(tmp_path, text, fuel="[g/s]", fill=True))
    slope = (flow(900, 85) - flow(900, 40)) / 45
    assert float(filled.fuel_flow(900 * RPM, 130)) == pytest.approx((flow(900, 85) + 45 * slope) / 1e3, rel=1e-9)


def test_no_consumption_per_work_without_work(tmp_path: Path) -> None:
    """Empty cells at zero torque are skipped."""
    head = "speed [rpm], torque [N.m], BSFC [g/kWh]\n"
    zeros = "".join(f"{n},0,{{}}\n" for n in SPEEDS)
    table = read(tmp_path, head + zeros.format("", "NaN", "", "nan") + rows(n, tau, specific))
    assert table.axes[1].points == TORQUES
    for fill in False, True:
        with pytest.raises(
            pt.ParameterError, match=r"fuel.csv:?.* a specific consumption at .*, where there is no power"
        ):
            read(tmp_path, head + zeros.format(999, 999, 999, 999) + rows(n, tau, specific), fill=fill)


def test_indicated_quantities_are_left_out(tmp_path: Path) -> None:
    head = (
        "speed [rpm],indicated torque [Nm],torque [Nm],friction torque [Nm],ISFC indicated fuel [g/kWh],BSFC [g/kWh]\n"
    )
    table = read(
        tmp_path, head + "1000,30,20,10,200,300\n1000,50,40,10,200,250\n2000,35,20,15,171,300\n2000,55,40,15,182,250\n"
    )
    assert table.axes[1].points == (20.0, 40.0)
    assert table.values.tolist() == [[300, 250], [300, 250]]
    indicated = read_fuel_map(tmp_path / "fuel.csv", load="indicated torque", fill=True)  # whoever asks for it gets it
    assert indicated.axes[1].points == (30.0, 35.0, 50.0, 55.0)


LONG = "speed [rpm],torque [N.m],fuel [g/s]\n"


@pytest.mark.parametrize(
    ("text", "options", "said"),
    [
        ("speed,torque,fuel\n0,0,0\n", {}, r"fuel.csv: no column .* the speed \(rpm, .*'speed', 'torque', 'fuel'; .*speed='name \[unit\]'"),
        ("speed [rpm],torque [N.m],NOx [g/h]\n0,0,0\n", {}, r"no column .* the fuel .*'NOx \[g/h\]'; .*pass fuel="),
        ("speed [rpm],turbo speed [rpm],torque [N.m],fuel [g/s]\n0,0,0,0\n", {}, r"'speed \[rpm\]' and 'turbo speed \[rpm\]' may both"),
        ("speed [rpm],indicated torque [Nm],fuel [g/s]\n0,0,0\n", {}, r"no column .* the load .*'indicated torque \[Nm\]'"),
        ("speed [rpm],friction torque [Nm],fuel [g/s]\n0,0,0\n", {}, r"no column .* the load .*'friction torque \[Nm\]'"),
        ("speed [rpm],torque [Nm],CO2 specific consumption [g/kWh]\n0,0,0\n", {}, r"no column .* the fuel .*'CO2 specific"),
        (LONG, {}, "rows of numbers are needed"),
        (LONG + "0,0,0\n", {"load": "BMEP"}, "load = 'BMEP': there is no such column; the columns are 'speed"),
        (LONG + "0,0,0\n", {"load": "torque [bar]"}, r"load = 'torque \[bar\]': the file gives 'torque \[N.m\]'"),
        (LONG + "0,0,0\n", {"load": "speed"}, r"no column is known to give the load \(a torque in N.m.*, or a bmep in bar"),
        ("speed [rpm],bmep [bar],fuel [g/s]\n0,0,0\n", {}, "the load is a mean effective pressure; pass displacement='1.6 l'"),
        ("speed [rpm],bmep [bar],fuel [g/s]\n0,0,0\n", {"displacement": 1.5}, r"displacement = 1.5 m3 is outside its range \(0, 0.1\] m3"),
        ("speed [rpm],power [kW],fuel [g/s]\n0,0,0\n", {}, "fuel.csv:2: the load is a power, which gives no torque at 0 rpm"),
        ("speed [rpm],bmep [bar],fuel [g/s]\n0,0,0\n", {"displacement": "1.5"}, "displacement = '1.5' is a text without a unit"),
        (LONG + "0,0,0\n", {"speed": 3}, "3 is not a column heading; write it as a string"),
        ("1000,10,0.1\n1000,20,0.2\n", {"speed": "[rpm]"}, "fuel.csv:1: the first line must hold headings"),
        (LONG + "0,0,0\n", {"strokes": 3}, "strokes = 3: choose 2 or 4"),
        (LONG + "0,0,many\n", {}, r"fuel.csv:2: fuel \[g/s\]: 'many' is not a number"),
        (LONG + ",0,1\n", {}, r"fuel.csv:2: speed \[rpm\]: the cell is empty"),
        (LONG + "0,0,\n", {}, r"fuel.csv: fuel \[g/s\]: all cells are empty"),
        (LONG + "0,0,1\n0,5,1\n0,5,2\n", {}, "lines 3 and 4 both give a value at 0 rpm and torque 5 N.m"),
        (LONG + "0,0,1\n0,5,1\n0,5,2\n", {"fill": True}, "lines 3 and 4 both give a value at 0 rpm and torque 5 N.m"),
        (LONG + "1000,0,1\n1000.2,5,1\n", {"fill": True}, "1000 rpm and torque 0 N.m is the only point at this speed; .* round"),
        (LONG.replace(",", ";") + "0;0;1,5\n0;5;1.5\n", {}, "'1,5' in line 2 has a comma, '1.5' in line 3 a point"),
        (
            LONG.replace(",", ";") + "800;0;1\n800;5;1\n1.500;0;1\n1.500;5;1\n",
            {},
            "fuel.csv:4: '1.500' in a column with '800' may be 1500; write numbers without separators of thousands",
        ),
        (LONG.replace(",", "\t") + "800\t0\t1\n-1,500\t5\t1\n", {}, "fuel.csv:3: '-1,500' in a column with '800' may be -1500"),
        ("Engine 1.6 l\n" + LONG + "0,0,1\n", {}, "but there are 1 headings; .*; lines above the headings begin with #"),
        (LONG + "0,0,1,5\n", {}, "fuel.csv:2: 4 cells, but there are 3 headings; columns are separated by ','"),
        (",10,20\n0,1,1\n", {"speed": "[rpm]"}, r"a wide table .* pass load='load \[unit\]', fuel='fuel \[unit\]'"),
        (LONG + "0,-5,1\n0,0,1\n9,-5,1\n9,0,1\n", {}, "fuel.csv: the fuel table ends at 0 N.m; it must contain torques above zero"),
        (
            LONG.replace(",", ";") + "1.000;0;1\n1.000;5;1\n6.000;0;1\n6.000;5;1\n",
            {},
            "fuel.csv: the fuel table ends at 0.628 rad/s, 6 rpm; .* without a mark for thousands: 6.000 is 6",
        ),
        (LONG + "0,0,-1\n0,5,1\n9,0,1\n9,5,1\n", {}, "fuel.csv: the fuel table has -1 g/s"),
    ],
)  # fmt: skip
def test_tables_that_are_refused(tmp_path: Path, text: str, options: dict[str, object], said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        read(tmp_path, text, **options)


def test_thirds_are_no_thousands(tmp_path: Path) -> None:
    (path := tmp_path / "torque.csv").write_text(
        "speed [rpm];throttle [%];torque [Nm]\n"
        + "".join(f"{n};{u};{u}\n" for n in (1, 3000) for u in ("0", "33.333", "66.667", "100"))
    )
    assert read_torque_map(path).axes[1].points == pytest.approx((0, 0.33333, 0.66667, 1), rel=1e-9)


THROTTLES = (0.0, 25.0, 100.0)


def pull(rpm: float, percent: float) -> float:
    return -12 + 1.5 * percent - rpm / 500


@pytest.mark.parametrize(
    "text",
    [
        "speed [rpm], throttle [%], torque [Nm]\n" + "".join(f"{n},{u},{pull(n, u)}\n" for n in SPEEDS for u in THROTTLES),
        "u\tn\tM\n%\t1/min\tkNm\n" + "".join(f"{u}\t{n}\t{pull(n, u) / 1e3}\n" for n in SPEEDS for u in THROTTLES),
        "RPM \\ pedal [%];0;25;100\n" + "".join(f"{n};" + ";".join(str(pull(n, u)) for u in THROTTLES) + "\n" for n in SPEEDS),
    ],
    ids=["long", "unit row", "wide"],
)  # fmt: skip
def test_torque_in_every_layout(tmp_path: Path, text: str) -> None:
    path = tmp_path / "torque.csv"
    path.write_text(text, encoding="utf-8")
    table = read_torque_map(path, torque="torque [Nm]" if "pedal" in text else None)
    assert [(axis.name, axis.unit) for axis in table.axes] == [("speed", "rad/s"), ("throttle", "1")]
    assert table(2600 * RPM, 0.5) == pytest.approx(pull(2600, 25) + (pull(2600, 100) - pull(2600, 25)) / 3, rel=1e-9)
    (tmp_path / "fuel.csv").write_text(TEXTS["BMEP"][0], encoding="utf-8")
    if "pedal" not in text:
        found = MappedEngine.from_csv(path, tmp_path / "fuel.csv", displacement=f"{1e3 * V} l")
        assert float(found.fuel_flow(2600 * RPM, 85.0)) == pytest.approx(flow(2600, 85) / 1e3, rel=1e-9)


@pytest.mark.parametrize("method", ["linear", "smooth"])
def test_torque_between_full_load_and_motored(tmp_path: Path, method: Literal["linear", "smooth"]) -> None:
    path = tmp_path / "full_load.csv"
    text = "".join(f"{n},{pull(n, 100)},{pull(n, 0)}\n" for n in SPEEDS)
    path.write_text("engine speed [1/min],full load torque [Nm],motoring torque [Nm]\n" + text)
    table = read_torque_map(path, method=method)
    assert table(2000 * RPM, 0.3) == pytest.approx(pull(2000, 30), rel=1e-9)
    path.write_text("n [rpm],a [Nm],b [Nm]\n" + text)
    assert read_torque_map(path, full_load="a", motored="b", method=method) == table
    path.write_text("RPM,WOT (Nm),friction (Nm)\n900,80,10\n1500,90,12\n")
    with pytest.raises(pt.ParameterError, match=r"full_load.csv: the torque table gives 12 N.m with closed throttle"):
        read_torque_map(path)
    path.write_text("RPM,WOT (Nm)\n900,80\n")
    with pytest.raises(
        pt.ParameterError, match=r"full_load.csv: no column .* the motored \(N.m, .* pass motored='name"
    ):
        read_torque_map(path)
    path.write_text("RPM,WOT (Nm),drag torque (Nm)\n900,80,\n1500,90,-12\n")
    with pytest.raises(pt.ParameterError, match=r"full_load.csv:2: one of the torques at full load and motored"):
        read_torque_map(path)
