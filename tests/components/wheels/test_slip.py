"""Force over slip: the linear tyre and the Magic Formula against their closed forms, in steady rolling, relaxation and sliding."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from cases import few
from wheel_rigs import Drum, plain, tight

import powertrain as pt
from powertrain.compiler.cancellation import terms
from powertrain.components import rotational as rot
from powertrain.components import translational as tr
from powertrain.components.blocks import Constant
from powertrain.components.wheels import MagicFormulaWheel, SlipWheel, Wheel
from powertrain.components.wheels.magic_formula import inverse_shape


def on_drum(wheel: Wheel, v: float, slip_speed: float, stop: float, load: float = 4000, **options: Any) -> Any:
    """A wheel of radius 0.3 m whose slip speed is given."""
    speeds = rot.ConstantSpeed(w_fixed=(v + slip_speed) / 0.3), tr.ConstantSpeed(v_fixed=v)
    return tight(Drum(wheel=wheel, turning=speeds[0], rolling=speeds[1], load=Constant(k=load)), stop, **options)


def steady(wheel: Wheel, v: float, kappa: float, load: float = 4000) -> float:
    return float(on_drum(wheel, v, kappa * abs(v), 200 / abs(v), load)["wheel.f"][-1])


def formula(tyre: dict[str, Any], kappa: float, load: float, mu: float = 1.0) -> float:
    """The Magic Formula as it stands in the book."""
    dfz = load / 4000 - 1
    C, E = tyre["pCx1"], tyre["pEx1"]
    D = mu * (tyre["pDx1"] + tyre["pDx2"] * dfz) * load
    K = load * (tyre["pKx1"] + tyre["pKx2"] * dfz) * np.exp(tyre["pKx3"] * dfz)
    x = K / (C * D) * kappa
    return float(D * np.sin(C * np.arctan(x - E * (x - np.arctan(x)))))


CREEPING = 1e-9
"""Speed of a wheel that is all but locked, in m/s: what a given speed of zero needs is not determined by friction."""
TYRES: list[dict[str, Any]] = [
    {"pCx1": 1.65, "pDx1": 1.0, "pDx2": 0.0, "pEx1": -0.5, "pKx1": 20.0, "pKx2": 0.0, "pKx3": 0.0},
    {"pCx1": 1.9, "pDx1": 0.9, "pDx2": -0.1, "pEx1": 0.97, "pKx1": 17.0, "pKx2": 3.0, "pKx3": -0.3},
    {"pCx1": 1.3, "pDx1": 1.1, "pDx2": -0.05, "pEx1": -5.0, "pKx1": 25.0, "pKx2": -2.0, "pKx3": 0.2},
    {"pCx1": 2.0, "pDx1": 0.3, "pDx2": 0.0, "pEx1": 0.99, "pKx1": 3.0, "pKx2": 0.0, "pKx3": 0.0},
]


@pytest.mark.parametrize("v", [0.5, -15.0, 40.0])
@pytest.mark.parametrize("kappa", [0.02, -0.05, 0.3])
def test_linear_force_and_its_limit(v: float, kappa: float) -> None:
    force = steady(SlipWheel(mu=0.8), v, kappa)
    assert force == pytest.approx(np.clip(6e4 * kappa, -3200, 3200), rel=1e-7)


def test_linear_tyre_relaxes_over_its_length() -> None:
    """f = C kappa (1 - exp(-t/T)) but for the damper, with T = sigma/v + d sigma/C."""
    v, kappa = 12.0, 0.01
    result = on_drum(SlipWheel(), v, kappa * v, 0.2)
    T = 0.3 / v + 1000 * 0.3 / 6e4
    u = 0.3 * kappa * (1 - np.exp(-result.time / T))
    np.testing.assert_allclose(result["wheel.u"], u, atol=1e-9)
    f = 6e4 * kappa * (1 - np.exp(-result.time / T)) + 1000 * 0.3 * kappa / T * np.exp(-result.time / T)
    np.testing.assert_allclose(result["wheel.f"], f, rtol=1e-6, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("tyre", TYRES, ids=["plain", "sharp", "flat", "snow"])
@pytest.mark.parametrize("kappa", [0.004, -0.04, 0.09, 0.2, -0.6, 2.0])
def test_magic_formula_at_steady_slip(tyre: dict[str, Any], kappa: float) -> None:
    """Below the peak, at it, beyond it, driving and braking, at two loads and on a slippery road."""
    for load, mu in ((4000.0, 1.0), (2500.0, 0.4)):
        force = steady(MagicFormulaWheel(**tyre, mu=mu), 10.0, kappa, load)
        assert force == pytest.approx(formula(tyre, kappa, load, mu), rel=2e-6)


@pytest.mark.parametrize(("E", "kappa"), [(-8.0, 0.005), (-20.0, 0.06)])
def test_a_pointed_magic_formula_with_slip_from_the_start(E: float, kappa: float) -> None:
    tyre: dict[str, Any] = TYRES[0] | {"pEx1": E}
    assert steady(MagicFormulaWheel(**tyre), 20.0, kappa) == pytest.approx(formula(tyre, kappa, 4000.0), rel=2e-6)


@pytest.mark.parametrize("E", [-20.0, -8.0, -0.5, 0.0, 0.5, 0.99])
def test_inverse_of_the_shape(E: float) -> None:
    """Also for the smallest slips, and with terms that do not dwarf the value."""
    t, curvature = ca.SX.sym("t"), ca.SX.sym("E")
    x = inverse_shape(t, curvature)
    function = ca.Function("inverse", [t, curvature], [x, terms(x)])
    for value in np.geomspace(1e-7, 1e6, 27):
        found, size = (float(each) for each in function(value, E))
        assert found - E * (found - np.arctan(found)) == pytest.approx(value, rel=1e-10)
        assert size < 1e9 * found


def test_shapes_that_have_no_peak_or_turn_round() -> None:
    with pytest.raises(pt.ParameterError, match=r"MagicFormulaWheel\.pCx1 = 2\.3 is outside its range \(1, 2\]"):
        MagicFormulaWheel(pCx1=2.3)
    with pytest.raises(pt.ParameterError, match=r"MagicFormulaWheel\.pEx1 = 1 is outside its range \[-20, 0\.99\]"):
        MagicFormulaWheel(pEx1=1.0)


def test_magic_formula_has_a_relaxation_length() -> None:
    """For little slip it is K/c, and the force follows as that of a linear tyre."""
    v, slip = 12.0, 1e-5
    result = on_drum(MagicFormulaWheel(d=1.0), v, slip * v, 0.2, atol=1e-14)
    steady_force = 20 * 4000 * slip
    expected = steady_force * (1 - np.exp(-result.time * v / (20 * 4000 / 2.5e5)))
    np.testing.assert_allclose(result["wheel.f"], expected, atol=2e-3 * steady_force)


@pytest.mark.parametrize("wheel", few([SlipWheel(mu=0.5), MagicFormulaWheel(mu=0.5)]), ids=["linear", "magic"])
def test_spinning_at_standstill_and_sliding_locked(wheel: Wheel) -> None:
    """No speed over the road, or no speed of the wheel: the limit of friction, in the direction of slip."""
    limit = 2000.0
    for v, slip in ((0.0, 3.0), (0.0, -3.0), (10.0, CREEPING - 10), (-10.0, 10 - CREEPING)):
        force = float(on_drum(wheel, v, slip, 20.0)["wheel.f"][-1])
        assert np.sign(force) == np.sign(slip)
        assert abs(force) == pytest.approx(limit, rel=1e-6) if isinstance(wheel, SlipWheel) else abs(force) < limit
    if isinstance(wheel, MagicFormulaWheel):
        locked = float(on_drum(wheel, 10.0, CREEPING - 10, 20.0)["wheel.f"][-1])
        assert locked == pytest.approx(formula(TYRES[0], -1.0, 4000, 0.5), rel=1e-6)


@pytest.mark.parametrize(("v", "share"), [(0.0, 1.0), (-1.5, 0.5), (4.0, 0.0)])
def test_the_damping_of_a_tyre_rises_towards_standstill(v: float, share: float) -> None:
    """Of a tyre that is not yet deflected, f = damping (v_slip - |v| f/C); by half a cosine it is d + d_low at rest and d from 3 m/s."""
    damping, v_slip = 1000 + 1e4 * share, 0.02
    force = on_drum(SlipWheel(), v, v_slip, 1e-3)["wheel.f"][0]
    assert force == pytest.approx(damping * v_slip / (1 + damping * abs(v) / 6e4), rel=1e-7)


@pytest.mark.parametrize(("v", "slide", "kappa"), [(1.0, -0.9, -0.9 / 2.1), (0.5, 4.0, 8.0)])
def test_the_slip_of_a_slow_contact_that_slides(v: float, slide: float, kappa: float) -> None:
    """v_c/max(|v|, 3 m/s - |v_c|), and the force of the formula there."""
    run = on_drum(MagicFormulaWheel(), v, slide, 3)
    assert run["wheel.kappa_c"][-1] == pytest.approx(kappa, rel=1e-6)
    assert run["wheel.f"][-1] == pytest.approx(formula(TYRES[0], kappa, 4000), rel=1e-6)


@pytest.mark.slow
def test_loss_of_steady_slip_is_force_times_slip_speed() -> None:
    for wheel in (SlipWheel(Cr=0), MagicFormulaWheel(Cr=0)):
        for kappa in (0.03, 0.4):
            result = on_drum(wheel, 10.0, kappa * 10, 20.0)
            assert result["wheel.lossPower"][-1] == pytest.approx(result["wheel.f"][-1] * kappa * 10, rel=1e-6)


def test_locked_brake_stops_by_friction() -> None:
    """All wheels' friction known: the front rolls freely, the rear slides with mu and its load."""
    result = tight(plain(SlipWheel(mu=0.6, Cr=0, J=0.001), demand=Constant(k=1.0)), 2.0, {"body.v": 20.0})
    rear = 0.45 / (1 + 0.6 * 0.55 / 2.7)  # part of the weight, less what the braking takes off
    early, late = (float(result.at(np.array([t]), "body.v")[0]) for t in (0.5, 1.5))
    assert late - early == pytest.approx(-0.6 * rear * 9.80665, rel=1e-5)


