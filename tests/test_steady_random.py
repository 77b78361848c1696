"""Operating points of random drivelines are where long simulations come to rest; where there is none, the simulations run away."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import pytest
from cases import few

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.cvu import CVU

OK, STUCK, SEVERAL, NOT_FOUND = 0, 1, 2, 6
CONSTANT = ((0.0, 1.0),)


class Chain(pt.Component):
    """Parts in a row behind a torque: shafts and gears lead on, brakes, bearings and dampers hold what they sit on."""

    parts: tuple[pt.Component, ...]
    grips: tuple[float, ...]
    tau: pt.Input = pt.signal_input("N.m", "Driving torque")
    drive: rot.Torque = rot.Torque()
    ground: rot.Fixed = rot.Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.tau, self.drive.tau)
        node = self.drive.flange
        for part, grip in zip(self.parts, self.grips, strict=True):
            yield pt.connect(node, part.flange_a)  # type: ignore[attr-defined]
            if isinstance(part, rot.Brake | rot.Clutch):
                yield part.f_normalized.value == grip
            if isinstance(part, rot.Damper):
                yield pt.connect(part.flange_b, self.ground.flange)
            elif not isinstance(part, rot.Brake | rot.BearingFriction):
                node = part.flange_b  # type: ignore[attr-defined]


def random_chain(rng: np.random.Generator) -> Chain:
    def uniform(low: float, high: float) -> float:
        return float(rng.uniform(low, high))

    parts: list[pt.Component] = [rot.Inertia(J=uniform(0.05, 1))]
    for kind in rng.integers(0, 6, rng.integers(2, 6)):
        ratio = uniform(0.4, 3) * float(rng.choice([-1, 1]))
        part = (
            rot.Gear(ratio=ratio, efficiency=float(rng.choice([1.0, 0.9, 0.95]))),
            rot.Clutch(fn_max=uniform(2, 30), mue_pos=CONSTANT),
            rot.SpringDamper(c=1e3, d=2.0),
            rot.Brake(fn_max=uniform(1, 20), mue_pos=CONSTANT),
            rot.BearingFriction(tau_pos=((0.0, uniform(0.5, 3)), (100.0, 8.0))),
            rot.Damper(d=uniform(0.05, 0.5)),
        )[kind]
        parts += [part, rot.Inertia(J=uniform(0.05, 1))] if kind < 3 else [part]
    parts.append(rot.Damper(d=uniform(0.05, 0.5)))
    return Chain(parts=tuple(parts), grips=tuple(float(g) for g in rng.choice([0.0, 0.5, 1.0], len(parts))))


@pytest.mark.parametrize("seed", few(range(300), 5))
def test_steady_is_where_simulations_end(seed: int) -> None:
    rng = np.random.default_rng(seed)
    plant = pt.compile(random_chain(rng))
    torque = float(rng.choice([-1, 1]) * rng.uniform(1, 30))
    names = [n for n in plant.compiled.signals if n.endswith(".w") and "flange" not in n]
    point = pt.steady(plant, {"tau": torque}, outputs=names)
    status = point.status.item()
    assert status in (OK, SEVERAL, NOT_FOUND)
    stop = 400.0
    while True:
        result = plant.simulate(stop, inputs={"tau": torque}, rtol=1e-8)
        left = {n: abs(result[n][-1] - result[n][result.time <= stop / 2][-1]) for n in names}
        if status != OK or max(left.values()) < 1e-6 * (1.0 + max(abs(result[n][-1]) for n in names)):
            break
        stop *= 4.0
        assert stop < 1e6
    if status == NOT_FOUND:
        assert max(left.values()) > 10.0
    if status == OK:
        for name in names:
            assert point[name].item() == pytest.approx(result[name][-1], rel=1e-5, abs=1e-5)


class Geared(pt.Component):
    """A variable unit between two damped shafts, one of which a bearing holds: at the ratio 0 nothing of the other can move it."""

    tau: pt.Input = pt.signal_input("N.m", "Driving torque")
    V: pt.Input = pt.signal_input("1", "Ratio of the unit")
    drive: rot.Torque = rot.Torque()
    shaft: rot.Inertia = rot.Inertia(J=0.1)
    unit: CVU = CVU(eta_ab=0.9, eta_ba=0.85)
    wheel: rot.Inertia = rot.Inertia(J=0.3)
    bearing: rot.BearingFriction = rot.BearingFriction(tau_pos=CONSTANT)
    first: rot.Damper = rot.Damper(d=0.1)
    second: rot.Damper = rot.Damper(d=0.2)
    wall: rot.Fixed = rot.Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.tau, self.drive.tau)
        yield pt.connect(self.V, self.unit.ratio)
        yield pt.connect(self.drive.flange, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.unit.flange_a, self.first.flange_a)
        yield pt.connect(self.unit.flange_b, self.wheel.flange_a)
        yield pt.connect(self.wheel.flange_b, self.bearing.flange_a, self.second.flange_a)
        yield pt.connect(self.wall.flange, self.first.flange_b, self.second.flange_b)


@pytest.mark.parametrize("ratios", [(0.0, 0.5, -0.7, 2.0), (0.5, 0.0, -0.7, 2.0), (2.0, -0.7, 0.5, 0.0)])
def test_a_point_is_the_same_in_any_grid(ratios: tuple[float, ...]) -> None:
    """Status and values of a point alone, and among others whose first has the ratio 0, where the wheel is held, or another ratio."""
    plant = pt.compile(Geared())
    names, torques = ["shaft.w", "wheel.w", "bearing.tau"], [10.0, -3.0, 0.3]
    together = pt.steady(plant, {"V": list(ratios), "tau": torques}, outputs=names)
    for i, V in enumerate(ratios):
        for k, torque in enumerate(torques):
            alone = pt.steady(plant, {"V": V, "tau": torque}, outputs=names)
            assert alone.status.item() == together.status.values[i, k] == (STUCK if V == 0.0 else OK)
            for name in names:
                np.testing.assert_allclose(alone[name].item(), together[name].values[i, k], rtol=1e-9, atol=1e-9)


def random_chain_without_inertias(rng: np.random.Generator) -> Chain:
    """As before, but most of the inertias between the parts are missing, and there is more than one thing that holds a shaft."""
    whole = random_chain(rng)
    kept = [
        k
        for k, part in enumerate(whole.parts)
        if not isinstance(part, rot.Inertia)
        or k == 0
        or isinstance(whole.parts[k - 1], rot.Clutch)
        or rng.random() < 0.2
    ]
    return Chain(parts=tuple(whole.parts[k] for k in kept), grips=tuple(whole.grips[k] for k in kept))


@dataclass(frozen=True)
class Section:
    """Parts between two slipping clutches, which turn as one: what the shaft at their left end needs to turn at a speed.

    ``out`` is the torque that the clutch at their right end takes.
    """

    parts: tuple[tuple[pt.Component, float], ...]
    out: float

    def needed(self, w: float) -> tuple[float, float]:
        """The least and the greatest torque at speed ``w``; infinite where a clutch that holds cannot carry what is needed."""
        speeds, low, high = [w], self.out, self.out
        for part, _ in self.parts:
            speeds.append(speeds[-1] / float(part.ratio) if isinstance(part, rot.Gear) else speeds[-1])
        for (part, grip), here in zip(reversed(self.parts), reversed(speeds[:-1]), strict=True):
            low, high = _through(part, grip, here, low, high)
        return low, high

    def speed(self, torque: float) -> float | None:
        """The speed at which this torque is what is needed, which grows with the speed; None where there is none."""
        low, high = self.needed(0.0)
        if low - 1e-12 <= torque <= high + 1e-12:
            return 0.0
        sign = 1.0 if torque > high else -1.0
        slow, fast = 0.0, 1.0
        while sign * (torque - self.needed(sign * fast)[0]) > 0.0:
            slow, fast = fast, 2.0 * fast
            if fast > 1e9:
                return None
        for _ in range(200):
            middle = (slow + fast) / 2
            above = sign * (torque - self.needed(sign * middle)[0]) > 0.0
            slow, fast = (middle, fast) if above else (slow, middle)
        balanced = abs(self.needed(sign * fast)[0] - torque) < 1e-6 * (1.0 + abs(torque))
        return sign * fast if balanced else None


def _through(part: pt.Component, grip: float, w: float, low: float, high: float) -> tuple[float, float]:
    """What is needed on the left of a part, from what is needed on its right, at the speed ``w`` of its left shaft."""
    if isinstance(part, rot.Brake | rot.BearingFriction):
        bearing = isinstance(part, rot.BearingFriction)
        u = float(part.tau_pos[0][1]) if isinstance(part, rot.BearingFriction) else float(part.fn_max) * grip
        size = u + (8.0 - u) * abs(w) / 100 if bearing else u
        return (low - size, high + size) if w == 0.0 else (low + np.sign(w) * size, high + np.sign(w) * size)
    if isinstance(part, rot.Damper):
        return low + float(part.d) * w, high + float(part.d) * w
    if isinstance(part, rot.Gear):
        ratio, eta = float(part.ratio), float(part.efficiency)
        ends = sorted((low / ratio, high / ratio))
        more, less = (max(x / eta, x * eta) for x in ends), (min(x / eta, x * eta) for x in ends)
        upper, lower = list(more), list(less)
        return (lower[0], upper[1]) if w == 0.0 else (upper[0], upper[1]) if w > 0.0 else (lower[0], lower[1])
    if isinstance(part, rot.Clutch):  # it holds
        size = float(part.fn_max) * grip
        if low > size + 1e-12 or high < -size - 1e-12:
            return (np.inf, np.inf) if low > size else (-np.inf, -np.inf)
        return max(low, -size), min(high, size)
    return low, high


def all_points(model: Chain, torque: float) -> list[list[float]]:
    """The speeds of the shafts on the left of all parts, for every consistent combination of clutches that hold or slip."""
    pairs, found = list(zip(model.parts, model.grips, strict=True)), list[list[float]]()
    clutches = {k: float(part.fn_max) * grip for k, (part, grip) in enumerate(pairs) if isinstance(part, rot.Clutch)}
    for modes in product((0.0, 1.0, -1.0), repeat=len(clutches)):
        slipping = [(k, m) for k, m in zip(clutches, modes, strict=True) if m]
        speeds = _speeds(pairs, [(k, m * clutches[k]) for k, m in slipping], torque)
        if speeds is None or any(m * (speeds[k] - speeds[k + 1]) < -1e-9 for k, m in slipping):
            continue
        if not any(np.allclose(speeds, other, atol=1e-6) for other in found):
            found.append(speeds)
    return found


def _speeds(
    pairs: list[tuple[pt.Component, float]], cuts: list[tuple[int, float]], torque: float
) -> list[float] | None:
    speeds: list[float] = []
    first, into = 0, torque
    for k, out in [*cuts, (len(pairs), 0.0)]:
        section = Section(tuple(pairs[first:k]), out)
        w = section.speed(into)
        if w is None:
            return None
        speeds.append(w)
        for part, _ in section.parts:
            speeds.append(speeds[-1] / float(part.ratio) if isinstance(part, rot.Gear) else speeds[-1])
        first, into = k + 1, out
    return speeds


@pytest.mark.parametrize("seed", few(range(1000), 5))
def test_steady_is_what_all_modes_say(seed: int) -> None:
    """Against all combinations of slipping clutches, what each section needs being a growing function of its speed."""
    rng = np.random.default_rng(seed)
    model = random_chain_without_inertias(rng)
    torques = [0.0, *(rng.choice([-1, 1], 3) * rng.uniform(0.5, 30, 3)).tolist()]
    plant = pt.compile(model)
    seen = [k for k, part in enumerate(model.parts) if isinstance(part, rot.Inertia | rot.Brake | rot.BearingFriction)]
    found = pt.steady(plant, {"tau": torques}, outputs=[f"parts[{k}].w" for k in seen])
    for i, torque in enumerate(torques):
        points, status = all_points(model, torque), int(found.status[i])
        if status == OK:
            speeds = [float(found[f"parts[{k}].w"][i]) for k in seen]
            same = [np.allclose(speeds, [point[k] for k in seen], rtol=1e-6, atol=1e-6) for point in points]
            assert any(same), (torque, speeds, points)
            assert len(points) == 1 or floats(model, points[0]), (torque, points)
        elif status == SEVERAL:
            assert len(points) != 1 or floats(model, points[0]), (torque, points)
        else:
            assert points == [], (torque, status, points)


def floats(model: Chain, speeds: list[float]) -> bool:
    """Whether more than the speeds is open: the twist of a shaft at rest between parts that stick, or shafts behind an open clutch."""
    found = zip(model.parts, model.grips, speeds, strict=False)
    return any(
        (isinstance(part, rot.Clutch) and grip == 0.0) or (isinstance(part, rot.SpringDamper) and abs(w) < 1e-9)
        for part, grip, w in found
    )
