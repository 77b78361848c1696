"""The design program: its table against the closed form, the paper's reasoning, combinations, refinement, duties, bad input."""

from __future__ import annotations

import math
from contextlib import suppress
from functools import partial
from itertools import product
from typing import Any

import numpy as np
import pandas as pd
import pytest
from cases import few
from yu_beachley import CONNECTIONS, only, solutions, unit_ratio

import powertrain as pt
from powertrain.components.cvu import CVU
from powertrain.components.differentials import FundamentalDifferential, Pairs, Planets, Ring, Sun
from powertrain.components.transmissions import SplitPathTransmission
from powertrain.design import Duty, SplitPathDesigns, sets_near, split_path_designs
from powertrain.design.evaluation import Demands
from powertrain.design.refinement import refine_ratio

ETA, ETA_V = 0.95, 0.9


def designs(*arguments: Any, **options: Any) -> SplitPathDesigns:
    return split_path_designs(*arguments, progress=False, **options)


@pytest.fixture(scope="module")
def paper() -> SplitPathDesigns:
    """The differential of the paper, r from 0.5 to 2."""
    return designs((0.5, 2.0), [-1.7])


def simple(found: SplitPathDesigns, coupling: str = "input") -> pd.DataFrame:
    """The six types, by number."""
    table = found.table
    table = table[(table.coupling == coupling) & table.type.isin([str(n) for n in range(1, 7)])]
    return table.assign(type=table.type.astype(int)).set_index("type").sort_index()


@pytest.mark.parametrize("coupling", ["input", "output"])
def test_table_is_the_closed_form(paper: SplitPathDesigns, coupling: str) -> None:
    table = simple(paper, coupling)
    r = np.linspace(0.5, 2.0, 31)
    assert set(paper.duty.r) == set(r)
    for number, row in table.iterrows():
        connection = CONNECTIONS[int(str(number))]
        points = {
            e: [only(solutions(connection, -1.7, x + e * (x == 1), ETA, ETA_V, coupling)) for x in r]
            for e in (-1e-12, 1e-12)
        }
        both = np.array([[p.efficiency for p in side] for side in points.values()])
        K = np.array([[p.K for p in side] for side in points.values()])
        assert row.mean_efficiency == pytest.approx(r.size / (1 / both.min(axis=0)).sum(), rel=1e-9)
        assert row.mean_efficiency_high == pytest.approx(r.size / (1 / both.max(axis=0)).sum(), rel=1e-9)
        assert row.min_efficiency == pytest.approx(both.min(), rel=1e-9)
        assert row.max_K == pytest.approx(np.abs(K).max(), rel=1e-9)
        V = [unit_ratio(connection, -1.7, x, coupling) for x in r]
        assert (row.V_min, row.V_max) == pytest.approx((min(V), max(V)), rel=1e-9)
        regimes = list(dict.fromkeys(p.regime for p in points[-1e-12]))
        assert [row.regimes.index(name) for name in regimes] == sorted(row.regimes.index(name) for name in regimes)


@pytest.mark.slow
def test_what_the_paper_says_of_curves_4_and_6(paper: SplitPathDesigns) -> None:
    """P. 16: for r from 0.5 to 2 curve 4 has the higher efficiency and less power through the unit; for a smaller range of V take 6."""
    six: Any = simple(paper)
    assert six.mean_efficiency[4] > six.mean_efficiency[6]
    assert six.max_K[4] < six.max_K[6]
    assert (six.V_max - six.V_min)[6] < (six.V_max - six.V_min)[4]
    assert (round(six.V_min[6], 3), round(six.V_max[6], 3)) == (0.685, 1.630)
    one_way = designs((0.5, 2.0), [-1.7], unit=(0.0, math.inf), couplings=["input"], combinations=False)
    assert one_way.feasible.type.tolist()[0] == "4"
    assert set(one_way.feasible.type) == {"1", "2", "4", "6"}  # 3 and 5 would do, with a unit that reverses
    assert six.mean_efficiency[3] > six.mean_efficiency[5] > six.mean_efficiency[4]
    small = designs((0.5, 2.0), [-1.7], unit=(0.6, 1.7), couplings=["input"], combinations=False)
    assert small.feasible.type.tolist() == ["6", "1"]
    assert "V from 0.2059 to 2.588, the unit has 0.6 to 1.7" in small.table.problem.tolist()


