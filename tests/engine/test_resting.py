"""Laws at a limit of their torque that others hold at rest, and those that only seem to be held."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from cases import few
from joined import joined
from scipy.optimize import brentq

import powertrain as pt
from powertrain.components import blocks
from powertrain.components import rotational as rot
from powertrain.components.transmissions import RangeTransmission
from powertrain.modes.resting import _follow, _own, mobility

NO_MOTION = np.zeros(2)


@pytest.mark.parametrize(
    ("free", "held"), [((10.0, 5.0), True), ((0.0, 0.0), True), ((10.0, 0.0), False), ((0.0, 1e-3), False)]
)
def test_a_law_is_held_that_moves_as_those_that_hold(free: tuple[float, float], held: bool) -> None:
    """Two laws of which the first moves twice as fast as the second, which holds; a prescribed motion between them adds to one alone."""
    G = np.array([[4.0, 2.0], [2.0, 1.0]])
    assert _follow(G, np.array(free), NO_MOTION, [0], np.array([False, True])) == [held]


def test_a_law_with_a_motion_of_its_own_is_not_held() -> None:
    G = np.array([[4.0, 2.0], [2.0, 1.5]])
    assert _follow(G, np.zeros(2), NO_MOTION, [0], np.array([False, True])) == [False]


@pytest.mark.parametrize("order", [[0, 1, 2], [2, 0, 1], [1, 2, 0]])
def test_laws_without_inertia_need_not_be_moved_as_they_move_others(order: list[int]) -> None:
    """Their rate is a speed, which the torques beyond a damper do not change, while their own torques accelerate what is there."""
    G = np.array([[1.0, 40.0, 20.0], [0.0, 1.0, 1.0], [0.0, 1.0, 1.0]])[np.ix_(order, order)]
    b, holds = np.array([3.0, 0.5, 0.5])[order], np.array([True, True, False])[order]
    assert _follow(G, b, np.zeros(3), [order.index(2)], holds) == [True]


@pytest.mark.parametrize(("left", "held"), [(2e-9, True), (1e-7, False)])
def test_a_motion_of_its_own_counts_from_1e_8_of_the_whole(left: float, held: bool) -> None:
    G = np.array([[1.0 + left, 1.0], [1.0, 1.0]])
    assert _follow(G, np.zeros(2), NO_MOTION, [0], np.array([False, True])) == [held]


def test_laws_are_scaled_by_what_moves_them_even_where_it_cancels() -> None:
    """A law that moves, one between shafts of 1e-6 kg.m2 that gears tie to each other, and one that nothing moves."""
    assert _own(np.array([-2.0, 1e-7, 0.0]), np.array([3.0, 2e6, 0.0])).tolist() == [2.0, 2e6, 1.0]


def test_the_round_off_of_other_rates_is_no_motion() -> None:
    """A law that moves as the second does, at zero; the third, far from both, has a rate of 1e3 in which it has no share but round-off."""
    G = np.array([[1.0, 1.0, 1e-15], [1.0, 1.0, 0.0], [1e-15, 0.0, 1.0]])
    holds = np.array([False, True, True])
    assert _follow(G, np.array([1e-24, 0.0, 1e3]), np.zeros(3), [0], holds) == [True]
    assert _follow(G, np.array([1e-5, 0.0, 1e3]), np.zeros(3), [0], holds) == [False]


def test_what_remains_of_a_motion_that_has_died_away_is_no_motion() -> None:
    G, holds = np.ones((2, 2)), np.array([False, True])
    for rate, held in ((0.9e-9, True), (1.1e-9, False)):
        assert _follow(G, np.array([rate, 0.0]), np.full(2, 1e-9), [0], holds) == [held]


class Leaning(pt.Component):
    """A mass that two brakes hold; a resistance that is not linear follows from its speed and from the first brake."""

    v: pt.Variable = pt.variable("m/s", "Speed", start=0.3)
    z: pt.Variable = pt.variable("N", "Resistance", guess=0.2)
    f_1: pt.Variable = pt.variable("N", "Of the first brake")
    f_2: pt.Variable = pt.variable("N", "Of the second brake")

    def equations(self) -> pt.Equations:
        yield pt.der(self.v) == 7.0 - self.f_1 - 2 * self.f_2 - self.z
        yield self.z + self.z**3 == 0.5 * self.f_1 + self.v
        yield pt.friction(self.v, self.f_1, -3, 3, peak=1.5, name="one")
        yield pt.friction(2 * self.v, self.f_2, -5, 5, peak=1.2, name="two")


def test_mobility_beside_an_implicit_unknown() -> None:
    """dz/df_1 = 0.5/(1 + 3 z^2), and at torques of zero one step of Newton's method leads to z - (z + z^3 - v)/(1 + 3 z^2)."""
    dae = pt.compile(Leaning()).compiled.dae
    function, z, v = mobility(dae), 0.4, 0.3
    assert function is not None
    y = np.concatenate([[v], [z], np.zeros(dae.z.numel() - 1)])
    slope, free, *_ = (np.array(e) for e in function([0.0, 0.0], y, dae.held_start, []))
    dz, near = 0.5 / (1 + 3 * z**2), z - (z + z**3 - v) / (1 + 3 * z**2)
    np.testing.assert_allclose(slope.T, [[1 + dz, 2.0], [2 * (1 + dz), 4.0]], rtol=1e-12)
    np.testing.assert_allclose(free.ravel(), [7.0 - near, 2 * (7.0 - near)], rtol=1e-12)


