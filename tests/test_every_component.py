"""What holds for every part of the library: it is found by walking the package, and nobody has to remember it here."""

from __future__ import annotations

import importlib
import pkgutil
from typing import Any

import numpy as np
import pytest
from catalogue import concrete, made, mechanical
from scipy.linalg import expm

import powertrain as pt
import powertrain.components as library
from powertrain.components import rotational, translational
from powertrain.components.blocks import Sine
from powertrain.components.electric import DCTerminal, VoltageSource
from powertrain.language.component import children
from powertrain.language.fields import Port, Quantity

ONE_SIDED = {
    "Freewheel": "locks in one direction",
    "OneWayClutch": "locks in one direction",
    "ElastoGap": "pushes and does not pull",
    "Chassis": "on a slope",
    "CoastDownBody": "on a slope",
    "ElectricMachine": "drives where its signal says",
    "VehicleBody": "on a slope, in the wind",
    "Trailer": "on a slope",
    "BandBrake": "energises itself forward",
    "Synchroniser": "its sleeve engages one way",
    "BeltSpan": "pulls and does not push",
    "Pulley": "its belt pulls and does not push",
    "PistonEngine": "fires forward",
    "Starter": "drives forward",
}


class Bench(pt.Component):
    """A part on a test bench: a driven inertia or mass on every free shaft end, a sine at every input, a voltage at every bus."""

    part: pt.Component
    rotors: tuple[rotational.Inertia, ...]
    masses: tuple[translational.Mass, ...]
    torques: tuple[rotational.Torque, ...]
    forces: tuple[translational.Force, ...]
    drives: tuple[Sine, ...]
    signals: tuple[Sine, ...]
    sources: tuple[VoltageSource, ...]

    def equations(self) -> pt.Equations:
        shafts, rods, inputs = list(self.rotors), list(self.masses), list(self.signals)
        drives, torques, forces = list(self.drives), list(self.torques), list(self.forces)
        sources = list(self.sources)
        for name, spec in self.part._fields.items():
            port = getattr(self.part, name) if isinstance(spec, Port) else None
            if isinstance(port, pt.Input):
                yield pt.connect(port, inputs.pop().y)
            elif isinstance(port, DCTerminal):
                yield pt.connect(port, sources.pop().bus)
            elif isinstance(spec, Port) and not spec.grounded and isinstance(port, rotational.Flange):
                rotor, torque = shafts.pop(), torques.pop()
                yield pt.connect(port, rotor.flange_a)
                yield pt.connect(rotor.flange_b, torque.flange)
                yield pt.connect(torque.tau, drives.pop().y)
            elif isinstance(spec, Port) and not spec.grounded and isinstance(port, translational.Flange):
                mass, force = rods.pop(), forces.pop()
                yield pt.connect(port, mass.flange_a)
                yield pt.connect(mass.flange_b, force.flange)
                yield pt.connect(force.f, drives.pop().y)


def bench(part: pt.Component) -> Bench:
    ports = [(part._fields.get(name), port) for name, port in children(part)]
    free = [port for spec, port in ports if isinstance(spec, Port) and not spec.grounded]
    n = sum(isinstance(port, rotational.Flange) for port in free)
    k = sum(isinstance(port, translational.Flange) for port in free)
    inputs = sum(isinstance(port, pt.Input) for _, port in ports)
    return Bench(
        part=part,
        rotors=tuple(rotational.Inertia(J=1.0 + 0.3 * i) for i in range(n)),
        masses=tuple(translational.Mass(m=1.0 + 0.3 * i) for i in range(k)),
        torques=(rotational.Torque(),) * n,
        forces=(translational.Force(),) * k,
        drives=tuple(Sine(amplitude=3.0 + i, f=0.4 + 0.17 * i, phase=0.3 * i) for i in range(n + k)),
        signals=tuple(Sine(amplitude=0.2, f=0.6, offset=0.5) for _ in range(inputs)),
        sources=(VoltageSource(),) * sum(isinstance(port, DCTerminal) for port in free),
    )


ALL = concrete()
NAMES = [kind.__qualname__ for kind in ALL]


def test_the_walk_finds_the_library() -> None:
    assert {"Inertia", "Clutch", "LossyGear", "MassWithStopAndFriction", "Vehicle", "Sine", "HeatCapacitor"} <= set(
        NAMES
    )


@pytest.mark.parametrize("kind", ALL, ids=NAMES)
def test_documented(kind: type[pt.Component]) -> None:
    """Says what it is; every quantity has a unit and a meaning."""
    assert (kind.__doc__ or "").strip()
    for name, spec in kind._fields.items():
        if isinstance(spec, Quantity):
            assert "" not in (spec.unit, spec.doc), f"{kind.__name__}.{name}"


MECHANICAL = [kind for kind in ALL if mechanical(kind)]
FIRST = set({kind.__module__.rpartition(".")[0]: kind for kind in reversed(MECHANICAL)}.values())
"""One of each family."""
BENCHED = [
    pytest.param(kind, marks=() if kind in FIRST else pytest.mark.slow, id=kind.__qualname__) for kind in MECHANICAL
]


