"""Operating points of random drivelines are where long simulations come to rest; where there is none, the simulations run away."""

from __future__ import annotations

import numpy as np
import pytest

import powertrain as pt
from powertrain.components import rotational as rot

OK, SEVERAL, NOT_FOUND = 0, 2, 6
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


@pytest.mark.parametrize("seed", [*range(12), *(pytest.param(k, marks=pytest.mark.slow) for k in range(12, 300))])
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


@pytest.mark.parametrize("seed", range(3))
def test_a_point_is_the_same_in_any_grid(seed: int) -> None:
    """Status and values of a point alone, and among others in another order."""
    rng = np.random.default_rng(seed)
    plant = pt.compile(random_chain(rng))
    torques = np.concatenate([[0.0], rng.uniform(-30, 30, 12)])
    names = [n for n in plant.compiled.signals if n.endswith(".w") and "flange" not in n]
    together = pt.steady(plant, {"tau": torques}, outputs=names)
    for k in rng.permutation(torques.size)[:6].tolist():
        alone = pt.steady(plant, {"tau": float(torques[k])}, outputs=names)
        assert alone.status.item() == together.status.values[k]
        for name in names:
            np.testing.assert_allclose(alone[name].item(), together[name].values[k], rtol=1e-9, atol=1e-9)
