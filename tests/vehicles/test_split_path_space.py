"""The space of split-path transmissions: ranges that meet, gears that use the unit, extrema, the front, units by their maps."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from cases import few

import powertrain as pt
from powertrain.components.cvu import CVU, HydrostaticUnit, VBelt
from powertrain.components.transmissions import UnitLoss, flow
from powertrain.design import (
    COMMON,
    Designs,
    Duty,
    Efficiencies,
    SplitPathSpace,
    Structure,
    Variator,
    split_path_space,
)
from powertrain.design.parts import cvu_of, ratio_of
from powertrain.design.rating import bounds, front, rate
from powertrain.design.space import _fit, geared

R = np.linspace(0.1, 1.5, 15)
DUTY = Duty.over(
    (0.1, 1.5), {"r": R, "weight": np.ones(15), "torque": 300 / np.maximum(R, 0.3), "speed": np.full(15, 200.0)}
)
ELECTRIC = Variator("electric", UnitLoss(0.85, 0.85), speed=800.0)
HYDROSTATIC = Variator("hydrostatic", UnitLoss(0.8, 0.82), ratio=(-1.0, 1.0), speed=400.0)
TWO_MODE = Structure((("Hab", "output"), ("Hab", "Hab")))
TWO_RANGES = Structure((("input", "abH"), ("input", "abH")))


@pytest.fixture(scope="module")
def found() -> SplitPathSpace:
    return split_path_space(
        DUTY, [ELECTRIC, HYDROSTATIC], [TWO_MODE, TWO_RANGES], candidates=64, rounds=2, progress=False
    )


def some(structure: Structure, unit: Variator, *, m: Any, R_o: Any, shifts: Any) -> Designs:
    a, b, c = (np.atleast_2d(np.asarray(x, float)) for x in (m, R_o, shifts))
    raw = Designs(structure, a, b, c, np.ones((1, 2)))
    return geared(raw, DUTY, unit)


def test_the_table_reaches_from_the_best_efficiency_to_the_smallest_unit() -> None:
    """A simple split trades efficiency for size over a long front, of which only the most efficient end used to be shown."""
    space = split_path_space(
        DUTY, [ELECTRIC], [Structure((("input", "Hab"),))], candidates=128, rounds=2, progress=False
    )
    (one,) = space.found
    size, efficiency = one.values["unit_size"], one.values["mean_efficiency"]
    assert np.isfinite(efficiency).sum() > 100
    assert len(one.front()) > 40
    assert space.table.unit_size.min() == pytest.approx(np.nanmin(size), rel=0.01)
    assert space.table.mean_efficiency.max() == pytest.approx(np.nanmax(efficiency), rel=1e-9)


@pytest.mark.parametrize("structure", [TWO_MODE, TWO_RANGES])
def test_ranges_meet_at_equal_speeds(structure: Structure) -> None:
    n = len(structure.planetaries)
    designs = some(
        structure, ELECTRIC, m=[0.3, 0.5, 1.3][:n] if n == 3 else [0.3, 1.1], R_o=[-1.2, -2.0, -0.6][:n], shifts=[0.6]
    )
    speeds = []
    for k in (0, 1):
        network, _ = designs.networks(k, 0.98, 0.99)
        factors = network.speeds() @ np.array([1.0, 0.6])
        speeds.append([float(factors[network.nodes[name]]) for name in network.unit])
    assert speeds[0] == pytest.approx(speeds[1], rel=1e-9)


def test_the_unit_runs_back_in_the_second_range() -> None:
    """As in a hydromechanical tractor transmission: V from its least to its greatest, and back; its range and speed are used."""
    designs = some(TWO_RANGES, HYDROSTATIC, m=[0.35, 1.1], R_o=[-1.2, -2.0], shifts=[0.7])
    V = []
    for k, r in ((0, [0.1, 0.7]), (1, [0.7, 1.5])):
        a, b = designs.unit_speeds(k, np.array([r]))
        V.append((b / a)[0].tolist())
    assert V[0][1] == pytest.approx(V[1][0])
    assert (V[0][1] - V[0][0]) * (V[1][1] - V[1][0]) < 0
    assert np.abs(V).max() == pytest.approx(1.0)
    assert np.abs(designs.unit_speeds(0, np.array([[0.1, 0.7]]))[0]).max() == pytest.approx(400 / 200)


def test_share_of_the_unit_follows_from_the_mechanical_points_alone() -> None:
    """Whatever the basic ratios and layouts: they decide about the meshes' losses only."""
    shares = []
    for layout, R_o in (("Hab", [-1.2, -2.0, -0.6]), ("baH", [-3.0, -0.5, -1.5])):
        ends: Any = ((layout, "output"), (layout, layout))
        designs = some(Structure(ends), ELECTRIC, m=[0.3, 0.5, 1.3], R_o=R_o, shifts=[0.6])
        network, _ = designs.networks(1, 1.0, 1.0)
        r = np.linspace(0.6, 1.5, 7)
        shares.append(flow(network, r, 10.0).K)
        np.testing.assert_allclose(shares[-1], (r - 0.5) * (r - 1.3) / (r * (1.3 - 0.5)), rtol=1e-8, atol=1e-12)


