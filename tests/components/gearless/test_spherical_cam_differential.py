"""The spherical cam differential as a component, and the planetary final drive before it."""

from __future__ import annotations

import math
from typing import Any, get_args

import numpy as np
import pytest
from cases import few
from joined import joined, run

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Sine
from powertrain.components.differentials import BevelDifferential, Differential, PlanetaryGear
from powertrain.components.gearless.spherical_cam import (
    NO_FRICTION,
    STANDARD_RATIOS,
    CamFriction,
    PlanetaryFinalDrive,
    Sharing,
    SphericalCam,
    SphericalCamDifferential,
)

SHARINGS = get_args(Sharing)
ROUGH = CamFriction(mu_pin=1.0, pin=0.9, mu_thrust=1.0, mu_contact=0.7, mu_bearing=0.3)
KINDS = [
    SphericalCamDifferential(),
    SphericalCamDifferential(sharing="single"),
    SphericalCamDifferential(cam=SphericalCam(3, 4), friction=CamFriction(mu_pin=0.1, mu_bearing=0.1)),
    SphericalCamDifferential(cam=SphericalCam(3, 6), sharing="single"),
]
AXLE = "0.crown=1.flange_a 0.left=2.flange_a 0.right=3.flange_a 4.flange=1.flange_b 5.flange=2.flange_b 6.flange=3.flange_b"
SPUN = "0.left=1.flange 0.right=2.flange 0.crown=3.flange"
each = pytest.mark.parametrize("differential", few(KINDS, 2), ids=["elastic", "single", "3-4", "3-6"])


def axle(differential: Differential, torques: tuple[float, float, float]) -> pt.Component:
    """Inertias on crown, left, right, and torques on them."""
    parts = [rot.Inertia(J=J) for J in (0.5, 1.0, 1.2)] + [rot.ConstantTorque(tau_constant=T) for T in torques]
    return joined(differential, *parts, joints=AXLE)


def spun(differential: Differential, left: float, right: float, torque: float, **options: Any) -> Any:
    """Both sides at given speeds, a torque on the crown wheel."""
    parts = rot.ConstantSpeed(w_fixed=left), rot.ConstantSpeed(w_fixed=right), rot.ConstantTorque(tau_constant=torque)
    return run(joined(differential, *parts, joints=SPUN), 2.0, **options)


@pytest.mark.slow
@each
@pytest.mark.parametrize("torque", [100.0, -40.0])
@pytest.mark.parametrize(("left", "right"), [(5.0, 4.0), (-9.0, -8.2)])
def test_torques_have_the_efficiency_of_the_cycle(
    differential: SphericalCamDifferential, torque: float, left: float, right: float
) -> None:
    """Cage at rest in thought: eta_0 of what the driving side puts in comes out, either way of turning and of the torque."""
    result = spun(differential, left, right, torque, times=np.linspace(0, 2, 401))
    theta, psi = result["parts[0].theta"], result["parts[0].psi"]
    cam, cycle = differential.cam, differential.cycle
    np.testing.assert_allclose(theta, (left - right) / 2 * result.time, atol=1e-9)
    np.testing.assert_allclose(psi, cam.N / cam.M * theta)
    sides = ("left", "right") if (left > right) == (torque > 0) else ("right", "left")
    driven, driving = (-result[f"parts[0].{side}.tau"] for side in sides)
    np.testing.assert_allclose(driven + driving, torque, rtol=1e-9)
    eta = cycle.eta_0(psi if left > right else -psi)
    error = np.abs(driven / driving / eta - 1)
    at_jumps = {e.time for e in result.events}
    assert error[[t not in at_jumps for t in result.time]].max() < 1e-7
    loss = result["parts[0].lossPower"]
    assert (loss > 0).all()
    np.testing.assert_allclose(loss, np.abs(driving - driven) / 2 * abs(left - right), rtol=1e-9)


