"""Copies with other values: what changes in one part changes at once, and later changes win."""

from __future__ import annotations

import pytest

import powertrain as pt
from powertrain.components.body import VehicleBody
from powertrain.vehicles.manual_car import ManualCar


class Band(pt.Component):
    """A low value below a high one."""

    low: pt.Parameter = pt.parameter("1", "Low", default=1.0)
    high: pt.Parameter = pt.parameter("1", "High", default=2.0)

    def check(self) -> pt.Equations:
        yield self.low < self.high

    def equations(self) -> pt.Equations:
        yield from ()


class Bands(pt.Component):
    """One band and a row of them, within another part."""

    one: Band = Band()
    row: tuple[Band, ...] = (Band(), Band())

    def equations(self) -> pt.Equations:
        yield from ()


class Whole(pt.Component):
    """A part with parts."""

    bands: Bands = Bands()

    def equations(self) -> pt.Equations:
        yield from ()


@pytest.mark.parametrize("place", ["bands.one", "bands.row[1]"])
@pytest.mark.parametrize(("low", "high"), [(5.0, 6.0), (-3.0, -2.0)])
@pytest.mark.parametrize("turned", [False, True])
def test_conditions_hold_for_all_new_values_together(place: str, low: float, high: float, turned: bool) -> None:
    changes = {f"{place}.low": low, f"{place}.high": high}
    made = pt.replace(Whole(), dict(reversed(changes.items())) if turned else changes)
    new = Band(low=low, high=high)
    rows = (Band(), new) if "row" in place else (Band(), Band())
    assert made == Whole(bands=Bands(one=Band() if "row" in place else new, row=rows))
    with pytest.raises(pt.ParameterError, match=r"self.low < self.high"):
        pt.replace(Whole(), {f"{place}.low": 2.0})


def test_later_changes_win() -> None:
    wide = Band(high=9.0)
    assert pt.replace(Bands(), {"one": wide, "one.low": 3.0}).one == Band(low=3.0, high=9.0)
    assert pt.replace(Bands(), {"one.low": 1.5, "one": wide}).one == wide
    assert pt.replace(Bands(), {"row[1].low": 1.5, "row[0]": wide}).row == (wide, Band(low=1.5))
    assert pt.replace(Bands(), {"row[1].low": 1.5, "row": (wide,)}).row == (wide,)
    assert pt.replace(Bands(), {"row": (wide, wide), "row[1].low": 1.5}).row == (wide, Band(low=1.5, high=9.0))


def test_a_field_of_a_part_is_named() -> None:
    with pytest.raises(pt.ParameterError, match=r"Bands has no field low; did you mean one.low\?"):
        pt.replace(Bands(), low=2.0)


class Shape(pt.Component):
    """Partial: a slot's kind that cannot be made itself."""


class Round(Shape):
    """One that can."""

    def equations(self) -> pt.Equations:
        yield from ()


class Square(Shape):
    """Another one."""

    def equations(self) -> pt.Equations:
        yield from ()


class Frame(pt.Component):
    """A slot for a shape."""

    shape: Shape = Round()

    def equations(self) -> pt.Equations:
        yield from ()


def test_what_fits_a_slot_is_named() -> None:
    """The kind of the slot was: a partial class, which cannot be made."""
    with pytest.raises(pt.ModelError, match=r"not Square itself; write Square\(...\)$"):
        pt.replace(Frame(), shape=Square)
    with pytest.raises(pt.ModelError, match=r"not str; write Round\(...\) or Square\(...\)$"):
        pt.replace(Frame(), {"shape": "Square"})


def test_a_parameter_asked_for_by_its_meaning_is_suggested() -> None:
    """It was "did you mean chassis?"."""
    with pytest.raises(pt.ParameterError, match=r"^VehicleBody has no field mass; did you mean m\?$"):
        pt.replace(ManualCar(), {"body.mass": 1500})
    with pytest.raises(pt.ParameterError, match=r"^VehicleBody has no field mass; did you mean m\? \(its fields: "):
        VehicleBody(mass=1500)  # type: ignore[call-arg]