KNOTS = np.linspace(0.0, 5.0, 11)
"""Instants (s)."""


class Brakes(pt.Component):
    """A mass on which several brakes act, each through a lever of its own."""

    f: pt.Input = pt.signal_input("N", "Force on the mass")
    v: pt.Variable = pt.variable("m/s", "Speed of the mass", start=0.0)

    brakes: tuple[Brake, ...] = ()

    def equations(self) -> pt.Equations:
        yield pt.der(self.v) == self.f.value - sum((b.ratio * b.tau for b in self.brakes), ca.SX(0))
        for brake in self.brakes:
            yield brake.w == brake.ratio * self.v


class Brake(pt.Component):
    """Coulomb friction that breaks away at more than it slides with; its limit is multiplied by ``press``, the values at ``KNOTS``."""

    ratio: pt.Parameter = pt.parameter("1/m", "Speed over that of the mass")
    limit: pt.Parameter = pt.parameter("N.m", "Torque while it slides")
    peak: pt.Parameter = pt.parameter("1", "Torque at which it breaks away, relative to its limit")
    w: pt.Variable = pt.variable("rad/s", "Speed")
    tau: pt.Variable = pt.variable("N.m", "Torque")
    press: tuple[float, ...] = (1.0,) * len(KNOTS)

    def equations(self) -> pt.Equations:
        limit = self.limit * pt.schedule(KNOTS, self.press)
        yield pt.friction(self.w, self.tau, -limit, limit, peak=self.peak)