def test_combinations_shift_at_one(paper: SplitPathDesigns) -> None:
    table = paper.table[paper.table.coupling == "input"].set_index("type")
    six = simple(paper)
    shifted = table[table.index.str.contains(":")]
    assert len(shifted) == 18
    row: Any = table.loc["II: 3, then 5"]
    assert row.name == paper.table.type[0]
    assert row.mean_efficiency > six.mean_efficiency.max()
    assert row.V_max == 1
    assert (
        row.regimes == "negative recirculation to r = 0.625, split to r = 1, negative recirculation to r = 1.58, split"
    )
    assert not designs((1.1, 2.0), [-1.7], couplings=["input"]).table.type.str.contains(":").any()


@pytest.mark.slow
def test_span_of_the_unit() -> None:
    """Fixed gears may bring V into the unit's range, so that only the span counts, in one direction."""
    found = designs((0.5, 2.0), [-1.7], unit=3.2, couplings=["input"], combinations=False)
    span = found.table.V_max / found.table.V_min
    assert ((span > 0) & (span <= 3.2)).equals(found.table.feasible)
    assert set(found.feasible.type) == {"1", "2", "6"}


@pytest.mark.slow
@pytest.mark.parametrize("unit", [None, (0.0, 3.0), 6.0])
def test_refinement_finds_what_a_fine_search_finds(unit: Any) -> None:
    found = designs((0.5, 2.0), np.linspace(-4, -0.25, 6), unit=unit, couplings=["input"], combinations=False)
    kinds = found.table.type.tolist()
    line = min(kinds.index("4"), kinds.index("6"))
    best, number = found.refine(line), kinds[line]
    fine = designs((0.5, 2.0), np.linspace(-4, -0.25, 151), unit=unit, couplings=["input"], combinations=False)
    top = fine.feasible[fine.feasible.type == number].iloc[0]
    assert best.mean_efficiency >= top.mean_efficiency - 1e-9
    assert best.R_o == pytest.approx(top.R_o, abs=0.026)
    assert best.mean_efficiency >= best.before


@pytest.mark.slow
def test_refinement_inside_and_with_a_limit_of_power() -> None:
    found = designs((0.5, 2.0), np.linspace(-4, -0.25, 6), couplings=["input"], combinations=False)
    table = found.table
    line = int(table.index[table.type == "4"][0])
    free, limited = found.refine(line), found.refine(line, max_K=0.7)
    assert limited.max_K <= 0.7 + 1e-9
    assert limited.mean_efficiency <= free.mean_efficiency + 1e-12
    assert free.by == "mean_efficiency"
    assert free.value == free.mean_efficiency


@pytest.mark.slow
def test_refinement_of_a_combination() -> None:
    found = designs((0.5, 2.0), [-3.0, -1.7, -0.6], unit=(0.3, 3.0), couplings=["input"])
    table = found.feasible
    line = int(table.index[table.type.str.startswith("III: 4")][0])
    best = found.refine(line, bounds=(-6.0, -1.1))
    assert best.mean_efficiency > best.before
    again = designs((0.5, 2.0), [best.R_o], unit=(0.3, 3.0), couplings=["input"]).feasible
    row = again[again.type == table.type[line]].iloc[0]
    assert row.mean_efficiency == pytest.approx(best.mean_efficiency, rel=1e-12)


def test_the_energy_at_a_shift_counts_half_before_it_and_half_after() -> None:
    halves = Duty.over((0.4, 2.0), {"r": [0.5, 1.0, 1.8], "weight": [5.0, 2.0, 3.0]}).halves()
    assert [float(half.weight.sum()) for half in halves] == pytest.approx([0.6, 0.4])
    assert [(half.low, half.high) for half in halves] == [(0.4, 1.0), (1.0, 2.0)]


@pytest.mark.slow
def test_weights_are_shares_of_energy() -> None:
    """Most of the work at r = 0.5 or at r = 1.8: another type is best."""
    low = {"r": [0.5, 1.8], "weight": [9.0, 1.0]}
    high = {"r": [0.5, 1.8], "weight": [1.0, 9.0]}
    tables = [
        designs((0.4, 2.0), [-1.7], weights=w, unit=(0.0, 3.2), couplings=["input"], combinations=False).table
        for w in (low, high)
    ]
    means = [t[t.coupling == "input"].set_index("type").mean_efficiency for t in tables]
    assert means[0]["4"] > means[0]["5"]
    assert means[1]["4"] < means[1]["5"]
    eta = [only(solutions(CONNECTIONS[4], -1.7, r, ETA, ETA_V)).efficiency for r in (0.5, 1.8)]
    row = tables[0][(tables[0].type == "4") & (tables[0].coupling == "input")].iloc[0]
    assert row.mean_efficiency == pytest.approx(1 / (0.9 / eta[0] + 0.1 / eta[1]), rel=1e-9)


