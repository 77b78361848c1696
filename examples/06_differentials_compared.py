"""One car, six differentials: a road with ice on one side, then a bend of 10 m.

The same rear-wheel-drive car starts with its left wheel on ice (mu = 0.15) and its right wheel on dry ground, and drives through a bend
to the left with the accelerator slightly pressed. Only the differential changes. Nothing is prescribed: which wheel spins, which
differential locks and where the energy goes follows from the laws of the tyres and of the differential.

On ice, open differentials give both wheels the small torque that the left one can transmit. A differential with friction between its
sides gives the right wheel more, up to its torque-bias ratio; a locking one turns both wheels at the same speed. In the bend the same
friction slows the car: the faster right wheel gets less torque than the left one, and a locked differential drives with the left wheel
alone.
"""

from __future__ import annotations

import sys
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes

import powertrain as pt
from powertrain.components.differentials import BevelDifferential, Differential, LimitedSlipDifferential
from powertrain.components.gearless.circular_cam import CircularCamDifferential
from powertrain.components.gearless.linkage import JointFriction, LinkageDifferential
from powertrain.components.gearless.spherical_cam import SphericalCamDifferential
from powertrain.vehicles import RearDriveCar

JOINTS = JointFriction(mu_shaft=0.1, mu_pin=0.1, mu_ball=0.1, mu_rod=0.1)
DIFFERENTIALS: dict[str, Differential] = {
    "bevel": BevelDifferential(eta=0.97),
    "limited slip": LimitedSlipDifferential(preload=20, bias_drive=2.5, bias_coast=1.5),
    "circular cam": CircularCamDifferential(),
    "circular cam, locking": CircularCamDifferential(mu=0.2),
    "spherical cam": SphericalCamDifferential(),
    "linkage": LinkageDifferential.of(joints=JOINTS),
}
ROADS: dict[str, dict[str, Any]] = {
    "left wheel on ice": {"parameters": {"rear.left.mu": 0.15}, "inputs": {"driver.accelerator_pedal": 0.5}},
    "bend of 10 m": {"inputs": {"driver.accelerator_pedal": 0.25, "curvature": 0.1}},
}
STARTS = {"body.v": 3.0, "engine.w": 3.0 / 0.3 * 3.5 * 3.9}
"""3 m/s with the clutch closed: wheels of 0.3 m, gear and final drive."""
STOP = 3.0
"""Seconds simulated."""
LATE = np.linspace(2.0, STOP, 1001)
"""Instants of the last second, over which torques are averaged; the samples of a result are closer at events."""


def drive(differential: Differential) -> dict[str, pt.Result[RearDriveCar]]:
    """The car on every road."""
    plant = pt.compile(pt.replace(RearDriveCar.in_one_gear(), {"rear.differential": differential}))
    return {road: plant.simulate(STOP, starts=STARTS, points=2000, **options) for road, options in ROADS.items()}


def torques(result: pt.Result[RearDriveCar], side: str) -> Any:
    """What the differential gives to a half shaft during the last second."""
    return -result.at(LATE, f"rear.differential.{side}.tau")


def row(result: pt.Result[RearDriveCar]) -> dict[str, float]:
    """The numbers of one run: means of the last second, speeds at the end, energies lost."""
    audit = pt.energy_audit(result)
    lost = audit.components.lost / 1000
    left, right = (torques(result, side).mean() for side in ("left", "right"))
    return {
        "T_left": left,
        "T_right": right,
        "share": max(left, right) / (left + right),
        "traction": (result.at(LATE, "rear.left.f") + result.at(LATE, "rear.right.f")).mean(),
        "v": result["body.v"][-1],
        "spin": result["rear.left.v_slip"][-1],
        "lost_differential": lost["rear.differential"],
        "lost_tyres": lost["rear.left"] + lost["rear.right"],
        "closure": audit.closure,
    }


def table(runs: dict[str, dict[str, pt.Result[RearDriveCar]]], road: str) -> pd.DataFrame:
    """One line for each differential: torques in N.m, traction in N, speeds in m/s, energies in kJ."""
    return pd.DataFrame({name: row(found[road]) for name, found in runs.items()}).T


def draw(runs: dict[str, dict[str, pt.Result[RearDriveCar]]], file: str) -> None:
    """Torques, speed and losses, a line of pictures for each road."""
    figure, axes = plt.subplots(len(ROADS), 3, figsize=(13, 8), layout="constrained", width_ratios=(1.15, 1, 1))
    for road, (shares, speeds, losses) in zip(ROADS, axes, strict=True):
        found = {name: results[road] for name, results in runs.items()}
        draw_torques(shares, found)
        for name, result in found.items():
            speeds.plot(result.time, result["body.v"], lw=1.6, label=name)
        draw_losses(losses, table(runs, road))
        shares.set_ylabel(road, fontsize=12)
        speeds.set_ylabel("speed of the car [m/s]")
        for ax in (shares, speeds, losses):
            ax.grid(alpha=0.25)
            ax.set_axisbelow(True)
    titles = "Torques: mean and range of the last second", "Traction", "Losses"
    labels = "torque on the half shafts [N.m]", "time [s]", f"energy lost in {STOP:g} s [kJ]"
    for i, (title, label) in enumerate(zip(titles, labels, strict=True)):
        axes[0, i].set_title(title)
        axes[-1, i].set_xlabel(label)
        axes[0, i].legend(fontsize=9, loc=("lower right", "upper left", "upper right")[i])
    figure.savefig(file, dpi=120)


def draw_torques(ax: Axes, found: dict[str, pt.Result[RearDriveCar]]) -> None:
    """Left and right torque of every differential."""
    places = np.arange(len(found))
    for side, shift, colour in (("left", -0.2, "C0"), ("right", 0.2, "C1")):
        values = [torques(result, side) for result in found.values()]
        mean = np.array([v.mean() for v in values])
        spread = np.abs([[v.min() for v in values] - mean, [v.max() for v in values] - mean])
        ax.barh(places + shift, mean, 0.38, xerr=spread, color=colour, label=f"{side} wheel", error_kw={"lw": 1})
    ax.set_yticks(places, list(found))
    ax.axvline(0, color="0.4", lw=0.8)
    ax.invert_yaxis()


def draw_losses(ax: Axes, numbers: pd.DataFrame) -> None:
    """What the driven tyres and the differential have lost."""
    places = np.arange(len(numbers))
    ax.barh(places, numbers.lost_tyres, color="0.7", label="driven tyres")
    ax.barh(places, numbers.lost_differential, left=numbers.lost_tyres, color="C3", label="differential")
    ax.set_xlim(0, 1.35 * (numbers.lost_tyres + numbers.lost_differential).max())
    ax.set_yticks(places, [])
    ax.invert_yaxis()


def main() -> None:
    """Simulate all of them and print the tables; pass a file name to save the figure."""
    runs = {name: drive(differential) for name, differential in DIFFERENTIALS.items()}
    for road in ROADS:
        shown = table(runs, road).drop(columns="closure")
        print(f"\n{road} (torques N.m, traction N, speeds m/s, energies kJ):\n{shown.round(2).to_string()}")
    if len(sys.argv) > 1:
        draw(runs, sys.argv[1])


if __name__ == "__main__":
    main()
