"""The gearset of AHS-2, a transmission with two machines, two ranges and four fixed gears: GM's patent US 6 953 409."""

from __future__ import annotations

from powertrain.components.transmissions import Lever, Network, joints

C1, C2, C3, C4 = joints("ring 3-housing", "carriers-out", "B-housing", "A-B")


def ahs2(R_1: float, R_2: float, R_3: float) -> Network:
    """Engine at the first ring; A at its sun and at the second ring; B at the second and third sun; the third carrier is the output."""
    levers = (
        Lever("1", "A", "in", "carriers", -R_1),
        Lever("2", "B", "A", "carriers", -R_2),
        Lever("3", "B", "ring 3", "out", -R_3),
    )
    return Network(levers, ("A", "B"))