def random_brakes(seed: int) -> tuple[Brakes, float, float]:
    """Brakes, some without a peak, and with what force they slide and hold together."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 5))
    ratios, limits, peaks = rng.uniform(0.3, 3.0, n), rng.uniform(0.5, 4.0, n), rng.uniform(1.0, 1.6, n)
    peaks[rng.random(n) < 0.3] = 1.0
    brakes = tuple(Brake(ratio=r, limit=b, peak=p) for r, b, p in zip(ratios, limits, peaks, strict=True))
    return Brakes(brakes=brakes), float(ratios @ limits), float(ratios @ (limits * peaks))


@pytest.mark.parametrize("seed", range(8))
def test_brakes_on_one_mass_break_away_together(seed: int) -> None:
    """At the sum of what each can hold, whichever is at its limit first, and again after each rest; sliding, they share theirs."""
    model, slides, holds = random_brakes(seed)
    force = np.arange(5.0), 1.1 * holds * np.array([0.0, 1.0, -1.0, 1.0, -1.0])
    run = pt.compile(model).simulate(4.0, inputs={"f": force}, rtol=1e-9)
    forces = [abs(np.interp(event.time, *force)) for event in run.events]
    leave = [f for f, event in zip(forces, run.events, strict=True) if event.old == 0.0]
    rest = [f for f, event in zip(forces, run.events, strict=True) if event.old != 0.0]
    assert leave == pytest.approx([holds] * len(leave), rel=1e-6)
    assert max(rest) < slides
    assert len(leave) == 4 * len(model.brakes)
    assert len(rest) == 3 * len(model.brakes)


@pytest.mark.slow
def test_the_same_in_c(tmp_path: Path) -> None:
    model, _, holds = random_brakes(0)
    plant = pt.compile(model)
    force = np.arange(5.0), 1.1 * holds * np.array([0.0, 1.0, -1.0, 1.0, -1.0])
    given: dict[str, Any] = {"inputs": {"f": force}, "rtol": 1e-9}
    found, wanted = plant.export_c(tmp_path).simulate(4.0, **given), plant.simulate(4.0, **given)
    assert [(e.name, e.old, e.new) for e in found.events] == [(e.name, e.old, e.new) for e in wanted.events]
    np.testing.assert_allclose(found["v"], wanted["v"], atol=1e-9)


@pytest.mark.parametrize("seed", range(8))
def test_brakes_share_what_they_hold_as_equally_stiff_parts(seed: int) -> None:
    """tau_i = clip(x/r_i, -L_i, L_i) with one x for all, at every instant, whatever limits and load were before."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 5))
    ratios, peaks = rng.uniform(0.3, 3.0, n), rng.choice([1.0, 1.2], n)
    limits = rng.uniform(0.2, 4.0, (n, KNOTS.size))
    load = rng.uniform(-0.9, 0.9, KNOTS.size) * (ratios @ limits)
    brakes = tuple(
        Brake(ratio=r, limit=1.0, peak=p, press=tuple(row)) for r, p, row in zip(ratios, peaks, limits, strict=True)
    )
    run = pt.compile(Brakes(brakes=brakes)).simulate(5.0, inputs={"f": (KNOTS, load)})
    assert not run.events
    times = np.linspace(0.0, 5.0, 101)
    found = run.at(times, [f"brakes[{i}].tau" for i in range(n)])
    for k, t in enumerate(times):
        most = peaks * [np.interp(t, KNOTS, row) for row in limits]
        force = np.interp(t, KNOTS, load)
        x = brentq(lambda x, most=most, force=force: ratios @ np.clip(x / ratios, -most, most) - force, -100, 100)
        expected = np.clip(x / ratios, -most, most)
        np.testing.assert_allclose([found[f"brakes[{i}].tau"][k] for i in range(n)], expected, atol=2e-6)


@pytest.mark.parametrize("seed", range(4))
def test_operating_points_share_as_simulations_do(seed: int) -> None:
    model, slides, _ = random_brakes(seed)
    plant, names = pt.compile(model), [f"brakes[{i}].tau" for i in range(len(model.brakes))]
    loads = slides * np.array([-0.99, -0.6, 0.3, 0.8, 0.95, 0.99])
    points = pt.steady(plant, {"f": loads}, outputs=["v", *names])
    for load, (_, point) in zip(loads, points.groupby("f"), strict=True):
        run = plant.simulate(0.1, inputs={"f": load})
        assert point["v"].item() == pytest.approx(0.0, abs=1e-9)
        assert [point[n].item() for n in names] == pytest.approx([run[n][-1] for n in names], abs=1e-6)


class Rubbed(pt.Component):
    """A mass on two brakes, of which the weaker comes to its limit, along which a belt slides that has a given speed."""

    v: pt.Variable = pt.variable("m/s", "Speed of the mass", start=0.0)
    brake: Brake = Brake(ratio=1.0, limit=2.0, peak=1.2)
    weak: Brake = Brake(ratio=1.0, limit=0.3, peak=1.2)
    belt: Brake = Brake(ratio=1.0, limit=1.0, peak=1.2, press=tuple(0.3 * min(i, 10 - i) for i in range(11)))

    def equations(self) -> pt.Equations:
        yield pt.der(self.v) == -self.brake.tau - self.weak.tau - self.belt.tau
        yield self.brake.w == self.v
        yield self.weak.w == self.v
        yield self.belt.w == self.v - 2.0


def test_a_law_that_slides_past_what_others_hold_does_not_rest() -> None:
    """Its rate is zero as theirs is, but not its speed."""
    run = pt.compile(Rubbed()).simulate(4.5)
    assert not run.events
    assert set(run["belt.mode"]) <= {-1.0, 2.0}  # free until it is pressed
    assert run["belt.tau"].min() == pytest.approx(-1.5, abs=0.01)
    np.testing.assert_allclose(run["v"], 0.0, atol=1e-12)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e6])