def test_a_duty_of_a_drive_is_what_the_output_takes() -> None:
    """5 kW at r = 0.5 and 15 kW at r = 1.5; at standstill and in overrun nothing, and r = 1 is only passed."""
    duty = Duty.driven([100.0, 80.0, 100.0, 100.0], [150.0, 0.0, 50.0, 60.0], [100.0, 50.0, 100.0, -20.0])
    assert duty.sampled
    assert [duty.low, duty.high] == [0.5, 1.5]
    assert duty.r.tolist() == [0.5, 1.0, 1.5]
    assert duty.weight == pytest.approx([0.25, 0.0, 0.75])
    assert duty.torque.tolist() == duty.speed.tolist() == [100.0, 100.0, 100.0]


@pytest.mark.slow
def test_drive_cycle() -> None:
    t = np.linspace(0, 60, 61)
    w_out = 60 + 60 * np.sin(t / 10)
    tau = 20 * np.cos(t / 10) + 5
    duty = Duty.driven(np.full(t.size, 100.0), w_out, tau)
    assert duty.weight.sum() == pytest.approx(1)
    assert duty.low > 0
    drives = tau > 0
    assert (duty.weight > 0).sum() == drives.sum()
    found = designs(duty, [-1.7, -2.5], combinations=False)
    assert len(found.table) == 24
    assert found.curves.efficiency_low.dims == ("coupling", "type", "R_o", "point")
    assert found.curves.r.size == duty.r.size


@pytest.mark.slow
def test_efficiency_that_depends_on_the_load_counts() -> None:
    """A unit whose efficiency falls at small torque: the duty's torque matters."""
    efficiency = pt.Map([pt.Axis("tau", "N.m", [0.0, 5.0, 200.0], "clip")], [0.6, 0.8, 0.95], "1")
    gear = SplitPathTransmission(cvu=CVU(map_ab=efficiency, map_ba=efficiency))
    means = []
    for torque in (5.0, 100.0):
        weights = {"r": [0.6, 1.6], "torque": [torque, torque]}
        found = designs((0.5, 2.0), [-1.7], weights=weights, transmission=gear, couplings=["input"], combinations=False)
        means.append(simple(found).mean_efficiency[4])
    assert means[0] < means[1]


def test_tooth_numbers_in_and_out() -> None:
    sets = [
        FundamentalDifferential.from_teeth(Sun(a), Ring(b), Planets(g)) for a, g, b in ((90, 31, 153), (30, 30, 90))
    ]
    assert sorted(set(designs((0.5, 2.0), sets, couplings=["input"], combinations=False).table.R_o)) == [-3.0, -1.7]
    near = sets_near(-1.7)
    assert near.R_o.tolist()[:2] == pytest.approx([-1.7, -1.7])
    assert ((near.sun == 90) & (near.ring == 153) & (near.planet == 31)).any()
    assert near.R_o.sub(-1.7).abs().le(0.0171).all()
    assert set(sets_near(-1.7, suns=90).sun) == {90}
    inverse = sets_near(-0.6)
    assert set(inverse.a) == {"ring"}
    assert inverse.R_o[0] == pytest.approx(-0.6)


@pytest.mark.parametrize("R_o", few([3.0, 1.6, 1.05, 0.8], 2))
def test_tooth_numbers_of_positive_ratios(R_o: float) -> None:
    """Every set can be made, has the ratio by eq. (3), and stepped planets of one module have one distance of axes."""
    near = sets_near(R_o)
    assert len(near) > 0
    assert (near.R_o - R_o).abs().round(9).is_monotonic_increasing
    assert ((near.R_o / R_o - 1).abs() <= 0.01).all()
    rows: Any = near.head(40).itertuples()
    for row in rows:
        if row.kind in ("KHV", "pairs"):
            exact = row.b / row.a
        else:
            exact = row.first * row.b / (row.a * row.second)
            sign = 1 if row.kind == "two suns" else -1
            assert row.a + sign * row.first == row.b + sign * row.second
        assert row.R_o == pytest.approx(exact, rel=1e-12)
    assert set(near.kind) <= {"two suns", "two rings", "pairs", "KHV"}
    assert R_o > 1 or not {"pairs", "KHV"} & set(near.kind)


def assembled(R_o: float, tolerance: float, suns: list[int], planets: range) -> set[tuple[int, int, int, int]]:
    """Sun, ring and pairs of planets whose ratio is near R_o and that go together, by trying all of them."""
    found = set()
    for a, b, first, second in product(suns, range(20, 300), planets, planets):
        if abs(b / a / R_o - 1) <= tolerance:
            with suppress(pt.ParameterError):
                FundamentalDifferential.from_teeth(Sun(a), Ring(b), Pairs(first, second))
                found.add((a, b, first, second))
    return found