def test_ratio_of_the_unit_is_infinite_where_its_shaft_a_passes_rest() -> None:
    """At the mechanical point 0.3, within the first mode; a unit of limited V cannot do it."""
    designs = some(TWO_MODE, ELECTRIC, m=[0.3, 0.5, 1.3], R_o=[-1.2, -2.0, -0.6], shifts=[0.6])
    rated = rate(designs, DUTY, ELECTRIC, Efficiencies(), np.zeros((1, 7))).values
    assert np.isneginf(rated["V_min"]).all()
    assert np.isposinf(rated["V_max"]).all()
    wide = Variator("wide", ELECTRIC.loss, ratio=(-1e6, 1e6))
    assert np.isnan(rate(designs, DUTY, wide, Efficiencies(), np.zeros((1, 7))).values["V_max"]).all()


def brute(network: Any, low: float, high: float) -> dict[str, float]:
    """The greatest values over a range, with all directions of power: a dense grid, and a denser one around the greatest of it."""
    values: dict[str, Any] = {
        "unit_torque": lambda at: np.abs(at.tau).max(axis=0),
        "unit_speed": lambda at: np.abs(at.w).max(axis=0),
        "unit_power": lambda at: at.unit_power,
        "max_K": lambda at: np.abs(at.K),
        "loss": lambda at: 1 - at.efficiency[0],
    }

    def at(r: Any) -> Any:
        return flow(network, r, np.interp(r, DUTY.r, DUTY.torque), 200.0, loss=ELECTRIC.loss)

    r = np.linspace(low, high, 4001)
    grid, found = at(r), {}
    for name, of in values.items():
        peak = r[int(of(grid).argmax())]
        near = np.linspace(max(peak - (r[1] - r[0]), low), min(peak + (r[1] - r[0]), high), 2001)
        found[name] = float(max(of(grid).max(), of(at(near)).max()))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("seed", few(range(4)))
def test_extrema_are_those_of_a_dense_grid(seed: int) -> None:
    """Random two-mode designs, to 1e-6."""
    rng = np.random.default_rng(seed)
    m, R_o = rng.uniform([0.2, 0.4, 1.0], [0.5, 0.7, 1.8]), -rng.uniform(0.5, 3.0, 3)
    designs = some(TWO_MODE, ELECTRIC, m=m, R_o=R_o, shifts=[rng.uniform(0.3, 0.9)])
    rated = rate(designs, DUTY, ELECTRIC, Efficiencies(), np.zeros((1, 7)), fine=True).values
    ends = bounds(designs, DUTY)[0]
    ranges = [brute(designs.networks(k, 0.98, 0.99)[0], ends[k], ends[k + 1]) for k in (0, 1)]
    worst = {name: max(each[name] for each in ranges) for name in ranges[0]}
    if not np.isfinite(rated["unit_size"][0]):
        assert not all(np.isfinite(v) and v < 1e6 for v in worst.values()) or worst["loss"] >= 1
        return
    assert 1 - rated["min_efficiency"][0] == pytest.approx(worst.pop("loss"), rel=1e-6)
    for name, value in worst.items():
        assert rated[name][0] == pytest.approx(value, rel=1e-6), name