def test_breakaway_of_two_brakes_does_not_depend_on_the_unit(scale: float) -> None:
    """The weak one is at its limit for a third of the time, at rest, until its peak and the limit of the other are met."""
    brakes = tuple(Brake(ratio=1.0, limit=scale * limit, peak=peak) for limit, peak in ((3.0, 1.3), (8.0, 1.0)))
    result = pt.simulate(Brakes(brakes=brakes), 1.0, inputs={"f": ([0.0, 1.0], [0.0, 12.0 * scale])})
    assert [(event.name, event.new) for event in result.events] == [("brakes[0].mode", 1.0), ("brakes[1].mode", 1.0)]
    assert result.events.times == pytest.approx(11.9 / 12.0, abs=1e-6)


class Parallel(pt.Component):
    """Two inertias between which two clutches hold side by side and a third through a gear; the second one has a brake."""

    t1: rot.Torque = rot.Torque()
    t2: rot.Torque = rot.Torque()
    a: rot.Inertia = rot.Inertia(J=1.571)
    b: rot.Inertia = rot.Inertia(J=3.962)
    c1: rot.Clutch = rot.Clutch(fn_max=3.29, mue_pos=((0, 1),))
    c2: rot.Clutch = rot.Clutch(fn_max=2.07, mue_pos=((0, 1),))
    c3: rot.Clutch = rot.Clutch(fn_max=4.05, mue_pos=((0, 1),))
    gear: rot.IdealGear = rot.IdealGear(ratio=0.5)
    brake: rot.Brake = rot.Brake(fn_max=1.21, mue_pos=((0, 1),))
    press: blocks.Constant = blocks.Constant(k=1.0)

    def equations(self) -> pt.Equations:
        yield self.t1.tau.value == 8.84 * ca.sin(2.0 * np.pi * 0.83 * pt.time + 0.64)
        yield self.t2.tau.value == 6.64 * ca.sin(2.0 * np.pi * 1.46 * pt.time + 4.15)
        laws = (self.c1, self.c2, self.c3, self.brake)
        yield pt.connect(self.press.y, *(law.f_normalized for law in laws))
        yield pt.connect(self.t1.flange, self.a.flange_a)
        yield pt.connect(self.a.flange_b, self.c1.flange_a, self.c2.flange_a, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.c3.flange_a)
        yield pt.connect(self.c1.flange_b, self.c2.flange_b, self.c3.flange_b, self.b.flange_a, self.t2.flange)
        yield pt.connect(self.b.flange_b, self.brake.flange_a)


def test_clutches_side_by_side_stay_stuck_where_the_whole_breaks_away() -> None:
    """It breaks away where the torques exceed what the third clutch and the brake hold; the others share what is left."""
    result = pt.simulate(Parallel(), 0.18)
    assert sorted((e.name, e.new) for e in result.events) == [("brake.mode", 1.0), ("c3.mode", -1.0)]
    t = result.events.times[0]
    torque = 8.84 * np.sin(2.0 * np.pi * 0.83 * t + 0.64) + 6.64 * np.sin(2.0 * np.pi * 1.46 * t + 4.15)
    assert torque == pytest.approx(4.05 + 1.21, abs=1e-6)
    assert result["c1.tau"][-1] == pytest.approx(result["c2.tau"][-1])


def test_massless_gears_behind_elastic_shafts_and_a_brake() -> None:
    """The gears of both ranges rest with the output, whose speed follows the torques at once; the brake holds the input throughout."""
    brake, full = rot.Brake(fn_max=20.0, mue_pos=((0.0, 1.0),)), blocks.Constant(k=1.0)
    load = rot.Torque(), blocks.Sine(amplitude=4.0, f=1.0)
    joints = "0.flange_a=1.flange_a=3.flange_a 2.y=1.f_normalized 4.y=3.ratio 5.flange=3.flange_b 6.y=5.tau"
    model = joined(rot.Inertia(J=1.0), brake, full, RangeTransmission(), blocks.Constant(k=0.3), *load, joints=joints)
    plant = pt.compile(model)
    runs = [plant.simulate(1.0, rtol=rtol) for rtol in (1e-5, 1e-7)]
    used, idle = (f"parts[3].gears[{k}].planetaries[0].mode" for k in (0, 1))
    rests = []
    for run in runs:
        assert np.abs(run["parts[0].w"]).max() < 1e-9
        rests += [[e.time for e in run.events if e.name == name and e.new == 0.0] for name in (used, idle)]
    assert len(rests[0]) == 2  # as the load changes its sign
    for times in rests:
        np.testing.assert_allclose(times, rests[0], atol=1e-4)


