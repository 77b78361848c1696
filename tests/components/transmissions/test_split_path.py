"""Yu & Beachley's transmission from its parts: the printed example, both couplings, sweeps through r = 1 and through zero."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from cases import few
from split_path_rigs import Bench, Stand, ThreePowers

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.cvu import CVU, HydrostaticUnit, TractionDrive, VBelt
from powertrain.components.differentials import FundamentalDifferential, Planets, Ring, Sun
from powertrain.components.transmissions import (
    TYPES,
    Coupling,
    Layout,
    SplitPathTransmission,
    overall_ratio,
    unit_ratio,
)

EXAMPLE = FundamentalDifferential.from_teeth(Sun(90), Ring(153), Planets(31), eta_ab=0.95, eta_ba=0.95)
UNIT = CVU(eta_ab=0.9, eta_ba=0.9)


def numbers(values: Any, prefix: str = "transmission.") -> dict[str, float]:
    """The quantities that the worked example prints, from the flanges of the parts (b at 1, H at 2, a at 3)."""

    def at(name: str) -> float:
        return float(np.asarray(values[prefix + name]).ravel()[-1])

    w = {"b": 100.0, "carrier": at("cvu.w_b"), "a": at("differential.w_rel") + at("cvu.w_b")}
    T = {name: at(f"differential.{name}.tau") for name in w}
    P = {name: T[name] * w[name] for name in w}
    P_in, P_out = at("flange_a.tau") * 100, P["a"]
    P_f = -at("differential.lossPower")
    return {
        "V": w["carrier"] / w["b"],
        "N_H/N_a": w["carrier"] / w["a"],
        "S_a": T["a"] * (w["a"] - w["carrier"]) / P["a"],
        "T_b/T_a": T["b"] / T["a"],
        "T_H/T_a": T["carrier"] / T["a"],
        "P_b/P_a": P["b"] / P["a"],
        "P_H/P_a": P["carrier"] / P["a"],
        "P_f/P_a": P_f / P["a"],
        "eta_d": -(P["a"] + P["carrier"]) / P["b"] * 100,
        "P_fv/P_out": at("cvu.lossPower") / abs(P_out),
        "loss/P_out": -(at("differential.lossPower") + at("cvu.lossPower")) / P_out,
        "P_in/P_out": P_in / P_out,
        "eta_oa": -P_out / P_in * 100,
        "K": P["carrier"] / P_in,
    }


PRINTED = {
    "V": "0.581",
    "N_H/N_a": "-4.47",
    "S_a": "5.47",
    "T_b/T_a": "1.789",
    "T_H/T_a": "-2.789",
    "P_b/P_a": "-13.77",
    "P_H/P_a": "12.48",
    "P_f/P_a": "0.288",
    "eta_d": "97.9",
    "P_fv/P_out": "1.248",
    "loss/P_out": "1.536",
    "P_in/P_out": "-2.536",
    "eta_oa": "39.4",
    "K": "-4.92",
}


def check_printed(found: dict[str, float], slack: float = 0.0) -> None:
    for name, text in PRINTED.items():
        half = 0.5 * 10.0 ** -len(text.split(".")[1])
        assert abs(found[name] - float(text)) <= half + slack * abs(float(text)), (name, found[name], text)


def test_printed_example_at_a_steady_point() -> None:
    """Printed to every digit; the closed form to 1e-9."""
    stand = Stand(transmission=SplitPathTransmission(layout="bHa", differential=EXAMPLE, cvu=UNIT))
    V = unit_ratio("bHa", -1.7, -0.13)
    point = pt.steady(stand, {"V": [V], "torque": [50.0]})
    assert point["status"].item() == 0
    found = numbers(point)
    check_printed(found)
    ratio = 1.7 / 0.95
    closed = {"T_b/T_a": ratio, "T_H/T_a": -1 - ratio, "P_b/P_a": -ratio / 0.13, "P_H/P_a": (1 + ratio) * V / 0.13}
    P_in = closed["P_b/P_a"] + 0.9 * closed["P_H/P_a"]
    closed |= {"V": V, "P_in/P_out": P_in, "eta_oa": -100 / P_in, "K": closed["P_H/P_a"] / P_in}
    for name, value in closed.items():
        assert found[name] == pytest.approx(value, rel=1e-9), name


def test_printed_example_at_the_end_of_a_simulation() -> None:
    """Small inertias and an elastic shaft, which the load's step has set swinging."""
    bench = Bench(transmission=SplitPathTransmission(layout="bHa", differential=EXAMPLE, cvu=UNIT))
    V = unit_ratio("bHa", -1.7, -0.13)
    start = {"J1.w": 100.0}
    result = pt.simulate(bench, 1.0, starts=start, inputs={"V": V, "torque": 50.0}, rtol=1e-9, atol=1e-9)
    assert np.ptp(result["J1.w"]) > 0.01
    assert pt.energy_audit(result).closure < 1e-7
    check_printed(numbers(result), slack=1e-5)


