"""The split-path car on a driven axle (differential, half shafts, Magic Formula tyres) over the WLTC, beside FASTSim on the same trace."""

from __future__ import annotations

from functools import partial

import powertrain as pt
from benchmarks import native
from benchmarks.drive_cycle import WLTC, fastsim, litres
from benchmarks.timing import Call, Row, at_most, duration, measure
from powertrain.components.body import DrivenAxle
from powertrain.components.differentials import BevelDifferential, CrownGear
from powertrain.vehicles.split_path_car import SplitPathCar

NAME = "driven axle"
RTOL = 1e-4
GOALS = {"no compiler": 300.0, "compiled steps": 30.0}
"""Times of FASTSim's conventional car."""
SETTLED = 2


def car() -> SplitPathCar:
    """The car with an open differential that has friction."""
    ring = CrownGear(ratio=4.5, eta_ab=0.97, eta_ba=0.97)
    axle = DrivenAxle(final_drive=ring, differential=BevelDifferential(eta=0.97))
    return pt.replace(SplitPathCar(front=axle), {"cycle.cycle": WLTC})


def run(rounds: int = 3) -> list[Row]:
    """All rows of this benchmark."""
    calls: dict[str, Call] = {}
    reason = native.no_compiler()
    for said in GOALS if not reason else ["no compiler"]:
        plant = pt.compile(car())
        calls[said] = partial(litres, plant, rtol=RTOL, compile=said == "compiled steps")
        for _ in range(SETTLED):
            calls[said]()
    try:
        calls["fastsim"], _ = fastsim()
    except ImportError as error:
        return [Row(NAME, "FASTSim", f"skipped: {error}; install powertrain[benchmarks]")]
    times = measure(calls, rounds, inner=1, slow=rounds)
    cars = [said for said in calls if said != "fastsim"]
    rows = [Row(NAME, f"{said}, rtol {RTOL:g}", duration(times.median(said))) for said in cars]
    ratios = {said: times.ratio(said, "fastsim") for said in cars}
    return [*rows, *(at_most(NAME, f"{said}, in times of FASTSim", ratios[said], GOALS[said]) for said in cars)]
