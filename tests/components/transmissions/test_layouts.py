"""The six types of connection and the nine combinations of Table 1."""

from __future__ import annotations

import math
from typing import Any

import pytest

import powertrain as pt
from powertrain.components.transmissions import (
    COMBINATIONS,
    TYPES,
    SplitPathTransmission,
    SwitchedSplitPathTransmission,
    UnitRatio,
    overall_ratio,
    relative_ratio,
    unit_ratio,
)
from powertrain.components.transmissions.layout import Coupling, switched


def test_six_printed_ratios() -> None:
    """R = -1.7, 2.7, 0.630, 0.37, 1.59, -0.59 for R_o = -1.7 (p. 15)."""
    printed = ["-1.7", "2.7", "0.630", "0.37", "1.59", "-0.59"]
    for layout, text in zip(TYPES.values(), printed, strict=True):
        assert f"{relative_ratio(layout, -1.7):.{len(text.split('.')[1])}f}" == text


def test_printed_ranges_of_V() -> None:
    """Curve 6 over r = 0.5 to 2: V from 0.69 to 1.63 (the paper's 1.66 is a misprint); the example's V = 0.581."""
    assert f"{unit_ratio('aHb', -1.7, 0.5):.3f}" == "0.685"
    assert f"{unit_ratio('aHb', -1.7, 2.0):.3f}" == "1.630"
    assert f"{unit_ratio('bHa', -1.7, -0.13):.3f}" == "0.581"


@pytest.mark.parametrize("layout", TYPES.values())
def test_ratios_back_and_forth(layout: str) -> None:
    for r in (-2.0, 0.3, 1.0, 2.5):
        assert overall_ratio(layout, -1.7, unit_ratio(layout, -1.7, r)) == pytest.approx(r)
        there = unit_ratio(layout, -1.7, r, "output")
        assert overall_ratio(layout, -1.7, there, "output") == pytest.approx(r)
    with pytest.raises(pt.ParameterError, match="V would be infinite"):
        unit_ratio(layout, -1.7, 0.0, "output")


def test_ratios_that_no_layout_has() -> None:
    """R_o = 0 and 1 make members coincide; output-coupled, V = 1/(1 - R) = 1/2 with R = -1 holds the input."""
    for R_o in (0.0, 1.0):
        said = f"R_o = {R_o:g}: no differential has this basic ratio"
        with pytest.raises(pt.ParameterError, match=said):
            relative_ratio("baH", R_o)
        with pytest.raises(pt.ParameterError, match=said):
            unit_ratio("baH", R_o, 0.5)
        with pytest.raises(pt.ParameterError, match=said):
            overall_ratio("baH", R_o, 0.5)
    with pytest.raises(pt.ParameterError, match=r"bHa holds its input at V = 0.5: r would be infinite"):
        overall_ratio("bHa", -1.0, 0.5, "output")


@pytest.mark.parametrize("coupling", ["input", "output"])
@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_ratios_that_are_no_numbers(bad: float, coupling: Coupling) -> None:
    with pytest.raises(pt.ParameterError, match=f"R_o = {bad:g} must be finite"):
        unit_ratio("bHa", bad, 0.5, coupling)
    with pytest.raises(pt.ParameterError, match=f"r = {bad:g} must be finite"):
        unit_ratio("bHa", -1.7, bad, coupling)
    with pytest.raises(pt.ParameterError, match=f"V = {bad:g} must be finite"):
        overall_ratio("bHa", -1.7, bad, coupling)


@pytest.mark.parametrize("r", [0.0, ([0.0, 1.0], [0.5, -0.5])])
def test_no_unit_ratio_where_the_output_stands_still(r: Any) -> None:
    """V = (1 - R/r)/(1 - R) has a pole at r = 0; input-coupled there is none."""

    class Wanted(pt.Component):
        """A ratio."""

        r: pt.Input = pt.signal_input("1", "Overall ratio")
        unit: UnitRatio

        def equations(self) -> pt.Equations:
            yield pt.connect(self.r, self.unit.r)

    with pytest.raises(
        pt.PowertrainError,
        match=r"size of the overall ratio, output-coupled .*below 1e-06; allowed is at least 1e-06",
    ):
        pt.simulate(Wanted(unit=UnitRatio(coupling="output", basic_ratio=-1.7)), 1.0, inputs={"r": r})
    V = pt.simulate(Wanted(unit=UnitRatio(basic_ratio=-1.7)), 1.0, inputs={"r": r})["unit.V"]
    assert V[-1] == pytest.approx(unit_ratio("bHa", -1.7, 0.0 if r == 0 else -0.5), rel=1e-12)


def test_nine_combinations() -> None:
    """Each column of Table 1 pairs all six types by the two members that change places; I keeps a as the output."""
    pairs = {"bH": ("I", "II", "III"), "aH": ("IV", "V", "VI"), "ab": ("VII", "VIII", "IX")}
    for change, names in pairs.items():
        assert sorted(k for name in names for k in COMBINATIONS[name]) == [1, 2, 3, 4, 5, 6]
        for name in names:
            first, second = (TYPES[k] for k in COMBINATIONS[name])
            p, q, stays = switched(first, second)
            assert {first[p], first[q]} == set(change)
            assert first[stays] == second[stays]
    assert TYPES[COMBINATIONS["I"][0]][2] == "a"


def test_layouts_that_do_not_exist_are_refused() -> None:
    with pytest.raises(pt.ParameterError, match="layout = 'abc' is none of 'bHa', 'Hba', 'baH', 'abH', 'Hab', 'aHb'"):
        pt.compile(SplitPathTransmission(layout="abc"))  # type: ignore[arg-type]
    with pytest.raises(pt.ParameterError, match="coupling = 'both' is none of 'input', 'output'"):
        pt.compile(SplitPathTransmission(coupling="both"))  # type: ignore[arg-type]
    with pytest.raises(pt.ParameterError, match="differ in 3 positions: exactly two members"):
        pt.compile(SwitchedSplitPathTransmission(first="bHa", second="Hab"))