@pytest.mark.parametrize(("N_a", "P_b", "P_h"), [(-0.03, "-59.6", "57.5"), (0.03, "53.8", "-55.9")])
def test_figure_6(N_a: float, P_b: str, P_h: str) -> None:
    """Powers connected to each member: the signs change over N_a/N_b = 0 (the text's 0.05 is a misprint for 0.03)."""
    w_h = (N_a + 1.7) / 2.7 * 100
    torque = 10.0 if N_a < 0 else -10.0  # a is the output
    rig = ThreePowers(
        differential=EXAMPLE,
        b=rot.ConstantSpeed(w_fixed=100),
        carrier=rot.ConstantSpeed(w_fixed=w_h),
        a=rot.ConstantTorque(tau_constant=torque),
    )
    result = pt.simulate(rig, 0.01)
    P = {n: result[f"differential.{n}.tau"][-1] * w for n, w in (("a", 100 * N_a), ("b", 100.0), ("carrier", w_h))}
    assert P["a"] < 0
    assert f"{P['b'] / P['a']:.1f}" == P_b
    assert f"{P['carrier'] / P['a']:.1f}" == P_h


def closed_form(layout: Layout, V: float, coupling: Coupling) -> tuple[float, float]:
    """r and efficiency from the powers of the three members; of all modes of mesh and unit the consistent one counts."""
    R_o, eta, eta_v = -1.7, 0.95, 0.9
    r = overall_ratio(layout, R_o, V, coupling)
    w = np.array([1.0, V if coupling == "input" else V * r, r])
    place = {name: i for i, name in enumerate(layout)}
    relative = w[place["a"]] - w[place["H"]]
    found = []
    for exponent, power_3 in itertools.product((1, -1), (1.0, -1.0)):
        T = np.zeros(3)
        T[place["a"]], T[place["b"]] = 1.0, -R_o * eta**exponent
        T[place["H"]] = -T[place["a"]] - T[place["b"]]
        T *= power_3 / (T[2] * r)
        P_2 = T[1] * w[1]
        into_unit = P_2 / eta_v if P_2 > 0 else P_2 * eta_v
        P_in = T[0] * w[0] + (into_unit if coupling == "input" else 0)
        P_out = power_3 + (into_unit if coupling == "output" else 0)
        if T[place["a"]] * relative * exponent > 0 and P_out < 0 < P_in:
            found.append(-P_out / P_in)
    assert len(found) == 1, (layout, coupling, V, found)
    return r, found[0]


@pytest.mark.parametrize("layout", TYPES.values())
@pytest.mark.parametrize("coupling", few(["input", "output"]))
def test_all_layouts_against_an_independent_derivation(layout: Layout, coupling: Coupling) -> None:
    """Ratio and efficiency, with power from flange_a to flange_b."""
    stand = Stand(transmission=SplitPathTransmission(layout=layout, coupling=coupling, cvu=UNIT))
    for V in (0.45, 0.8, 1.25):
        r, efficiency = closed_form(layout, V, coupling)
        point = pt.steady(stand, {"V": [V], "torque": [-20.0 * np.sign(r)]})
        assert point["status"].item() == 0
        T_in, T_out = (point[f"transmission.flange_{side}.tau"].item() for side in "ab")
        assert -T_out * r / T_in == pytest.approx(efficiency, rel=1e-9), (layout, coupling, V)


