"""A differential without gears: the spatial linkage RRSCSRR of Madhavan 1996, a car in a bend, and better lengths.

Two couplers on the output shafts hold the ends of a lever in ball joints. The lever turns and slides on an axis in the cage, and a half
turn about that axis exchanges left and right, so the shafts turn relative to the cage at equal and opposite speeds, as in a bevel
differential. The differences are inside: the mass of the lever shakes the housing, the torque loads the ball joints, and friction in all
joints biases the torque.

The car drives through the bend of the source, first at constant speed and then accelerating, a case that the source leaves open. The last
table is the optimisation that the source proposes: shaking against the forces in the ball joints. Pass a file name to save the figure.
"""

from __future__ import annotations

import sys

import matplotlib.pyplot as plt
import numpy as np

import powertrain as pt
from powertrain.components.differentials import BevelDifferential, Differential
from powertrain.components.gearless.linkage import (
    CORRECTED,
    TABLE_5_1,
    JointFriction,
    Linkage,
    LinkageDifferential,
    figures,
    in_bend,
    ratio_from_theta,
    scaled,
)
from powertrain.components.gearless.linkage.design import (
    DifferentialDuty,
    Front,
    alternate,
    ball_force,
    guided,
    pareto,
    peaks,
    rod_force,
)
from powertrain.components.gearless.linkage.shaking import shaking, turns
from powertrain.components.rotational import ConstantTorque, IdealGear, Inertia

LINKAGE = Linkage(a=0.03, b=0.06)
BEND = in_bend(88, radius=7, track=1.4)
JOINTS = JointFriction(mu_shaft=0.003, mu_pin=0.05, mu_ball=0.05, mu_rod=0.05)
"""Rolling bearings for the shafts, lubricated sliding everywhere else."""

MASS, WHEEL_RADIUS, ACCELERATION = 1200.0, 0.3, 3.0


class CarInBend(pt.Component):
    """A car whose wheels roll in a bend: the outer one turns by w_diff/w_cage faster than its middle, the inner one slower."""

    differential: Differential
    drive: ConstantTorque
    resistance: ConstantTorque = ConstantTorque(tau_constant=-200)
    outer: IdealGear = IdealGear(ratio=BEND.outer / 88)
    inner: IdealGear = IdealGear(ratio=BEND.inner / 88)
    car: Inertia = Inertia(J=MASS * WHEEL_RADIUS**2)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.differential.crown)
        yield pt.connect(self.differential.left, self.outer.flange_a)
        yield pt.connect(self.differential.right, self.inner.flange_a)
        yield pt.connect(self.outer.flange_b, self.inner.flange_b, self.car.flange_a)
        yield pt.connect(self.car.flange_b, self.resistance.flange)


def table_of_numbers() -> None:
    """What the source prints and what comes out; where it errs, the right value is named."""
    alpha = np.linspace(0, 2 * np.pi, 4001)
    moved = alternate(LINKAGE)
    rows: list[tuple[str, str, float]] = [
        ("greatest angle of the lever [rad]", "0.5", LINKAGE.theta_max),
        ("a/b for 30 degrees", "0.5176", ratio_from_theta(np.radians(30))),
        ("b for that and a = 3 cm [cm]", "5.8", 100 * guided().b),
        ("speed of the outer wheel [rad/s]", "96.8", BEND.outer),
        ("speed of the inner wheel [rad/s]", "79.2", BEND.inner),
        ("torque of 18 kW at 88 rad/s [N.m]", "200 (204.5)", DifferentialDuty.cruising(18000, 88).torque),
        (
            "turns of the shaking force in a cycle",
            "10 (11)",
            turns(shaking(LINKAGE, DifferentialDuty().drive(alpha), phi=10 * alpha).force),
        ),
        ("cage about the shafts [g.cm2]", "24200 (134200)", CORRECTED.cage.axial * 1e7),
        ("S-pair force [N]", "", ball_force(LINKAGE, 100)),
        ("C-pair force [N]", "", rod_force(LINKAGE, 100)),
        ("moved C axis: S-pair force [%]", "(-2.3)", 100 * (ball_force(moved, 1) / ball_force(LINKAGE, 1) - 1)),
        ("moved C axis: C-pair force [%]", "", 100 * (rod_force(moved, 1) / rod_force(LINKAGE, 1) - 1)),
    ]
    print(f"{'':40s}{'printed (right)':>16s}{'computed':>12s}")
    for name, printed, value in rows:
        print(f"{name:40s}{printed:>16s}{value:12.6g}")


