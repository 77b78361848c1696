"""Stick and slip: single laws against closed forms, coupled laws, starts with everything unknown."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from models import COUPLED_PARAMETERS, COUPLED_START, bodies, coupled_clutches, dae
from reference import load
from scipy.optimize import brentq

from powertrain.dae.hybrid import Friction, HybridDae, Switch
from powertrain.engine.simulator import Simulator
from powertrain.errors import InitializationError


def symmetric(*limits: float) -> object:
    return lambda torque, m: [(-limit, limit) for limit in limits]


def modes(model: HybridDae, x: list[float], t: float = 0.0) -> list[float]:
    engine = Simulator(model)
    return [float(v) for v in engine.resolve(t, x, [], model.held_start, [])[2]]


def test_mass_with_coulomb_friction_on_a_sine_force() -> None:
    t = ca.SX.sym("t")
    model = bodies([1.0], [2.0 * ca.sin(t)], np.array([[1.0]]), symmetric(1.0), t)
    events = Simulator(model).run([0.0], [], stop=8.0, rtol=1e-9, atol=1e-11).events
    breaks = np.arcsin(0.5)
    stops = brentq(lambda s: 2 * (np.cos(breaks) - np.cos(s)) - (s - breaks), 2, 4)
    assert [e.new for e in events[:3]] == [1.0, -1.0 if 2 * np.sin(stops) < -1 else 0.0, events[2].new]
    assert events[0].time == pytest.approx(breaks, abs=1e-9)
    assert events[1].time == pytest.approx(stops, abs=1e-8)


def coupled_columns() -> list[str]:
    return ["J1.phi", "J1.w", *(f"clutch{k}.{v}" for k in (1, 2, 3) for v in ("phi_rel", "w_rel"))]


@pytest.mark.parametrize("method", ["dopri5", "rodas5p", "sparse"])
def test_coupled_clutches_follow_the_reference(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if method == "sparse":
        monkeypatch.setattr("powertrain.engine.prepared._LARGE", 0)
        method = "rodas5p"
    reference = load("Rotational/CoupledClutches")
    trajectory = Simulator(coupled_clutches(), method).run(COUPLED_START, COUPLED_PARAMETERS, stop=1.5)  # type: ignore[arg-type]
    x = trajectory.at(reference.time, with_events=False)[1]
    for k, name in enumerate(coupled_columns()):
        assert np.abs(x[:, k] - reference.signals[name]).max() < 2e-4, name
    for k in (1, 2, 3):
        since, expected = zip(*reference.modes[f"clutch{k}.mode"][1:], strict=True)
        ours = [e for e in trajectory.events if e.name == f"clutch{k}"]
        assert [e.new for e in ours] == list(expected)
        assert np.abs(np.array([e.time for e in ours]) - since).max() < 1e-5


def test_perturbed_coupled_clutches_keep_the_sequence_of_a_tight_run() -> None:
    engine = Simulator(coupled_clutches())
    rng = np.random.default_rng(7)
    for _ in range(30):
        p = COUPLED_PARAMETERS * (1 + 0.05 * rng.standard_normal(8))
        p[5] = max(p[5], 1.0)
        loose, tight = (engine.run(COUPLED_START, p, stop=1.5, rtol=r, atol=0.01 * r).events for r in (1e-6, 1e-11))
        assert [(e.name, e.new) for e in loose] == [(e.name, e.new) for e in tight]


def test_event_times_converge_with_the_tolerance() -> None:
    engine = Simulator(coupled_clutches())
    times = [
        np.array(
            [e.time for e in engine.run(COUPLED_START, COUPLED_PARAMETERS, stop=1.5, rtol=r, atol=0.01 * r).events]
        )
        for r in (1e-6, 1e-8, 1e-12)
    ]
    errors = [np.abs(found - times[-1]).max() for found in times[:-1]]
    assert errors[0] > 5 * errors[1]
    assert errors[1] < 1e-8


def test_stuck_speeds_are_exactly_zero() -> None:
    trajectory = Simulator(coupled_clutches()).run(COUPLED_START, COUPLED_PARAMETERS, stop=1.5)
    for instant in trajectory.instants:
        for k in range(3):
            if instant.held_right[k] == 0:
                assert instant.right[3 + 2 * k] == 0.0


def three_in_series(push: float, limits: tuple[float, float, float]) -> HybridDae:
    """Body 0 pushed; laws between 0-1, 1-2 and 2-ground."""
    t = ca.SX.sym("t")
    jacobian = np.array([[1.0, -1, 0], [0, 1, -1], [0, 0, 1]])
    return bodies([1.0, 2.0, 3.0], [push + 0 * t, 0, 0], jacobian, symmetric(*limits), t, peak=1.0)


@pytest.mark.parametrize(
    ("push", "limits", "expected"),
    [
        (1.0, (2, 2, 2), [0, 0, 0]),
        (5.0, (2, 3, 4), [1, 0, 0]),
        (5.0, (9, 9, 4), [0, 0, 1]),
        (5.0, (9, 3, 4), [0, 1, 0]),
        (-5.0, (9, 3, 4), [0, -1, 0]),
        (20.0, (9, 5, 1), [1, 1, 1]),
    ],
)
def test_three_clutches_in_series_at_rest(push: float, limits: tuple[float, float, float], expected: list[int]) -> None:
    assert modes(three_in_series(push, limits), [0.0, 0.0, 0.0]) == expected


@pytest.mark.parametrize("seed", range(6))
def test_many_laws_at_rest_agree_with_enumeration(seed: int) -> None:
    """Random positive definite couplings: exactly one solution exists, and it is found from any guess."""
    rng = np.random.default_rng(seed)
    n = 4
    jacobian = rng.standard_normal((n, n))
    t = ca.SX.sym("t")
    model = bodies([1.0] * n, list(3 * rng.standard_normal(n)), jacobian, symmetric(*rng.uniform(0.1, 1.5, n)), t)
    engine = Simulator(model)
    found = {tuple(engine.resolve(0.0, np.zeros(n), [], rng.integers(-1, 2, n), [])[2]) for _ in range(10)}
    assert len(found) == 1


def test_planetary_with_clutch_and_brake() -> None:
    """Sun and carrier are free bodies, the ring turns with (3 carrier - sun) / 2; brake on the ring, clutch between sun and carrier."""
    t = ca.SX.sym("t")
    jacobian = np.array([[-0.5, 1.5], [1.0, -1.0]])
    for torque, brake, clutch, expected in ((4.0, 9.0, 9.0, [0, 0]), (4.0, 9.0, 0.5, [0, 1]), (4.0, 0.2, 9.0, [1, 0])):
        model = bodies([1.0, 2.0], [torque + 0 * t, -0.1], jacobian, symmetric(brake, clutch), t)
        assert [abs(m) for m in modes(model, [0.0, 0.0])] == expected
    sliding = bodies([1.0, 2.0], [4.0 * ca.sin(3 * t), -0.1], jacobian, symmetric(0.7, 0.5), t)
    loose, tight = (
        Simulator(sliding).run([1.0, 0.0], [], stop=10.0, rtol=r, atol=0.01 * r).events for r in (1e-6, 1e-10)
    )
    assert [(e.name, e.new) for e in loose] == [(e.name, e.new) for e in tight]


def lossy(drive: float, load: float, efficiency: float = 0.8) -> HybridDae:
    """A mesh that loses (1 - eta) or (1 / eta - 1) of the torque it carries, by its sign; a bearing beside it."""
    t = ca.SX.sym("t")

    def carried(torque: ca.SX) -> ca.SX:
        return drive - torque[1]

    def bounds(torque: ca.SX, m: ca.SX) -> list[tuple[ca.SX, ca.SX]]:
        tau = carried(torque)
        up = ca.if_else(m[2] > 0.5, (1 - efficiency) * tau, (1 - 1 / efficiency) * tau)
        low = ca.if_else(m[2] > 0.5, (1 - 1 / efficiency) * tau, (1 - efficiency) * tau)
        return [(low, up), (ca.SX(-0.3), ca.SX(0.3))]

    def switches(torque: ca.SX, m: ca.SX) -> tuple[Switch, ...]:
        return (Switch("side", "hand", 2, carried(torque)),)

    return bodies([1.0], [drive - load + 0 * t], np.array([[1.0], [1.0]]), bounds, t, switches=switches, extra_held=1)


def test_lossy_gear_beside_a_bearing() -> None:
    trajectory = Simulator(lossy(5.0, 1.0)).run([0.0], [], stop=1.0)
    assert trajectory.final[0] == pytest.approx(5.0 - 1.0 - 0.3 - 0.2 * 4.7, rel=1e-9)
    slowing = Simulator(lossy(5.0, 6.0)).run([1.0], [], stop=3.0)
    deceleration = 5.0 - 6.0 - 0.3 - 0.2 * 4.7
    assert slowing.events[0].time == pytest.approx(-1 / deceleration, rel=1e-6)


def self_locking(push: float) -> HybridDae:
    """Once it slides forward the torque is upper = 1 + 2 T, that is -1: not a passive law."""
    t = ca.SX.sym("t")
    return bodies([1.0], [push + 0 * t], np.array([[1.0]]), lambda torque, m: [(ca.SX(-10.0), 1 + 2 * torque[0])], t)


def test_a_jam_names_the_laws_and_their_torques() -> None:
    said = r"(?s)no modes are consistent \(the mechanism jams\).*law0 \(hand\): torque -?[\d.]+ N.m, bounds"
    with pytest.raises(InitializationError, match=said):
        Simulator(self_locking(-2.0)).run([0.0], [], stop=1.0)


def test_laws_that_lock_the_same_motion_share_the_torque() -> None:
    """Two brakes on one shaft, the stronger one taking what the weaker one cannot: it breaks loose at the sum of the limits."""
    t = ca.SX.sym("t")
    model = bodies([2.0], [4.0 * ca.sin(t)], np.array([[1.0], [1.0]]), symmetric(1.0, 2.0), t)
    single = bodies([2.0], [4.0 * ca.sin(t)], np.array([[1.0]]), symmetric(3.0), t)
    trajectory, expected = (
        Simulator(each).run([0.5], [], stop=12.0, rtol=1e-8, atol=1e-10) for each in (model, single)
    )
    times = np.linspace(0, 12, 100)
    assert np.abs(trajectory.at(times, with_events=False)[1] - expected.at(times, with_events=False)[1]).max() < 1e-6


def test_massless_node_with_friction() -> None:
    """A spring pulls a massless slider: d s' = k (u - s) - T. The speed depends on the torque algebraically."""
    t, x, m, p = ca.SX.sym("t"), ca.SX.sym("x", 1), ca.SX.sym("m", 1), ca.SX.sym("p", 0)
    pull = 10.0 * (ca.sin(t) - x[0])
    torque = ca.if_else(m[0] == 0, pull, m[0] * 2.0)
    speed = (pull - torque) / 0.5
    law = Friction(
        "slider", "hand", 0, speed, torque, ca.SX(-2.0), ca.SX(2.0), ca.SX(1.0), speed, algebraic=True, may_free=False
    )
    trajectory = Simulator(dae(t, x, m, p, speed, ["s"], frictions=(law,))).run(
        [0.0], [], stop=6.0, rtol=1e-9, atol=1e-11
    )
    events = trajectory.events
    assert [e.new for e in events] == [1, 0, -1, 0, 1]
    assert events[0].time == pytest.approx(np.arcsin(0.2), abs=1e-8)
    stuck = trajectory.at([events[1].time], with_events=False)[1][0, 0]
    assert np.sin(events[2].time) == pytest.approx(stuck - 0.2, abs=1e-7)