def test_sweep_through_latent_power_reversal_and_r_of_one() -> None:
    """r from -0.5 through 0 (Fig. 6: powers of a change sign, no event) and through 1 (the mesh changes its mode once)."""
    bench = Bench(
        transmission=SplitPathTransmission(layout="bHa", differential=EXAMPLE, cvu=UNIT), drag=rot.Damper(d=0.5)
    )
    V = [unit_ratio("bHa", -1.7, r) for r in (-0.5, 1.5)]
    starts = {"J1.w": 100.0}
    result = pt.simulate(bench, 4.0, starts=starts, inputs={"V": ([0.0, 4.0], V)}, rtol=1e-8, atol=1e-8)
    r = result["J3.w"] / result["J1.w"]
    assert r[0] == pytest.approx(-0.5, abs=1e-6)
    assert r[-1] == pytest.approx(1.5, abs=1e-6)
    modes = result["transmission.differential.mode"]
    assert np.count_nonzero(np.diff(modes)) == 1
    changed = int(np.flatnonzero(np.diff(modes))[0])
    assert r[changed] == pytest.approx(1.0, abs=2e-3)
    assert set(result["transmission.cvu.mode"]) == {1}
    assert np.sign(result["transmission.differential.a.tau"][[2, -1]]).tolist() == [1.0, -1.0]
    assert pt.energy_audit(result).closure < 1e-7
    for part in ("differential", "cvu"):
        loss = result[f"transmission.{part}.lossPower"]
        assert loss.min() > -1e-6 * loss.max()


@pytest.mark.parametrize(
    "unit", few([VBelt(r_mean=0.2), TractionDrive(e=0.2), HydrostaticUnit(D_b=8e-5, leakage=1e-11, C=1e-11)], 2)
)
@pytest.mark.parametrize("layout", ["bHa", "abH"])
def test_mesh_sticks_where_the_variable_unit_gives_way(layout: Any, unit: Any) -> None:
    """Forward - stuck - backward about r = 1, where a unit with creep leaves the mesh its choice: no chattering, energy closed."""
    bench = Bench(
        transmission=SplitPathTransmission(layout=layout, differential=EXAMPLE, cvu=unit), drag=rot.Damper(d=0.5)
    )
    table = ([0.0, 3.0, 4.0, 7.0], [0.7, 1.0, 1.0, 1.3])
    starts = {"J1.w": 100.0, "J3.w": 100 * overall_ratio(layout, -1.7, 0.7)}
    result = pt.simulate(bench, 7.0, starts=starts, inputs={"V": table}, rtol=1e-8, atol=1e-8)
    modes = result["transmission.differential.mode"]
    visited = [int(modes[0]), *(int(m) for m in modes[1:][np.diff(modes) != 0])]
    assert visited[0] == -visited[-1] != 0
    assert 0 in visited
    assert len(visited) == 3
    stuck = modes == 0
    assert np.abs(result["transmission.differential.w_rel"][stuck]).max() < 1e-9
    assert pt.energy_audit(result).closure < 1e-6


@pytest.mark.parametrize("layout", TYPES.values())
@pytest.mark.parametrize("coupling", few(["input", "output"]))
def test_ratio_held_at_one(layout: Layout, coupling: Coupling) -> None:
    """The mesh is at rest whatever its torque, of which the least is taken."""
    part = SplitPathTransmission(layout=layout, coupling=coupling, differential=EXAMPLE, cvu=UNIT)
    plant = pt.compile(Bench(transmission=part, drag=rot.Damper(d=0.5)))
    for V in (0.9, 1.1):
        result = plant.simulate(1.0, starts={"J1.w": 100.0}, inputs={"V": ([0.0, 0.5, 1.0], [V, 1.0, 1.0])})
        assert result["J3.w"][-1] == pytest.approx(result["J1.w"][-1], rel=1e-12)
        assert result["transmission.differential.w_rel"][-1] == pytest.approx(0.0, abs=1e-9)
        assert set(result["transmission.differential.mode"][result.time > 0.5]) == {0.0}
        assert pt.energy_audit(result).closure < 1e-6


@pytest.mark.parametrize("layout", TYPES.values())
@pytest.mark.parametrize("coupling", ["input", "output"])
def test_ideal_limit(layout: Layout, coupling: Coupling) -> None:
    """Without loss every path gives the power back: T_1 w_1 + T_3 w_3 = 0."""
    ideal = FundamentalDifferential(ratio=-1.7)
    part = SplitPathTransmission(layout=layout, coupling=coupling, differential=ideal, cvu=CVU())
    points = pt.steady(Stand(transmission=part), {"V": [0.45, 1.4], "torque": [-20.0]})
    r = [overall_ratio(layout, -1.7, V, coupling) for V in (0.45, 1.4)]
    into, out = (points[f"transmission.flange_{side}.tau"].values.ravel() for side in "ab")
    np.testing.assert_allclose(into, -out * r, rtol=1e-9)


