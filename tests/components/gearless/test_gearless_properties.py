"""What holds for every gearless differential, over random geometry and friction, in motion."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from joined import joined, run

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.differentials import BevelDifferential, Differential
from powertrain.components.gearless.circular_cam import (
    CircularCamDifferential,
    CircularCams,
    FrictionDisk,
    bias_ratio,
    latent_efficiency,
)
from powertrain.components.gearless.linkage import JointFriction, Linkage, LinkageDifferential, LinkMasses
from powertrain.components.gearless.linkage.masses import LinkBody
from powertrain.components.gearless.spherical_cam import CamFriction, SphericalCam, SphericalCamDifferential

SPUN = "0.left=1.flange 0.right=2.flange 0.crown=3.flange"
AXLE = "0.crown=1.flange_a 0.left=2.flange_a 0.right=3.flange_a 1.flange_b=4.flange 2.flange_b=5.flange 3.flange_b=6.flange"
NOTHING = LinkMasses(LinkBody(1.0, 1e-12, 1e-12), LinkBody(0.0, 0.0, 0.0), LinkBody(0.0, 0.0, 0.0))
CAMS = ((4, 5), (3, 4), (3, 5), (3, 6), (5, 6))
mu = st.one_of(st.just(0.0), st.floats(0.001, 0.15))
quick = settings(
    max_examples=6, deadline=None, suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow]
)


@st.composite
def circular(draw: st.DrawFn) -> CircularCamDifferential:
    """A design that can be built."""
    D_out, n = draw(st.floats(0.06, 0.12)), draw(st.sampled_from([4, 6]))
    D_in = draw(st.floats(0.45, 0.75)) * D_out
    try:
        cams = CircularCams.build(
            D_out=D_out,
            D_in=D_in,
            r_out=0.4 * D_out * math.sin(math.pi / n),
            r_in=0.4 * D_in * math.sin(math.pi / n),
            alpha_out=draw(st.floats(0.1, 0.5)),
            alpha_in=draw(st.floats(0.1, 0.5)),
            disk=FrictionDisk(D_out, 0.4 * D_out, draw(mu)),
            n=n,
        )
    except pt.ParameterError:
        assume(False)
    sharing: Any = draw(st.sampled_from(["elastic", "averaged"]))
    stiffness, groove = draw(st.floats(0.3, 3.0)), draw(mu)
    return CircularCamDifferential.from_design(cams, sharing=sharing, stiffness=stiffness, mu_groove=groove)


@st.composite
def spherical(draw: st.DrawFn) -> SphericalCamDifferential:
    """A cam that can be built, with any friction."""
    M, N = draw(st.sampled_from(CAMS))
    alpha_3, alpha_4 = draw(st.floats(0.6, 0.85)), draw(st.floats(0.15, 0.4))
    try:
        cam = SphericalCam(M, N, alpha_3=alpha_3, alpha_4=alpha_4)
    except pt.ParameterError:
        assume(False)
    friction = CamFriction(mu_pin=draw(mu), mu_thrust=draw(mu), mu_contact=draw(mu), mu_bearing=draw(mu))
    sharing: Any = draw(st.sampled_from(["elastic", "single"]))
    return SphericalCamDifferential(cam=cam, friction=friction, sharing=sharing)


@st.composite
def linkages(draw: st.DrawFn) -> LinkageDifferential:
    """A linkage without masses."""
    b = draw(st.floats(0.04, 0.1))
    a = draw(st.floats(0.2, 1.2)) * b
    linkage = Linkage(a, b, draw(st.floats(-0.3, 0.3)) * a)
    joints = JointFriction(draw(mu), draw(mu), draw(mu), draw(mu))
    return LinkageDifferential.of(linkage, NOTHING, joints)


def kappa_of(differential: Differential, result: Any) -> Any:
    """The locking coefficient of the design tools at the run's angles, w_left > w_right."""
    if isinstance(differential, SphericalCamDifferential):
        return differential.cycle.kappa(result["parts[0].psi"])
    if isinstance(differential, LinkageDifferential):
        names = [f"parts[0].{n}" for n in ("a", "b", "offset")]
        joints = JointFriction(**{n: result.parameters[f"parts[0].{n}"] for n in vars(JointFriction())})
        return joints.kappa(Linkage(*(result.parameters[n] for n in names)), result["parts[0].alpha"])
    return result["parts[0].kappa"]


