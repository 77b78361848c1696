"""CoupledClutches: four inertias, three clutches, nine events with eleven changes in 1.5 s, 1,501 outputs, rtol 1e-6.

Against the same equations in C with the same method, and against the same equations written for ``scipy.integrate.solve_ivp``;
and 200 models with 5 % noise on every parameter against their event sequences at 1e-11.
"""

from __future__ import annotations

import atexit
import ctypes
import math
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import powertrain as pt
from benchmarks import native
from benchmarks.by_hand import simulate_by_hand
from benchmarks.timing import Call, Row, at_least, at_most, duration, measure
from powertrain.components.blocks import Sine, Step
from powertrain.components.rotational import Clutch, Inertia, Torque
from powertrain.engine.simulator import Simulator

STOP, ATOL = 1.5, 1e-8
GRID = np.linspace(0.0, STOP, 1501)
NAME = "CoupledClutches"
Array = NDArray[np.float64]
Events = list[tuple[str, float, float]]


class CoupledClutches(pt.Component):
    """Four inertias and three clutches in a row, as in the Modelica Standard Library."""

    torque: Torque = Torque()
    sin1: Sine = Sine(amplitude=10, f=5)
    sin2: Sine = Sine(amplitude=1, f=0.2, phase=math.pi / 2)
    step1: Step = Step(startTime=0.4)
    step2: Step = Step(startTime=0.9)
    J1: Inertia = Inertia(J=1)
    J2: Inertia = Inertia(J=1)
    J3: Inertia = Inertia(J=1)
    J4: Inertia = Inertia(J=1)
    clutch1: Clutch = Clutch(peak=1.1, fn_max=20)
    clutch2: Clutch = Clutch(peak=1.1, fn_max=20)
    clutch3: Clutch = Clutch(peak=1.1, fn_max=20)

    def equations(self) -> pt.Equations:
        """Connections."""
        yield pt.connect(self.sin1.y, self.torque.tau)
        yield pt.connect(self.torque.flange, self.J1.flange_a)
        yield pt.connect(self.J1.flange_b, self.clutch1.flange_a)
        yield pt.connect(self.clutch1.flange_b, self.J2.flange_a)
        yield pt.connect(self.J2.flange_b, self.clutch2.flange_a)
        yield pt.connect(self.clutch2.flange_b, self.J3.flange_a)
        yield pt.connect(self.J3.flange_b, self.clutch3.flange_a)
        yield pt.connect(self.clutch3.flange_b, self.J4.flange_a)
        yield pt.connect(self.sin2.y, self.clutch1.f_normalized)
        yield pt.connect(self.step1.y, self.clutch2.f_normalized)
        yield pt.connect(self.step2.y, self.clutch3.f_normalized)

    def initial(self) -> pt.Equations:
        """One inertia turns."""
        yield self.J1.w == 10


def simulate(plant: pt.Plant[CoupledClutches], **options: Any) -> list[Array]:
    """What is timed for powertrain: one run of the compiled model and its states at the 1,501 instants (and both sides of events)."""
    result = plant.simulate(STOP, times=GRID, **options)
    return [result[name] for name in plant.compiled.states]


def engine_alone(plant: pt.Plant[CoupledClutches], compiled: bool) -> Callable[[], Any]:
    """What a run costs without initialisation, checks and a result: the engine and its outputs at the 1,501 instants."""
    engine = Simulator(plant.compiled.dae, compile=compiled)
    x, _, m, _ = plant.initialize()
    p = plant.parameter_vector()
    return lambda: engine.run(x, p, m, stop=STOP).at(GRID)