def test_interval_where_all_turns_as_one_block() -> None:
    """At r = 1 the mesh is stuck: T_b lies between -R_o T_a eta and -R_o T_a/eta, the input torque between what follows from these."""
    stand = Stand(transmission=SplitPathTransmission(layout="bHa", differential=EXAMPLE, cvu=UNIT))
    points = pt.steady(stand, {"V": [0.9, 1.0, 1.1], "torque": [-50.0]})
    assert points["status"].values.ravel().tolist() == [0, 1, 0]
    low, high = (points[f"transmission.flange_a.tau_{end}"].values.ravel()[1] for end in ("low", "high"))
    expected = [b + (50 - b) / 0.9 for b in (-85 * 0.95, -85 / 0.95)]
    assert (low, high) == pytest.approx(tuple(expected), rel=1e-9)


@pytest.mark.parametrize("coupling", few(["input", "output"]))
def test_relabelled_members(coupling: Coupling) -> None:
    """Exchanging the names a and b (R_o -> 1/R_o, eta_ab <-> eta_ba) changes nothing outside."""
    one = FundamentalDifferential(ratio=-1.7, eta_ab=0.95, eta_ba=0.92)
    other = FundamentalDifferential(ratio=-1 / 1.7, eta_ab=0.92, eta_ba=0.95)
    swap = str.maketrans("ab", "ba")
    for layout in TYPES.values():
        renamed: Any = layout.translate(swap)
        torques = []
        pairs: list[tuple[Any, FundamentalDifferential]] = [(layout, one), (renamed, other)]
        for name, differential in pairs:
            part = SplitPathTransmission(layout=name, coupling=coupling, differential=differential, cvu=UNIT)
            points = pt.steady(Stand(transmission=part), {"V": [0.45, 0.8, 1.25], "torque": [-20.0, 20.0]})
            torques.append(points["transmission.flange_a.tau"].values)
        np.testing.assert_allclose(torques[0], torques[1], rtol=1e-9)


@pytest.mark.parametrize("layout", TYPES.values())
def test_mirrored_motion_and_torque(layout: Layout) -> None:
    """Opposite speed and torque give the opposite torque at the input."""
    part = SplitPathTransmission(layout=layout, differential=EXAMPLE, cvu=UNIT)
    grids = {"V": [0.45, 0.8, 1.25], "torque": [-20.0]}
    forward = pt.steady(Stand(transmission=part), grids)
    backward = pt.steady(Stand(transmission=part, drive=rot.ConstantSpeed(w_fixed=-100)), {**grids, "torque": [20.0]})
    name = "transmission.flange_a.tau"
    np.testing.assert_allclose(backward[name].values, -forward[name].values, rtol=1e-9)


def test_hydrostatic_units_have_one_operating_point_in_either_coupling() -> None:
    """Pressures of 10 MPa are found as speeds of 100 rad/s are; they were "several solutions". A simulation rests at the point."""
    from powertrain.design import SplitPathBench

    unit = HydrostaticUnit(D_b=8e-6, leakage=4e-12, d_a=0.01, d_b=0.01, mue=0.03)
    plant = pt.compile(SplitPathBench(transmission=SplitPathTransmission(layout="bHa", coupling="output", cvu=unit)))
    V, load = [-0.6, 0.3, 0.6], [-80.0, 20.0]
    found = pt.steady(plant, {"V": V, "load": load}, outputs=["r", "transmission.cvu.p"], progress=False)
    assert (found.status == 0).all()
    r, p = (found[name].sel(V=0.6, load=20.0).item() for name in ("r", "transmission.cvu.p"))
    starts = {"inertia.w": 100 * r, "transmission.cvu.p": p}
    result = pt.simulate(plant, 2.0, starts=starts, inputs={"V": 0.6, "load": 20.0}, rtol=1e-9, atol=1e-9)
    assert result["inertia.w"][-1] == pytest.approx(100 * r, rel=1e-8)
    assert result["transmission.cvu.p"][-1] == pytest.approx(p, rel=1e-8)