@pytest.mark.parametrize("kind", BENCHED)
def test_energy_closes_and_no_loss_is_negative(kind: type[pt.Component]) -> None:
    """What enters through the ports is lost, stored, or (sources) supplied; a passive part never loses less than nothing."""
    result = pt.simulate(bench(made(kind)), stop=2.0, rtol=1e-8)
    audit = pt.energy_audit(result)
    assert not audit.hidden
    assert audit.closure < 1e-6  # the integrator's tolerance over a few hundred steps
    loss = np.asarray(audit.loss["part"])
    if not kind.boundary:
        assert loss.min() >= -1e-7 * (1.0 + np.abs(loss).max())


SYMMETRIC = [kind for kind in MECHANICAL if kind.__name__ not in ONE_SIDED and not kind.boundary]


@pytest.mark.slow
@pytest.mark.parametrize("kind", SYMMETRIC, ids=[kind.__qualname__ for kind in SYMMETRIC])
def test_mirrored_drive_gives_mirrored_motion(kind: type[pt.Component]) -> None:
    """Opposite torques and forces give opposite speeds: no direction is preferred."""
    plant, times = pt.compile(bench(made(kind))), np.linspace(0.0, 1.5, 31)
    drives = {f"drives[{i}].amplitude": float(drive.amplitude) for i, drive in enumerate(plant.model.drives)}
    runs = [
        plant.simulate(1.5, parameters={n: sign * v for n, v in drives.items()}, times=times, rtol=1e-9)
        for sign in (1.0, -1.0)
    ]
    speeds = [
        name for name in runs[0].names("*") if name.startswith(("rotors[", "masses[")) and name.endswith((".w", ".v"))
    ]
    assert speeds
    for name in speeds:
        forward, backward = (run.at(times, name) for run in runs)
        np.testing.assert_allclose(backward, -forward, atol=1e-6 * (1.0 + np.abs(forward).max()))


def _moved(plant: pt.Plant[Any], t: float, h: float, starts: dict[str, float]) -> pt.Result[Any]:
    return plant.simulate(t + h, start=t, starts=starts, rtol=1e-11, points=3)


@pytest.mark.slow
@pytest.mark.parametrize("kind", MECHANICAL, ids=[kind.__qualname__ for kind in MECHANICAL])
def test_the_linear_model_is_the_derivative_of_short_runs(kind: type[pt.Component]) -> None:
    """At rest and in motion, where no law changes its mode and the runs from either side have one derivative."""
    plant = pt.compile(bench(made(kind)))
    run = plant.simulate(1.0, rtol=1e-9)
    for t in (0.0, 0.77):
        _compare_with_short_runs(plant, run, t)


def _compare_with_short_runs(plant: pt.Plant[Bench], run: pt.Result[Bench], t: float) -> None:
    h, eps = 1e-4, 1e-6
    names = list(plant.compiled.states)
    known = {name: float(run.at(t, name)) for name in [*names, *(n for n in plant.compiled.discretes if n in run)]}
    driven = "rotors[0].flange_a.tau" if plant.model.rotors else "masses[0].flange_a.f"
    linear = pt.linearize(plant, at=(run, t), inputs=[driven], outputs=names)
    middle = _moved(plant, t, h, known)
    for moved in np.asarray(linear.C).T:
        changes = dict(zip(names, eps * moved, strict=True))
        sides = [_moved(plant, t, h, known | {n: known[n] + sign * changes[n] for n in names}) for sign in (1, -1)]
        if any(event.time > t for one in (middle, *sides) for event in one.events):
            continue
        (up, down), base = ([[one[n][-1] for n in names] for one in runs] for runs in (sides, [middle]))
        above, below = (np.subtract(up, base[0]) / eps - moved) / h, (np.subtract(base[0], down) / eps - moved) / h
        states = np.linalg.lstsq(np.asarray(linear.C), moved)[0]
        expected = np.asarray(linear.C) @ (expm(np.asarray(linear.A) * h) @ states - states) / h
        second = np.abs(
            expected - np.asarray(linear.C) @ (np.asarray(linear.A) @ states)
        )  # as are changes of A with time
        smooth = np.abs(above - below) < 1e-2 * (1 + np.abs(above))
        wrong = smooth & (np.abs(above - expected) > 3e-2 * (1 + np.abs(above)) + second)
        assert not wrong.any(), [(names[i], above[i], below[i], expected[i]) for i in np.flatnonzero(wrong)]


def test_every_package_says_what_it_exports() -> None:
    """And has it."""
    for module in pkgutil.iter_modules(library.__path__, "powertrain.components."):
        found = importlib.import_module(module.name)
        if hasattr(found, "__path__") or any(kind.__module__ == module.name for kind in ALL):
            assert found.__all__, module.name
            for name in found.__all__:
                assert hasattr(found, name) or importlib.import_module(f"{module.name}.{name}"), name
