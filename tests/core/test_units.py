"""Messages speak of a law's torque or force in its own unit."""

from __future__ import annotations

import pytest

import powertrain as pt
from powertrain.components import rotational, translational
from powertrain.language.units import rate_unit


class Brakes(pt.Component):
    mass: translational.Mass = translational.Mass(m=1)
    pads: translational.Brake = translational.Brake(fn_max=1)
    shaft: rotational.Inertia = rotational.Inertia(J=1)
    disc: rotational.Brake = rotational.Brake(fn_max=1)
    pedal: pt.Input = pt.signal_input("1", "Pressure", default=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.mass.flange_b, self.pads.flange_a)
        yield pt.connect(self.shaft.flange_b, self.disc.flange_a)
        yield pt.connect(self.pedal, self.pads.f_normalized, self.disc.f_normalized)


def test_friction_has_the_unit_of_its_force_or_torque() -> None:
    frictions = pt.compile(Brakes()).compiled.dae.frictions
    assert {law.name: law.unit for law in frictions} == {"pads.mode": "N", "disc.mode": "N.m"}


@pytest.mark.parametrize(
    ("unit", "rates"), [("m", ["m/s", "m/s2"]), ("m/s2", ["m/s3", "m/s4"]), ("J", ["J/s", "J/s2"])]
)
def test_units_of_rates(unit: str, rates: list[str]) -> None:
    assert [rate_unit(unit, order) for order in (0, 1, 2)] == [unit, *rates]