def spun(differential: Differential, torque: float) -> Any:
    parts = rot.ConstantSpeed(w_fixed=6.0), rot.ConstantSpeed(w_fixed=4.0), rot.ConstantTorque(tau_constant=torque)
    return run(joined(differential, *parts, joints=SPUN), 0.6, times=np.linspace(0, 0.6, 121))


@pytest.mark.slow
@quick
@given(st.one_of(circular(), spherical(), linkages()), st.sampled_from([150.0, -80.0]))
def test_torques_losses_and_efficiency(differential: Any, torque: float) -> None:
    """kappa >= 0, loss >= 0, T_slow/T_fast = (1 + kappa)/(1 - kappa), of the design tools and of the run."""
    result = spun(differential, torque)
    at_events = {event.time for event in result.events}
    kept = np.array([t not in at_events for t in result.time])
    kappa = kappa_of(differential, result)[kept]
    assert kappa.min() >= 0
    sides = (
        ("left", "right") if torque > 0 else ("right", "left")
    )  # a torque that holds back holds the faster side back more
    fast, slow = (-result[f"parts[0].{side}.tau"][kept] / torque for side in sides)
    np.testing.assert_allclose(fast + slow, 1, rtol=1e-8)
    np.testing.assert_allclose(slow - fast, kappa, atol=1e-7)
    slips = kappa < 1 - 1e-6
    np.testing.assert_allclose((slow / fast)[slips], bias_ratio(kappa[slips]), rtol=1e-4)
    np.testing.assert_allclose((fast / slow)[slips], latent_efficiency(kappa[slips]), atol=1e-6)
    assert result["parts[0].lossPower"].min() >= 0
    np.testing.assert_allclose(result["parts[0].lossPower"][kept], kappa * abs(torque) / 2 * 2.0, atol=1e-5)


@pytest.mark.slow
@quick
@given(st.one_of(circular(), spherical(), linkages()))
def test_energy_closes(differential: Any) -> None:
    parts = [rot.Inertia(J=J) for J in (0.5, 1.0, 1.2)] + [
        rot.ConstantTorque(tau_constant=T) for T in (300.0, -60.0, -110.0)
    ]
    result = run(joined(differential, *parts, joints=AXLE), 0.3, {"1.w": 20.0, "2.w": 21.5})
    audit = pt.energy_audit(result)
    assert audit.closure < 1e-6
    assert (
        np.asarray(audit.loss["parts[0]"]).min() > -1e-9 * 300 * 20
    )  # the speed at which it sticks is known to round-off


@pytest.mark.slow
@quick
@given(st.sampled_from(["circular", "spherical", "linkage"]), st.data())
def test_without_friction_it_is_the_bevel(kind: str, data: st.DataObject) -> None:
    made: Any = data.draw({"circular": circular(), "spherical": spherical(), "linkage": linkages()}[kind])
    off = dict.fromkeys(("mu", "mu_groove", "mu_pin", "mu_thrust", "mu_bearing", "mu_shaft", "mu_ball", "mu_rod"), 0.0)
    plain = pt.replace(made, **{n: v for n, v in off.items() if n in type(made)._fields})
    speeds = []
    for differential in (plain, BevelDifferential()):
        parts: list[pt.Component] = [rot.Inertia(J=J) for J in (0.5, 1.0, 1.2)]
        parts += [rot.ConstantTorque(tau_constant=T) for T in (300.0, -60.0, -110.0)]
        result = run(joined(differential, *parts, joints=AXLE), 0.3)
        speeds.append([float(result[f"parts[{i}].w"][-1]) for i in (1, 2, 3)])
    assert speeds[0] == pytest.approx(speeds[1], rel=1e-7)