class Redundant(pt.Component):
    """A shaft that a brake holds, and a clutch with a peak to a second shaft that a strong brake holds."""

    torque: blocks.TimeTable
    presses: tuple[blocks.TimeTable, ...]
    peak: float = 1.3
    source: rot.Torque = rot.Torque()
    a: rot.Inertia = rot.Inertia(J=20.0)
    b: rot.Inertia = rot.Inertia(J=0.2)
    brake: rot.Brake = rot.Brake(fn_max=1.0, mue_pos=((0.0, 1.0),))
    clutch: rot.Clutch = rot.Clutch(fn_max=1.0, mue_pos=((0.0, 1.0),), peak=1.3)
    strong: rot.Brake = rot.Brake(fn_max=1.0, mue_pos=((0.0, 5.0),))
    full: blocks.Constant = blocks.Constant(k=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque.y, self.source.tau)
        yield pt.connect(self.source.flange, self.a.flange_a, self.brake.flange_a, self.clutch.flange_a)
        yield pt.connect(self.clutch.flange_b, self.b.flange_a, self.strong.flange_a)
        yield pt.connect(self.presses[0].y, self.brake.f_normalized)
        yield pt.connect(self.presses[1].y, self.clutch.f_normalized)
        yield pt.connect(self.full.y, self.strong.f_normalized)


def line(start: float, end: float) -> blocks.TimeTable:
    return blocks.TimeTable(table=((0.0, start), (1.0, end)))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_clutch_with_a_peak_breaks_away_with_the_brake_beside_it(sign: float) -> None:
    """Both slide from where the torque is that of the brake and of the clutch's peak; the brake's limit is reached before."""
    result = pt.simulate(
        Redundant(torque=line(1.77 * sign, 1.77 * sign), presses=(line(1.2, 0.5), line(1.0, 0.5))), 1.0
    )
    t = (1.2 + 1.3 - 1.77) / (0.7 + 0.65)
    assert result.events.times == pytest.approx([t, t], abs=1e-6)
    left = 1.0 - t
    slid = sign * ((1.77 - (1.2 - 0.7 * t) - (1.0 - 0.5 * t)) * left + 1.2 / 2 * left**2) / 20.0
    assert result["a.w"][-1] == pytest.approx(slid, rel=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(60))
def test_redundant_laws_with_peaks_break_away(seed: int) -> None:
    random = np.random.default_rng(seed)
    brake, clutch = random.uniform(0.3, 3.0, 2), random.uniform(0.3, 3.0, 2)
    torque, J = random.uniform(-3.0, 3.0, 2), 10.0 ** random.uniform(-1.0, 1.0, 2)
    torque[0] = np.clip(torque[0], -0.95 * (brake[0] + clutch[0]), 0.95 * (brake[0] + clutch[0]))
    model = Redundant(
        torque=line(*torque), presses=(line(*brake), line(*clutch)), a=rot.Inertia(J=J[0]), b=rot.Inertia(J=J[1])
    )
    result = pt.simulate(model, 1.0)
    time = np.linspace(0.0, 1.0, 100_001)
    excess = np.abs(torque[0] + (torque[1] - torque[0]) * time) - (
        brake[0] + (brake[1] - brake[0]) * time + 1.3 * (clutch[0] + (clutch[1] - clutch[0]) * time)
    )
    if (excess < -1e-3).all():
        assert np.abs(result["a.w"]).max() < 1e-9
    elif (excess > 1e-3).any():
        assert result.at(time[np.argmax(excess > 0.0)] - 1e-4, "a.w") == pytest.approx(0.0, abs=1e-9)
        assert np.abs(result["a.w"]).max() > 0.0


