"""A run at the time that it has reached, and a progress bar that shows it."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from typing import Any, Generic, TypeVar

import numpy as np

from powertrain.compiler.assemble import Compiled
from powertrain.engine.loop import Progress
from powertrain.engine.trajectory import Samples
from powertrain.errors import ParameterError
from powertrain.language.component import Component
from powertrain.language.reals import Array
from powertrain.numerics.background import progress as building
from powertrain.signals import Signals, signals_of

M = TypeVar("M", bound=Component)


class Present(Generic[M]):
    """A run at the time that it has reached: ``now.time`` in s, ``now["body.v"]`` the value of a signal (selectors work, too)."""

    def __init__(self, signals: Signals, t: float, x: Array, z: Array, m: Array, p: Array) -> None:
        self.time = t
        self._signals, self._p = signals, p
        self._sample = Samples(np.array([t]), x[None], z[None], m[None])

    def __getitem__(self, what: str | Callable[[M], Any]) -> float:
        """The present value of a signal or of an expression of signals. ParameterError for an unknown name."""
        return float(self._signals.values(self._signals.pick(what), self._sample, self._p)[0])

    def __repr__(self) -> str:
        return f"Present({type(self._signals.model).__name__} at t = {self.time:g} s)"


Watch = Callable[[Present[Any]], None]


class Bar:
    """A progress bar over the time of a simulation (s), with what ``say`` tells of the present."""

    def __init__(self, start: float, stop: float, say: Callable[[Present[Any]], str] | None = None) -> None:
        self._start, self._say, self._bar = start, say, _bar(start, stop)

    def __call__(self, now: Present[Any]) -> None:
        """Show the time reached."""
        texts = (self._say(now) if self._say is not None else "", building())
        self._bar.set_postfix_str(", ".join(text for text in texts if text), refresh=False)
        self._bar.update(now.time - self._start - self._bar.n)

    def close(self) -> None:
        """Leave it as it is."""
        self._bar.close()


def watcher(progress: bool | Watch, start: float, stop: float) -> Watch | None:
    """What is told how far a run is: a function that is given, a bar, or None. ParameterError for anything else."""
    if callable(progress):
        return progress
    if not isinstance(progress, bool):
        raise ParameterError(
            f"progress = {progress!r} must be True or False, or a function of the run at the time reached"
        )
    return Bar(start, stop) if progress else None


def told(compiled: Compiled, p: Array, watch: Watch | None) -> Progress | None:
    """How the engine tells how far it is."""
    if watch is None:
        return None
    signals, n = signals_of(compiled), compiled.dae.x.numel()
    nz, held = compiled.dae.z.numel(), compiled.dae.m.numel()

    def tell(t: float, y: Array, m: Array) -> None:
        y, m = y.copy(), m.copy()
        watch(Present(signals, t, y[:n], y[n : n + nz], m[:held], p))

    return tell


def _bar(start: float, stop: float) -> Any:
    """A bar in thousandths of the duration or coarser."""
    with warnings.catch_warnings():
        warnings.filterwarnings(
            "ignore", message="IProgress not found"
        )  # a notebook without widgets gets a bar of text
        from tqdm.auto import tqdm

    decimals = max(0, 3 - math.ceil(math.log10(stop - start))) if stop > start else 0
    number = f":.{decimals}f"
    shown = (
        f"{{percentage:3.0f}} %|{{bar}}| {{n{number}}} of {{total{number}}} s [{{elapsed}}<{{remaining}}{{postfix}}]"
    )
    return tqdm(total=stop - start, bar_format=shown)