def test_no_tooth_numbers_within_the_tolerance_are_left_out() -> None:
    """91 and 218 teeth are nearest to 2.4 but not assembled with three pairs; 217 are. A wide tolerance has its whole range."""
    near = sets_near(2.4, suns=91, tolerance=0.0066)
    pairs = near[near.kind == "pairs"]
    listed = set(zip(pairs.a, pairs.b, pairs["first"], pairs["second"], strict=True))
    every = assembled(2.4, 0.0066, [91], range(12, 61))
    assert len(near) == 300
    assert listed <= every
    assert {b for _, b, _, _ in listed} == {217}
    assert {218, 219} <= set(near[near.kind == "KHV"].b) <= {217, 218, 219}
    inner = sets_near(-0.6, suns=30, tolerance=0.31)  # a is the ring, of 30/0.786 to 30/0.414 teeth
    rings = {b for b in range(39, 73) if (30 + b) % 3 == 0}
    assert set(inner.ring) <= rings
    assert max(inner.ring) == max(rings)


@pytest.mark.slow
def test_self_locking_and_standstill_are_said() -> None:
    locked = designs((0.5, 2.0), [1.02], combinations=False).table
    assert not locked[(locked.coupling == "input") & locked.type.isin(["3", "4"])].feasible.any()
    assert locked.problem.str.contains("several_solutions|no_solution").any()
    neutral = designs((-0.5, 1.0), [-1.7], combinations=False).table
    assert (neutral[neutral.coupling == "output"].problem == "cannot_move at r = 0").all()
    assert neutral[neutral.coupling == "input"].feasible.all()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: designs((2.0, 0.5), [-1.7]), "the required range of r: the range 2 to 0.5 is empty"),
        (lambda: designs((0.5, 2.0), []), "no basic ratio"),
        (lambda: designs((0.5, 2.0), [1.0]), "ratio"),
        (lambda: designs((0.5, 2.0), [-1.7], weights={"weight": [1.0]}), r"the columns r \(required\)"),
        (lambda: designs((0.5, 2.0), [-1.7], weights={"r": [3.0]}), "outside the required range"),
        (lambda: designs((0.5, 2.0), [-1.7], weights={"r": [1.0], "weight": [-1.0]}), "shares of the delivered energy"),
        (lambda: designs(Duty.over((0.5, 2.0)), [-1.7], weights={"r": [1.0]}), "a Duty has its own"),
        (lambda: designs((0.5, 2.0), [-1.7], unit=(2.0, 0.5)), "from V = 2 to 0.5 is empty"),
        (
            lambda: designs((0.5, 2.0), [-1.7], unit=0.5),
            "V_max/V_min = 0.5 of the variable unit must be greater than 1",
        ),
        (lambda: designs((0.5, 2.0), [-1.7], by="mean"), "cannot be ranked by 'mean'; choose from mean_efficiency"),
        (lambda: Duty.driven([100.0], [50.0], [-1.0]), "never takes power"),
        (lambda: sets_near(1.0), "no gear set has this basic ratio"),
        (lambda: sets_near(float("nan")), "R_o = nan is not a finite number"),
        (lambda: sets_near("-1.7"), "R_o = '-1.7' is not a finite number"),  # type: ignore[arg-type]
        (lambda: sets_near(-1.7, tolerance=-0.01), "tolerance = -0.01 must lie between 0 and 1"),
        (lambda: sets_near(-1.7, planets=0), "planets = 0 must be at least 1"),
        (lambda: sets_near(-1.7, suns=[18.5]), "suns = 18.5 must be a whole number"),  # type: ignore[list-item]
    ],
)
def test_bad_input(call: Any, message: str) -> None:
    with pytest.raises(pt.ParameterError, match=message):
        call()


def test_nothing_to_refine(paper: SplitPathDesigns) -> None:
    refine = partial(refine_ratio, [paper.plants["input", 3]], paper.duty, by="mean_efficiency")
    with pytest.raises(pt.ParameterError, match=r"R_o = 1.02 does not meet this duty"):
        refine(1.02, (1.01, 1.04), Demands(None, {}))
    with pytest.raises(
        pt.ParameterError, match=r"no basic ratio between -2 and -1\.5 meets this duty within its limits"
    ):
        refine(-1.7, (-2.0, -1.5), Demands((0.9, 1.1), {}))