def test_share_of_a_compound_range_is_greatest_between_the_points_of_the_grid() -> None:
    """At r = sqrt(m_a m_b), in closed form without loss; a search looks at the grid, its table between."""
    m_a, m_b = 0.05, 1.9
    unit = Variator("lossless", UnitLoss(), speed=800.0)
    designs = some(Structure((("Hab", "Hab"),)), unit, m=[m_a, m_b], R_o=[-1.2, -2.0], shifts=np.zeros((1, 0)))
    rough, fine = (
        rate(designs, DUTY, unit, Efficiencies(1 - 1e-12, 1 - 1e-12), np.zeros((1, 4)), fine=how).values["max_K"][0]
        for how in (False, True)
    )
    greatest = (np.sqrt(m_b) - np.sqrt(m_a)) ** 2 / (m_b - m_a)
    assert fine == pytest.approx(greatest, rel=1e-9)
    assert rough < greatest * (1 - 1e-5)


@pytest.mark.parametrize(
    ("low", "high", "ratio", "factor"),
    [
        (-2.0, -0.2, (0.1, 1.0), -0.5),
        (-2.0, 0.0, (-1.0, 0.5), 0.5),
        (0.5, 4.0, (0.25, 2.0), 0.5),
        (0.1, 4.0, (0.25, 2.0), np.nan),
    ],
)
def test_gear_that_brings_a_ratio_into_the_range_of_a_unit(
    low: float, high: float, ratio: tuple[float, float], factor: float
) -> None:
    """Of either sign, and none where the span is too wide."""
    assert _fit(low, high, ratio) == pytest.approx(factor, nan_ok=True)


def test_mean_efficiency_is_energy_over_energy() -> None:
    designs = some(TWO_RANGES, ELECTRIC, m=[0.35, 1.1], R_o=[-1.2, -2.0], shifts=[0.7])
    rated = rate(designs, DUTY, ELECTRIC, Efficiencies(), np.zeros((1, 5)))
    supplied = 0.0
    for r, weight, torque in zip(DUTY.r, DUTY.weight, DUTY.torque, strict=True):
        network, _ = designs.networks(0 if r < 0.7 else 1, 0.98, 0.99)
        supplied += weight / flow(network, [r], torque, 200.0, loss=ELECTRIC.loss).efficiency[0, 0]
    assert rated.values["mean_efficiency"][0] == pytest.approx(1 / supplied, rel=1e-12)


def test_front_is_what_nothing_betters(found: SplitPathSpace) -> None:
    table, best = found.table, found.pareto
    assert len(best) >= 2
    for _, row in table.iterrows():
        better = table[(table.mean_efficiency > row.mean_efficiency) & (table.unit_size < row.unit_size)]
        assert row.front is False or better.empty or not bool(row.front)
    assert front(np.array([0.9, np.nan, 0.8, 0.85]), np.array([2.0, 0.1, 1.0, 3.0])).tolist() == [0, 2]
    assert (best.mean_efficiency.diff().dropna() <= 0).all()
    assert (best.unit_size.diff().dropna() < 0).all()