class Cornering(pt.Component):
    """A wheel on a drum with a side force."""

    drum: Drum
    side: Constant

    def equations(self) -> pt.Equations:
        yield pt.connect(self.side.y, self.drum.wheel.side)


@pytest.mark.parametrize("wheel", few([SlipWheel(mu=0.5), MagicFormulaWheel(mu=0.5)]), ids=["linear", "magic"])
def test_a_side_force_takes_of_the_grip(wheel: Wheel) -> None:
    """Kamm's circle: 0.6 of the grip to the side leave 0.8 of it along the road; more than all of it leaves next to nothing."""
    drum = Drum(
        wheel=wheel,
        turning=rot.ConstantSpeed(w_fixed=3 / 0.3),
        rolling=tr.ConstantSpeed(v_fixed=0),
        load=Constant(k=4000),
    )
    whole = tight(Cornering(drum=drum, side=Constant(k=0)), 20.0)["drum.wheel.f"][-1]
    grip = whole / 4000
    for side, left in ((0.6, 0.8), (-0.6, 0.8), (1.2, 1e-3)):
        result = tight(Cornering(drum=drum, side=Constant(k=side * grip)), 20.0)
        assert result["drum.wheel.f"][-1] == pytest.approx(left * whole, rel=1e-5)


@pytest.mark.parametrize("wheel", few([SlipWheel(mu=0.5), MagicFormulaWheel(mu=0.5)]), ids=["linear", "magic"])
def test_a_side_force_beyond_the_grip_is_counted(wheel: Wheel) -> None:
    """Both tyres grip with 0.5 of their load: a bend that takes 0.49 is driven, one that takes 0.51 is not."""
    drum = Drum(wheel=wheel, rolling=tr.ConstantSpeed(v_fixed=3), turning=rot.ConstantSpeed(w_fixed=3 / 0.3))
    for side, beyond in ((0.49, False), (0.51, True), (-0.51, True)):
        result = pt.simulate(Cornering(drum=drum, side=Constant(k=side)), 1.0)
        counted = result.statistics["outside side force over load"]
        assert counted == (result.statistics["steps"] if beyond else 0)


