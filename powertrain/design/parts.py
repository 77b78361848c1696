"""Designs as components: their gears, and a unit with the losses of the design."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import powertrain as pt
from powertrain.components.cvu import CVU, ElectricPair, VariableUnit
from powertrain.components.electric import ElectricMachine
from powertrain.components.transmissions import (
    ElectricTransmission,
    NetworkRatio,
    NetworkTransmission,
    OverallRatio,
    RangeTransmission,
    RatioOfUnit,
    UnitLoss,
    VariableTransmission,
)
from powertrain.components.transmissions.ranges import Span

RESERVE = 2.0
"""Capacity of the machines of a pair, relative to the demands of the duty."""


def transmission_of(spans: Sequence[Span], unit: VariableUnit | ElectricPair) -> VariableTransmission:
    """Ranges with a unit: a pair of machines serves all of them, a unit controlled by its ratio one or several."""
    if isinstance(unit, ElectricPair):
        return ElectricTransmission.of(spans, unit)
    return NetworkTransmission.of(spans[0][2], unit) if len(spans) == 1 else RangeTransmission.of(spans, unit)


def ratio_of(transmission: VariableTransmission) -> RatioOfUnit:
    """The signal ``ratio`` of a transmission for an overall ratio: V of the unit, or r itself if the transmission accepts that."""
    if isinstance(transmission, NetworkTransmission):
        return NetworkRatio(network=transmission.network)
    return OverallRatio()


def cvu_of(loss: UnitLoss) -> CVU:
    """A component with these losses."""
    eta: dict[str, Any] = {}
    for end in ("ab", "ba"):
        given = getattr(loss, end)
        eta["map_" + end if isinstance(given, pt.Map) else "eta_" + end] = given
    return CVU(**eta)


def pair_of(loss: UnitLoss, *, torque: float, speed: float, power: float) -> ElectricPair:
    """Two machines with these losses: for the efficiency from a to b, sqrt(eta_ab) is that of a as generator, and of b as motor.

    ``torque`` [N.m], ``speed`` [rad/s] and ``power`` [W] are the limits of either machine. Errors: ParameterError for an efficiency map of
    both machines together, which does not give the losses of each.
    """
    if isinstance(loss.ab, pt.Map) or isinstance(loss.ba, pt.Map):
        raise pt.ParameterError(
            "the efficiency of the unit is a map of both machines together, which does not separate their losses; give an "
            "ElectricPair with its machines"
        )
    ab, ba = math.sqrt(loss.ab), math.sqrt(loss.ba)
    generating, driving = (ab, ba), (ba, ab)  # of a and b
    made = [
        ElectricMachine(
            loss_map=_loss_by_efficiency(drives, generates, speed, torque),
            tau_max=torque,
            P_max=power,
            w_max=speed,
            J=0.02,
            P_0=0,
        )
        for drives, generates in zip(driving, generating, strict=True)
    ]
    return ElectricPair(machine_a=made[0], machine_b=made[1])


def _loss_by_efficiency(drives: float, generates: float, speed: float, torque: float) -> pt.Map:
    """|w tau| is bilinear on either side of zero torque, so four points next to it represent it exactly: positive torques drive."""
    axes = [
        pt.Axis("w", "rad/s", [0.0, speed], "linear"),
        pt.Axis("tau", "N.m", [-torque, 0.0, torque], "linear"),
    ]
    power = speed * torque
    values = [[0.0, 0.0, 0.0], [(1 - generates) * power, 0.0, (1 / drives - 1) * power]]
    return pt.Map(axes, values, "W", f"loss at {drives:.3g} driving, {generates:.3g} generating")