def test_limits_of_the_unit_are_kept(found: SplitPathSpace) -> None:
    rows = found.table[found.table.unit == "hydrostatic"]
    assert len(rows)
    assert (rows.V_max <= 1 + 1e-5).all()
    assert (rows.V_min >= -1 - 1e-5).all()
    limit = float(rows.unit_torque.median())
    tight = Variator("tight", HYDROSTATIC.loss, HYDROSTATIC.ratio, speed=400.0, torque=limit)
    again = split_path_space(DUTY, [tight], [TWO_RANGES], candidates=64, rounds=2, progress=False)
    assert (again.table.unit_torque <= limit * (1 + 1e-5)).all()
    none = Variator("none", HYDROSTATIC.loss, HYDROSTATIC.ratio, speed=400.0, power=1.0)
    assert split_path_space(DUTY, [none], [TWO_RANGES], candidates=8, rounds=1, progress=False).table.empty


def test_the_same_search_finds_the_same(found: SplitPathSpace) -> None:
    again = split_path_space(
        DUTY, [ELECTRIC, HYDROSTATIC], [TWO_MODE, TWO_RANGES], candidates=64, rounds=2, progress=False
    )
    assert again.table.equals(found.table)


def test_later_rounds_better_the_best_of_the_first() -> None:
    first, all_three = (
        split_path_space(DUTY, [ELECTRIC], [TWO_RANGES], candidates=16, rounds=rounds, progress=False).table
        for rounds in (1, 3)
    )
    assert all_three.mean_efficiency[0] > first.mean_efficiency[0] + 1e-4


def test_designs_are_components(found: SplitPathSpace) -> None:
    """The ranges of the table; their unit ratio is that of the table's flows. A unit of any V is a pair of machines."""
    from powertrain.components.cvu import ElectricPair
    from powertrain.components.transmissions import (
        ElectricTransmission,
        NetworkRatio,
        NetworkTransmission,
        OverallRatio,
        RangeTransmission,
    )

    line = int(np.flatnonzero(found.table.unit == "hydrostatic")[0])
    for number, unit, kind in ((line, CVU, RangeTransmission), (0, ElectricPair, ElectricTransmission)):
        assert isinstance(found.part(number), unit)
        part = found.transmission(number)
        assert isinstance(part, kind)
        assert part.spans == tuple(found.ranges(number))
        assert isinstance(found.unit_ratio(number), OverallRatio)
    assert found.table.unit[0] == "electric"
    pair: Any = found.part(0)
    assert float(pair.machine_a.tau_max) == pytest.approx(2 * found.table.unit_torque[0])
    low, high, network = found.ranges(0)[1]
    r = np.linspace(low, high, 5)[1:-1]
    ratio = pt.steady(NetworkRatio(network=network), {"r": r}, outputs=["V"])
    at = flow(network, r, 100.0, loss=found.unit(0).loss)
    np.testing.assert_allclose(ratio["V"].values, at.V, rtol=1e-9)
    one = split_path_space(DUTY, [ELECTRIC], [Structure(TWO_MODE.ranges[:1])], candidates=8, rounds=1, progress=False)
    assert isinstance(one.transmission(0), ElectricTransmission)
    plain = one.transmission(0, CVU())
    assert isinstance(plain, NetworkTransmission)
    assert ratio_of(plain) == NetworkRatio(network=one.ranges(0)[0][2])


def test_variator_of_a_hydrostatic_unit_is_the_unit() -> None:
    unit = HydrostaticUnit(D_b=8e-6, leakage=4e-12, d_a=0.01, d_b=0.01, mue=0.03)
    made = Variator.of(
        "hydrostatic", unit, np.linspace(-1, 1, 33).tolist(), np.linspace(10, 210, 21).tolist(), speed=400.0
    )
    assert made.ratio == (-1.0, 1.0)
    table: Any = made.loss.ab
    found = pt.steady(
        _bench(unit), {"V": 0.5, "load": -100.0, "drive.w_fixed": 200.0}, outputs=["unit.flange_a.tau", "ratio"]
    )
    V, tau = float(found["ratio"]), float(found["unit.flange_a.tau"])
    assert table(V, tau) == pytest.approx(100 * V / tau, abs=0.003)
    assert cvu_of(made.loss).map_ab == table
    with pytest.raises(pt.ParameterError, match="cannot carry any of the torques"):
        Variator.of("weak", VBelt(clamp=1.0), [0.5, 1.0], [500.0])