def test_a_spinning_tyre_has_less_grip_for_the_side_force() -> None:
    """At a slip of 0.3 the formula has fallen to 0.776: nothing is left for a force along the road while 0.9 is taken to the side."""
    fast = Drum(wheel=MagicFormulaWheel(), rolling=tr.ConstantSpeed(v_fixed=3), turning=rot.ConstantSpeed(w_fixed=13))
    for side, spun in ((0.7, False), (0.9, True)):
        result = pt.simulate(Cornering(drum=fast, side=Constant(k=side)), 1.0)
        assert (result.statistics["outside side force over load"] > 0) == spun
        assert (abs(result["drum.wheel.f"][-1]) < 10) == spun


@pytest.mark.parametrize(("kind", "left"), [(SlipWheel, 1e-12), (MagicFormulaWheel, 1e-5)])
def test_a_smooth_road_gives_nothing(kind: type[SlipWheel | MagicFormulaWheel], left: float) -> None:
    """Next to nothing: a millionth of the load is left to the Magic Formula tyre, 1e-6 g for a second."""
    result = tight(plain(kind(mu=0.0, Cr=0), torque=Constant(k=50)), 1.0)
    assert result["body.v"][-1] == pytest.approx(0, abs=left)
    assert result["front.w"][-1] == pytest.approx(50, rel=1e-4)


