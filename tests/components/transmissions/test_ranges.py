"""Transmissions of several ranges that shift while they drive: ratios, torques against the network's, energy, what cannot be."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from ratio_bench import RatioBench

import powertrain as pt
from powertrain.components.cvu import CVU, RatioActuator
from powertrain.components.transmissions import Network, RangeTransmission, UnitLoss, flow
from powertrain.components.transmissions.ratio import factors_of_unit
from powertrain.design import Designs, Structure

BACK_AND_FORTH = Structure((("input", "abH"), ("input", "abH")))
TWO_MODE = Structure((("Hab", "output"), ("Hab", "Hab")))
THREE_MODE = Structure((("Hab", "output"), ("Hab", "Hab"), ("Hab", "Hab")))
LOSS = UnitLoss(0.85, 0.8)
UNIT = CVU(eta_ab=0.85, eta_ba=0.8)
CASES: list[Any] = [
    (BACK_AND_FORTH, [0.35, 1.1], [-1.2, -2.0], [0.7]),
    (BACK_AND_FORTH, [0.35, 1.2], [-1.2, -2.0], [0.6]),
    (TWO_MODE, [0.95, 0.6, 1.6], [-1.2, -2.0, -0.6], [0.8]),
    (THREE_MODE, [0.95, 0.7, 1.75, 1.0, 2.2], [-1.2, -2.0, -0.6, -1.5, -0.8], [0.8, 1.2]),
]


def spans(structure: Structure, m: Any, R_o: Any, shifts: list[float]) -> list[tuple[float, float, Network]]:
    """Ranges from r = 0.3 to 1.4, the unit's shafts as fast as the input in the first one."""
    designs = Designs(structure, np.array([m]), np.array([R_o]), np.array([shifts]), np.ones((1, 2)))
    ends = [0.3, *shifts, 1.4]
    return [(ends[k], ends[k + 1], designs.networks(k, 0.98, 0.99)[0]) for k in range(len(structure.ranges))]


def driven(parts: Any, times: list[float], wanted: list[float]) -> pt.Result[RatioBench]:
    """The bench with a wanted ratio, which is that of the start at first."""
    part = next(part for part in parts if part[0] <= wanted[0] <= part[1])
    model = RatioBench(
        transmission=RangeTransmission.of(parts, UNIT),
        actuator=RatioActuator(T=0.1, rate=0.1, ratio_start=wanted[0]),
    )
    w_a = float(factors_of_unit(part[2])[0] @ [200.0, 200.0 * wanted[0]])
    starts = {"engine.w": 200.0, "output.w": 200 * wanted[0], "transmission.rotor.w": w_a}
    return pt.simulate(model, times[-1], starts=starts, inputs={"wanted": (times, wanted)}, rtol=1e-7, atol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize(("structure", "m", "R_o", "shifts"), CASES)
def test_ranges_shift_up_and_down(structure: Structure, m: Any, R_o: Any, shifts: list[float]) -> None:
    """The ratio follows through all ranges and back; where it rests the torques are those of the network."""
    parts = spans(structure, m, R_o, shifts)
    result = driven(parts, [0, 1, 1, 16, 16, 30], [0.3, 0.3, 1.4, 1.4, 0.4, 0.4])
    ratio = result["output.w"] / result["engine.w"]
    np.testing.assert_allclose(ratio, result["actuator.ratio"], atol=0.03)  # shafts wind up
    number = result["transmission.range"]
    assert number[0] == number[-1] == 0
    assert number.max() == len(shifts)
    up = np.flatnonzero(np.diff(number) > 0)
    np.testing.assert_allclose(result["actuator.ratio"][up], shifts, atol=1e-6)
    for time, r, network in ((15.9, 1.4, parts[-1][2]), (29.9, 0.4, parts[0][2])):
        assert result.at(time, "output.w") / result.at(time, "engine.w") == pytest.approx(r, rel=1e-4)
        at = flow(network, [r], 100.0, 200.0, loss=LOSS)
        assert result.at(time, "transmission.flange_a.tau") == pytest.approx(at.tau_in[0], rel=4e-3)
        for k, side in enumerate("ab"):
            assert result.at(time, f"transmission.cvu.flange_{side}.tau") == pytest.approx(at.tau[k, 0], rel=4e-3)
    audit = pt.energy_audit(result)
    assert audit.closure < 1e-5
    assert np.asarray(audit.loss).min() > -1e-6 * np.asarray(audit.loss).max()


def test_it_may_begin_in_any_range() -> None:
    result = driven(spans(*CASES[0]), [0, 0.1], [1.2, 1.2])
    assert (result["transmission.range"] == 1).all()
    assert result["output.w"][-1] / result["engine.w"][-1] == pytest.approx(1.2, abs=0.01)


@pytest.mark.slow
def test_it_begins_in_the_range_of_its_ratio() -> None:
    """Two shifts at the start lead from the first range, in which it begins by default, to the third."""
    structure, m, R_o, shifts = CASES[-1]
    parts, r = spans(structure, m, R_o, shifts), 1.3
    w_a = float(factors_of_unit(parts[2][2])[0] @ [200.0, 200.0 * r])
    model = RatioBench(transmission=RangeTransmission.of(parts, UNIT), actuator=RatioActuator(ratio_start=r))
    starts = {"engine.w": 200.0, "output.w": 200 * r, "transmission.rotor.w": w_a}
    result = pt.simulate(model, 1.0, starts=starts, inputs={"wanted": r})
    assert set(result["transmission.range"]) == {2.0}
    assert result["output.w"][-1] / result["engine.w"][-1] == pytest.approx(r, rel=1e-4)


def test_the_unit_runs_back_through_the_same_speeds() -> None:
    """V goes up to the shift and down after it; the speeds of the unit have no jump."""
    result = driven(spans(*CASES[0]), [0, 0.5, 0.5, 9], [0.5, 0.5, 0.9, 0.9])
    V, r = result["transmission.cvu.ratio"], result["actuator.ratio"]
    below, above = r < 0.699, r > 0.701
    assert (np.diff(V[below]) >= -1e-9).all()
    assert (np.diff(V[above]) <= 1e-9).all()
    for side in "ab":
        w, t = result[f"transmission.cvu.w_{side}"], result.time
        assert np.abs(np.diff(w)).max() < 2.0 + 300 * np.diff(t)[np.abs(np.diff(w)).argmax()]


def test_what_are_no_ranges() -> None:
    parts = spans(*CASES[0])
    (low, high, one), (_, last, other) = parts
    wrong = {
        "0 range; one that does not shift": [],
        "1 range; one that does not shift is a NetworkTransmission": parts[:1],
        "is followed by one from 0.8": [(low, high, one), (0.8, last, other)],
        "in one range, at .* times in the next: the ranges do not meet": [(low, 0.8, one), (0.8, last, other)],
    }
    for said, given in wrong.items():
        with pytest.raises(pt.ParameterError, match=said):
            pt.compile(RatioBench(transmission=RangeTransmission.of(given, UNIT)))
    with pytest.raises(pt.ParameterError, match="do not belong to 2 ranges"):
        pt.compile(RatioBench(transmission=pt.replace(RangeTransmission.of(parts), selectors_a=())))