def _bench(unit: Any) -> Any:
    from powertrain.design.units import UnitBench

    return UnitBench(unit=unit)


def test_several_duties_are_one() -> None:
    field, road = (
        Duty.over(span, {"r": np.linspace(*span, 3), "weight": np.ones(3)}) for span in ((0.1, 0.4), (0.5, 1.5))
    )
    both = Duty.together([(field, 3.0), (road, 1.0)])
    assert both.weight.sum() == pytest.approx(1)
    assert both.weight[both.r < 0.45].sum() == pytest.approx(0.75)
    assert (both.low, both.high) == (0.1, 1.5)
    with pytest.raises(pt.ParameterError, match="none may be negative"):
        Duty.together([(field, -1.0)])


def test_ends_of_a_duty_have_the_torque_of_their_neighbours() -> None:
    duty = Duty.over((0.1, 2.0), {"r": [0.5, 1.5], "weight": [1, 1], "torque": [100.0, 20.0]})
    assert duty.r.tolist() == [0.1, 0.5, 1.0, 1.5, 2.0]
    assert duty.torque.tolist() == [100, 100, 60, 20, 20]


def test_what_is_no_structure() -> None:
    for ranges, said in (
        ((), "needs a range"),
        ((("input", "output"),), "no power is split"),
        ((("input", "abc"),), "the side 'abc' must be one of"),
    ):
        with pytest.raises(pt.ParameterError, match=said):
            Structure(ranges)  # type: ignore[arg-type]
    with pytest.raises(pt.ParameterError, match="is empty"):
        Variator("v", UnitLoss(), (1.0, 0.5))
    with pytest.raises(pt.ParameterError, match=r"torque = -1 N\.m must be positive"):
        Variator("v", UnitLoss(), torque=-1.0)
    with pytest.raises(pt.ParameterError, match="points: from -1 to 1"):
        split_path_space(DUTY, [ELECTRIC], points=(-1.0, 1.0), progress=False)
    assert len({str(s) for s in COMMON}) == 30
    assert math.isinf(ELECTRIC.ratio[1])


def test_figures(found: SplitPathSpace, tmp_path: Any) -> None:
    import matplotlib.pyplot as plt

    from powertrain.design.figures import design_figure, front_figure

    for figure in (design_figure(found, 0, tmp_path / "a.png"), front_figure(found, tmp_path / "b.png")):
        plt.close(figure)
    assert (tmp_path / "a.png").read_bytes()[:4] == (tmp_path / "b.png").read_bytes()[:4] == b"\x89PNG"


@pytest.mark.slow
def test_a_design_drives_in_a_car(tmp_path: Any) -> None:
    """Half a minute: a network like the car's own transmission uses its fuel; one of the program with auxiliary gears drives as well."""
    from powertrain.components.cycles import DriveCycle
    from powertrain.components.transmissions import Network, NetworkRatio, NetworkTransmission
    from powertrain.trials import drive_cycle
    from powertrain.vehicles.split_path_car import SplitPathCar

    path = tmp_path / "short.csv"
    path.write_text("time_s,speed_km_h\n0,0\n3,0\n13,30\n18,30\n27,0\n30,0\n")
    cycle = DriveCycle.from_csv(path)
    same = Network.split_path("abH", "input", -1.7, 0.95)
    duty = Duty.over(
        (0.2, 2.0), {"r": [0.2, 0.6, 1.2, 2.0], "weight": np.ones(4), "torque": [150.0, 150, 80, 60], "speed": 200.0}
    )
    unit = Variator("unit", UnitLoss(0.9, 0.9), ratio=(-0.3, 2.6))
    best = split_path_space(duty, [unit], [Structure((("input", "abH"),))], candidates=64, rounds=2, progress=False)
    cars = [
        SplitPathCar(),
        SplitPathCar(transmission=NetworkTransmission.of(same), unit_ratio=NetworkRatio(network=same)),
        SplitPathCar(transmission=best.transmission(0), unit_ratio=best.unit_ratio(0)),
    ]
    runs = [drive_cycle(car, cycle) for car in cars]
    fuel = [float(run.result["engine.fuel"][-1]) for run in runs]
    assert fuel[1] == pytest.approx(fuel[0], rel=1e-6)
    assert fuel[2] == pytest.approx(fuel[0], rel=0.2)
    assert max(abs(run.audit.closure) for run in runs) < 1e-5