TIR = """[MDI_HEADER]
FILE_TYPE = 'tir'
! : COMMENT : a tyre that does not exist; names = values in comments are none
$----------------------------------------------------------------units
[UNITS]
 LENGTH  = 'meter'
FORCE    = 'Newton'
  ANGLE  = 'radians'
[MODEL]
FITTYP   = 61   $Magic Formula Version number
[DIMENSION]
UNLOADED_RADIUS = 0.33 $Free tyre radius
[SHAPE]
{radial width}
 1.0    0.0
[VERTICAL]
FNOMIN = 5000
VERTICAL_STIFFNESS = 2.2e5
BREFF = 8.0
DREFF = 0.25
FREFF = 0.05
[STRUCTURAL]
LONGITUDINAL_STIFFNESS = 3.1E+005
[SCALING_COEFFICIENTS]
LFZO = 0.8
LMUX = 0.9
LKX  = 1.1
LCX  = 1.0
LEX  = 0.5
[LONGITUDINAL_COEFFICIENTS]
PCX1 = 1.6
PDX1 = 1.2
PDX2 = -0.1
PEX1 = 0.3
PEX2 = 0.1
PKX1 = 22
PKX2 = 5
PKX3 = -0.3
[ROLLING_COEFFICIENTS]
QSY1 = -0.012
"""


def test_tyre_files(tmp_path: Path) -> None:
    """The force at steady slip is that of the file's coefficients; a wheel that rolls freely under nominal load turns with its radius."""
    (tmp_path / "tyre.tir").write_text(TIR)
    wheel = MagicFormulaWheel.from_tir(tmp_path / "tyre.tir", J=1.4)
    coefficients = {"pCx1": 1.6, "pDx1": 1.08, "pDx2": -0.09, "pEx1": 0.15, "pKx1": 24.2, "pKx2": 5.5, "pKx3": -0.3}
    assert {name: float(getattr(wheel, name)) for name in coefficients} == pytest.approx(coefficients)
    drum = Drum(
        wheel=wheel,
        turning=rot.ConstantSpeed(w_fixed=10 * 1.03 / float(wheel.radius)),
        rolling=tr.ConstantSpeed(v_fixed=10),
        load=Constant(k=5600),
    )
    x = 24.2 + 5.5 * 0.4  # 5,600 N are 1.4 of the nominal load 0.8 5,000 N
    B = x * np.exp(-0.3 * 0.4) / (1.6 * (1.08 - 0.09 * 0.4))
    inner = B * 0.03 - 0.15 * (B * 0.03 - np.arctan(B * 0.03))
    force = (1.08 - 0.09 * 0.4) * 5600 * np.sin(1.6 * np.arctan(inner))
    assert tight(drum, 20.0)["wheel.f"][-1] == pytest.approx(force, rel=2e-6)
    assert float(wheel.radius) == pytest.approx(0.33 - 4000 / 2.2e5 * (0.25 * np.arctan(8.0) + 0.05))
    assert (float(wheel.c), float(wheel.Cr), float(wheel.J)) == (3.1e5, 0.012, 1.4)


