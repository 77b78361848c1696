"""Maps: interpolation, the rule outside of every axis, validation, text files."""

from __future__ import annotations

import pickle
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from powertrain import Axis, Map, ParameterError
from powertrain.language.map import FEW
from powertrain.language.recorder import Recorder, reading

SPEED, TORQUE = np.linspace(0, 10, 11), np.array([0.0, 1.0, 2.0, 4.0, 5.0])
FIELD = np.add.outer(SPEED**2, 3 * TORQUE) + np.outer(SPEED, TORQUE)


def symbolic(table: Map, *values: float) -> float:
    """The value as equations see it."""
    arguments = [ca.SX.sym(f"x{i}") for i in range(len(values))]
    return float(ca.Function("f", arguments, [table(*arguments)])(*values))


def slope(table: Map, value: float) -> float:
    x = ca.SX.sym("x")
    return float(ca.Function("f", [x], [ca.gradient(table(x), x)])(value))


def field(outside: str, method: str = "linear") -> Map:
    axes = (Axis("speed", "rad/s", SPEED, outside), Axis("torque", "N.m", TORQUE, outside))  # type: ignore[arg-type]
    return Map(axes, FIELD, "W", "loss", method)  # type: ignore[arg-type]


def test_curve_is_linear_between_its_points() -> None:
    table = Map.curve([0, 10, 30], [0.5, 0.3, 0.4], x="w", x_unit="rad/s")
    assert [table(x) for x in (0.0, 5.0, 10.0, 20.0, 30.0)] == pytest.approx([0.5, 0.4, 0.3, 0.35, 0.4])
    assert isinstance(table(5), float)


@given(st.lists(st.floats(-50, 50), min_size=1, max_size=2 * FEW, unique=True), st.floats(-80, 80), st.data())
@settings(max_examples=60, deadline=None)
def test_curve_against_numpy(points: list[float], x: float, data: st.DataObject) -> None:
    points = sorted(points)
    if len(points) > 1 and min(np.diff(points)) < 1e-3:
        return
    values = data.draw(st.lists(st.floats(-10, 10), min_size=len(points), max_size=len(points)))
    table = Map.curve(points, values, outside="clip")
    expected = float(np.interp(x, points, values))
    assert symbolic(table, x) == pytest.approx(expected, abs=1e-9)
    assert table(x) == pytest.approx(expected, abs=1e-9)


def test_few_points_need_no_call() -> None:
    x = ca.SX.sym("x")
    short = Map.curve(np.arange(FEW), np.arange(FEW) ** 2, outside="clip")(x)
    long = Map.curve(np.arange(FEW + 1), np.arange(FEW + 1) ** 2, outside="clip")(x)
    assert "powertrain_map" not in str(short)
    assert "powertrain_map" in str(long)


def test_steep_pieces_do_not_lose_digits() -> None:
    table = Map.curve([0, 1e-6, 1, 2], [0, 1, 1, 3], outside="linear")
    assert symbolic(table, 0.7) == pytest.approx(1, abs=1e-14)
    assert symbolic(table, 2) == pytest.approx(3, abs=1e-14)


def test_one_point_is_a_constant() -> None:
    assert Map.curve([0], [0.5], outside="linear")(7.0) == 0.5
    assert Map.curve([0], [0.5])(7.0) == 0.5
    assert symbolic(Map.constant(0.5), -3) == 0.5
    ridge = Map((Axis("x", "1", [2.0]), Axis("y", "1", [0.0, 1.0])), [[1.0, 3.0]], "1")
    assert ridge(99.0, 0.5) == 2.0


def test_plane_against_scipy() -> None:
    exact = RegularGridInterpolator((SPEED, TORQUE), FIELD)
    points = np.random.default_rng(1).uniform([0, 0], [10, 5], (200, 2))
    assert field("clip")(points[:, 0], points[:, 1]) == pytest.approx(exact(points), abs=1e-12)


def test_space_against_scipy() -> None:
    grids = [np.array([0.0, 1, 3]), np.array([-1.0, 0, 2, 3]), np.array([0.0, 1.0])]
    values = np.random.default_rng(2).normal(size=(3, 4, 2))
    table = Map(tuple(Axis(n, "1", g) for n, g in zip("abc", grids, strict=True)), values, "1")
    points = np.random.default_rng(3).uniform([0, -1, 0], [3, 3, 1], (50, 3))
    assert table(*points.T) == pytest.approx(RegularGridInterpolator(tuple(grids), values)(points), abs=1e-12)


def test_smooth_reproduces_a_polynomial_and_its_derivative() -> None:
    x = np.linspace(-2, 3, 12)
    table = Map.curve(x, x**3 - x, method="smooth", outside="clip")
    assert table(np.array([-2.0, -1.234, 0.5, 3.0])) == pytest.approx(np.array([-6, -0.645, -0.375, 24]), abs=2e-3)
    assert slope(table, 0.5) == pytest.approx(3 * 0.25 - 1, abs=1e-9)