@each
def test_speeds(differential: SphericalCamDifferential) -> None:
    """Half the sum at the crown wheel whatever M and N, which only set the spin of the cam."""
    result = spun(differential, 7.0, 3.0, 10.0)
    crown, cam = result["parts[3].flange.phi"], differential.cam
    np.testing.assert_allclose(crown, 5.0 * result.time, atol=1e-9)
    np.testing.assert_allclose(result["parts[0].w_cam"], cam.N / cam.M * (7.0 - 5.0))


@each
def test_energy_closes_in_motion(differential: SphericalCamDifferential) -> None:
    result = run(axle(differential, (300.0, -60.0, -110.0)), 1.5, {"1.w": 20.0, "0.w_rel": 3.0})
    audit = pt.energy_audit(result)
    assert audit.closure < 1e-7  # the tolerance over some hundred handovers
    assert np.asarray(audit.loss["parts[0]"]).min() >= 0


@pytest.mark.slow
@each
def test_mirrored_torques_give_mirrored_motion(differential: SphericalCamDifferential) -> None:
    """And exchanged sides exchanged motion: left ahead at psi is right ahead at -psi."""
    torques, starts = (200.0, -30.0, -160.0), {"0.w_rel": 4.0, "1.w": 10.0}
    one = run(axle(differential, torques), 1.0, starts)
    t1, t2, t3 = torques
    other = run(axle(differential, (-t1, -t2, -t3)), 1.0, {name: -w for name, w in starts.items()})
    for i in (1, 2, 3):
        assert other[f"parts[{i}].w"][-1] == pytest.approx(-one[f"parts[{i}].w"][-1], rel=1e-7, abs=1e-7)
    parts = [rot.Inertia(J=J) for J in (0.5, 1.2, 1.0)] + [rot.ConstantTorque(tau_constant=T) for T in (t1, t3, t2)]
    crossed = run(joined(differential, *parts, joints=AXLE), 1.0, {"0.w_rel": -4.0, "1.w": 10.0})
    for i, j in ((1, 1), (2, 3), (3, 2)):
        assert crossed[f"parts[{i}].w"][-1] == pytest.approx(one[f"parts[{j}].w"][-1], rel=1e-7, abs=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("sharing", SHARINGS)
@pytest.mark.parametrize("torques", [(300.0, -60.0, -110.0), (-300.0, 60.0, 110.0), (50.0, 20.0, -70.0)])
def test_without_friction_it_is_the_bevel_differential(sharing: Sharing, torques: tuple[float, float, float]) -> None:
    """In the limit too: the error goes with the friction."""
    bevel, tiny = run(axle(BevelDifferential(), torques), 1.0), CamFriction(mu_pin=1e-7, mu_thrust=0, mu_bearing=1e-7)
    for friction, error in ((NO_FRICTION, 1e-9), (tiny, 1e-5)):
        cam = run(axle(SphericalCamDifferential(friction=friction, sharing=sharing), torques), 1.0)
        for i in (1, 2, 3):
            assert cam[f"parts[{i}].w"][-1] == pytest.approx(bevel[f"parts[{i}].w"][-1], rel=error, abs=error)


@pytest.mark.slow
def test_between_the_bevel_differentials_of_its_extreme_efficiencies() -> None:
    """The mesh law with R_o = -1 and an efficiency that changes."""
    torques = (300.0, -60.0, -200.0)
    differential = SphericalCamDifferential()
    eta = differential.cycle.eta_0(np.linspace(0, differential.cam.half, 200))
    w = [
        run(axle(each, torques), 1.0)["parts[2].w"][-1]
        for each in (BevelDifferential(eta=float(eta.min())), differential, BevelDifferential(eta=float(eta.max())))
    ]
    assert w[0] < w[1] < w[2]


@pytest.mark.slow
def test_halves_hold_together_up_to_kappa() -> None:
    """At rest against each other: torques may differ by kappa T_C, no more; eta_0 ripples with the angle where it breaks loose."""
    differential = SphericalCamDifferential()
    for psi in (0.0, 0.2, -0.2, 0.5):
        theta = psi * differential.cam.M / differential.cam.N
        kappa = float(differential.cycle.kappa(psi))
        for share, stuck in ((0.98, True), (1.02, False)):
            load = 100.0
            # free sides of equal inertia: the difference of the outer torques is that of the side torques while stuck
            parts = [rot.Inertia(J=1.0) for _ in range(3)]
            parts[0] = rot.Inertia(J=1e-9)
            outer = [
                rot.ConstantTorque(tau_constant=T) for T in (load, share * kappa * load / 2, -share * kappa * load / 2)
            ]
            result = run(joined(differential, *parts, *outer, joints=AXLE), 0.01, {"0.theta": theta})
            assert (result["parts[0].mode"][-1] == 0) == stuck


@pytest.mark.slow
def test_rough_rollers_lock() -> None:
    """kappa > 1: with one side held no torque turns the cage; with the paper's friction it turns."""
    for friction, locks in ((ROUGH, True), (CamFriction(), False)):
        differential = SphericalCamDifferential(cam=SphericalCam(3, 6), friction=friction)
        assert (float(differential.cycle.kappa(0.0)) > 1) == locks
        for torque in (1.0, 1e4, -40.0):
            parts = rot.Fixed(), rot.Inertia(J=0.1), rot.ConstantTorque(tau_constant=torque), rot.Inertia(J=0.1)
            joints = "0.right=1.flange 0.crown=2.flange_a 2.flange_b=3.flange 0.left=4.flange_a"
            result = run(joined(differential, *parts, joints=joints), 0.01)
            assert (np.abs(result["parts[0].theta"]).max() < 1e-12) == locks


def test_hands_over_at_events() -> None:
    """One carries at a time: a jump of the torques wherever a roller of either side takes over."""
    differential = SphericalCamDifferential(sharing="single")
    result = spun(differential, 3.0, 1.0, 50.0)
    cam, h = differential.cam, differential.cycle.handover
    end = cam.N / cam.M * 2.0
    times = sorted(
        (k * cam.half + side * h) / (cam.N / cam.M)
        for side in (1, -1)
        for k in range(-2, 12)
        if 0 < k * cam.half + side * h < end
    )
    logged = sorted({round(e.time, 9) for e in result.events if e.time > 0 and e.name == "parts[0].handover"})
    np.testing.assert_allclose(logged, times, atol=1e-8)


@pytest.mark.slow
def test_events_while_it_slides() -> None:
    """A roller changes its sense of turning where the axis of relative rotation passes through its contact: nothing else happens."""
    differential = SphericalCamDifferential()
    result = spun(differential, 4.0, 1.0, 50.0)
    cam, times = differential.cam, sorted(e.time for e in result.events if e.time > 0)
    assert {e.name for e in result.events} == {"parts[0].spin"}
    u = np.linspace(0, cam.half, 20_001)
    reversal = float(u[np.argmin(np.abs(cam.beta_4(u - cam.half) - cam.alpha_4))])
    apart = np.mod(np.array(times) * 1.5 * cam.N / cam.M + 1e-9, cam.half)
    near = np.min([np.abs(apart - at) for at in (0.0, reversal, cam.half - reversal)], axis=0)
    assert near.max() < 1e-4
    assert not spun(
        SphericalCamDifferential(cam=SphericalCam(3, 6)), 30.0, 10.0, 50.0
    ).events  # it lies outside all the time


def test_refuses_axes_that_are_not_at_right_angles() -> None:
    with pytest.raises(pt.ParameterError, match="alpha_1 = 75° must be 90°"):
        SphericalCamDifferential(
            cam=SphericalCam(4, 5, alpha_1=math.radians(75), alpha_3=math.radians(36), alpha_4=math.radians(15))
        )
    with pytest.raises(pt.ParameterError, match=r"SphericalCamDifferential\.friction = 0\.1 is not a CamFriction"):
        SphericalCamDifferential(friction=0.1)  # type: ignore[arg-type]
    with pytest.raises(pt.ParameterError, match="sharing = 'both' is none of"):
        SphericalCamDifferential(sharing="both")  # type: ignore[arg-type]


class Slot(pt.Component):
    """An axle whose differential may be replaced."""

    differential: Differential = BevelDifferential()
    drive: Sine = Sine(amplitude=50, f=1.0)
    torque: rot.Torque = rot.Torque()
    left: rot.Inertia = rot.Inertia(J=1.0)
    right: rot.Inertia = rot.Inertia(J=1.5)
    cage: rot.Inertia = rot.Inertia(J=0.1)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.y, self.torque.tau)
        yield pt.connect(self.torque.flange, self.cage.flange_a)
        yield pt.connect(self.cage.flange_b, self.differential.crown)
        yield pt.connect(self.differential.left, self.left.flange_a)
        yield pt.connect(self.differential.right, self.right.flange_a)