def test_prescribed_motion_follows_the_sign_of_its_speed() -> None:
    t, x, m, p = ca.SX.sym("t"), ca.SX.sym("x", 1), ca.SX.sym("m", 1), ca.SX.sym("p", 1)
    speed, rate = p[0] * ca.cos(t), -p[0] * ca.sin(t)
    law = Friction(
        "bearing",
        "car.py:7",
        0,
        speed,
        m[0] * 3.0,
        ca.SX(-3),
        ca.SX(3),
        ca.SX(1),
        rate,
        prescribed=True,
        may_free=False,
    )
    engine = Simulator(dae(t, x, m, p, m[0] * 3.0, ["heat"], frictions=(law,)))
    trajectory = engine.run([0.0], [1.0], stop=3.0)
    assert [e.time for e in trajectory.events] == [pytest.approx(np.pi / 2, abs=1e-9)]
    resting = engine.run([0.0], [0.0], stop=3.0)
    assert not resting.events
    assert "bearing is stuck where nothing can move; its torque is not unique" in resting.notes[0]


def test_coupled_speeds_of_stuck_laws_are_set_to_zero_together() -> None:
    model = three_in_series(1.0, (2, 2, 2))
    x, _, m = Simulator(model).resolve(0.0, [1e-10, 0.5e-10, -0.5e-10], [], [0, 0, 0], [])
    assert list(m) == [0, 0, 0]
    assert np.abs(np.array([[1.0, -1, 0], [0, 1, -1], [0, 0, 1]]) @ x).max() < 1e-20


def test_a_torque_excursion_between_samples_is_not_missed() -> None:
    """While all is stuck nothing limits the step but the torques: two short breakaways in a long rest."""
    t = ca.SX.sym("t")
    push = 3.0 * ca.exp(-(((t - 10.2) / 0.8) ** 2)) - 3.0 * ca.exp(-(((t - 31.7) / 0.8) ** 2)) + 0.1 * ca.sin(t)
    model = bodies([1.0], [push], np.array([[1.0]]), symmetric(2.0), t)
    events = Simulator(model).run([0.0], [], stop=40.0, rtol=1e-4, atol=1e-6).events
    assert [e.new for e in events] == [1, 0, -1, 0]
