"""Continuously variable units: losses by the direction of power, maps, ranges, the actuator, and units built of real parts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from cases import few
from joined import Joined, joined, run

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Constant, Ramp, Sine, TimeTable
from powertrain.components.cvu import (
    CVU,
    ActuatedUnit,
    ElectricVariator,
    HydrostaticUnit,
    LimitedUnit,
    RatioActuator,
    TorqueLimiter,
    TractionDrive,
    VariableUnit,
    VBelt,
)


def prescribed(unit: VariableUnit, V: float, w_a: float, load: float, stop: float = 0.01, J: float = 0.0) -> Any:
    """flange_a turns as given, a torque acts on flange_b."""
    parts = unit, rot.ConstantSpeed(w_fixed=w_a), rot.Inertia(J=J), rot.ConstantTorque(tau_constant=load), Constant(k=V)
    joints = "0.flange_a=1.flange 0.flange_b=2.flange_a 2.flange_b=3.flange 0.ratio=4.y"
    return run(joined(*parts, joints=joints), stop)


@pytest.mark.parametrize("V", [-2.0, -0.3, 0.4, 1.5])
@pytest.mark.parametrize("w_a", [-50.0, 50.0])
@pytest.mark.parametrize("load", [-10.0, 10.0])
def test_efficiency_by_the_direction_of_power(V: float, w_a: float, load: float) -> None:
    """Eqs. (25a), (25b): the power at flange_b decides; |P_f| = |P_v| (1 - eta) or |P_v| (1 - eta)/eta."""
    result = prescribed(CVU(eta_ab=0.9, eta_ba=0.8), V, w_a, load)
    T_a, T_b = (result[f"parts[0].flange_{side}.tau"][-1] for side in "ab")
    P_v = -T_b * V * w_a  # given to what stands at flange_b
    assert T_b == pytest.approx(load)
    loss = result["parts[0].lossPower"][-1]
    assert loss == pytest.approx(abs(P_v) * (1 - 0.8) if P_v < 0 else abs(P_v) * (1 - 0.9) / 0.9, rel=1e-9)
    assert T_a * w_a + T_b * V * w_a == pytest.approx(loss, rel=1e-9)
    assert T_a * w_a == pytest.approx(-0.8 * T_b * V * w_a if P_v < 0 else P_v / 0.9, rel=1e-9)


@pytest.mark.parametrize("load", [-10.0, 10.0])
def test_geared_neutral(load: float) -> None:
    """At V = 0 flange_b stands still whatever acts on it, and flange_a turns freely."""
    result = prescribed(CVU(eta_ab=0.9, eta_ba=0.9), 0.0, 50.0, load)
    assert result["parts[0].flange_a.tau"][-1] == pytest.approx(0, abs=1e-12)
    assert result["parts[0].w_b"][-1] == 0


def swinging(unit: VariableUnit, *ratio: pt.Component, joints: str) -> Joined:
    """Two inertias, a swinging torque at flange_a, drag at flange_b."""
    inertias = rot.Inertia(J=0.1), rot.Inertia(J=0.2)
    torques = rot.Torque(), Sine(f=0.5, amplitude=5, offset=1), rot.Damper(d=0.1), rot.Fixed()
    wired = "0.flange_a=1.flange_a 0.flange_b=2.flange_a 1.flange_b=3.flange 3.tau=4.y 2.flange_b=5.flange_a 5.flange_b=6.flange"
    return joined(unit, *inertias, *torques, *ratio, joints=f"{wired} {joints}")


def test_changing_ratio_between_two_inertias() -> None:
    """J_a w_a' + J_b (V w_a)' V = T - d V^2 w_a without loss: the rate of the ratio brakes or drives."""
    model = swinging(CVU(), Ramp(height=1.0, duration=4.0, offset=0.5), joints="0.ratio=7.y")
    result = run(model, 3.0)
    t, w = result.time, result["parts[1].w"]
    V = 0.5 + t / 4
    right = 1 + 5 * np.sin(np.pi * t) - 0.1 * V**2 * w - 0.2 * V / 4 * w
    np.testing.assert_allclose(result["parts[1].a"], right / (0.1 + 0.2 * V**2), atol=1e-7)
    np.testing.assert_allclose(result["parts[2].w"], V * w, atol=1e-9)
    assert pt.energy_audit(result).closure < 1e-7


UNITS = [
    CVU(eta_ab=0.9, eta_ba=0.85),
    VBelt(clamp=500),
    TractionDrive(clamp=100),
    HydrostaticUnit(D_b=3e-6, leakage=2e-11, C=1e-11, d_a=0.01, d_b=0.01, mue=0.05),
    ElectricVariator(k=5),
    LimitedUnit(tau_max=2.0, unit=CVU(eta_ab=0.9, eta_ba=0.9)),
]


@pytest.mark.parametrize("unit", UNITS, ids=[type(unit).__name__ for unit in UNITS])
def test_energy_of_every_kind_of_unit(unit: VariableUnit) -> None:
    actuator = RatioActuator(ratio_start=0.6, rate=0.5)
    table = TimeTable(table=((0, 0.6), (1, 0.6), (1, 1.4), (3, 1.4)))
    result = run(swinging(unit, actuator, table, joints="0.ratio=7.ratio 7.demand=8.y"), 3.0)
    audit = pt.energy_audit(result)
    assert audit.closure < 1e-6
    assert np.asarray(audit.loss).min() > -1e-7
    rolling = result["parts[0].w_b"] - result["parts[7].ratio"] * result["parts[0].w_a"]
    assert np.abs(rolling).max() < 1e-9 if isinstance(unit, CVU) else np.abs(rolling).max() > 1e-4


@pytest.mark.parametrize("unit", few(UNITS, 2), ids=[type(unit).__name__ for unit in UNITS])
def test_mirrored_torque_gives_mirrored_motion(unit: VariableUnit) -> None:
    runs = []
    for sign in (1.0, -1.0):
        model = swinging(unit, Constant(k=0.8), joints="0.ratio=7.y")
        changes = {"parts[4].amplitude": 5 * sign, "parts[4].offset": sign}
        runs.append(pt.simulate(model, 2.0, parameters=changes, rtol=1e-9))
    for i in (1, 2):
        assert runs[0][f"parts[{i}].w"][-1] == pytest.approx(-runs[1][f"parts[{i}].w"][-1], rel=1e-5, abs=1e-7)


def test_efficiency_map() -> None:
    axes = pt.Map.curve([0, 100], [0.8, 0.9], x="w_a", x_unit="rad/s").axes[0]
    ratio = pt.Map.curve([0, 2], [0, 0], x="ratio").axes[0]
    table = pt.Map((axes, ratio), [[0.8, 0.9], [0.9, 0.95]], "1", "efficiency")
    result = prescribed(CVU(map_ab=table, map_ba=table), 1.5, 40.0, -10.0)
    a, b = (result[f"parts[0].flange_{side}.tau"][-1] for side in "ab")
    assert -b * 1.5 / a == pytest.approx(table(40.0, 1.5), rel=1e-9)
    wrong = pt.Map.curve([0, 1], [0.9, 0.9], x="T", x_unit="K")
    with pytest.raises(pt.ParameterError, match=r"map_ab: an efficiency cannot depend on T \[K\], only on ratio"):
        prescribed(CVU(map_ab=wrong), 1.5, 40.0, -10.0)


def test_ratio_outside_its_range_is_an_error() -> None:
    model = swinging(
        CVU(ratio_min=0.4, ratio_max=2.5), Ramp(height=4.0, duration=2.0, offset=0.5), joints="0.ratio=7.y"
    )
    with pytest.raises(
        pt.SimulationError,
        match=r"speed ratio of the variable unit \(parts\[0\].*above 2\.5; allowed is 0\.4 to 2\.5",
    ):
        run(model, 2.0)
    for values, message in (
        ({"eta_ab": 0.0}, r"eta_ab = 0 is outside its range \(0, 1\]"),
        ({"eta_ba": 1.2}, "eta_ba"),
    ):
        with pytest.raises(pt.ParameterError, match=message):
            CVU(**values)  # type: ignore[arg-type]


def test_actuator_keeps_rate_and_range() -> None:
    actuator = RatioActuator(ratio_min=0.5, ratio_max=2.0, rate=0.8, T=0.1, ratio_start=1.0)
    table = TimeTable(table=((0, 1), (0.5, 1), (0.5, 9), (3, 9), (3, -9), (6, -9)))
    result = run(joined(actuator, table, joints="0.demand=1.y"), 6.0)
    t, V = result.time, result["parts[0].ratio"]
    rate = np.diff(V) / np.maximum(np.diff(t), 1e-12)
    assert np.abs(rate).max() < 0.8 * (1 + 1e-4)
    assert V.min() >= 0.5 - 1e-9
    assert V.max() <= 2.0 + 1e-9
    assert result.at(1.5, "parts[0].ratio") == pytest.approx(1.0 + 0.8, abs=1e-6)
    assert result.at(3.0, "parts[0].ratio") == pytest.approx(2.0, abs=1e-4)
    assert V[-1] == pytest.approx(0.5, abs=1e-4)


def test_an_actuator_with_an_empty_range_is_refused() -> None:
    with pytest.raises(pt.ParameterError, match=r"with ratio_min = 2.6, ratio_max = 0.4"):
        RatioActuator(ratio_min=2.6, ratio_max=0.4)


@pytest.mark.parametrize("start", [0.3, 2.7])
def test_an_actuator_that_starts_outside_its_range_is_refused(start: float) -> None:
    """It went back into its range in silence."""
    with pytest.raises(pt.ParameterError, match=rf"ratio_start = {start}"):
        RatioActuator(ratio_min=0.4, ratio_max=2.6, ratio_start=start)


@pytest.mark.parametrize(("unit", "limit"), [(VBelt(), "belt"), (TractionDrive(), "traction")])
def test_friction_drives_creep_under_load(unit: VariableUnit, limit: str) -> None:
    """Creep follows the load by x/sqrt(1 + x^2); the speed ratio falls by it; the torques are those of the radii."""
    V, w_a = 0.8, 100.0
    r_b = 2 * 0.05 / 1.8 if limit == "belt" else 2 * 0.06 / 1.8
    force = 2 * 0.09 * 2e4 / np.cos(0.192) if limit == "belt" else 6 * 0.06 * 1e4
    load = -0.5 * force * r_b
    result = prescribed(unit, V, w_a, load, stop=2.0, J=0.01)
    x = 0.5 / np.sqrt(1 - 0.25)
    w_b = result["parts[0].w_b"][-1]
    rolling = np.sqrt(1 + (V * w_a) ** 2 / 2 + w_b**2 / 2)
    assert (V * w_a - w_b) / rolling == pytest.approx(0.01 * x, rel=1e-6)
    assert result["parts[0].flange_a.tau"][-1] == pytest.approx(-V * load, rel=1e-6)
    assert result["parts[0].r_a"][-1] / result["parts[0].r_b"][-1] == pytest.approx(V)
    overloaded = prescribed(unit, V, w_a, -1.2 * force * r_b, stop=1.0, J=1.0)
    assert overloaded["parts[0].w_b"][-1] < 0


@pytest.mark.parametrize(
    ("V", "V_full", "counted"), [(0.7, 1.0, 1.0), (0.1, 1.0, 1.0), (0.7, 2.0, 2.0), (1.3, 1.0, 1.3)]
)
def test_hydrostatic_unit_by_wilsons_losses(V: float, V_full: float, counted: float) -> None:
    """The dry friction of the pump is that of its full displacement, also where it displaces little."""
    w_a, load, D, leak, d, mue = 150.0, -40.0, 8e-6, 2e-12, 0.02, 0.04
    unit = HydrostaticUnit(D_b=D, V_full=V_full, leakage=leak, d_a=d, d_b=d, mue=mue)
    result = prescribed(unit, V, w_a, load, stop=20.0, J=0.01)
    p, w_b = result["parts[0].p"][-1], result["parts[0].w_b"][-1]
    assert D * (V * w_a - w_b) == pytest.approx(leak * p, rel=1e-5)
    assert -load == pytest.approx(D * p * (1 - mue) - d * w_b, rel=1e-6)
    assert result["parts[0].flange_a.tau"][-1] == pytest.approx(D * p * (V + mue * counted) + d * w_a, rel=1e-6)


@pytest.mark.parametrize("V", [0.8, -0.8])
def test_relief_valve_of_a_slow_motor(V: float) -> None:
    """The motor takes a small part of the flow of the pump; the rest goes through leakage and valve, and its power becomes heat."""
    D, w_a, w_b, leak, relief, p_max, mue = 8e-6, 150.0, 5.0, 2e-12, 4e-10, 40e6, 0.03
    unit = HydrostaticUnit(D_b=D, leakage=leak, p_max=p_max, relief=relief, mue=mue)
    speeds = rot.ConstantSpeed(w_fixed=w_a), rot.ConstantSpeed(w_fixed=np.copysign(w_b, V))
    held = joined(unit, *speeds, Constant(k=V), joints="0.flange_a=1.flange 0.flange_b=2.flange 0.ratio=3.y")
    result = run(held, 1.0)
    flow = D * (abs(V) * w_a - w_b)
    p = (flow + relief * p_max) / (leak + relief)
    assert 40e6 < p < 43e6
    assert result["parts[0].p"][-1] == pytest.approx(np.copysign(p, V), rel=1e-6)
    assert result["parts[0].flange_a.tau"][-1] == pytest.approx(D * p * (abs(V) + mue), rel=1e-6)
    assert abs(result["parts[0].flange_b.tau"][-1]) == pytest.approx(D * p * (1 - mue), rel=1e-6)
    assert result["parts[0].lossPower"][-1] == pytest.approx(flow * p + mue * D * p * (w_a + w_b), rel=1e-6)
    assert pt.energy_audit(result).closure < 1e-6


def test_electric_variator_keeps_ratio_and_link() -> None:
    result = prescribed(ElectricVariator(), 0.6, 100.0, -50.0, stop=3.0, J=0.02)
    unit = "parts[0]."
    tau_a, tau_b, w_b = (result[unit + name][-1] for name in ("tau_a", "tau_b", "w_b"))
    assert w_b == pytest.approx(60 - 50.6 / 100, rel=2e-3)
    assert result[unit + "E"][-1] == pytest.approx(5e3, rel=2e-2)
    losses = 0.05 * (tau_a**2 + tau_b**2) + 2e-3 * (100**2 + w_b**2)
    assert tau_a * 100 + tau_b * w_b == pytest.approx(losses, rel=1e-6)
    needed = tau_a / np.sqrt(1 - (tau_a / 300) ** 2) * (100**2 + 1) / 100  # as if the torque had no limit
    missing = needed + tau_b * w_b - 0.05 * tau_b**2 - 2e-3 * (100**2 + w_b**2)
    assert result[unit + "E"][-1] == pytest.approx(5e3 - missing / 50, rel=1e-9)
    assert missing > 0.05 * tau_a**2


def test_electric_variator_gives_no_more_than_its_link_holds() -> None:
    """V w_a T_b = 4 kW need 400 N.m from flange_a, which 300 N.m cannot be: the link runs empty."""
    with pytest.raises(pt.SimulationError, match=r"energy in the link .* leaves its range"):
        prescribed(ElectricVariator(), 4.0, 10.0, -100.0, stop=30.0, J=0.02)


def test_torque_limiter_slips_beyond_its_torque() -> None:
    parts = TorqueLimiter(tau_max=5.0), rot.ConstantSpeed(w_fixed=10), rot.Inertia(J=0.1)
    for load, mode in ((-4.9, 0), (-5.1, -1), (5.1, 1)):
        model = joined(
            *parts,
            rot.ConstantTorque(tau_constant=load),
            joints="0.flange_a=1.flange 0.flange_b=2.flange_a 2.flange_b=3.flange",
        )
        result = run(model, 1.0, starts={"2.w": 10.0})
        assert result["parts[0].mode"][-1] == mode
        assert abs(result["parts[0].tau"][-1]) <= 5.0 + 1e-12


def test_actuated_unit_takes_any_demand() -> None:
    """A step of the demand beyond the range: the ratio follows at its rate and stays at its limit."""
    unit = ActuatedUnit(ratio_min=0.4, ratio_max=1.4, rate=0.5, ratio_start=0.6, unit=CVU(eta_ab=0.9, eta_ba=0.9))
    result = run(swinging(unit, TimeTable(table=((0, 0.6), (1, 0.6), (1, 5), (4, 5))), joints="0.ratio=7.y"), 4.0)
    V = result["parts[0].unit.ratio"]
    assert result.at(2.0, "parts[0].unit.ratio") == pytest.approx(0.6 + 0.5, rel=1e-6)
    assert V[-1] == pytest.approx(1.4, abs=1e-5)
    np.testing.assert_allclose(result["parts[0].w_b"], V * result["parts[0].w_a"], atol=1e-9)
    assert pt.energy_audit(result).closure < 1e-6


@pytest.mark.parametrize("E_0", [5e3, 5e4])
def test_map_of_an_electric_variator(E_0: float) -> None:
    """The slip of the speed control from its torque, the torque of the other machine from the balance of powers, a quadratic equation."""
    from powertrain.design.units import UnitBench

    V, load, w_a = np.linspace(-1, 1, 5), np.array([-100.0, -20.0, 40.0]), 200.0
    found = pt.steady(
        UnitBench(unit=ElectricVariator(E_0=E_0)),
        {"V": V, "load": load, "drive.w_fixed": w_a},
        outputs=["unit.flange_a.tau", "ratio"],
        progress=False,
    )
    assert (found.status == 0).all()
    k, limit, copper, iron = 100.0, 300.0, 0.05, 2e-3
    w_b = V[:, None] * w_a - -load / np.sqrt(1 - (load / limit) ** 2) / k
    needed = copper * load**2 + iron * (w_a**2 + w_b**2) - load * w_b
    tau_a = (w_a - np.sqrt(w_a**2 - 4 * copper * needed)) / (2 * copper)
    np.testing.assert_allclose(found["ratio"].values, w_b / w_a, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found["unit.flange_a.tau"].values, tau_a, rtol=1e-8)


@pytest.mark.parametrize("coupling", ["input", "output"])
@pytest.mark.parametrize("layout", few(["aHb", "abH", "bHa", "Hba", "baH", "Hab"]))
@pytest.mark.parametrize("unit", [TractionDrive(), VBelt(), LimitedUnit(tau_max=100), ElectricVariator()])
def test_points_at_the_ratio_of_a_transmission_are_those_at_the_ratio_of_its_unit(
    unit: VariableUnit, layout: Any, coupling: Any
) -> None:
    """Where the unit keeps its ratio. Slipping as a whole it has other ratios that balance the same load."""
    from powertrain.components.transmissions import SplitPathTransmission
    from powertrain.design import SplitPathBench

    bench = pt.compile(SplitPathBench(transmission=SplitPathTransmission(layout=layout, coupling=coupling, cvu=unit)))
    V = np.linspace(0.3, 2.7, 7) if isinstance(unit, VBelt | LimitedUnit) else np.linspace(-1.9, 1.8, 7)
    speeds = "transmission.cvu.w_a", "transmission.cvu.w_b"
    given = pt.steady(bench, {"V": V, "load": [-40.0, -10.0, 10.0]}, outputs=["r", *speeds], progress=False)
    given = given.stack(point=["V", "load"])
    slip = 1.0 - given[speeds[1]] / (given.V * given[speeds[0]])
    given = given.sel(point=(given.status == 0) & (abs(slip) < 0.02))
    grid = {name: xr.DataArray(given[name].values, dims="point") for name in ("r", "load")}
    found = pt.steady(bench, grid, outputs=["V"], first=True, progress=False)
    turning = found.status.values != 1  # at a synchronous point the mesh is stuck
    assert turning.sum() >= 3
    assert np.isin(found.status.values[turning], [0, 2]).all()
    np.testing.assert_allclose(found.V.values[turning], given.V.values[turning], rtol=1e-6)


@pytest.mark.parametrize("coupling", ["input", "output"])
@pytest.mark.parametrize("unit", [ElectricVariator(), HydrostaticUnit(leakage=1e-12)])
def test_transmissions_with_real_units_have_maps(unit: VariableUnit, coupling: Any) -> None:
    """At light load close to those of an ideal unit; at r = 1 the mesh is stuck."""
    from powertrain.components.transmissions import SplitPathTransmission
    from powertrain.design import SplitPathBench

    maps = []
    for cvu in (unit, CVU()):
        bench = SplitPathBench(transmission=SplitPathTransmission(layout="Hba", coupling=coupling, cvu=cvu))
        grid = {"r": np.array([0.4, 0.8, 1.0, 1.2, 1.6]), "load": np.array([-30.0, 10.0])}
        maps.append(pt.steady(bench, grid, outputs=["V"], progress=False))
    real, ideal = maps
    np.testing.assert_array_equal(real.status.values, ideal.status.values)
    moving = real.status.values == 0
    assert moving.sum() == 8
    np.testing.assert_allclose(real.V.values[moving], ideal.V.values[moving], rtol=0.05)


@pytest.mark.parametrize("V", few([-2.0, -0.5, 1.0, 2.0]))
@pytest.mark.parametrize("w_a", [20.0, 500.0])
def test_single_points_of_an_electric_variator(V: float, w_a: float) -> None:
    """Far from where the search begins, with saturated torques on the way; none where the machine at flange_a cannot bear the power.

    copper T_a^2 - w_a T_a + needed = 0 has no root below tau_max there: the link would run empty.
    """
    from powertrain.design.units import UnitBench

    k, limit, copper, iron, statuses = 100.0, 300.0, 0.05, 2e-3, set()
    for load in (-150.0, -30.0, 30.0, 150.0):
        found = pt.steady(
            UnitBench(unit=ElectricVariator()),
            {"V": V, "load": load, "drive.w_fixed": w_a},
            outputs=["unit.flange_a.tau", "ratio"],
        )
        w_b = V * w_a + load / np.sqrt(1 - (load / limit) ** 2) / k
        needed = copper * load**2 + iron * (w_a**2 + w_b**2) - load * w_b
        root = w_a**2 - 4 * copper * needed
        tau_a = (w_a - np.sqrt(root)) / (2 * copper) if root >= 0 else np.inf
        statuses.add(int(found.status))
        assert (int(found.status) == 0) == (abs(tau_a) < limit)
        if int(found.status) == 0:
            assert float(found["unit.flange_a.tau"]) == pytest.approx(tau_a, rel=1e-9)
            assert float(found["ratio"]) == pytest.approx(w_b / w_a, rel=1e-9)
    assert statuses <= {0, 6}