@pytest.mark.slow
def test_slot() -> None:
    for differential in KINDS:
        result = pt.simulate(pt.replace(Slot(), differential=differential), stop=1.0)
        speeds = (result["left.w"] + result["right.w"]) / 2
        np.testing.assert_allclose(speeds, result["cage.w"], atol=1e-9)


@pytest.mark.parametrize("ratio", STANDARD_RATIOS)
@pytest.mark.parametrize("eta", [1.0, 0.97])
def test_final_drive(ratio: float, eta: float) -> None:
    """Sun in, ring held, carrier out: speeds by the ratio, torques by the mesh law with the carrier's speed taken off."""
    drive = PlanetaryFinalDrive(ratio=ratio, eta_ab=eta, eta_ba=eta)
    parts = drive, rot.ConstantSpeed(w_fixed=10 * ratio), rot.ConstantTorque(tau_constant=-100)
    result = run(joined(*parts, joints="0.flange_a=1.flange 0.flange_b=2.flange"), 0.1)
    assert result["parts[2].flange.phi"][-1] == pytest.approx(1.0)
    sun = result["parts[0].flange_a.tau"][-1]
    assert sun == pytest.approx(100 / (1 + (ratio - 1) * eta))
    power = float(result["parts[0].gear.mesh.lossPower"][-1])
    assert power == pytest.approx(sun * 10 * ratio - 1000, abs=1e-8)