@pytest.mark.slow
def test_a_car_shifts_its_ranges(tmp_path: Any) -> None:
    """A hydromechanical transmission whose unit runs back in the second range, over a drive that needs both."""
    from powertrain.components.cvu import RatioActuator
    from powertrain.components.cycles import DriveCycle
    from powertrain.trials import drive_cycle
    from powertrain.vehicles.split_path_car import SplitPathCar

    path = tmp_path / "short.csv"
    path.write_text("time_s,speed_km_h\n0,0\n3,0\n18,60\n25,60\n38,0\n42,0\n")
    duty = Duty.over(
        (0.2, 2.0), {"r": [0.2, 0.6, 1.2, 2.0], "weight": np.ones(4), "torque": [150.0, 150, 80, 60], "speed": 200.0}
    )
    unit = Variator("hydrostatic", UnitLoss(0.85, 0.85), ratio=(-1.0, 1.0))
    found = split_path_space(duty, [unit], [TWO_RANGES], candidates=64, rounds=2, progress=False)
    car = SplitPathCar(
        transmission=found.transmission(0),
        unit_ratio=found.unit_ratio(0),
        actuator=RatioActuator(T=0.2, rate=0.5, ratio_start=0.2),
    )
    run = drive_cycle(car, DriveCycle.from_csv(path))
    number = run.result["transmission.range"]
    assert {0.0, 1.0} <= set(np.unique(number).tolist())
    assert np.abs(run.result["transmission.cvu.ratio"]).max() < 1.001
    assert abs(run.audit.closure) < 1e-5
    assert run.result["body.v"].max() > 15


@pytest.mark.slow
def test_electric_two_mode_designs_drive_in_a_car(tmp_path: Any) -> None:
    """V is infinite within their modes. The duty contains what the car asks for when it starts, and its engine's speed at full power."""
    from powertrain.components.cvu import RatioActuator
    from powertrain.components.cycles import DriveCycle
    from powertrain.trials import drive_cycle
    from powertrain.vehicles.split_path_car import SplitPathCar

    path = tmp_path / "short.csv"
    path.write_text("time_s,speed_km_h\n0,0\n3,0\n18,60\n25,60\n38,0\n42,0\n")
    duty = Duty.over(
        (0.2, 2.0),
        {
            "r": [0.2, 0.6, 1.2, 2.0],
            "weight": np.ones(4),
            "torque": [650.0, 217, 108, 65],
            "speed": [300.0, 300, 400, 400],
        },
    )
    unit = Variator("electric", UnitLoss(0.85, 0.8), speed=1000.0)
    found = split_path_space(duty, [unit], [TWO_MODE], candidates=64, rounds=2, progress=False)
    assert np.isinf(found.table.V_max[0])
    car = SplitPathCar(
        transmission=found.transmission(0),
        unit_ratio=found.unit_ratio(0),
        actuator=RatioActuator(T=0.2, rate=0.5, ratio_start=0.2),
    )
    run = drive_cycle(car, DriveCycle.from_csv(path))
    assert run.result.time[-1] == 42
    assert abs(run.audit.closure) < 1e-6
    assert set(np.unique(run.result["transmission.range"]).tolist()) == {0.0, 1.0}
    assert run.result["transmission.pair.link.v"].min() > 300