@pytest.mark.parametrize("method", ["linear", "smooth"])
def test_clip_holds_the_edge(method: str) -> None:
    table = field("clip", method)
    assert table(12.0, 7.0) == pytest.approx(FIELD[-1, -1])
    assert table(-1.0, 2.0) == pytest.approx(FIELD[0, 2])
    assert symbolic(table, 12.0, 2.0) == pytest.approx(FIELD[-1, 2])


@pytest.mark.parametrize("method", ["linear", "smooth"])
def test_linear_goes_on_with_the_slope_at_the_edge(method: str) -> None:
    table = field("linear", method)
    inner, outer = table(9.999999, 2.0), table(10.0, 2.0)
    assert table(12.0, 2.0) == pytest.approx(outer + (outer - inner) / 1e-6 * 2, rel=1e-5)
    assert table(5.0, -1.0) == pytest.approx(25 - 3 - 5, rel=1e-6)
    assert symbolic(table, 12.0, 2.0) == pytest.approx(table(12.0, 2.0))


def test_rules_differ_by_axis() -> None:
    table = Map((Axis("a", "1", [0, 1], "clip"), Axis("b", "1", [0, 1], "linear")), [[0, 1], [10, 11]], "1")
    assert table(5.0, 5.0) == pytest.approx(15)


def test_error_outside_names_value_unit_and_limits() -> None:
    with pytest.raises(ParameterError, match=r"map loss: speed = 11 rad/s is outside its range \[0, 10\] rad/s"):
        field("error")(np.array([1.0, 11.0]), 2.0)
    assert field("error")(10.0, 5.0) == pytest.approx(FIELD[-1, -1])


def test_equations_guard_the_range_once_per_axis_and_call() -> None:
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    axes = (Axis("a", "m", [0, 1], "error"), Axis("b", "N", [0, 2], "clip"), Axis("c", "K", [0, 3], "linear"))
    table = Map(axes, np.zeros((2, 2, 2)), "W", "loss")
    with reading(Recorder()) as active:
        table(x, y, x)
    assert [(g.name, g.unit, g.action) for g in active.guards] == [("loss: a", "m", "error"), ("loss: b", "N", "count")]
    assert float(active.guards[1].high) == pytest.approx(2)


def test_arguments_broadcast() -> None:
    result = field("clip")(SPEED[:, None], TORQUE)
    assert result.shape == (11, 5)
    assert result == pytest.approx(FIELD)
    assert field("clip")(np.empty((0, 2)), 1.0).shape == (0, 2)


def test_constant_symbols_are_numbers() -> None:
    assert float(Map.curve([0, 1], [0, 2])(ca.SX(0.5))) == 1.0


def test_equal_maps_are_equal_hashed_and_pickled() -> None:
    one, two = field("clip"), field("clip")
    assert one(1.0, 1.0) == two(1.0, 1.0)
    assert (one, hash(one), repr(one)) == (two, hash(two), repr(two))
    assert pickle.loads(pickle.dumps(one)) == one
    assert one != field("linear")
    assert repr(one) != repr(Map(one.axes, FIELD + 1, "W", "loss"))
    with pytest.raises(ValueError, match="read-only"):
        one.values[0, 0] = 1.0


