"""Random machines either run, with closed energy and the same events in finer steps, or are refused with the names of their parts.

``POWERTRAIN_FUZZ=2000:12000`` examines these seeds in place of those of the slow suite.
"""

from __future__ import annotations

import os
from typing import Any

import casadi as ca
import numpy as np
import pytest
from bounded import bounded
from cases import few
from mechanisms import mechanism, random_starts

import powertrain as pt
from powertrain.dae.hybrid import Friction
from powertrain.engine.trajectory import Instant
from powertrain.modes.resolve import ModeResolver

FIRST, _, LAST = os.environ.get("POWERTRAIN_FUZZ", "60:180").partition(":")
STOP = 1.0
FINE: dict[str, Any] = {"rtol": 1e-7}
NOTHING = 1e-9
"""Energy in J that is round-off."""
KEPT = 2 * FINE["rtol"]
"""Share of the stored energy that is nothing: a speed may be off by ``rtol``, its energy by twice that, also where nothing is exchanged."""
NOISE = 1e-6
"""Share of energies that is nothing."""
STILL = 1e-5
"""Speeds (rad/s, m/s) that are nothing: what tens of steps of the coarse run leave of one beside a tyre, each with 1e-7 of its slip."""
SLOW = 1e-2
"""Rates (rad/s2, m/s2) that are nothing: what a speed that is nothing makes of stiff couplings."""
TOGETHER = 1e-5
"""Changes of a law within this time (s) are one: speeds that pass zero together do so one after the other by what is left of them."""
NEAR = 1e-3
"""By how much (s) an event may be moved by the error of the coarse run: with speeds near zero it grows."""


class Laws:
    """What the friction laws of a plant are seen to do."""

    def __init__(self, plant: pt.Plant[Any], result: pt.Result[Any]) -> None:
        dae = plant.compiled.dae
        self.laws, self.p = dae.frictions, np.array(list(result.parameters.values()))
        self.sizes = dae.x.numel(), dae.z.numel(), dae.m.numel()
        values = ca.vertcat(*[ca.horzcat(law.w, law.rate) for law in dae.frictions])
        self.function = ca.Function("laws", [dae.t, dae.x, dae.z, dae.m, dae.p], [ca.densify(values)])

    def changes(self, instant: Instant) -> dict[str, tuple[str, str]]:
        """The laws that are seen to change at an instant, and what they do before and after it.

        When a law turns that transmits nothing is no event; other laws only happen to have theirs at such times.
        """
        before, after = (self._seen(instant, right) for right in (False, True))
        seen = zip(self.laws, before, after, strict=True)
        return {law.name: (old, now) for law, old, now in seen if old != now and not self._free(instant, law)}

    @staticmethod
    def _free(instant: Instant, law: Friction) -> bool:
        """Whether a law transmits nothing on both sides of an instant."""
        return bool(instant.held_left[law.index] == instant.held_right[law.index] == 2.0)

    def _seen(self, instant: Instant, right: bool) -> list[str]:
        """The direction of motion: what is about to rest comes from where its rate does not point."""
        y, held = (instant.right, instant.held_right) if right else (instant.left, instant.held_left)
        n, nz, nm = self.sizes
        values = np.array(self.function(instant.time, y[:n], y[n : n + nz], held[:nm], self.p)).reshape(-1, 2)
        found = []
        for law, (w, rate) in zip(self.laws, values, strict=True):
            turns = 0.0 if law.prescribed or abs(rate) < SLOW else rate if right else -rate
            way = float(np.sign(turns if abs(w) < STILL else w))
            found.append({1.0: "forward", 0.0: "at rest", -1.0: "backward"}[way])
        return found


