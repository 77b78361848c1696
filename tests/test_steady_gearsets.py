"""Operating points of gearsets whose clutches hold and slip, against an independent enumeration of where latent power flows."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest
import xarray as xr
from cases import few
from gearsets import EIGHT, RATIOS, TEETH, EightSpeed, eight_speed
from numpy.typing import NDArray

import powertrain as pt
from powertrain.components.rotational import Brake, ConstantSpeed, ConstantTorque, IdealPlanetary, Inertia, Torque
from powertrain.equilibrium.laws import SteadyLaws

ETA = 0.98
NODES = ("turbine", "suns", "ring1", "carrier1", "ring2", "ring3", "carrier3", "output")
SETS = (
    ("suns", "ring1", "carrier1"),
    ("suns", "ring2", "turbine"),
    ("ring2", "ring3", "carrier3"),
    ("ring3", "carrier1", "output"),
)
"""Sun, ring and carrier of each set."""
ELEMENTS = {
    "A": ("suns", None), "B": ("ring1", None), "C": ("turbine", "ring3"), "D": ("carrier3", "output"), "E": ("ring2", "ring3"),
}  # fmt: skip
"""What each shift element holds together; None is the housing."""


def speeds(gear: str) -> NDArray[np.float64]:
    """The speeds of all shafts for one rad/s of the turbine, by Willis' equations."""
    rows = [np.eye(8)[0]]
    for (sun, ring), members in zip(TEETH, SETS, strict=True):
        s, r, c = (np.eye(8)[NODES.index(n)] for n in members)
        rows.append(s - c + ring / sun * (r - c))
    for element in EIGHT[gear]:
        one, other = ELEMENTS[element]
        rows.append(np.eye(8)[NODES.index(one)] - (0.0 if other is None else np.eye(8)[NODES.index(other)]))
    return np.linalg.solve(np.array(rows), np.eye(8)[0])


def output_torques(gear: str, drive: float, eta: float) -> list[float]:
    """Torques of the load that balance ``drive`` at the turbine, for every consistent choice of the driving sides of the meshes.

    Unknown are the torque of each sun, its loss, those of the three elements, and the load. A set without relative motion loses nothing
    that could be told; where its torques are not determined the least ones are taken, which does not change the load.
    """
    w, found = speeds(gear), []
    relative = [w[NODES.index(s)] - w[NODES.index(c)] for s, _, c in SETS]
    rests = [abs(each) < 1e-9 for each in relative]
    for sides in product((1, -1), repeat=4):
        matrix, right = np.zeros((12, 12)), np.zeros(12)
        right[0] = -drive
        for k, (members, (sun, ring)) in enumerate(zip(SETS, TEETH, strict=True)):
            place = [NODES.index(n) for n in members]
            matrix[place, k] += np.array([-1.0, -ring / sun, 1.0 + ring / sun])
            matrix[place[1:], 4 + k] += np.array([ring / sun, -ring / sun])
            matrix[8 + k, k] = 0.0 if rests[k] else -((1 - eta) if sides[k] > 0 else (1 - 1 / eta))
            matrix[8 + k, 4 + k] = 1.0
        held = np.zeros((12, 4))
        for j, element in enumerate(EIGHT[gear]):
            one, other = ELEMENTS[element]
            held[NODES.index(one), j] = -1.0
            if other is not None:
                held[NODES.index(other), j] = 1.0
        held[NODES.index("output"), 3] = 1.0
        whole = np.hstack([matrix[:, :8], held])
        found_here = np.linalg.lstsq(whole, right, rcond=None)[0]
        if np.abs(whole @ found_here - right).max() > 1e-9 * abs(drive):
            continue
        fine = all(
            rest or side * t * v >= -1e-12
            for rest, side, t, v in zip(rests, sides, found_here[:4], relative, strict=True)
        )
        if fine:
            found.append(float(found_here[11]))
    return found


@pytest.fixture(scope="module", params=few([ETA, 1.0]))
def plant(request: pytest.FixtureRequest) -> pt.Plant[EightSpeed]:
    return pt.compile(eight_speed(request.param, ConstantTorque(tau_constant=-1.0)))


