"""How many lobes, how many rollers? The spherical cam differential of Chaudhary, Angeles & Morozov 2014, from tables to torques.

Pairs of conjugate spherical cams replace the bevel pinions of a differential, and carriers of conical rollers its side
gears. The paper chooses four lobes and five rollers from two tables. The first one, of pressure angles, is computed here with roller
angles that the paper does not state; its printed maxima cannot be reproduced. The second one is arithmetic: it multiplies final-drive
ratios by M/N, which has no effect in a car. Half the sum of the speeds of both wheels is that of the cage, as the simulations at the end
show. What the cams do change is the friction, and therefore how unequal the torques of the two wheels may be.

Pass a file name to save the figure.
"""

from __future__ import annotations

import sys

import matplotlib.pyplot as plt
import numpy as np

import powertrain as pt
from powertrain.components.differentials import BevelDifferential, Differential
from powertrain.components.gearless.spherical_cam import (
    CamFriction,
    CamGeometry,
    Cycle,
    PlanetaryFinalDrive,
    SphericalCam,
    SphericalCamDifferential,
    pressure_angle_range,
    search,
    table_2,
)
from powertrain.components.gearless.spherical_cam.figures import (
    efficiency,
    flat_profile,
    load_sharing,
    mechanism,
    pressure_angles,
    profile_on_sphere,
)
from powertrain.components.rotational import ConstantTorque, Inertia

TABLE_1 = {
    (3, 3): (0.0, 0.21),
    (3, 4): (0.63, 0.66),
    (3, 5): (0.88, 0.9),
    (3, 6): (1.02, 1.11),
    (3, 7): (1.1, 1.11),
    (4, 4): (0.0, 16.62),
    (4, 5): (0.52, 0.57),
    (4, 6): (0.78, 0.8),
    (4, 7): (1.01, 1.02),
    (4, 8): (1.02, 1.03),
}


class Axle(pt.Component):
    """An engine's torque on a planetary final drive, and two wheels that are held back unequally."""

    differential: Differential
    drive: PlanetaryFinalDrive = PlanetaryFinalDrive(ratio=3.29, eta_ab=0.985, eta_ba=0.985)
    engine: ConstantTorque = ConstantTorque(tau_constant=60)
    shaft: Inertia = Inertia(J=0.1)
    left: Inertia = Inertia(J=1.5)
    right: Inertia = Inertia(J=1.5)
    on_left: ConstantTorque = ConstantTorque(tau_constant=-60)
    on_right: ConstantTorque = ConstantTorque(tau_constant=-90)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.flange, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.drive.flange_a)
        yield pt.connect(self.drive.flange_b, self.differential.crown)
        yield pt.connect(self.differential.left, self.left.flange_a)
        yield pt.connect(self.differential.right, self.right.flange_a)
        yield pt.connect(self.left.flange_b, self.on_left.flange)
        yield pt.connect(self.right.flange_b, self.on_right.flange)


def tables() -> None:
    """Both tables of the paper beside what is computed, then the search."""
    print("Table 1: pressure angle [rad]       printed       computed (end: where both cams are equal)")
    for (M, N), (least, most) in TABLE_1.items():
        computed = pressure_angle_range(CamGeometry(M, N))
        print(f"  M = {M}, N = {N}              {least:5.2f} ..{most:6.2f}   {computed[0]:5.2f} ..{computed[1]:6.2f}")
    print("\nTable 2: M/N, and M/N times standard final-drive ratios, cut off")
    for (M, N), row in table_2().items():
        print(f"  M = {M}, N = {N}:  " + "  ".join(f"{x:4.2f}" for x in row))
    print("\nSearch, best first                     least pressure angle   off standard   mean eta_0")
    for choice in search():
        if choice.refused:
            print(f"  refused: {choice.refused}")
        else:
            angle, off, eta = choice.minimum_pressure_angle, choice.off_standard, choice.mean_eta
            print(
                f"  M = {choice.M}, N = {choice.N}                              {angle:8.3f} rad   {off:8.3f}      {eta:8.4f}"
            )


def on_an_axle() -> None:
    """The same axle with a bevel differential and with cam differentials of several friction, in half a second."""
    rough = CamFriction(mu_pin=1.0, pin=0.9, mu_thrust=1.0, mu_contact=0.7, mu_bearing=0.3)
    kinds = {
        "bevel": BevelDifferential(),
        "cam (4, 5)": SphericalCamDifferential(),
        "cam (4, 5), one roller at a time": SphericalCamDifferential(sharing="single"),
        "cam (3, 4)": SphericalCamDifferential(cam=SphericalCam(3, 4)),
        "cam (4, 5), dry pins": SphericalCamDifferential(friction=CamFriction(mu_pin=0.2, mu_thrust=0.2)),
        "cam (3, 6), rough": SphericalCamDifferential(cam=SphericalCam(3, 6), friction=rough),
    }
    print(
        "\nAxle after 0.5 s                    left     right     their mean   engine/3.29   T_right/T_left      lost"
    )
    for name, differential in kinds.items():
        result = pt.simulate(Axle(differential=differential), stop=0.5)
        left, right, engine = (result[f"{part}.w"][-1] for part in ("left", "right", "shaft"))
        ratio = result["differential.right.tau"] / result["differential.left.tau"]
        lost = float(np.trapezoid(result["differential.lossPower"] if "cam" in name else 0 * result.time, result.time))
        print(
            f"  {name:32} {left:7.2f}  {right:7.2f} rad/s {(left + right) / 2:7.2f}   {engine / 3.29:11.2f}   "
            f"{ratio.min():7.3f} .. {ratio.max():5.3f} {abs(lost):8.2f} J"
        )


def draw(name: str) -> None:
    """The mechanism, its profile, and its curves, as a picture."""
    cam, figure = SphericalCam(4, 5), plt.figure(figsize=(15, 14), layout="constrained")
    flat_profile(cam, figure.add_subplot(3, 3, 1))
    profile_on_sphere(cam, figure.add_subplot(3, 3, 2, projection="3d"))
    mechanism(cam, 0.2, figure.add_subplot(3, 3, 3, projection="3d"))
    pressure_angles(cam, figure.add_subplot(3, 3, 4))
    load_sharing(Cycle(cam), figure.add_subplot(3, 3, 5))
    efficiency(Cycle(cam), figure.add_subplot(3, 3, 6))
    pressure_angles(SphericalCam(3, 4), figure.add_subplot(3, 3, 7))
    load_sharing(Cycle(cam, sharing="single"), figure.add_subplot(3, 3, 8))
    efficiency(Cycle(cam, sharing="single"), figure.add_subplot(3, 3, 9))
    figure.suptitle("Spherical cam differential: Chaudhary, Angeles & Morozov 2014")
    figure.savefig(name, dpi=110)


def main() -> None:
    """Choose, then simulate, then draw."""
    tables()
    on_an_axle()
    if len(sys.argv) > 1:
        draw(sys.argv[1])


if __name__ == "__main__":
    main()