@pytest.mark.parametrize("J", few([1e-7, 1e-5, 1e-4]))
def test_a_part_too_light_for_shared_torques_is_an_error(J: float, tmp_path: Path) -> None:
    """A clutch and a brake hold 20 kg.m2 through it, beside another brake: at 1e-7 the clutch carried 0.18 in place of 0.5 N.m."""
    presses = (line(1.0, 1.0), line(1.0, 1.0))
    plant = pt.compile(Redundant(torque=line(0.0, 1.5), presses=presses, a=rot.Inertia(J=20.0), b=rot.Inertia(J=J)))
    runs: tuple[Callable[[], pt.Result[Any]], ...] = (
        lambda: plant.simulate(1.0),
        lambda: plant.simulate(1.0, compile=True),
        lambda: plant.export_c(tmp_path).simulate(1.0),
    )
    for run in runs if J == 1e-4 else runs[:2]:
        if J == 1e-4:
            assert run()["clutch.tau"][-1] == pytest.approx(-0.5, rel=1e-4)
            continue
        with pytest.raises(pt.SimulationError, match=r"the torque of clutch.mode .* is not accurate.* Give that part"):
            run()


class Tied(pt.Component):
    """A rising torque on a shaft that two brakes hold; a clutch between two shafts that both follow it at one speed, through gears."""

    gears: tuple[rot.IdealGear, rot.IdealGear, rot.IdealGear]
    rise: blocks.Ramp = blocks.Ramp(height=10.0, duration=1.0)
    drive: rot.Torque = rot.Torque()
    shaft: rot.Inertia = rot.Inertia(J=0.1)
    weak: rot.Brake = rot.Brake(fn_max=2.0, mue_pos=((0.0, 1.0),), peak=1.5)
    strong: rot.Brake = rot.Brake(fn_max=5.0, mue_pos=((0.0, 1.0),))
    clutch: rot.Clutch = rot.Clutch(fn_max=10.0, mue_pos=((0.0, 1.0),))
    full: blocks.Constant = blocks.Constant(k=1.0)

    def equations(self) -> pt.Equations:
        one, first, second = self.gears
        yield pt.connect(self.rise.y, self.drive.tau)
        yield pt.connect(self.full.y, self.weak.f_normalized, self.strong.f_normalized, self.clutch.f_normalized)
        yield pt.connect(self.drive.flange, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.weak.flange_a, self.strong.flange_a, one.flange_a, first.flange_a)
        yield pt.connect(first.flange_b, second.flange_a)
        yield pt.connect(one.flange_b, self.clutch.flange_a)
        yield pt.connect(second.flange_b, self.clutch.flange_b)


def tied(ratios: tuple[float, float, float]) -> pt.Plant[Tied]:
    one, first, second = (rot.IdealGear(ratio=ratio) for ratio in ratios)
    return pt.compile(Tied(gears=(one, first, second)))


def break_away_together(run: pt.Result[Any]) -> None:
    """At what both hold at rest, 3 + 5 N.m."""
    assert sorted((e.name, e.new) for e in run.events) == [("strong.mode", 1.0), ("weak.mode", 1.0)]
    assert run.events.times == pytest.approx(0.8, abs=1e-6)


@pytest.mark.parametrize("ratios", [(3.0, 0.3, 10.0), (3.0, 0.1 * 3.0, 10.0), (0.6, 0.2, 3.0)])
def test_a_clutch_that_cannot_turn_says_nothing_of_what_holds(ratios: tuple[float, float, float]) -> None:
    """Its torque moves nothing but for the round-off of the ratios, which counted as a motion."""
    break_away_together(tied(ratios).simulate(1.0))


@pytest.mark.slow
def test_a_clutch_that_cannot_turn_in_c(tmp_path: Path) -> None:
    break_away_together(tied((0.6, 0.2, 3.0)).export_c(tmp_path).simulate(1.0))


@pytest.mark.parametrize("ratios", [(3.0, 0.3, 10.0), (3.0, 0.1 * 3.0, 10.0), (0.6, 0.2, 3.0), (2.1, 0.7, 3.0)])
def test_a_clutch_that_cannot_turn_does_not_stop_its_shafts(ratios: tuple[float, float, float]) -> None:
    """Its speed is a round-off times that of the shaft, which was set to zero with it: the shaft began with 1 rad/s or none of its 10."""
    open_brakes = {"weak.fn_max": 0.0, "strong.fn_max": 0.0}
    result = tied(ratios).simulate(1.0, starts={"shaft.w": 10.0}, parameters=open_brakes)
    assert result["shaft.w"][0] == pytest.approx(10.0, rel=1e-14)
    assert result["shaft.w"][-1] == pytest.approx(10.0 + 5.0 / 0.1, rel=1e-6)
