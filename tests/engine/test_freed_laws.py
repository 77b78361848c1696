from __future__ import annotations

import powertrain as pt
from powertrain.components.rotational import BearingFriction, Brake, ConstantTorque, Inertia
from powertrain.engine.enumeration import _free_or_not


class Released(pt.Component):
    """A shaft that turns in a bearing, with a brake that is not pressed."""

    torque: ConstantTorque = ConstantTorque(tau_constant=5)
    shaft: Inertia = Inertia(J=1)
    bearing: BearingFriction = BearingFriction(tau_pos=((0.0, 1.0),))
    brake: Brake = Brake(fn_max=10)
    press: pt.Input = pt.signal_input("1", "Pressure", default=0.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque.flange, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.bearing.flange_a)
        yield pt.connect(self.bearing.flange_b, self.brake.flange_a)
        yield pt.connect(self.press, self.brake.f_normalized)


def test_the_search_frees_what_has_no_torque_and_holds_what_has() -> None:
    """A brake that was tried at rest shares the bearing's bounds; its own are zero."""
    for press, wanted in ((0.0, [0.0, 2.0]), (1.0, [0.0, 0.0])):
        plant = pt.compile(Released())
        plant.simulate(1, inputs={"press": press})
        engine = plant._engine("auto", False)
        laws = {law.name: law.index for law in engine.dae.frictions}
        places = [laws["bearing.mode"], laws["brake.mode"]]
        for tried in ([0.0, 0.0], [2.0, 2.0]):
            engine.memory.m[places] = tried
            _free_or_not(engine.dae, engine.memory, 0)
            assert engine.memory.m[places].tolist() == wanted
