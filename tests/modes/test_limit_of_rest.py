"""A gearset under a constant torque, and one of its elements eases: it rests as long as statics finds torques within the limits.

The static theorem as linear programs: unknown are the torques at the levers and of the elements. The loss of a lever lies between its
values for both directions of motion, which depend on the torque at a; for each combination of the signs of these torques that is convex.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog

import powertrain as pt
from powertrain.components.differentials import FundamentalDifferential
from powertrain.components.rotational import Brake, Clutch, Fixed, Inertia, Torque
from powertrain.components.transmissions.gear_scheme import GearScheme
from powertrain.components.transmissions.gearsets import EIGHT_SPEED, LEPELLETIER_SIX

LARGEST = 3000.0
"""Torque of every element at full pressure, N.m."""
TORQUE, EASING = 200.0, 5.0
"""At the input, N.m; how long an element takes to open, s."""


class Bench(pt.Component):
    """Levers, shafts and elements of a scheme; a heavy output."""

    scheme: GearScheme
    press: tuple[float, ...]
    eases: str
    levers: tuple[FundamentalDifferential, ...]
    shafts: tuple[Inertia, ...]
    elements: tuple[Any, ...]
    drive: Torque = Torque()
    output: Inertia = Inertia(J=8.0)
    housing: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        nodes = self.scheme.free.nodes
        at = {k: [shaft.flange_a] for k, shaft in enumerate(self.shafts)} | {-1: [self.housing.flange]}
        for lever, part in zip(self.scheme.levers, self.levers, strict=True):
            for shaft, flange in zip((lever.a, lever.b, lever.carrier), (part.a, part.b, part.carrier), strict=True):
                at[nodes[shaft]].append(flange)
        for element, part, press in zip(self.scheme.elements, self.elements, self.press, strict=True):
            one, other = sorted((nodes[element.a], nodes[element.b]), reverse=True)
            at[one].append(part.flange_a)
            if not element.is_brake:
                at[other].append(part.flange_b)
            opens = element.name == self.eases
            yield part.f_normalized.value == (pt.schedule([1.0, 1.0 + EASING], [press, 0.0]) if opens else press)
        at[nodes[self.scheme.input]].append(self.drive.flange)
        at[nodes[self.scheme.output]].append(self.output.flange_a)
        yield self.drive.tau.value == TORQUE
        for flanges in at.values():
            if len(flanges) > 1:
                yield pt.connect(*flanges)


def bench(scheme: GearScheme, press: tuple[float, ...], eases: str) -> Bench:
    return Bench(
        scheme=scheme,
        press=press,
        eases=eases,
        levers=tuple(FundamentalDifferential(ratio=x.ratio, eta_ab=x.eta, eta_ba=x.eta) for x in scheme.levers),
        shafts=(Inertia(J=0.01),) * (max(scheme.free.nodes.values()) + 1),
        elements=tuple(
            (Brake if e.is_brake else Clutch)(fn_max=LARGEST, mue_pos=((0.0, 1.0),)) for e in scheme.elements
        ),
    )


def least_press(scheme: GearScheme, press: tuple[float, ...], eases: str) -> float:
    """The least pressure of the element that eases, as a share of its first, at which statics has a solution."""
    signs = product((1.0, -1.0), repeat=len(scheme.levers))
    found = [_least(scheme, press, eases, each) for each in signs]
    return min(share for share in found if share is not None)


def _least(scheme: GearScheme, press: tuple[float, ...], eases: str, signs: tuple[float, ...]) -> float | None:
    """The same for given signs of the torques at a. Unknowns: torque at a and loss of each lever, torques of the elements, share."""
    nodes, levers, n = scheme.free.nodes, len(scheme.levers), 2 * len(scheme.levers) + len(scheme.elements) + 1
    balance, load = np.zeros((len(set(nodes.values()) | {-1}), n)), np.zeros(len(set(nodes.values()) | {-1}))
    limits, unit = list[np.ndarray[Any, Any]](), np.eye(n)
    bounds = [0.0] * (3 * levers)
    for k, (lever, sign) in enumerate(zip(scheme.levers, signs, strict=True)):
        a, loss, R = unit[2 * k], unit[2 * k + 1], lever.ratio
        for shaft, torque in ((lever.a, a), (lever.b, -R * (a - loss)), (lever.carrier, -a + R * (a - loss))):
            balance[nodes[shaft]] += torque
        forward, backward = (1.0 - lever.eta) * a, (1.0 - 1.0 / lever.eta) * a
        limits += [-sign * a, sign * (loss - forward), sign * (backward - loss)]
    for j, (element, full) in enumerate(zip(scheme.elements, press, strict=True)):
        torque, opens = unit[2 * levers + j], element.name == eases
        balance[nodes[element.a]] += torque
        balance[nodes[element.b]] -= torque
        limits += [way * torque - (LARGEST * full * unit[-1] if opens else 0.0) for way in (1.0, -1.0)]
        bounds += [0.0 if opens else LARGEST * full] * 2
    load[nodes[scheme.input]] = TORQUE
    free = sorted(set(nodes.values()) - {-1})  # the last row is that of the housing, which holds everything
    answer = linprog(
        unit[-1], np.array(limits), bounds, balance[free], load[free], [(None, None)] * (n - 1) + [(0.0, 1.0)]
    )
    return None if answer.x is None else float(answer.x[-1])  # it has none if there is no solution


@pytest.mark.parametrize(
    ("scheme", "press", "eases"),
    [
        (EIGHT_SPEED, (0.3, 0.05, 0.05, 0.05, 0.3), "B"),
        (EIGHT_SPEED, (0.05, 0.05, 0.3, 0.05, 0.05), "C"),
        (LEPELLETIER_SIX, (0.02, 0.05, 0.05, 0.3, 0.03), "D"),
        (LEPELLETIER_SIX, (0.0, 0.05, 0.05, 0.05, 0.3), "D"),
    ],
    ids=["eight speeds, B", "eight speeds, C", "Lepelletier, D", "Lepelletier without A"],
)
def test_rest_ends_where_statics_has_no_solution(scheme: GearScheme, press: tuple[float, ...], eases: str) -> None:
    """Laws at their limits on one motion change the side that they hold while one of them eases: nothing slips before the limit."""
    share = least_press(scheme, press, eases)
    assert 0.0 < share < 1.0
    instant = 1.0 + EASING * (1.0 - share)
    events = pt.simulate(bench(scheme, press, eases), instant + 0.2).events
    assert events[0].time == pytest.approx(instant, abs=1e-5)
    assert len(events) < 20