def happened(plant: pt.Plant[Any], result: pt.Result[Any]) -> dict[str, list[tuple[float, str]]]:
    """Of all laws by their names: when they are seen to have become what."""
    laws, found = Laws(plant, result), dict[str, list[tuple[float, str]]]()
    names, touching = {law.name for law in laws.laws}, {c.name for c in plant.compiled.dae.contacts}
    for event in result.events:
        shared = event.name in touching and not np.isnan(event.new)  # friction may hold what presses on a stop
        if event.name not in names and not shared:
            seen = found.setdefault(event.name, [])
            if (
                not seen or event.time - seen[-1][0] > NEAR
            ):  # of bounces that accumulate the last ones cannot be counted
                seen.append((event.time, f"{event.new:g}"))
    for instant in result.trajectory.instants:
        for name, (old, now) in laws.changes(instant).items():
            seen = found.setdefault(name, [])
            if seen and instant.time - seen[-1][0] < TOGETHER:  # of shafts that stop together one may be seen to go on
                seen.pop()
            elif seen and seen[-1][1] != old:  # no instant shows it: it broke loose without a rate, or died away
                seen.append((np.nan if old == "at rest" else _last_event(result, name, instant.time), old))
            if not seen or seen[-1][1] != now:  # between two of the same it did what cannot be told from noise
                seen.append((instant.time, now))
    return found


def _last_event(result: pt.Result[Any], name: str, before: float) -> float:
    """When a law last changed its mode before a time; that time if it did not."""
    return max((event.time for event in result.events if event.name == name and event.time < before), default=before)


def examined(seed: int, careless: bool = False) -> bool:
    """Whether the machine of this seed runs; fails where it neither runs as it should nor is refused with names."""
    found = runs(seed, careless)
    if isinstance(found, pt.PowertrainError):
        assert "parts[" in str(found), f"{seed} names no component: {found}"
        return False
    plant, coarse, fine = found
    audit = pt.energy_audit(fine)
    stored = audit.energy[""].abs().max()
    assert audit.residual < 1e-5 * audit.turnover + KEPT * stored + NOTHING, (seed, audit)
    assert not (audit.violations.amount.abs() > NOISE * (1.0 + audit.turnover)).any(), (seed, audit)
    for result in (coarse, fine):
        assert np.isfinite(result.to_dataframe().to_numpy()).all(), seed
    seldom, often = happened(plant, coarse), happened(plant, fine)
    for name in sorted(seldom.keys() | often.keys()):
        one, other = seldom.get(name, []), often.get(name, [])
        assert [what for _, what in one] == [what for _, what in other], (seed, name, one, other)
        apart = np.array([t for t, _ in one]) - [t for t, _ in other]
        assert not (np.abs(apart) > NEAR).any(), (seed, name, one, other)  # speeds that die away rest at no time (nan)
    return True


def runs(seed: int, careless: bool) -> tuple[pt.Plant[Any], pt.Result[Any], pt.Result[Any]] | pt.PowertrainError:
    """A run, and one with a fifth of the step size and a tenth of the tolerance; or the refusal."""
    try:
        with bounded():
            plant = pt.compile(mechanism(seed, careless))
            starts = random_starts(plant, seed)
            coarse = plant.simulate(STOP, starts=starts)
            step = STOP / max(coarse.statistics["steps"], 1.0) / 5
            return plant, coarse, plant.simulate(STOP, starts=starts, max_step=step, **FINE)
    except pt.PowertrainError as error:
        return error


@pytest.mark.parametrize("seed", few(range(60), 10))
def test_mechanisms(seed: int) -> None:
    examined(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(int(FIRST), int(LAST)))
def test_many_mechanisms(seed: int) -> None:
    examined(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(30))
def test_careless_mechanisms(seed: int) -> None:
    examined(seed, careless=True)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [80592, 80599, 81110])
def test_what_may_be_taken_for_an_error(seed: int) -> None:
    """A gear that idles with 21 J and exchanges nothing; a shaft that turns while its brake is open; a motor behind an impact."""
    assert examined(seed)


def test_a_machine_that_seizes_is_proved_to_jam() -> None:
    """Worm gears and a self-locking differential in a row. The proof tries every combination of the conditions in their bounds."""
    found = runs(77107, False)
    assert isinstance(found, pt.SimulationError)
    assert (
        "no modes are consistent with any of the 256 combinations of the conditions in the bounds (the mechanism jams)"
        in str(found)
    )
    assert "parts[11].mode" in str(found)


def test_modes_that_repeat_are_refused_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Modes that are found again and again but never hold: once round is enough."""
    rounds = list[int]()

    def never(resolver: ModeResolver, side: int) -> bool:
        rounds.append(side)
        return False

    monkeypatch.setattr(ModeResolver, "_found", never)
    with pytest.raises(pt.InitializationError, match="no consistent modes were found"):
        pt.compile(mechanism(0)).simulate(STOP)
    assert len(rounds) < 10
