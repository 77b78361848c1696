"""The nine combinations of Table 1: two members change places by clutches while the transmission drives."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from cases import few

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.cvu import CVU, TractionDrive
from powertrain.components.transmissions import (
    COMBINATIONS,
    TYPES,
    SwitchedSplitPathTransmission,
    overall_ratio,
)

UNIT = CVU(eta_ab=0.9, eta_ba=0.9)


class Shifting(pt.Component):
    """Driven at a constant speed through an elastic shaft, loaded by drag."""

    V: pt.Input = pt.signal_input("1", "Ratio of the variable unit")
    shift: pt.Input = pt.signal_input("1", "0: first layout, 1: second")
    transmission: SwitchedSplitPathTransmission
    drive: rot.ConstantSpeed = rot.ConstantSpeed(w_fixed=100)
    shaft: rot.SpringDamper = rot.SpringDamper(c=1e4, d=20)
    J1: rot.Inertia = rot.Inertia(J=1e-2)
    J3: rot.Inertia = rot.Inertia(J=1e-1)
    drag: rot.Damper = rot.Damper(d=0.5)
    ground: rot.Fixed = rot.Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.J1.flange_a)
        yield pt.connect(self.J1.flange_b, self.transmission.flange_a)
        yield pt.connect(self.transmission.flange_b, self.J3.flange_a)
        yield pt.connect(self.J3.flange_b, self.drag.flange_a)
        yield pt.connect(self.drag.flange_b, self.ground.flange)
        yield pt.connect(self.V, self.transmission.ratio)
        yield pt.connect(self.shift, self.transmission.shift)


def shifted(first: Any, second: Any, coupling: Any = "input", unit: Any = UNIT) -> Any:
    """V from 0.7 to 1.3; the clutches change over while V passes through 1, where all places turn nearly alike."""
    model = Shifting(
        transmission=SwitchedSplitPathTransmission(first=first, second=second, coupling=coupling, cvu=unit)
    )
    w = dict(zip(first, (100.0, 70.0, 100 * overall_ratio(first, -1.7, 0.7, coupling)), strict=True))
    if coupling == "output":
        w[first[1]] = 0.7 * w[first[2]]
    starts = {f"transmission.shafts[{k}].w": w[name] for k, name in enumerate("abH")}
    starts |= {"J1.w": 100.0, "J3.w": w[first[2]]}
    inputs = {"V": ([0, 2, 3, 5], [0.7, 0.97, 1.03, 1.3]), "shift": ([0, 2.2, 2.4], [0, 0, 1])}
    return pt.simulate(model, 5.0, starts=starts, inputs=inputs, rtol=1e-7, atol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("name", COMBINATIONS)
def test_members_change_places_while_driving(name: str) -> None:
    first, second = (TYPES[k] for k in COMBINATIONS[name])
    result = shifted(first, second)
    before, after = result.at(1.9, "J3.w") / result.at(1.9, "J1.w"), result["J3.w"][-1] / result["J1.w"][-1]
    assert before == pytest.approx(overall_ratio(first, -1.7, 0.7 + 0.27 * 1.9 / 2), rel=1e-6)
    assert after == pytest.approx(overall_ratio(second, -1.7, 1.3), rel=1e-6)
    clutches = [result[f"transmission.clutches[{k}].mode"] for k in range(4)]
    assert [mode[1] for mode in clutches] == [0, 0, 2, 2]
    assert [mode[-1] for mode in clutches] == [2, 2, 0, 0]
    assert result.statistics["events"] < 40
    audit = pt.energy_audit(result)
    assert audit.closure < 1e-6
    assert np.asarray(audit.loss).min() > -1e-6 * np.asarray(audit.loss).max()


@pytest.mark.parametrize("name", few(["VI", "I", "IX"]))
def test_both_pairs_hold_while_a_unit_creeps(name: str) -> None:
    """All places turn alike and all clutches hold."""
    first, second = (TYPES[k] for k in COMBINATIONS[name])
    result = shifted(first, second, unit=TractionDrive(e=0.2))
    clutches = np.array([result[f"transmission.clutches[{k}].mode"] for k in range(4)])
    assert clutches[:, -1].tolist() == [2, 2, 0, 0]
    slip = np.array([result[f"transmission.clutches[{k}].w_rel"] for k in range(4)])
    assert np.abs(slip[clutches == 0]).max() < 1e-8
    both = (clutches != 2).all(axis=0) & (np.abs(slip).max(axis=0) < 1e-9)
    assert np.count_nonzero(both) > 5
    after = result["J3.w"][-1] / result["J1.w"][-1]
    assert after == pytest.approx(overall_ratio(second, -1.7, 1.3), rel=0.05)
    assert pt.energy_audit(result).closure < 1e-6


def test_the_capacity_is_that_of_any_plates() -> None:
    """Plates of 0.12 m with a coefficient of friction of 0.4 transmit 1,000 N.m with a force of 1000/(0.12 0.4) N."""
    clutches = (rot.Clutch(fn_max=1, cgeo=0.12, mue_pos=((0.0, 0.4), (10.0, 0.4))),) * 4
    model = Shifting(transmission=SwitchedSplitPathTransmission(cvu=UNIT, clutches=clutches))
    start = pt.compile(model).start(inputs={"V": 0.7, "shift": 0.0})
    assert start["transmission.clutches[0].fn"] == pytest.approx(1000 / 0.12 / 0.4)


@pytest.mark.slow
def test_output_coupled_change() -> None:
    result = shifted("abH", "baH", "output")
    assert result["J3.w"][-1] / result["J1.w"][-1] == pytest.approx(overall_ratio("baH", -1.7, 1.3, "output"), rel=1e-6)
    assert pt.energy_audit(result).closure < 1e-6


@pytest.mark.slow
def test_clutch_slips_where_the_circulating_power_exceeds_its_torque() -> None:
    """Output-coupled type 4 at V = 1.3 sends several times the input power through its members: a clutch of 1000 N.m gives way."""
    result = shifted("Hba", "abH", "output")
    assert result["transmission.clutches[3].mode"][-1] == 1
    assert result["transmission.clutches[3].tau"][-1] == pytest.approx(1000.0)
    assert result["J3.w"][-1] / result["J1.w"][-1] < 0.9 * overall_ratio("abH", -1.7, 1.3, "output")
    stronger = shifted("baH", "abH", "output")
    assert stronger["J3.w"][-1] / stronger["J1.w"][-1] == pytest.approx(2.0408163, rel=1e-6)