@pytest.mark.parametrize("gear", list(EIGHT))
@pytest.mark.parametrize("torque", few([100.0, -100.0]))
def test_eight_speed(plant: pt.Plant[EightSpeed], gear: str, torque: float) -> None:
    """All ratios, and the torque of the load that the turbine drives, or that drives the turbine."""
    held = {f"p{e}": float(e in EIGHT[gear]) for e in "ABCDE"}
    grid = {"turbine.w": 200.0, "tau_in": torque} | held
    point = pt.steady(plant, grid, outputs=["output.w", "load.tau_constant"], free=["load.tau_constant"])
    assert point.status.item() == 0, point.attrs["problems"]
    ratio = 200.0 / point["output.w"].item()
    assert ratio == pytest.approx(1 / speeds(gear)[7], rel=1e-9)
    assert ratio == pytest.approx(RATIOS[gear], abs=1.5e-3)
    (load,) = np.unique(np.round(output_torques(gear, torque, plant.parameters["sets[0].eta_ab"]), 9))
    assert point["load.tau_constant"].item() == pytest.approx(load, rel=1e-9)


def test_modes_that_contradict_each_other_cost_little(
    plant: pt.Plant[EightSpeed], monkeypatch: pytest.MonkeyPatch
) -> None:
    """At starts with the wrong speeds no torques let all laws stick. Iterated to the end, that took 900 evaluations a point."""
    asked, known = [0], SteadyLaws.equations

    def equations(self: SteadyLaws, fixed: list[Any], z: Any) -> Any:
        asked[0] += len(z)
        return known(self, fixed, z)

    monkeypatch.setattr(SteadyLaws, "equations", equations)
    grid: dict[str, Any] = {"turbine.w": np.linspace(10.0, 600.0, 20), "tau_in": np.linspace(-200.0, 200.0, 20)}
    grid |= {f"p{e}": float(e in EIGHT["1"]) for e in "ABCDE"}
    point = pt.steady(plant, grid, outputs=["output.w"], free=["load.tau_constant"])
    assert (point.status == 0).all()
    assert asked[0] < 650 * point.status.size


def test_eight_speed_under_its_own_load() -> None:
    """Speeds are found, in a map of all gears and torques; the mirrored torque gives the mirrored motion."""
    plant = pt.compile(eight_speed(ETA))
    gears = {f"p{e}": xr.DataArray([float(e in EIGHT[g]) for g in EIGHT], dims="gear") for e in "ABCDE"}
    grid: dict[str, Any] = {"tau_in": [-100.0, 30.0, 100.0], **gears}
    found = pt.steady(plant, grid, outputs=["turbine.w", "output.w", "load.flange.tau"])
    assert (found.status == 0).all(), found.attrs["problems"]
    for k, gear in enumerate(EIGHT):
        here = found.isel(gear=k)
        np.testing.assert_allclose(here["turbine.w"] / here["output.w"], 1 / speeds(gear)[7], rtol=1e-9)
        np.testing.assert_allclose(here["turbine.w"][0], -here["turbine.w"][2], rtol=1e-9)
        np.testing.assert_allclose(here["load.flange.tau"][2], -output_torques(gear, 100.0, ETA)[0], rtol=1e-9)


class HeldRing(pt.Component):
    """A planetary gear driven at its sun, with its ring held by a brake and a load on its carrier."""

    load: pt.Input = pt.signal_input("N.m", "Torque on the carrier")
    drive: ConstantSpeed = ConstantSpeed(w_fixed=100.0)
    gear: IdealPlanetary = IdealPlanetary(ratio=2.0)
    brake: Brake = Brake(fn_max=1000.0, mue_pos=((0.0, 1.0),))
    torque: Torque = Torque()
    J: Inertia = Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.gear.sun)
        yield pt.connect(self.gear.ring, self.brake.flange_a)
        yield pt.connect(self.gear.carrier, self.J.flange_a)
        yield pt.connect(self.J.flange_b, self.torque.flange)
        yield self.brake.f_normalized.value == 1.0
        yield pt.connect(self.load, self.torque.tau)


def test_held_ring_at_every_load() -> None:
    """The carrier turns at 100/(1 + 2); the brake carries 2/(1 + 2) of the load."""
    load = np.linspace(-200.0, -10.0, 39)
    found = pt.steady(HeldRing(), {"load": load}, outputs=["J.w", "brake.tau"])
    assert (found.status == 0).all(), found.attrs["problems"]
    np.testing.assert_allclose(found["J.w"], 100 / 3, rtol=1e-12)
    np.testing.assert_allclose(found["brake.tau"], load * 2 / 3, rtol=1e-9)