def table_of_runs() -> None:
    """Torques of the wheels over 1.5 s of bend, at a steady speed and gaining speed, with each differential."""
    kinds: dict[str, Differential] = {
        "bevel": BevelDifferential(),
        "linkage, no friction": LinkageDifferential.of(LINKAGE, TABLE_5_1),
        "linkage, friction": LinkageDifferential.of(LINKAGE, TABLE_5_1, JOINTS),
    }
    cruising = DifferentialDuty()
    driving = {"steady": cruising, f"{ACCELERATION:g} m/s2": cruising.accelerating(ACCELERATION, MASS, WHEEL_RADIUS)}
    print(f"\n{'1.5 s in the bend':22s}{'':10s}{'outer wheel [N.m]':>20s}{'inner wheel [N.m]':>20s}{'lost [J]':>10s}")
    for name, kind in kinds.items():
        for case, duty in driving.items():
            model = CarInBend(differential=kind, drive=ConstantTorque(tau_constant=duty.torque))
            result = pt.simulate(model, 1.5, starts={"car.w": 88.0})
            sides = (-result[f"differential.{side}.tau"] for side in ("left", "right"))
            ranges = "".join(f"{f'{v.min():.1f} .. {v.max():.1f}':>20s}" for v in sides)
            lost = float(pt.energy_audit(result).components["lost"]["differential"])
            print(f"{name:22s}{case:10s}{ranges}{lost:10.1f}")
    print(f"\n{'joints, peaks':22s}{'S-pair [N]':>14s}{'C-pair [N]':>14s}{'shaking [N]':>14s}")
    for case, duty in driving.items():
        found = peaks(LINKAGE, TABLE_5_1, duty)
        print(f"{case:22s}{found.ball_force:14.0f}{found.rod_force:14.0f}{found.shaking_force:14.1f}")


def table_of_designs(front: Front) -> None:
    """The front, and the source's design beside it."""
    print(
        f"\n{'a [cm]':>8s}{'b [cm]':>8s}{'offset':>8s}{'lever':>8s}{'shaking [N]':>13s}{'S-pair [N]':>12s}{'C-pair [N]':>12s}"
    )
    source = guided()
    for name, linkage, one in [
        *(("", *pair) for pair in zip(front.designs, front.peaks, strict=True)),
        ("the source's", source, peaks(source, scaled(source))),
    ]:
        angle = f"{np.degrees(linkage.theta_max):.0f} deg"
        print(
            f"{100 * linkage.a:8.2f}{100 * linkage.b:8.2f}{100 * linkage.offset:8.2f}{angle:>8s}"
            f"{one.shaking_force:13.1f}{one.ball_force:12.0f}{one.rod_force:12.0f}  {name}"
        )


def draw(front: Front, name: str) -> None:
    """Mechanism, motion, shaking, forces, efficiency and the front."""
    figure = plt.figure(figsize=(15, 9), layout="constrained")
    figures.mechanism(LINKAGE, ax=figure.add_subplot(2, 3, 1, projection="3d", proj_type="ortho"))
    figures.motion(LINKAGE, figure.add_subplot(2, 3, 2)).set_title("Motion of lever and couplers")
    figures.shaking_path(LINKAGE, ax=figure.add_subplot(2, 3, 3)).set_title("Shaking force in one cycle: 11 turns")
    figures.ball_forces(LINKAGE, ax=figure.add_subplot(2, 3, 4)).set_title("S-pairs, 200 N.m on the cage")
    figures.efficiency(LINKAGE, ax=figure.add_subplot(2, 3, 5)).set_title("Friction in the joints")
    figures.front(front, figure.add_subplot(2, 3, 6)).set_title("Shaking against joint forces")
    figure.savefig(name, dpi=120)


def main() -> None:
    """Print the tables; pass a file name to save the figure."""
    table_of_numbers()
    table_of_runs()
    front = pareto(points=8)
    table_of_designs(front)
    if len(sys.argv) > 1:
        draw(front, sys.argv[1])


if __name__ == "__main__":
    main()