def exported(plant: pt.Plant[CoupledClutches]) -> Callable[[], Array]:
    """The model exported as C; its run gives the states at the grid."""
    folder = Path(tempfile.mkdtemp(prefix="powertrain_exported_"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    library = plant.export_c(folder).library
    memory, out = np.zeros(library.pt_size() // 8 + 1), np.empty((len(GRID), len(plant.compiled.states)))

    def run() -> Array:
        one, rows, grid = map(native.pointer, (memory, out, GRID))
        library.pt_start(one)
        library.pt_sample(one, grid, ctypes.c_long(len(GRID)), rows)
        status = library.pt_run(one, ctypes.c_double(STOP))
        if status:
            raise RuntimeError(library.pt_message(status).decode())
        return out

    return run


def speeds(result: pt.Result[CoupledClutches]) -> Array:
    """The four speeds at the grid."""
    found = result.at(GRID, ["J1.w", "J2.w", "J3.w", "J4.w"])
    return np.column_stack(list(found.values()))


def floor(checks: bool) -> Callable[[], tuple[Array, int]]:
    """The program in C; its run gives the speeds at the grid and the number of instants with events."""
    library = native.build(native.FLOORS / "coupled_clutches.c", defines=(f"CHECKS={int(checks)}",))
    parameters = np.array([1, 1, 1, 1, 10, 5, 1, 0.2, math.pi / 2, 0.4, 0.9, 20, 20, 20, 0.5, 1.1], float)
    start, modes = np.array([0, 10, 0, -10, 0, 0, 0, 0], float), (ctypes.c_int * 3)(-1, 2, 2)
    out, when, steps = np.empty((len(GRID), 8)), np.empty(100), (ctypes.c_long * 2)()
    arrays = (parameters, start, GRID, out, when)
    numbers = [ctypes.c_double(v) for v in (STOP, 1e-6, ATOL)]

    def run() -> tuple[Array, int]:
        p, x0, grid, rows, instants = map(native.pointer, arrays)
        events = library.run(p, x0, modes, *numbers, grid, len(GRID), rows, instants, steps)
        if events < 0:
            raise RuntimeError(f"the C program failed: {events}")
        return out, events

    return run


def perturbed(plant: pt.Plant[CoupledClutches], n: int, seed: int = 1) -> list[dict[str, float]]:
    """Sets of parameters with 5 % noise on each that is not zero; peak stays at least 1."""
    random = np.random.default_rng(seed)
    base = {name: value for name, value in plant.parameters.items() if value}
    variants = []
    for _ in range(n):
        noise = 1 + 0.05 * random.standard_normal(len(base))
        values = {name: value * e for (name, value), e in zip(base.items(), noise, strict=True)}
        variants.append({k: max(v, 1.0) if k.endswith(".peak") else v for k, v in values.items()})
    return variants


def sequence(plant: pt.Plant[CoupledClutches], parameters: dict[str, float], **options: Any) -> Events:
    """What switches, in order."""
    events = plant.simulate(STOP, points=1, parameters=parameters, **options).events
    return [(e.name, e.old, e.new) for e in events]


def same_sequences(plant: pt.Plant[CoupledClutches], n: int) -> int:
    """How many of n perturbed models switch at 1e-6 as they do at 1e-11 with steps that can not overlook anything."""
    tight = {"rtol": 1e-11, "atol": 1e-13, "max_step": 1e-3}
    return sum(sequence(plant, p) == sequence(plant, p, **tight) for p in perturbed(plant, n))


def run(rounds: int = 31, variants: int = 200) -> list[Row]:
    """All rows of this benchmark."""
    plant = pt.compile(CoupledClutches())
    reference = speeds(plant.simulate(STOP, times=GRID, rtol=1e-11))
    calls: dict[str, Call] = {"ours": lambda: simulate(plant), "scipy": simulate_by_hand}
    calls["engine"] = engine_alone(plant, compiled=False)
    reason = native.no_compiler()
    if not reason:
        calls |= {
            "compiled engine": engine_alone(plant, compiled=True),
            "compiled": lambda: simulate(plant, compile=True),
            "exported": exported(plant),
            "C": floor(checks=True),
            "C, step ends": floor(checks=False),
        }
    times = measure(calls, rounds, slow=3)
    rows = [Row(NAME, "one run, no compiler", duration(times.median("ours")))]
    error = np.abs(speeds(plant.simulate(STOP, times=GRID)) - reference).max()
    rows.append(Row(NAME, "largest error of a speed (10 rad/s)", f"{error:.1e} rad/s"))
    if reason:
        rows.append(Row(NAME, "against C", reason))
    else:
        out, events = floor(checks=True)()
        hand = np.cumsum(out[:, 1::2], axis=1)
        said = f"{duration(times.median('C'))}, {events} events, error {np.abs(hand - reference).max():.1e} rad/s"
        rows.append(Row(NAME, "the whole run in hand-written C, same method", said))
        rows.append(at_most(NAME, "no compiler against C", times.ratio("ours", "C"), 15))
        rows.append(at_most(NAME, "compiled steps against C", times.ratio("compiled", "C"), 7))
        rows.append(at_most(NAME, "the simulator alone, no compiler against C", times.ratio("engine", "C"), 15))
        rows.append(
            at_most(NAME, "the simulator alone, compiled steps against C", times.ratio("compiled engine", "C"), 7)
        )
        rows.append(at_most(NAME, "the exported model in C against hand-written C", times.ratio("exported", "C"), 2))
        strict = [f"{times.ratio(name, 'C, step ends'):.3g} x" for name in ("ours", "compiled")]
        rows.append(Row(NAME, "the same two against C without checks inside steps", ", ".join(strict)))
    rows.append(Row(NAME, "hand-written for solve_ivp, BDF", duration(times.median("scipy"))))
    rows.append(Row(NAME, "faster than solve_ivp, BDF: no compiler", f"{times.ratio('scipy', 'ours'):.3g} x"))
    if not reason:
        rows.append(at_least(NAME, "faster than solve_ivp, BDF: compiled steps", times.ratio("scipy", "compiled"), 100))
    if variants:
        same = same_sequences(plant, variants)
        rows.append(
            Row(NAME, "perturbed models that switch as at 1e-11", f"{same} of {variants}", "all", same == variants)
        )
    return rows
