"""A model that runs in a millisecond, and functions of its runs, for sweeps. Workers import this module by its name."""

from __future__ import annotations

import os
import signal
from typing import Any

import numpy as np

import powertrain as pt
from powertrain.components.rotational import Damper, Fixed, Inertia

STARTS = {"inertia.w": 10.0}


class SpinDown(pt.Component):
    """An inertia that a damper brakes: w = w0 exp(-d t/J)."""

    inertia: Inertia = Inertia(J=2.0)
    damper: Damper = Damper(d=0.5)
    ground: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.inertia.flange_b, self.damper.flange_a)
        yield pt.connect(self.damper.flange_b, self.ground.flange)


def cases(count: int) -> list[dict[str, Any]]:
    """Inertias from 1 to 4 kg.m2."""
    return [{"parameters": {"inertia.J": J}} for J in np.linspace(1.0, 4.0, count).tolist()]


def exact(count: int) -> np.ndarray[Any, Any]:
    """The speeds after a second."""
    return 10.0 * np.exp(-0.5 / np.linspace(1.0, 4.0, count))


def last_speed(run: pt.Result[Any]) -> float:
    return float(run["inertia.w"][-1])


def deadly_above_three(run: pt.Result[Any]) -> float:
    """Ends its process without a word."""
    if run.parameters["inertia.J"] > 3.0:
        os._exit(1)
    return last_speed(run)


def deadly_once(run: pt.Result[Any]) -> float:
    """Kills its process the first time that it is called for an inertia above 3 kg.m2."""
    flag = os.environ["POWERTRAIN_TEST_FLAG"]
    if run.parameters["inertia.J"] > 3.0 and not os.path.exists(flag):  # noqa: PTH110
        open(flag, "w").close()  # noqa: PTH123
        os.kill(os.getpid(), signal.SIGKILL)
    return last_speed(run)


def broken_above_three(run: pt.Result[Any]) -> float:
    return 1.0 / (run.parameters["inertia.J"] <= 3.0)


def interrupted_above_three(run: pt.Result[Any]) -> float:
    if run.parameters["inertia.J"] > 3.0 and "POWERTRAIN_TEST_FLAG" not in os.environ:
        raise KeyboardInterrupt
    return last_speed(run)


def two_numbers(run: pt.Result[Any]) -> Any:
    return run["inertia.w"][:2]
