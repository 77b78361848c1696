"""Madhavan 1996, section 5.2: torques under load, and what shakes."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from powertrain.components.gearless.linkage import cage_turns
from powertrain.components.gearless.linkage.forces import Drive, Reactions, reactions
from powertrain.components.gearless.linkage.shaking import shaking, turns
from powertrain.reproductions.madhavan_data import CYCLE, DUTY, LINKAGE, POWER, W_COUPLING
from powertrain.reproductions.table import Row, Table


def in_the_bend() -> Reactions:
    """Forces over one internal cycle in the bend, with 100 N.m taken by the right wheel."""
    return reactions(LINKAGE, DUTY.drive(CYCLE), right=-DUTY.torque / 2)


def torques() -> Table:
    """Section 5.2.2, external loads."""
    found = in_the_bend()
    crown, left = found.torques.crown, -found.torques.left
    S = LINKAGE.motion(CYCLE).S
    on_lever = found.C_moment[..., 0] + S * found.C_force[..., 2]
    arm, F_1, F_3 = _local_x()
    rows = [
        Row(
            "τ_cage = 18 kW/88 rad/s",
            "N.m",
            "eq. (5.46)",
            "200",
            POWER / DUTY.w,
            "rounded to 200 in the thesis",
            right="204.5",
        ),
        Row("τ_cage, mean over a cycle with τ_6 = 100 N.m", "N.m", "5.2.2", "200", float(crown.mean())),
        Row("τ_2, mean over a cycle", "N.m", "eq. (5.47)", "100", float(left.mean())),
        Row(
            "greatest deviation of τ_cage from 200 N.m",
            "N.m",
            "5.2.2",
            "",
            float(np.abs(crown - 200).max()),
            "called extremely small",
        ),
        Row("M_x + F_z S at the C-pair, mean", "N.m", "eq. (5.50)", "200", float(on_lever[:-1].mean()), "on the lever"),
        Row(
            "M_x + F_z S at the C-pair, greatest deviation from 200",
            "N.m",
            "eq. (5.50)",
            "",
            float(np.abs(on_lever - 200).max()),
        ),
        Row(
            "M_z at the C-pair over b (F_x1 − F_x3), without inertia",
            "1",
            "eq. (5.49)",
            "2 b (F_x1 + F_x2)",
            arm / (LINKAGE.b * (F_1 - F_3)),
            "M_z = b (F_x1 − F_x3) with signs, 2 b F_x1 in statics",
            right="1.00",
        ),
    ]
    return Table(
        "Torques under load", rows, "Cage at 88 rad/s, left wheel at 96.8 rad/s, 100 N.m taken by the right wheel."
    )


def _local_x() -> tuple[float, float, float]:
    """In statics at alpha = 1 rad: the moment at the C-pair about the lever's z, forces along its x (the C axis) at its +y and -y ends."""
    still = reactions(LINKAGE, Drive.at(np.array([1.0])), right=-100.0)
    theta = float(LINKAGE.motion(1.0).theta)
    z = np.array([math.sin(theta), 0.0, math.cos(theta)])
    moment = float(-(still.C_moment[0] @ z))
    return moment, float(still.S_right[0, 1]), float(still.S_left[0, 1])


def shaking_forces() -> Table:
    """Sections 5.2.1 and 5.2.2, inertia effects."""
    coupling = shaking(LINKAGE, Drive.at(CYCLE, u=W_COUPLING))
    cycle = np.linspace(0, 2 * math.pi, 14401)
    car = shaking(LINKAGE, DUTY.drive(cycle), phi=cycle * cage_turns(DUTY.radius, DUTY.track))
    at_rest = _on_bearings(Drive.at(CYCLE, u=W_COUPLING), 0.0)
    free, loaded = (_on_bearings(DUTY.drive(CYCLE), torque) for torque in (0.0, DUTY.torque))
    change = _greatest(loaded - free)
    rows = [
        Row("shaking force of the coupling along X and Z", "N", "5.2.1", "0", _greatest(at_rest[:, [0, 2]])),
        Row("shaking moment of the coupling about Z", "N.m", "5.2.1", "0", _greatest(coupling.moment[:, 2])),
        Row("shaking force of the differential along X", "N", "5.2.2", "0", _greatest(free[:, 0])),
        Row(
            "shaking force with 200 N.m on the cage against that without",
            "",
            "5.2.2",
            "the same",
            "the same" if change < 1e-9 * _greatest(free) else f"differs by {change:.3g} N",
        ),
        Row(
            "turns of the differential's shaking force per internal cycle",
            "1",
            "5.2.2, Fig. 5.19",
            "10",
            abs(turns(car.force)),
            "ten turns of the cage and one of the motion inside it",
            right="11",
        ),
        Row(
            "which shakes more, the coupling at 2000 rpm or the differential",
            "",
            "5.2.2",
            "coupling",
            "coupling" if _greatest(coupling.force) > _greatest(car.force) else "differential",
        ),
    ]
    for what, where, found in (
        ("force of the coupling along Y", "Fig. 5.11", coupling.force[:, 1]),
        ("force of the differential along Y", "Fig. 5.15", car.force[:, 1]),
        ("force of the differential along Z", "Fig. 5.16", car.force[:, 2]),
    ):
        rows.append(Row(f"greatest shaking {what}", "N", where, "", _greatest(found)))
    for what, where, found in (
        ("moment of the coupling about Y", "Fig. 5.12", coupling.moment[:, 1]),
        ("moment of the differential about Y", "Fig. 5.17", car.moment[:, 1]),
        ("moment of the differential about Z", "Fig. 5.18", car.moment[:, 2]),
    ):
        rows.append(Row(f"greatest shaking {what}", "N.m", where, "", _greatest(found)))
    note = (
        "Moments are about the centre, where C axis and shaft axis meet; the thesis does not state its point. Its curves are missing from "
        "the available copy, so their peaks are only computed."
    )
    return Table("Shaking", rows, note)


def _on_bearings(drive: Drive, torque: float) -> NDArray[np.float64]:
    """The force of lever and couplers on cage and shafts, summed over their joints [N], in axes of the cage."""
    found = reactions(LINKAGE, drive, crown=torque)
    return -(found.C_force + found.R_left + found.R_right)


def _greatest(values: NDArray[np.float64]) -> float:
    return float(np.abs(values).max())