@pytest.mark.parametrize(
    ("points", "values", "options", "message"),
    [
        ([0, 2, 1], [0, 1, 2], {}, "the points must increase, but 1 follows 2 .1."),
        ([0, 1, 1], [0, 1, 2], {}, "must increase"),
        ([], [], {}, "axis x has no points"),
        ([0, np.nan], [0, 1], {}, "axis x: nan at .1. is not a finite number"),
        ([0, 1], [0, np.inf], {}, "map map: inf at .1. is not a finite number"),
        ([0, 1], [0, 1, 2], {}, r"values of shape \(3,\), but its axes require \(2,\) \(x: 2\)"),
        ([0, 1], [0, 1], {"outside": "extrapolate"}, "outside='extrapolate' must be one of error, clip, linear"),
        ([0, 1], [0, 1], {"method": "cubic"}, "method='cubic' must be one of linear, smooth"),
        ([0, 1, 2], [0, 1, 2], {"method": "smooth"}, "needs at least 4 points on every axis, x has 3"),
    ],
)
def test_unusable_data(points: list[float], values: list[float], options: dict[str, str], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        Map.curve(points, values, **options)  # type: ignore[arg-type]


def test_unusable_calls() -> None:
    with pytest.raises(ParameterError, match=r"takes 2 arguments \(speed \[rad/s\], torque \[N.m\]\), got 1"):
        field("clip")(1.0)
    with pytest.raises(ParameterError, match="map loss: torque: nan"):
        field("clip")(1.0, float("nan"))
    with pytest.raises(ParameterError, match="two axes have the same name"):
        Map((Axis("a", "1", [0, 1]), Axis("a", "1", [0, 1])), np.zeros((2, 2)), "1")


def write(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def test_reads_a_table(tmp_path: Path) -> None:
    text = "# a comment\nspeed [rad/s], torque [N.m], loss [W]\n0,0,1\n0,5,2\n10,5,4\n\n10,0,3\n"
    table = Map.from_csv(write(tmp_path / "loss.csv", text), outside={"speed": "clip"})
    assert [(a.name, a.unit, a.outside) for a in table.axes] == [("speed", "rad/s", "clip"), ("torque", "N.m", "error")]
    assert (table.name, table.unit) == ("loss", "W")
    assert table(5.0, 2.5) == pytest.approx(2.5)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a [m], b [N]\n", "a header .* and rows of numbers are needed"),
        ("a, b [N]\n0, 1\n", "t.csv: column 1: 'a' is not a column heading"),
        ("b [N]\n1\n", "t.csv: a column for every axis and one for the value"),
        ("a [m], b [N]\n0, one\n", "t.csv:2: .* is not a row of numbers"),
        ("a [m], b [N]\n0, 1, 2\n", "t.csv:2: 3 cells, but there are 2 headings; columns are separated by ','"),
        ("a [m], b [N]\n0\n", "t.csv:2: 2 finite numbers are needed"),
        ("a [m], b [furlong]\n0, 1\n", "t.csv: column 'b': unknown unit 'furlong'"),
        ("a [m]; b [N]\n0,5; 1.5\n", "t.csv: '0,5' in line 2 has a comma, '1.5' in line 2 a point"),
        ("a [m], b [N]\n0, 1\n0, 2\n", "t.csv:3: this grid point already has a value"),
        ("a [m], b [m], c [N]\n0,0,1\n1,1,2\n", "no row for a = 0 m, b = 1 m"),
    ],
)
def test_refuses_a_table(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        Map.from_csv(write(tmp_path / "t.csv", text))


@pytest.mark.parametrize(
    "text",
    [
        "load [%]; torque [Nm]; p [kPa]\n0; 0; 150\n0; 12,5; 250\n50; 12,5; 450\n50; 0; 350\n",
        "\ufeffload\ttorque\tp\t\n%\tkNm\tbar\n0\t0\t1.5\t\n0\t.0125\t2.5\n50\t0\t3.5\n50\t.0125\t4.5\n",
    ],
    ids=["semicolons", "tabs"],
)
def test_units_and_separators_of_every_day(tmp_path: Path, text: str) -> None:
    table = Map.from_csv(write(tmp_path / "p.csv", text))
    assert [(a.name, a.unit) for a in table.axes] == [("load", "1"), ("torque", "N.m")]
    assert table.unit == "Pa"
    assert table(0.25, 6.25) == pytest.approx(3e5, rel=1e-12)


@pytest.mark.parametrize("rpm", ["rpm", "RPM", "1/min", "min-1", "rev/min", "r/min", "U/min"])
def test_speeds_and_powers_are_those_of_components(tmp_path: Path, rpm: str) -> None:
    table = Map.from_csv(write(tmp_path / "p.csv", f"n [{rpm}], v [km/h], P [kW]\n0,0,0\n0,36,1\n60,0,2\n60,36,3\n"))
    assert [a.unit for a in table.axes] == ["rad/s", "m/s"]
    assert table.unit == "W"
    assert table(2 * np.pi, 10.0) == pytest.approx(3000.0, rel=1e-12)


def test_refuses_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="cannot be read"):
        Map.from_csv(tmp_path / "none.csv")


def test_refuses_a_file_of_another_encoding(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_bytes("speed [rad/s], Öl [W]\n0, 1\n".encode("latin-1"))
    with pytest.raises(ParameterError, match=r"t\.csv: byte 15 is not text in UTF-8"):
        Map.from_csv(tmp_path / "t.csv")


def test_a_sparse_table_of_many_points_names_a_hole(tmp_path: Path) -> None:
    """2,000 rows on the diagonal of a grid of 60 GiB."""
    rows = "".join(f"{k},{k},{k},1\n" for k in range(2000))
    with pytest.raises(ParameterError, match="no row for a = 0 m, b = 0 m, c = 1 m"):
        Map.from_csv(write(tmp_path / "t.csv", f"a [m], b [m], c [m], d [N]\n{rows}"))


def test_many_values_at_once() -> None:
    x: NDArray[np.float64] = np.linspace(0, 10, 20_000)
    assert field("clip")(x, 2.0).shape == x.shape


def test_rule_for_a_column_that_is_not_there(tmp_path: Path) -> None:
    path = tmp_path / "loss.csv"
    path.write_text("speed [rad/s], loss [W]\n0, 0\n100, 5\n", encoding="utf-8")
    with pytest.raises(ParameterError, match=r"loss\.csv: outside: the table has no axis sped; did you mean speed\?"):
        Map.from_csv(path, outside={"sped": "clip"})
    assert Map.from_csv(path, outside={"speed": "clip"})(200.0) == 5.0
