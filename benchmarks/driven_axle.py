"""The split-path car on a driven axle (differential, half shafts, Magic Formula tyres) over the WLTC, beside FASTSim on the same trace."""

from __future__ import annotations

import atexit
import ctypes
import shutil
import tempfile
from functools import partial
from pathlib import Path

import numpy as np

import powertrain as pt
from benchmarks import native
from benchmarks.drive_cycle import WLTC, fastsim, litres
from benchmarks.timing import Call, Row, at_most, duration, measure
from powertrain.components.body import DrivenAxle
from powertrain.components.differentials import BevelDifferential, CrownGear
from powertrain.vehicles.split_path_car import SplitPathCar

NAME = "driven axle"
RTOL = 1e-4
GOALS = {"no compiler": 300.0, "compiled steps": 30.0, "exported to C": 10.0}
"""Times of FASTSim's conventional car."""
SETTLED = 2


def car() -> SplitPathCar:
    """The car with an open differential that has friction."""
    ring = CrownGear(ratio=4.5, eta_ab=0.97, eta_ba=0.97)
    axle = DrivenAxle(final_drive=ring, differential=BevelDifferential(eta=0.97))
    return pt.replace(SplitPathCar(front=axle), {"cycle.cycle": WLTC})


def exported() -> Call:
    """The car exported as C: the run alone, without outputs."""
    folder = Path(tempfile.mkdtemp(prefix="powertrain_exported_"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    library = pt.compile(car()).export_c(folder, method="rodas5p").library
    memory, stop = np.zeros(library.pt_size() // 8 + 1), float(WLTC.times[-1])

    def call() -> None:
        one = native.pointer(memory)
        library.pt_start(one)
        library.pt_tolerance(one, *map(ctypes.c_double, (RTOL, RTOL, np.inf)))
        status = library.pt_run(one, ctypes.c_double(stop))
        if status:
            raise RuntimeError(library.pt_message(status).decode())

    return call


def run(rounds: int = 3) -> list[Row]:
    """All rows of this benchmark."""
    calls: dict[str, Call] = {}
    reason = native.no_compiler()
    for said in ("no compiler", "compiled steps") if not reason else ("no compiler",):
        plant = pt.compile(car())
        calls[said] = partial(litres, plant, rtol=RTOL, compile=said == "compiled steps")
        for _ in range(SETTLED):
            calls[said]()
    if not reason:
        calls["exported to C"] = exported()
    try:
        calls["fastsim"], _ = fastsim()
    except ImportError as error:
        return [Row(NAME, "FASTSim", f"skipped: {error}; install powertrain[benchmarks]")]
    times = measure(calls, rounds, inner=1, slow=rounds)
    cars = [said for said in calls if said != "fastsim"]
    rows = [Row(NAME, f"{said}, rtol {RTOL:g}", duration(times.median(said))) for said in cars]
    ratios = {said: times.ratio(said, "fastsim") for said in cars}
    return [*rows, *(at_most(NAME, f"{said}, in times of FASTSim", ratios[said], GOALS[said]) for said in cars)]
