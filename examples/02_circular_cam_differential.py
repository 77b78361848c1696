"""Does a circular-cam differential lock? The bench experiments of Provatidis 2023, simulated.

Two cam disks with circular-arc tracks turn relative to each other over rollers in the cage. The flatter the tracks, the more the rollers
press the disks apart, and the friction of the disks may lock them against any torque. On a test bench the author of the paper found: with
one shaft clamped, no torque turns the cage (1); with the cage clamped, no torque turns one shaft (2); and a small torque on the other
shaft releases both. With the data of Table 1 of the paper the model turns at once: locking needs more friction than the printed
0.066, and how much more depends on how the two tracks share the load. Both cases are shown.

Pass a file name to save the figure.
"""

from __future__ import annotations

import math
import sys

import matplotlib.pyplot as plt
import numpy as np

import powertrain as pt
from powertrain.components.differentials import Differential
from powertrain.components.gearless.circular_cam import (
    TABLE_1,
    TORQUE,
    CircularCamDifferential,
    Sharing,
    all_phase_limit,
    critical_angle,
    locking,
    with_friction,
)
from powertrain.components.gearless.circular_cam.figures import (
    contact_angles,
    contact_pressures,
    locking_coefficient,
    locking_limits,
    mechanism,
    normal_forces,
)
from powertrain.components.rotational import ConstantTorque, Fixed, Inertia


class Experiment1(pt.Component):
    """The right shaft in a clamp, a torque on the cage, an assisting torque on the left shaft."""

    differential: Differential
    drive: ConstantTorque
    assist: ConstantTorque
    clamp: Fixed = Fixed()
    cage: Inertia = Inertia(J=0.05)
    shaft: Inertia = Inertia(J=0.05)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.cage.flange_a)
        yield pt.connect(self.cage.flange_b, self.differential.crown)
        yield pt.connect(self.differential.left, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.assist.flange)
        yield pt.connect(self.differential.right, self.clamp.flange)


class Experiment2(pt.Component):
    """The cage in a clamp, a torque on the left shaft, an assisting torque on the right shaft the other way."""

    differential: Differential
    drive: ConstantTorque
    assist: ConstantTorque
    clamp: Fixed = Fixed()
    first: Inertia = Inertia(J=0.05)
    second: Inertia = Inertia(J=0.05)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.first.flange_a)
        yield pt.connect(self.first.flange_b, self.differential.left)
        yield pt.connect(self.differential.right, self.second.flange_a)
        yield pt.connect(self.second.flange_b, self.assist.flange)
        yield pt.connect(self.differential.crown, self.clamp.flange)


def outcome(model: pt.Component) -> str:
    """What a quarter of a second on the bench shows."""
    result = pt.simulate(model, stop=0.25)
    turned = math.degrees(result["differential.theta"][-1])
    if abs(turned) < 1e-6:
        return "held"
    left, right, crown = (result[f"differential.{shaft}.phi"][-1] for shaft in ("left", "right", "crown"))
    ratio, other = (left / crown, "cage") if crown else (left / right, "right")
    end = "still turns" if result["differential.mode"][-1] else "then held"
    return f"turns {turned:.2f}°, left {ratio:+.1f} times the {other}, {end}"


def bench(mu: float, sharing: Sharing) -> None:
    """Both experiments: without assistance, just below and above what releases the shafts, and above what turns them at every phase."""
    cams = with_friction(TABLE_1, mu)
    differential = CircularCamDifferential.from_design(cams, sharing=sharing)
    kappa, greatest = (float(cams.kappa(theta, sharing).max()) for theta in (0.0, np.linspace(0, math.pi / 2, 1001)))
    print(f"\nmu = {mu:g}, {sharing} sharing: kappa = {kappa:.3f} at theta = 0, {greatest:.3f} at most")
    for kind, where, torque in (
        (Experiment1, "cage", 100.0),
        (Experiment1, "cage", 1000.0),
        (Experiment2, "left", 100.0),
    ):
        release, turn = (torque * (k - 1) / (2 if kind is Experiment1 else k + 1) for k in (kappa, greatest))
        for assist in dict.fromkeys((0.0, 0.99 * release, 1.01 * release, 1.01 * turn) if kappa > 1 else (0.0,)):
            model = kind(
                differential=differential,
                drive=ConstantTorque(tau_constant=torque),
                assist=ConstantTorque(tau_constant=assist if kind is Experiment1 else -assist),
            )
            print(f"  {kind.__name__}: {torque:6.0f} N.m on the {where}, {assist:8.3f} N.m to assist: {outcome(model)}")


def draw(name: str) -> None:
    """The mechanism at two phases, and its curves, as a picture."""
    figure, axes = plt.subplots(3, 2, figsize=(12, 12), layout="constrained")
    mechanism(TABLE_1, math.pi / 8, axes[0, 0])
    contact_angles(TABLE_1, axes[0, 1])
    locking_coefficient(TABLE_1, axes[1, 0])
    locking_limits(TABLE_1, axes[1, 1])
    normal_forces(TABLE_1, TORQUE, axes[2, 0])
    contact_pressures(TABLE_1, TORQUE, axes[2, 1])
    figure.suptitle("Circular-cam differential: the data of Provatidis 2023, Table 1")
    figure.savefig(name, dpi=120)


def main() -> None:
    """Answer the question for the paper's data, then put the differential on the bench."""
    sharings: tuple[Sharing, ...] = ("rigid", "elastic")
    for sharing in sharings:
        print(f"Table 1, {sharing} sharing: {locking(TABLE_1, sharing)}")
    limit = critical_angle(TABLE_1.disk.D_R, TABLE_1.outer.D, TABLE_1.xi, TABLE_1.disk.mu)
    print(
        f"Greatest angle of similar tracks that locks: {np.degrees(limit):.2f}° by eq. (42), where both tracks carry; "
        f"{np.degrees(all_phase_limit(TABLE_1)):.2f}° at every phase"
    )
    bench(0.066, "averaged")
    bench(0.2, "averaged")
    bench(0.066, "elastic")
    bench(0.36, "elastic")
    if len(sys.argv) > 1:
        draw(sys.argv[1])


if __name__ == "__main__":
    main()
