"""Machine code for columns of points against CasADi's virtual machine: the same to the last bit."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
import xarray as xr

import powertrain as pt
from benchmarks import implicit_map
from powertrain.design import SplitPathBench
from powertrain.language.symbols import Symbol
from powertrain.numerics.batch import Columns, Common, Tape
from powertrain.numerics.compiled import InC, compile_functions
from powertrain.numerics.vectorised import VectorTape, abreast, vector_tape
from powertrain.trials.operating import on_rolling_road
from powertrain.vehicles.split_path_car import SplitPathCar

pytestmark = pytest.mark.skipif(not (shutil.which("cc") or shutil.which("gcc")), reason="no C compiler on this machine")
SPECIAL = [0.0, -0.0, 1.0, -1.0, 0.5, 1e300, -1e-300, np.inf, -np.inf, np.nan]
NAMES = "exp log sqrt sin cos tan asin acos atan floor ceil fabs sign erf sinh cosh tanh asinh acosh atanh log1p expm1 logic_not"
UNARY: list[Any] = [getattr(ca, name) for name in NAMES.split()]
UNARY += [lambda x: -x, lambda x: 2 * x, lambda x: 1 / x, lambda x: x**2]
NAMES = "plus minus times rdivide power fmod remainder atan2 hypot copysign fmin fmax lt le eq ne logic_and logic_or"
BINARY: list[Any] = [getattr(ca, name) for name in NAMES.split()]
BINARY += [lambda x, y: ca.if_else(x, y, 0)]


@pytest.fixture(autouse=True, scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """A cache of its own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("POWERTRAIN_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


def machine(varying: list[Symbol], common: Symbol, outputs: list[Symbol], rows: Any, values: Any) -> Any:
    tape = vector_tape(varying, common, outputs)
    assert isinstance(tape, VectorTape)
    tape.set_common(values)
    return tape(rows)


def compare(varying: list[Symbol], common: Symbol, outputs: list[Symbol], rows: Any, values: Any) -> None:
    """The results are those of one point after the other, but for the signs of values that are no numbers."""
    found = machine(varying, common, outputs, rows, values)
    exact = ca.Function("one", [ca.vertcat(*varying), common], [ca.densify(ca.vertcat(*outputs))]).map(
        max(1, rows.shape[1])
    )
    assert_same(found, np.array(exact(rows, values)) if rows.size else found[:, :0])


def assert_same(found: Any, exact: Any) -> None:
    assert found.shape == exact.shape
    known = ~np.isnan(exact)
    np.testing.assert_array_equal(np.isnan(found), ~known)
    np.testing.assert_array_equal(found[known].view(np.int64), exact[known].view(np.int64))


def test_every_operation() -> None:
    """Also at zeros of both signs, where there is no value, and on truth values."""
    x, y, c = (ca.SX.sym(name) for name in "xyc")
    less, nothing = x < y, ca.logic_not(x)
    pairs = ((x, y), (x, c), (c, c + 1.0), (less, nothing), (less, y), (y, less), (less, c < 1.0))
    outputs = [f(a) for f in UNARY for a in (x, less)] + [f(a, b) for f in BINARY for a, b in pairs]
    outputs += [ca.SX(1.5), ca.SX(0), ca.SX(-np.inf), x, c]
    points = np.array([(a, b) for a in SPECIAL for b in SPECIAL]).T
    rows = np.hstack([points, np.random.default_rng(0).normal(size=(2, 100))])
    compare([x, y], c, outputs, rows, np.array([0.7]))


@pytest.mark.parametrize("count", [0, 1, 3, 4, 5, 11, 1 << 16, (1 << 15) + 1])
def test_any_number_of_points(count: int) -> None:
    """Fewer than are computed at a time, some more, and so many that two threads share them."""
    x, y, c = (ca.SX.sym(name) for name in "xyc")
    rows = np.random.default_rng(count).normal(size=(2, count))
    compare([x, y], c, [x * y + c, ca.sin(c) * x], rows, np.array([0.7]))


@pytest.mark.parametrize("seed", range(8))
def test_random_tapes(seed: int) -> None:
    """Operations of what differs from point to point and of what does not."""
    rng = np.random.default_rng(seed)
    varying, common = [ca.SX.sym(f"x{i}") for i in range(4)], ca.SX.sym("c", 3)
    nodes = [*varying, *ca.vertsplit(common)]
    for _ in range(100):
        a, b = (nodes[int(rng.integers(len(nodes)))] for _ in range(2))
        one, two = (some[int(rng.integers(len(some)))] for some in (UNARY, BINARY))
        if two is not ca.copysign:  # of the sign of a value that is no number
            nodes.append(one(a) if rng.random() < 0.3 else two(a, b))
    rows = np.hstack([rng.normal(1.0, 2.0, (4, 200)), rng.choice(SPECIAL, (4, 50))])
    compare(varying, common, nodes, rows, rng.normal(1.0, 1.0, 3))


@pytest.mark.parametrize("wide", [True, False])
@pytest.mark.parametrize("seed", range(2))
def test_points_abreast(seed: int, wide: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """A function of four points, called as CasADi's are: from its library, and as CasADi has it; two of them in one library."""
    if not wide:
        monkeypatch.setattr("powertrain.numerics.vectorised._wide", lambda: False)
    rng = np.random.default_rng(seed)
    x, m, p = ca.SX.sym("x", 3), ca.SX.sym("m", 2), ca.SX.sym("p", 1)
    nodes = [*ca.vertsplit(x), *ca.vertsplit(m), p]
    for _ in range(60):
        a, b = (nodes[int(rng.integers(len(nodes)))] for _ in range(2))
        one, two = (some[int(rng.integers(len(some)))] for some in (UNARY, BINARY))
        if two is not ca.copysign:
            nodes.append(one(a) if rng.random() < 0.3 else two(a, b))
    outputs, points = ca.vertcat(*nodes, 0, 1.5), rng.normal(1.0, 2.0, (4, 3))
    common = rng.normal(size=2), rng.normal(size=1)
    written = abreast(f"powertrain_abreast{seed}", x, [m, p], outputs)
    table = pt.Map([pt.Axis("x", "1", [0.0, 1.0, 3.0])], [0.0, 1.0, 4.0], "1")
    beside = abreast(f"powertrain_beside{seed}", x, [p], ca.vertcat(table(x[0]), p))
    assert isinstance(written, InC)
    assert isinstance(beside, InC)
    assert ("avx2" in written.code) == (wide and "avx2" in Path("/proc/cpuinfo").read_text())
    compiled = compile_functions({"f": written, "g": beside})
    there = compiled["f"]
    np.testing.assert_array_equal(
        np.array(compiled["g"](points, common[1])), np.array(beside.function(points, common[1]))
    )
    assert there.name() == written.name()
    assert there is not written.function
    exact = np.array([ca.Function("one", [x, m, p], [outputs])(row, *common).full().ravel() for row in points])
    for found in (there, written.function):
        assert_same(np.array(found(points, *common)), exact)


@pytest.mark.parametrize("even", [True, False])
@pytest.mark.parametrize("outside", ["clip", "linear"])
@pytest.mark.parametrize("axes", [1, 2, 3])
def test_tables(axes: int, outside: Any, even: bool) -> None:
    """Values and slopes, inside, outside and on the points, as those of the columns of the virtual machine."""
    rng, counts = np.random.default_rng(axes), (40, 5, 3)[:axes]
    points = [np.linspace(-1.0, 2.0, n) if even else np.cumsum(rng.uniform(0.1, 1.0, n)) - 1.0 for n in counts]
    table = pt.Map([pt.Axis(f"x{k}", "1", p, outside) for k, p in enumerate(points)], rng.normal(size=counts), "1")
    x, c = [ca.SX.sym(f"x{k}") for k in range(axes)], ca.SX.sym("c")
    outputs = [table(*x) * c, table(*(e * c for e in x)), *ca.vertsplit(ca.gradient(c * table(*x), ca.vertcat(*x)))]
    outputs += [table(*(c for _ in x)), ca.jtimes(table(*x), ca.vertcat(*x), ca.vertcat(*(k + c for k in range(axes))))]
    rows = np.hstack(
        [rng.uniform(-2.0, 3.0, (axes, 50)), [[p[0], p[-1], p[1]] for p in points], rng.choice(SPECIAL, (axes, 20))]
    )
    virtual = Tape("test", x, c, outputs, 16)
    virtual.set_common(np.array([0.7]))
    assert_same(machine(x, c, outputs, rows, np.array([0.7])), virtual(rows))


def test_calls_of_other_functions_stay_with_the_virtual_machine() -> None:
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    called = ca.Function("called", [x], [ca.sin(x)], {"never_inline": True})
    assert vector_tape([x], y, [called(x) + y]) is None
    one_by_one = abreast("powertrain_abreast", x, [y], called(x) + y)
    assert isinstance(one_by_one, ca.Function)
    np.testing.assert_allclose(
        np.array(one_by_one([0.0, 1.0, 2.0, 3.0], 2.0)).ravel(), np.sin([0.0, 1.0, 2.0, 3.0]) + 2.0
    )
    common = Common(y)
    columns = Columns("test", [x], common, [called(x) + y], compile=True)
    common.set(np.array([2.0]))
    np.testing.assert_allclose(columns(np.array([[0.0, 1.0]])), [[2.0, np.sin(1.0) + 2.0]], rtol=1e-15)


def both(model: Any, grid: dict[str, Any], rtol: float = 0.0, **more: Any) -> xr.Dataset:
    """The map, which machine code does not change; with implicit unknowns, up to the rounding of another order of elimination."""
    plant = pt.compile(model)
    found, compiled = pt.steady(plant, grid, **more), pt.steady(plant, grid, compile=True, **more)
    xr.testing.assert_identical(found["status"], compiled["status"])
    xr.testing.assert_allclose(found, compiled, rtol=rtol, atol=rtol)
    return found


def test_scattered_points() -> None:
    """Several combinations of modes at once, in blocks that grow."""
    rng, count = np.random.default_rng(2), 100_000
    points = {"r": rng.uniform(-2.0, 3.0, count), "load": rng.uniform(-200.0, 200.0, count)}
    both(SplitPathBench(), {name: xr.DataArray(values, dims="point") for name, values in points.items()})


def test_points_at_rest() -> None:
    """Where friction is at rest under a prescribed motion, torques are intervals."""
    found = both(SplitPathBench(), {"r": [-1.7, 0.0, 0.5, 1.0], "load": np.linspace(-200.0, 200.0, 9)})
    assert (found["status"] == 1).any()


def test_implicit_unknowns_and_tables() -> None:
    found = both(implicit_map.bench(), {"r": np.linspace(-2.0, 3.0, 20), "load": np.linspace(-200.0, 200.0, 20)}, 1e-12)
    assert (found["status"] == 0).sum() > 300


@pytest.mark.slow
def test_a_whole_car() -> None:
    """With points that have several solutions."""
    grid = {"body.speed": np.linspace(2, 140, 12) / 3.6, "driver.accelerator_set": np.linspace(0, 1, 12)}
    found = both(
        on_rolling_road(SplitPathCar()),
        grid,
        1e-12,
        outputs=["body.force", "engine.fuel_rate", "engine.w"],
        progress=False,
    )
    assert (found["status"] == 0).sum() > 100


def test_no_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setitem(sys.modules, "ziglang", None)
    with pytest.raises(pt.PowertrainError, match="needs a C compiler"):
        pt.steady(implicit_map.bench(), {"r": [0.5], "load": [100.0]}, compile=True)


def test_no_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The map is the same, with a warning that says why it takes longer."""
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("POWERTRAIN_CACHE", str(tmp_path / "file"))
    with pytest.warns(RuntimeWarning, match="cache of compiled models cannot be used"):
        found = pt.steady(implicit_map.bench(), {"r": [0.5], "load": [100.0]}, compile=True)
    assert int(found["status"]) == 0 if found["status"].ndim == 0 else (found["status"] == 0).all()