def test_older_tyre_files_have_a_relaxation_length(tmp_path: Path) -> None:
    """sigma = Fz PTX1 R0/Fz0 LSGKP = K/c; a radius that is given needs nothing of the file."""
    text = TIR.replace("LONGITUDINAL_STIFFNESS = 3.1E+005", "PTX1 = 2.5\nLSGKP = 1.2").replace("BREFF = 8.0", "")
    (tmp_path / "tyre.tir").write_text(text)
    wheel = MagicFormulaWheel.from_tir(tmp_path / "tyre.tir", radius="31 cm")
    assert 24.2 * 4000 / float(wheel.c) == pytest.approx(4000 * 2.5 * 0.33 / 5000 * 1.2)
    assert float(wheel.radius) == pytest.approx(0.31)
    with pytest.raises(pt.ParameterError, match="has no BREFF, DREFF and FREFF for the rolling radius under load"):
        MagicFormulaWheel.from_tir(tmp_path / "tyre.tir")


def test_the_free_radius_of_a_tyre_file_is_a_share_of_the_unloaded_one(tmp_path: Path) -> None:
    """Version 6: R_e = R_0 Q_RE0 - Fz_0/c_z (D atan(B) + F) at nominal load and low speed."""
    (tmp_path / "tyre.tir").write_text(TIR.replace("DREFF = 0.25", "DREFF = 0.25\nQ_RE0 = 1.02"))
    radius = float(MagicFormulaWheel.from_tir(tmp_path / "tyre.tir").radius)
    assert radius == pytest.approx(1.02 * 0.33 - 4000 / 2.2e5 * (0.25 * np.arctan(8.0) + 0.05))


def test_tyre_files_of_other_writers(tmp_path: Path) -> None:
    """A byte order mark, and units spelt otherwise."""
    (tmp_path / "tyre.tir").write_text(TIR)
    (tmp_path / "other.tir").write_text(TIR.replace("'meter'", "'m'\nTIME = 'sec'"), encoding="utf-8-sig")
    assert MagicFormulaWheel.from_tir(tmp_path / "other.tir") == MagicFormulaWheel.from_tir(tmp_path / "tyre.tir")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("VERTICAL_STIFFNESS = 2.2", "VERTICAL_STIFFNESS = 0.0", "VERTICAL_STIFFNESS = 0 must be positive"),
        ("'meter'", "'inch'", "LENGTH = inch; only files in meter are read"),
        ("PKX1 = 22", "", "has no PKX1, which a Magic Formula file of version 5.2 or later has"),
        ("PDX1 = 1.2", "PDX1 = soft", "PDX1 = soft is not a number"),
        ("PEX1 = 0.3", "PEX1 = 3", r"pEx1 = 1.5 is outside its range \[-20, 0.99\]"),
        ("[MDI_HEADER]", "", "is not a tyre property file"),
        ("PDX1 = 1.2", "PDX1 = 1.2\npdx1 = 12", r"tyre.tir:\d+: pdx1 = 12, but 1.2 in line \d+"),
    ],
)
def test_tyre_files_that_do_not_fit(tmp_path: Path, old: str, new: str, said: str) -> None:
    (tmp_path / "tyre.tir").write_text(TIR.replace(old, new))
    with pytest.raises(pt.ParameterError, match=said):
        MagicFormulaWheel.from_tir(tmp_path / "tyre.tir")
    with pytest.raises(pt.ParameterError, match=r"none\.tir cannot be read"):
        MagicFormulaWheel.from_tir(tmp_path / "none.tir")


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"pCx1": 2.4}, r"pCx1 = 2.4 is outside its range \(1, 2\] .*above 2 it reverses at large slip"),
        ({"pCx1": 1.0}, "up to 1 the force has no peak"),
        ({"pEx1": 1.0}, "pEx1 = 1 is outside .*towards 1 the peak moves to infinite slip"),
    ],
)
def test_formulas_without_a_peak_and_a_falling_branch_are_refused(given: dict[str, Any], said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        MagicFormulaWheel(**given)