def test_final_drive_from_teeth() -> None:
    """73 on 35.6 would be 3.05; 82/40 is."""
    gear = PlanetaryFinalDrive.from_teeth(40, 82, 21, 2)
    assert float(gear.ratio) == pytest.approx(3.05)
    assert float(PlanetaryGear.from_teeth(40, 82, 21, 2).ratio) == pytest.approx(2.05)


def test_final_drive_with_no_room_for_planets_is_refused() -> None:
    with pytest.raises(pt.ParameterError, match="ratio = 2"):
        PlanetaryFinalDrive(ratio=2.0)


def test_final_drive_ahead_of_the_differential() -> None:
    """Total reduction is that of the final drive; M/N does not enter."""
    parts = (
        PlanetaryFinalDrive(ratio=4.1),
        SphericalCamDifferential(),
        rot.ConstantSpeed(w_fixed=41.0),
        rot.Inertia(J=1),
        rot.Inertia(J=1),
    )
    joints = "2.flange=0.flange_a 0.flange_b=1.crown 1.left=3.flange_a 1.right=4.flange_a"
    result = run(joined(*parts, joints=joints), 0.5, {"3.w": 11.0, "4.w": 9.0})
    np.testing.assert_allclose(result["parts[3].w"] + result["parts[4].w"], 20.0)
