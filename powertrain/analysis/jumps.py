"""What happens to energy at single instants: stored energy that jumps, and what sources give with an impulse.

An impulse P of a contact reaches every part that cannot give way: a source that prescribes a motion w transmits an impulse of its own and
supplies w times this impulse, as a motor that drives a press does at every stroke. The rest of the change is the work of the impulses in
the contacts, P (v + v')/2, which is never positive. The power through a port is torque times speed, so the work of an impulse through it is
the slope of the power with the force of the contact, times P: the mean of both sides, which is exact where speeds jump.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from powertrain.analysis.energy_terms import EnergyTerms
from powertrain.dae.hybrid import Contact, Friction, HybridDae
from powertrain.engine.trajectory import Instant, Samples, Trajectory
from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol, column


@dataclass(frozen=True)
class Jump:
    """A change at one instant: the energy stored by each part, what each boundary supplies, and the parts that declare what happens."""

    time: float
    cause: str
    change: Array
    supplied: Array
    owners: tuple[int, ...]

    @property
    def given(self) -> float:
        """Energy created, in joules: the increase of stored energy less what boundaries supply."""
        return float(self.change.sum() - self.supplied.sum())


def jumps(terms: EnergyTerms, dae: HybridDae, trajectory: Trajectory, p: Array) -> tuple[Jump, ...]:
    """The changes of energy at the instants of events, and the components that declare what happened."""
    instants = [i for i in trajectory.instants if i.time > trajectory.start]
    if not instants:
        return ()
    samples = trajectory.limits(instants)
    energy, supplied = terms.values(samples, p).energy, _supplied(terms, dae, instants, samples, p)
    place = {part.path: k for k, part in enumerate(terms.parts)}
    found = []
    for i, instant in enumerate(instants):
        owners = {place[path] for name, _ in instant.extra if (path := name.rpartition(".")[0]) in place}
        names = [name for name, _ in instant.extra] or [
            law for index, law, _ in trajectory.laws if instant.held_left[index] != instant.held_right[index]
        ]
        change, cause = energy[2 * i + 1] - energy[2 * i], ", ".join(dict.fromkeys(names))
        found.append(Jump(instant.time, cause, change, supplied[i], tuple(sorted(owners))))
    return tuple(found)


def _supplied(terms: EnergyTerms, dae: HybridDae, instants: list[Instant], samples: Samples, p: Array) -> Array:
    """The energy that each part supplies with an impulse at each instant: zero except for boundaries."""
    found = np.zeros((len(instants), len(terms.parts)))
    boundary = np.array([part.boundary for part in terms.parts])
    struck = [i for i, instant in enumerate(instants) if instant.impulses]
    if not struck or not boundary.any():
        return found
    slopes = ca.Function("impulses", dae.arguments, [_slopes(dae, terms.opened)])
    for i in struck:
        sides = [slopes(*(block[k] for block in samples), p) for k in (2 * i, 2 * i + 1)]
        through = np.array(0.5 * (sides[0] + sides[1])) @ np.array(instants[i].impulses)
        found[i] = np.where(boundary, -(terms.own @ through), 0.0)
    return found


def _slopes(dae: HybridDae, power: Symbol) -> Symbol:
    """The slopes of powers, given in terms of the laws' torques, with the impulses of the barriers."""
    assert dae.opened is not None
    laws: list[Friction | Contact] = [*dae.frictions, *dae.contacts]
    place = {law.index: k for k, law in enumerate(laws)}
    torques = column([*(law.torque for law in dae.frictions), *(contact.force for contact in dae.contacts)])
    struck = [place[b.index] for b in dae.barriers]
    slopes = ca.jacobian(power, dae.opened.tau)[:, struck] @ ca.diag(ca.DM([b.sense for b in dae.barriers]))
    return ca.densify(ca.substitute(slopes, dae.opened.tau, torques))
