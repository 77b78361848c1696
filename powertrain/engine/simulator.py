"""The simulator of one compiled model: consistent starts, runs, continued runs."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from powertrain.dae.friction import BACKWARD, FORWARD, STUCK
from powertrain.dae.hybrid import JUMPED, START, HybridDae
from powertrain.dae.tolerances import ZONE
from powertrain.engine.in_c import LoopInC
from powertrain.engine.loop import Progress, Run
from powertrain.engine.prepared import Compile, Method, Prepared, vector
from powertrain.engine.trajectory import Trajectory
from powertrain.errors import InitializationError, SimulationError
from powertrain.language.reals import Array
from powertrain.modes.algebra import NotConsistent
from powertrain.numerics.compiled import warn_of_cache

TOLERANCE = 1e-6
"""Default tolerance of a run, relative and in nominal sizes."""


class Simulator(Prepared):
    """Runs a :class:`HybridDae` any number of times. Functions are built on first use; one instance serves one thread.

    ``method``: "dopri5" (not stiff, no algebraic unknowns), "rodas5p" (stiff, algebraic unknowns) or "auto". "auto" starts with "dopri5" if
    possible; for stiff models it starts with "rodas5p" or changes to it. ``compile`` compiles the functions as C, "background" while runs
    continue, for runs that start later.
    """

    def __init__(self, dae: HybridDae, method: Method = "auto", compile: Compile = False) -> None:
        super().__init__(dae, method, compile)
        self._loops: dict[str, LoopInC | None] = {}

    def _in_c(self, method: str) -> LoopInC | None:
        """The loop in C for a method, if all that it needs is machine code."""
        if method not in self._loops and (code := self.machine_code(method)) is not None:
            self._loops[method] = None
            try:
                self._loops[method] = LoopInC(self, *code, explicit=method == "dopri5" and self.method == "auto")
            except OSError as error:
                warn_of_cache(error)
        return self._loops.get(method)

    def run(
        self,
        x0: ArrayLike,
        p: ArrayLike,
        m0: ArrayLike | None = None,
        z0: ArrayLike | None = None,
        *,
        start: float = 0.0,
        stop: float,
        rtol: float = TOLERANCE,
        atol: float = TOLERANCE,
        max_step: float = np.inf,
        progress: Progress | None = None,
    ) -> Trajectory:
        """Simulate from ``start`` to ``stop`` (s). Modes and algebraic unknowns at the start are found from the guesses.

        Raises SimulationError with the trajectory so far as ``result``, InitializationError if there is no consistent start.
        """
        if not stop >= start:
            raise ValueError(f"stop = {stop:g} s lies before start = {start:g} s")
        self.adopt()
        self._load(start, x0, z0, m0, p, rtol, atol)
        self._settle(start)
        return Run(self, start, stop, max_step, progress, self._in_c).execute()

    def resume(
        self,
        x: ArrayLike,
        p: ArrayLike,
        m: ArrayLike,
        z: ArrayLike,
        *,
        start: float,
        stop: float,
        rtol: float,
        atol: float,
        max_step: float,
        held: ArrayLike | None,
    ) -> Trajectory:
        """Continue from the end of another run, with its held values ``m``; ``held``: the new ones, if inputs have changed since.

        Raises SimulationError.
        """
        self._load(start, x, z, m, p, rtol, atol)
        self.memory.m[: self.sizes[2]] = vector("m", m, self.sizes[2])
        if held is not None:
            try:
                self._jump(start, vector("held", held, self.sizes[2]))
            except (NotConsistent, SimulationError) as error:
                said = str(error).removeprefix(f"at t = {start:.9g} s ")
                raise SimulationError(f"at t = {start:.9g} s {said}") from None
        return Run(self, start, stop, max_step, None, self._in_c).execute(resumed=held is None)

    def _jump(self, t: float, held: Array) -> None:
        """Give inputs other values. SimulationError if what may not jump follows them."""
        memory = self.memory
        self.rest[0]()
        memory.y[0][:] = memory.y[1]
        self.keep_left(t, 0)
        memory.m[: held.size] = held
        memory.fire.fill(0.0)
        self.resolver.resolve(0, JUMPED)
        self.admissible.check(0)
        self.check_jumps(t, 0)

    def resolve(self, t: float, x: ArrayLike, z: ArrayLike, m: ArrayLike, p: ArrayLike) -> tuple[Array, Array, Array]:
        """The modes of all laws at one instant, from the guess ``m``: consistent (x, z, m). Raises InitializationError."""
        self._load(t, x, z, m, p, TOLERANCE, TOLERANCE)
        self._settle(t)
        self.fresh[0]()
        n, nz, held, _ = self.sizes
        y = self.memory.y[1]
        return y[:n].copy(), y[n : n + nz].copy(), self.memory.m[:held].copy()

    def _guess_modes(self) -> None:
        """Let moving laws slide: with implicit unknowns, the equations may have no solution in other modes."""
        dae, memory = self.dae, self.memory
        for law, w in zip(dae.frictions, memory.frictions(0).w, strict=True):
            if not law.algebraic and memory.m[law.index] == STUCK and abs(w) > ZONE:
                memory.m[law.index] = FORWARD if w > 0.0 else BACKWARD

    def _settle(self, t: float) -> None:
        """Find the modes of a start on side 0 of the buffers."""
        if self.algebra is not None and self.dae.frictions:
            self._guess_modes()
        self.memory.fire.fill(0.0)
        self.resolver.notes.clear()
        self.fire(t)
        self._hold_one_way_laws()
        try:
            self._resolve_start()
            if self.overlaps is not None:
                self.overlaps.check_start(t, 0)
            self.admissible.check(0)
            self.resolver.check_unique(0)
        except (NotConsistent, SimulationError) as error:
            said = str(error).removeprefix(f"at t = {t:.9g} s ")
            raise InitializationError(f"start at t = {t:.9g} s: {said}") from None

    def _hold_one_way_laws(self) -> None:
        """Set to zero what little a freewheel turns backward: a start may be the end of another run."""
        memory = self.memory
        beyond = self.admissible.barely_beyond(0)
        if not beyond:
            return
        m = memory.m.copy()
        memory.m[[law.index for law in self.dae.frictions]] = FORWARD
        memory.m[beyond] = STUCK
        self.rest[0]()
        memory.y[0][:], memory.m[:] = memory.y[1], m

    def _resolve_start(self) -> None:
        m, y = self.memory.m.copy(), self.memory.y[0].copy()
        try:
            self.resolver.resolve(0, START)
        except SimulationError:
            self.memory.m[:], self.memory.y[0][:] = m, y
            self.admissible.check_speeds(0)
            raise
