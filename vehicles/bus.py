"""The bus of a vehicle: its parts, and the power available to a machine, as an input of its control."""

from __future__ import annotations

from powertrain import Component, Equations, ParameterError, Symbol, connect, replace
from powertrain.components.control import BlendedBraking
from powertrain.components.electric import (
    AccessoryLoad,
    BatteryCooling,
    ElectricMachine,
    MachineCooling,
    PolarizedBattery,
)
from powertrain.components.evaluation import numbers
from powertrain.components.thermal import HeatPort


def one_bus(
    vehicle: Component,
    battery: PolarizedBattery,
    cooling: BatteryCooling,
    accessories: AccessoryLoad,
    *machines: tuple[ElectricMachine, MachineCooling],
) -> Equations:
    """``battery`` supplies the ``machines`` and the ``accessories``; the coolings give battery and machines their temperatures.

    Errors: ParameterError if even the full battery cannot supply what they take while the vehicle stands.
    """
    yield connect(battery.heat_port, cooling.battery)
    for machine, of_machine in machines:
        yield connect(machine.heat_port, of_machine.machine)
    yield connect(battery.bus, *(machine.bus for machine, _ in machines), accessories.bus)
    voltage, R = battery.ocv.values.max(), float(replace(battery).R)
    load, idle = float(replace(accessories).P), sum(_at_rest(machine) for machine, _ in machines)
    most, taken = voltage**2 / (4 * R), load + idle
    if most <= taken:
        raise ParameterError(
            f"{type(vehicle).__name__}.battery delivers at most {most:.3g} W, with {voltage:.3g} V and R = {R:.3g} Ohm, but while the "
            f"vehicle stands the accessories take {load:.3g} W and the electric machines {idle:.3g} W; "
            "give it an ocv of more cells in series, or a smaller R"
        )


def _at_rest(machine: ElectricMachine) -> float:
    """The loss [W] of a machine at rest without torque."""
    machine = replace(machine)
    return float(numbers(lambda w: machine.losses(w, Symbol(0.0), HeatPort.reference), 0.0))


def known_machine(control: BlendedBraking, machine: ElectricMachine, left: Symbol) -> Equations:
    """Tell the control the machine's largest torque and losses; ``left`` is the power [W] that it may draw, including losses."""
    idle = machine.loss_at(Symbol(0.0))
    most = machine.full_load(machine.w, machine.bus.v, machine.heat_port.T)
    yield control.limit.value == most
    yield control.added_loss.value == machine.loss_at(most) - idle
    yield control.discharge_power.value == left - idle
