"""Mechanisms in which more than one law holds the same motion, at the points where a search among modes once failed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from cases import few
from gearsets import ONE, eight_speed

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.cvu import CVU
from powertrain.components.differentials import PlanetaryGear, RavigneauxGear
from powertrain.components.transmissions import TorqueConverter

OK, STUCK = 0, 1


class FourSpeed(pt.Component):
    """Ravigneaux set behind a converter: clutches drive the suns and the carrier, brakes hold one of each."""

    engine: rot.Inertia = rot.Inertia(J=0.15)
    drive: rot.Torque = rot.Torque()
    converter: TorqueConverter = TorqueConverter()
    turbine: rot.Inertia = rot.Inertia(J=0.02)
    gear: RavigneauxGear = RavigneauxGear.from_teeth(36, 30, 78, 21, 20, eta=0.99)
    C1: rot.Clutch = rot.Clutch(fn_max=1000, mue_pos=ONE)
    C2: rot.Clutch = rot.Clutch(fn_max=1000, mue_pos=ONE)
    C3: rot.Clutch = rot.Clutch(fn_max=1000, mue_pos=ONE)
    B1: rot.Brake = rot.Brake(fn_max=1000, mue_pos=ONE)
    B2: rot.Brake = rot.Brake(fn_max=1000, mue_pos=ONE)
    large: rot.Inertia = rot.Inertia(J=0.005)
    small: rot.Inertia = rot.Inertia(J=0.005)
    carrier: rot.Inertia = rot.Inertia(J=0.01)
    output: rot.Inertia = rot.Inertia(J=10.0)
    load: rot.BearingFriction = rot.BearingFriction(tau_pos=((0.0, 20.0), (200.0, 120.0)))
    ground: rot.Fixed = rot.Fixed()
    tau: pt.Input = pt.signal_input("N.m", "Torque of the engine", default=120.0)
    p1: pt.Input = pt.signal_input("1", "Pressure of C1", default=1.0)
    p2: pt.Input = pt.signal_input("1", "Pressure of C2", default=0.0)
    p3: pt.Input = pt.signal_input("1", "Pressure of C3", default=0.0)
    b1: pt.Input = pt.signal_input("1", "Pressure of B1", default=0.0)
    b2: pt.Input = pt.signal_input("1", "Pressure of B2", default=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.tau, self.drive.tau)
        yield pt.connect(self.drive.flange, self.engine.flange_a)
        yield pt.connect(self.engine.flange_b, self.converter.flange_a)
        yield pt.connect(self.converter.support, self.ground.flange)
        yield pt.connect(self.converter.flange_b, self.turbine.flange_a)
        yield pt.connect(self.turbine.flange_b, self.C1.flange_a, self.C2.flange_a, self.C3.flange_a)
        yield pt.connect(self.C1.flange_b, self.small.flange_a, self.gear.sun_small)
        yield pt.connect(self.C2.flange_b, self.large.flange_a, self.gear.sun_large, self.B1.flange_a)
        yield pt.connect(self.C3.flange_b, self.carrier.flange_a, self.gear.carrier, self.B2.flange_a)
        yield pt.connect(self.gear.ring, self.output.flange_a)
        yield pt.connect(self.output.flange_b, self.load.flange_a)
        for signal, element in (("p1", self.C1), ("p2", self.C2), ("p3", self.C3), ("b1", self.B1), ("b2", self.B2)):
            yield pt.connect(getattr(self, signal), element.f_normalized)


@pytest.mark.slow
def test_a_ravigneaux_four_speed_takes_off_and_shifts() -> None:
    """From rest, where elements, meshes and the load hold each other; first gear is Z_ring/Z_small; the second run is the first."""
    plant = pt.compile(FourSpeed())
    shift: dict[str, Any] = {"b2": ([0.0, 4.0, 4.3], [1.0, 1.0, 0.0]), "b1": ([0.0, 4.0, 4.3], [0.0, 0.0, 1.0])}
    first = plant.simulate(8.0, inputs=shift)
    again = plant.simulate(8.0, inputs=shift)
    np.testing.assert_array_equal(again["output.w"], first["output.w"])
    at = np.flatnonzero(first.time < 4.0)[-1]
    assert first["turbine.w"][at] / first["output.w"][at] == pytest.approx(78 / 30, rel=1e-6)
    audit = pt.energy_audit(first)
    assert abs(audit.residual) < 1e-6 * audit.turnover


class ElectricCvt(pt.Component):
    """Engine at the carrier, output at the ring, and the sun, that has no inertia, to the output by a lossy unit of ratio V."""

    gear: PlanetaryGear = PlanetaryGear(ratio=2.6, eta_ab=0.98, eta_ba=0.98)
    unit: CVU = CVU(eta_ab=0.9, eta_ba=0.9)
    engine: rot.Inertia = rot.Inertia(J=0.2)
    output: rot.Inertia = rot.Inertia(J=2.0)
    drive: rot.Torque = rot.Torque()
    load: rot.Damper = rot.Damper(d=0.8)
    ground: rot.Fixed = rot.Fixed()
    tau: pt.Input = pt.signal_input("N.m", "Torque of the engine", default=100.0)
    V: pt.Input = pt.signal_input("1", "Ratio of the unit", default=0.15)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.tau, self.drive.tau)
        yield pt.connect(self.drive.flange, self.engine.flange_a)
        yield pt.connect(self.engine.flange_b, self.gear.carrier)
        yield pt.connect(self.gear.ring, self.output.flange_a, self.unit.flange_a)
        yield pt.connect(self.gear.sun, self.unit.flange_b)
        yield pt.connect(self.V, self.unit.ratio)
        yield pt.connect(self.output.flange_b, self.load.flange_a)
        yield pt.connect(self.load.flange_b, self.ground.flange)


@pytest.mark.parametrize("V", few([-0.8, -0.15, 0.0, 0.15, 0.6, 1.0, 1.7]))
@pytest.mark.parametrize("tau", [100.0, -60.0])
def test_an_electric_cvt_without_inertia_at_the_sun_rests_where_simulations_end(V: float, tau: float) -> None:
    plant = pt.compile(ElectricCvt())
    point = pt.steady(plant, {"V": V, "tau": tau}, outputs=["engine.w", "output.w"])
    assert point.status.item() == (STUCK if V == 1.0 else OK)  # at V = 1 the gear turns as one block
    run = plant.simulate(120.0, inputs={"V": V, "tau": tau}, rtol=1e-9)
    for name in ("engine.w", "output.w"):
        ends = [f"{name}_low", f"{name}_high"] if V == 1.0 else [name, name]
        low, high = (point[end].item() for end in ends)
        slack = 1e-6 * abs(low)
        assert low - slack <= run[name][-1] <= high + slack


class TwoMode(pt.Component):
    """Two lossless planetary gears: below the synchronous point B holds the second ring, above it C joins that to the first sun."""

    first: rot.IdealPlanetary = rot.IdealPlanetary(ratio=2.0)
    second: rot.IdealPlanetary = rot.IdealPlanetary(ratio=2.0)
    B: rot.Brake = rot.Brake(fn_max=5000, mue_pos=ONE)
    C: rot.Clutch = rot.Clutch(fn_max=5000, mue_pos=ONE)
    engine: rot.Inertia = rot.Inertia(J=0.2)
    output: rot.Inertia = rot.Inertia(J=1.0)
    one: rot.Inertia = rot.Inertia(J=0.05)
    two: rot.Inertia = rot.Inertia(J=0.05)
    drive: rot.Torque = rot.Torque()
    machine: rot.Torque = rot.Torque()
    other: rot.Torque = rot.Torque()
    load: rot.Torque = rot.Torque()
    engine_torque: pt.Input = pt.signal_input("N.m", "Torque of the engine")
    b: pt.Input = pt.signal_input("1", "Pressure of B")
    c: pt.Input = pt.signal_input("1", "Pressure of C")
    tau_1: pt.Input = pt.signal_input("N.m", "Torque of the first machine")
    tau_2: pt.Input = pt.signal_input("N.m", "Torque of the second machine")
    tau_load: pt.Input = pt.signal_input("N.m", "Torque at the output")

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine_torque, self.drive.tau)
        yield pt.connect(self.tau_1, self.machine.tau)
        yield pt.connect(self.tau_2, self.other.tau)
        yield pt.connect(self.tau_load, self.load.tau)
        yield pt.connect(self.drive.flange, self.engine.flange_a)
        yield pt.connect(self.engine.flange_b, self.first.ring)
        yield pt.connect(self.machine.flange, self.one.flange_a)
        yield pt.connect(self.one.flange_b, self.first.sun, self.C.flange_a)
        yield pt.connect(self.other.flange, self.two.flange_a)
        yield pt.connect(self.two.flange_b, self.second.sun, self.first.carrier)
        yield pt.connect(self.second.ring, self.B.flange_a, self.C.flange_b)
        yield pt.connect(self.second.carrier, self.output.flange_a)
        yield pt.connect(self.load.flange, self.output.flange_b)
        yield pt.connect(self.b, self.B.f_normalized)
        yield pt.connect(self.c, self.C.f_normalized)


def test_a_two_mode_transmission_at_its_synchronous_point() -> None:
    """With both elements closed and the first sun at rest, engine and output are in the ratio of the gears; one mode on either side."""
    w = np.array([199.0, 199.9999, 200.0, 200.0001, 201.0])
    for pressed in ({"b": 1.0, "c": 0.0}, {"b": 0.0, "c": 1.0}):
        # the first sun turns with w - 200: at 200 rad/s of the engine the second ring and the first sun both stand
        wanted: dict[str, Any] = (
            {"engine.w": w, "two.w": 400.0 / 3} | pressed | {"engine_torque": 100.0, "tau_load": -150.0}
        )
        found = pt.steady(TwoMode(), wanted, free=["tau_1", "tau_2"], outputs=["output.w", "one.w"])
        assert found.status.values.tolist() == [OK] * 5
        np.testing.assert_allclose(found["one.w"], 3 * 400 / 3 - 2 * w, atol=1e-9)


@pytest.mark.slow
def test_two_locks_on_one_lossy_mesh_do_not_chatter() -> None:
    """First and second gear of the eight-speed at once: the meshes rest, and no loss is made."""
    plant = pt.compile(eight_speed(0.98))
    held = {f"p{element}": 1.0 for element in "ABCE"} | {"pD": 0.0, "tau_in": 200.0}
    run = plant.simulate(2.0, inputs=held)
    assert len([e for e in run.events if e.time > 0.0]) == 0
    assert np.abs(run["output.w"]).max() < 1e-7  # a free turbine would reach 8,000 rad/s
