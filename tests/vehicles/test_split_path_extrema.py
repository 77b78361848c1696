"""Extrema of split-path designs: properties of the range of ratios, not of the samples; limits of the unit; the method for a ridge."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

import powertrain as pt
from powertrain.components.cvu import CVU
from powertrain.components.differentials import FundamentalDifferential
from powertrain.components.transmissions import TYPES, SplitPathTransmission
from powertrain.design import Duty, SplitPathBench, SplitPathDesigns, split_path_designs

COLUMNS = ("min_efficiency", "max_K", "V_min", "V_max", "unit_torque", "unit_speed", "unit_power")
CVU_AT = "transmission.cvu"


def designs(*arguments: Any, **options: Any) -> SplitPathDesigns:
    return split_path_designs(*arguments, progress=False, **options)


def line(found: SplitPathDesigns, kind: str, coupling: str = "input") -> Any:
    table = found.table
    return table[(table.type == kind) & (table.coupling == coupling)].iloc[0]


def brute(gear: SplitPathTransmission, r: Any, torque: float = 10.0) -> dict[str, float]:
    """The worst on a dense grid."""
    grid: dict[str, Any] = {
        "r": xr.DataArray(r, dims="point"),
        "load": xr.DataArray(np.where(r < 0, torque, -torque), dims="point"),
        "drive.w_fixed": 100.0,
    }
    names = ["V", "efficiency", "K", *(f"{CVU_AT}.{n}" for n in ("flange_a.tau", "flange_b.tau", "w_a", "w_b"))]
    found = pt.steady(SplitPathBench(transmission=gear), grid, outputs=names)
    ends = [{n: found.get(f"{n}_{end}", found[n]).values for n in names} for end in ("low", "high")]
    sides = [(f"{CVU_AT}.flange_{x}.tau", f"{CVU_AT}.w_{x}") for x in "ab"]
    return {
        "min_efficiency": min(float(e["efficiency"].min()) for e in ends),
        "max_K": max(float(np.abs(e["K"]).max()) for e in ends),
        "V_min": float(ends[0]["V"].min()),
        "V_max": float(ends[0]["V"].max()),
        "unit_torque": max(float(np.abs(e[tau]).max()) for e in ends for tau, _ in sides),
        "unit_speed": max(float(np.abs(e[w]).max()) for e in ends for _, w in sides),
        "unit_power": max(float(np.abs(e[tau] * e[w]).max()) for e in ends for tau, w in sides),
    }


@pytest.mark.slow
@pytest.mark.parametrize("coupling", ["input", "output"])
@pytest.mark.parametrize("R_o", [-1.7, -0.45, 2.3])
def test_extrema_are_those_of_a_dense_grid(coupling: Any, R_o: float) -> None:
    """From a duty of three points."""
    found = designs(
        (0.31, 2.2), [R_o], weights={"r": [0.7, 1.1, 1.9]}, couplings=[coupling], combinations=False
    ).table.set_index("type")
    r = np.unique(np.append(np.linspace(0.31, 2.2, 4001), [1.0]))
    for number, layout in TYPES.items():
        row: Any = found.loc[str(number)]
        if row.problem:
            continue
        differential = FundamentalDifferential(ratio=R_o, eta_ab=0.95, eta_ba=0.95)
        gear = SplitPathTransmission(differential=differential, layout=layout, coupling=coupling)
        for name, value in brute(gear, r).items():
            better = row[name] - value if name in ("min_efficiency", "V_min") else value - row[name]
            assert better <= 1e-9 * max(1, abs(value)), (number, name)  # no sample is worse
            assert row[name] == pytest.approx(value, rel=1e-5, abs=1e-7), (number, name)


@pytest.mark.slow
def test_extrema_do_not_depend_on_the_samples() -> None:
    """Through standstill, where from 11 to 3,001 points max K of type 4 went from 2.0 to 6.8."""
    rows = [
        line(
            designs(
                (-0.5, 2.0), [-1.7], weights={"r": np.linspace(-0.5, 2, n)}, couplings=["input"], combinations=False
            ),
            "4",
        )
        for n in (11, 203)
    ]
    for name in COLUMNS:
        assert rows[0][name] == pytest.approx(rows[1][name], rel=1e-6, abs=1e-7)
    assert rows[0].max_K == pytest.approx(6.8965, abs=1e-3)
    assert rows[0].min_efficiency == 0


@pytest.mark.slow
def test_a_kink_between_samples_is_found() -> None:
    """A unit whose efficiency has a hole at V = 1.234: the least efficiency lies there, whatever the samples."""
    hole = pt.Map([pt.Axis("ratio", "1", [0.0, 1.2, 1.234, 1.27, 4.0], "clip")], [0.9, 0.9, 0.6, 0.9, 0.9], "1")
    gear = SplitPathTransmission(cvu=CVU(map_ab=hole, map_ba=hole))
    options: Any = {"transmission": gear, "couplings": ["input"], "combinations": False}
    row = line(designs((0.5, 2.0), [-1.7], weights={"r": [0.5, 2.0]}, **options), "4")
    r = np.linspace(0.5, 2.0, 20001)
    wanted = brute(pt.replace(gear, layout=TYPES[4]), r)
    assert row.min_efficiency == pytest.approx(wanted["min_efficiency"], abs=5e-4)  # what the dense grid misses
    assert row.min_efficiency <= wanted["min_efficiency"]


@pytest.mark.slow
def test_both_types_count_at_the_shift() -> None:
    """The least efficiency of a combination is the worse of its types at r = 1, whichever of them comes first."""
    found = designs((0.5, 2.0), [-1.7], couplings=["input"])
    for pair in ((3, 5), (4, 6)):
        one, other = (line(found, f"{'II' if pair == (3, 5) else 'III'}: {a}, then {b}") for a, b in (pair, pair[::-1]))
        at_one = [line(designs((0.99, 1.0), [-1.7], couplings=["input"], combinations=False), str(n)) for n in pair]
        for row in (one, other):
            assert row.min_efficiency <= min(each.min_efficiency for each in at_one if each.min_efficiency > 0) + 0.05
            assert row.max_K >= max(float(np.abs(_at_one(n)["K"]).max()) for n in pair) - 1e-9


def _at_one(number: int) -> Any:
    bench = SplitPathBench(transmission=SplitPathTransmission(layout=TYPES[number]))
    found = pt.steady(bench, {"r": np.array([1.0]), "load": -10.0}, outputs=["K", "efficiency"])
    return {n: np.array([float(found[f"{n}_{end}"][0]) for end in ("low", "high")]) for n in ("K", "efficiency")}


@pytest.mark.slow
def test_limits_of_the_unit() -> None:
    """Torque at standstill counts: the load asks for it there too."""
    free = designs((0.0, 2.0), [-1.7], couplings=["input"], combinations=False)
    torque = line(free, "4").unit_torque
    tight = designs((0.0, 2.0), [-1.7], limits={"torque": 0.9 * torque}, couplings=["input"], combinations=False)
    assert line(tight, "4").problem == f"torque of the unit up to {torque:.4g} N.m, it has {0.9 * torque:g}"
    wide = designs((0.0, 2.0), [-1.7], limits={"torque": 1.1 * torque}, couplings=["input"], combinations=False)
    assert line(wide, "4").problem == ""
    for limits, said in (
        ({"heat": 1.0}, "no limit 'heat'; choose from torque, speed, power"),
        ({"power": -1.0}, "must be"),
    ):
        with pytest.raises(pt.ParameterError, match=said):
            designs((0.5, 2.0), [-1.7], limits=limits)


@pytest.mark.slow
def test_refinement_by_what_ranks() -> None:
    """|K| at both ends of the range is equal at the best R_o: a ridge. A fine search finds nothing better."""
    found = designs((0.5, 2.0), np.linspace(-4, -0.25, 6), couplings=["input"], combinations=False, by="max_K")
    number = int(found.table.index[found.table.type == "4"][0])
    best = found.refine(number)
    assert best.by == "max_K"
    assert best.value == best.max_K <= best.before
    fine = designs((0.5, 2.0), np.linspace(-4, -0.25, 101), couplings=["input"], combinations=False, by="max_K")
    assert best.value <= fine.table[fine.table.type == "4"].max_K.min() + 1e-9
    ridge = designs((0.5, 2.0), np.linspace(-4, -0.25, 6), unit=(0.1, 2.45), couplings=["input"], combinations=False)
    limited = ridge.refine(int(ridge.table.index[(ridge.table.type == "4")][0]))
    assert limited.V_max <= 2.45 + 1e-9


@pytest.mark.slow
def test_an_optimum_at_the_edge_says_so() -> None:
    found = designs((0.5, 2.0), [-2.0, -1.8, -1.6], couplings=["input"], combinations=False, by="min_efficiency")
    assert found.at_edge()
    best = found.refine(0)
    assert best.edge
    assert "at the edge of the bounds" in str(best)
    inside = designs((0.5, 2.0), [-4.0, -1.0, -0.25], couplings=["input"], combinations=False, by="max_K")
    row = inside.table.index[inside.table.type == "4"][0]
    assert inside.refine(int(row)).edge == (inside.refine(int(row)).R_o in (-4.0, -0.25))


@pytest.mark.slow
def test_no_efficiency_is_no_design() -> None:
    """At R_o = eta the differential locks itself: 1.6e-15 is no efficiency, and rounding is no regime."""
    table = designs((0.5, 2.0), [0.95], unit=3.0).table
    assert (table[table.feasible].min_efficiency > 1e-3).all()
    near = designs((0.5, 2.0), [0.95 + 1e-13], unit=3.0).table
    key = ["coupling", "type"]
    one, other = (t.set_index(key).sort_index() for t in (table, near))
    assert (one.feasible == other.feasible).all()
    assert (one.regimes == other.regimes).all()


def test_overrun_has_the_efficiency_of_the_power_flow() -> None:
    """Power delivered over power supplied, whichever side supplies."""
    bench = SplitPathBench(transmission=SplitPathTransmission(layout="bHa"))
    for load in (-10.0, 10.0):
        grid: dict[str, Any] = {"r": np.array([1.5, 0.7]), "load": load}
        found = pt.steady(bench, grid, outputs=["efficiency"])
        flow = pt.power_flow(bench, grid, progress=False)
        np.testing.assert_allclose(found.efficiency.values, flow.efficiency.values, rtol=1e-9)
        assert (found.efficiency < 1).all()


@pytest.mark.slow
def test_a_drive_cycle_is_its_samples() -> None:
    duty = Duty.driven([100.0] * 4, [50.0, 80.0, 80.0, 160.0], [10.0, 30.0, 5.0, 8.0])
    assert duty.sampled
    row = line(designs(duty, [-1.7], couplings=["input"], combinations=False), "4")
    gear = SplitPathTransmission(layout=TYPES[4])
    worst = [brute(gear, np.array([r]), tau) for r, tau in ((0.5, 10.0), (0.8, 30.0), (1.6, 8.0))]
    assert row.unit_torque == pytest.approx(max(w["unit_torque"] for w in worst), rel=1e-9)
