"""The functions and arrays for simulating one compiled model, built on first use."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Literal, get_args

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from powertrain.dae.hybrid import Guard, HybridDae, Switch
from powertrain.dae.switch import timed
from powertrain.engine.catalogue import catalogue
from powertrain.engine.continuity import Continuity
from powertrain.engine.location import Locator
from powertrain.engine.overlaps import Overlaps
from powertrain.engine.schedules import Schedules, just_after
from powertrain.engine.waves import Waves
from powertrain.engine.zeno import Zeno, resetting
from powertrain.errors import InitializationError, ParameterError
from powertrain.integration import fused as steps
from powertrain.integration.parts import Parts, in_parts
from powertrain.integration.specialized import Calls, SpecialSteps, for_modes
from powertrain.language.arguments import one_of
from powertrain.language.reals import Array
from powertrain.modes import resting
from powertrain.modes.admissible import Admissible
from powertrain.modes.algebra import AlgebraicSolver, NotConsistent
from powertrain.modes.discontinuities import reset_values
from powertrain.modes.indicators import Indicator, indicators
from powertrain.modes.resolve import ModeResolver
from powertrain.numerics.background import Builds, Install
from powertrain.numerics.buffers import Call, Evaluated, Memory, bound
from powertrain.numerics.compiled import Compilable, Library, compile_functions
from powertrain.numerics.pivots import match_rows

Method = Literal["auto", "dopri5", "rodas5p"]
Compile = bool | Literal["background"]
"""Whether functions are compiled as C; "background": while runs continue, for runs that start later."""
_LARGE = 100
"""Above this number of unknowns, linear systems are solved numerically instead of by expressions."""
_MANY = 50
"""Above this number of unknowns, a step calls functions and adds vectors instead of using one instruction per number."""
_LONG = 8000
"""Above this number of instructions, machine code of a step also calls functions: written out it compiles and runs more slowly."""
_FEW = 10
"""Above this number of implicit unknowns, Python marks the laws that others hold at rest: expressions grow with its third power."""
_EXPLICIT_STEPS = 5000.0
"""A run starts with the implicit method if stability alone would require more explicit steps than this."""


class Prepared:
    """The functions of a :class:`HybridDae`, bound to one memory; ``engine`` and ``loop`` call them."""

    def __init__(self, dae: HybridDae, method: Method, compile: Compile) -> None:
        one_of("method", method, get_args(Method))
        if method == "dopri5" and dae.z.numel():
            raise ParameterError(
                "method='dopri5' is explicit, but the model has algebraic unknowns; use 'rodas5p' or 'auto'"
            )
        self.dae, self.method, self.compile = dae, method, compile
        self.indicators: tuple[Indicator, ...] = indicators(dae)
        self.guard_places = [k for k, indicator in enumerate(self.indicators) if isinstance(indicator.law, Guard)]
        self.bends = _bends(self.indicators)
        self.waves = Waves(dae, self.indicators)
        self._turning = bool(dae.schedules or self.bends)
        self.timed = timed(dae)[1]
        self.sizes = (dae.x.numel(), dae.z.numel(), dae.m.numel(), dae.p.numel())
        self.large = sum(self.sizes[:2]) > _LARGE  # linear systems are solved numerically
        self.catalogue = catalogue(dae)
        self.schedules = Schedules(dae.schedules)
        self.memory = Memory(dae, len(self.indicators), len(self.timed))
        self.algebra = AlgebraicSolver(dae, self.memory) if dae.z.numel() else None
        self._steps: dict[str, Calls] = {}
        self._machine_code: dict[str, Library] = {}
        self._builds = Builds()
        self._functions: dict[str, ca.Function] = {}
        self._general: dict[str, ca.Function] = {}
        self.special = SpecialSteps(self.catalogue.modes, self._special)
        self._ready = False
        self.continuity = Continuity(dae, self.memory) if dae.smooth else None
        self.overlaps = Overlaps(dae, self.memory) if dae.contacts else None
        self.zeno = Zeno(dae, self.memory) if resetting(dae) else None

    def stepper(self, name: str, numeric: bool = False) -> Calls:
        """The step of a method from either side of the double buffer; ``numeric`` uses the sparse solver with pivoting at run time."""
        if name == "rodas5p" and (numeric or self.large):
            name = "sparse"
        if name not in self._steps:
            if name == "sparse":
                from powertrain.integration.sparse_step import SparseStep

                self._steps[name] = [*SparseStep(self._model, self.memory).calls]
            else:
                self._steps[name] = self._step(name)
        return self._steps[name]

    def machine_code(self, method: str) -> tuple[Library, Library] | None:
        """The step of a method and the other functions of the loop, if all of them are machine code."""
        step, others = self._machine_code.get(method), self._functions
        return (step, others) if step is not None and isinstance(others, Library) else None

    @property
    def specializes(self) -> bool:
        """Whether steps for given modes are worth building: machine code and long vectors gain little from fewer instructions."""
        return not self.compile and sum(self.sizes[:2]) <= _MANY

    def _special(self, method: str, modes: list[float]) -> Calls:
        """The step for given modes."""
        function = for_modes(self._general[method], self.catalogue.modes, modes)
        return self._bound({method: function}, method)

    def _step(self, method: str) -> Calls:
        """The step for any modes."""
        written = self._written(method)
        calls: Calls = []

        def install(functions: dict[str, ca.Function]) -> None:
            calls[:] = self._bound(functions, method)

        if written is not None:
            self._general[method] = written
        if written is not None and not (self.compile and _long(written)):
            install(self._finished({method: written}, {method: written}, install))
            return calls
        model = self._in_calls()
        whole = {method: steps.step(model, method) if written is None else written} if self.compile is not True else {}
        install(self._finished(whole, in_parts(model, method), install) if self.compile else whole)
        return calls

    def _written(self, method: str) -> ca.Function | None:
        """The step as a list of instructions, for few unknowns."""
        return steps.step(self._model, method) if sum(self.sizes[:2]) <= _MANY else None

    def first_method(self, span: float) -> str:
        """The method with which a run starts, from the initial values in memory."""
        if self.method != "auto":
            return self.method
        if self.algebra is not None or self.large:
            return "rodas5p"
        (slopes,) = self._slopes(*self.memory.instant(0))
        size = float(np.abs(slopes).sum(axis=1).max(initial=0.0))
        if not size < np.inf or size * span < _EXPLICIT_STEPS:
            return "dopri5"
        radius = float(np.abs(np.linalg.eigvals(slopes)).max())
        return "rodas5p" if radius * span > 2.5 * _EXPLICIT_STEPS else "dopri5"

    @cached_property
    def _slopes(self) -> Evaluated:
        return Evaluated(self.dae.function("stiffness", ca.jacobian(self.dae.xdot, self.dae.x)))

    def _bound(self, functions: dict[str, ca.Function], method: str) -> Calls:
        """A step from either side of the double buffer."""
        if isinstance(functions, Library):
            self._machine_code[method] = functions
        if "advance" in functions:
            return Parts(functions, self.memory).calls
        return [self._bind_step(functions[method], side) for side in (0, 1)]

    def _bind_step(self, function: ca.Function, side: int) -> Call:
        memory, other = self.memory, 1 - side
        arguments = [memory.time, memory.y[side], memory.m, memory.p, memory.reached[side], memory.tolerance]
        results = [memory.y[other], memory.reached[other], memory.info, memory.dense, memory.outside]
        return bound(function, arguments, results)

    def _load(
        self, t: float, x: ArrayLike, z: ArrayLike | None, m: ArrayLike | None, p: ArrayLike, rtol: float, atol: float
    ) -> None:
        memory, (n, nz, held, parameters) = self.memory, self.sizes
        y = memory.y[0]
        y[:n] = vector("x", x, n)
        y[n : n + nz] = 0.0 if z is None else vector("z", z, nz)
        memory.m[:held] = vector("m", self.dae.held_start if m is None else m, held)
        memory.p[:parameters] = vector("p", p, parameters)
        memory.time[:] = t, 0.0
        memory.tolerance[:] = rtol, atol
        if self.schedules:
            self.schedules.enter(memory.m, t)
        if self.algebra is not None and not self._ready:
            self._solve_start(t)
        if not self._ready:
            self._build()

    def _solve_start(self, t: float) -> None:
        """Solve for the algebraic unknowns at which pivots are chosen; while modes are unknown there may be no solution."""
        assert self.algebra is not None
        guess = self.memory.y[0].copy()
        try:
            self.algebra.solve(0)
        except NotConsistent as error:
            if not (self.dae.frictions or self.dae.switches or self.dae.contacts):
                raise InitializationError(f"at t = {t:.9g} s {error}") from None
            self.memory.y[0][:] = guess

    def fire(self, t: float) -> None:
        """Mark the timed laws whose instant is ``t``, within rounding."""
        near = just_after(t) - t
        for k, instant in enumerate(self._known_instants()):
            if abs(instant - t) <= near:
                self.memory.fire[k] = 1.0

    def next_instant(self, t: float) -> float:
        """The first known instant of a timed law after ``t``."""
        after = just_after(t)
        later = [instant for instant in self._known_instants() if instant > after]
        return min(later) if later else np.inf

    def _known_instants(self) -> list[float]:
        """The instants of the timed laws for the present held values."""
        if not self.timed:
            return []
        self.instants()
        instants: list[float] = self.memory.instants.tolist()
        return instants

    @cached_property
    def _model(self) -> steps.Model:
        if self.algebra is None:
            return steps.Model(self.dae)
        pattern = ca.jacobian(self.dae.residual, self.dae.z).sparsity()
        try:
            return steps.Model(self.dae, match_rows(pattern, self.algebra.equations(0)[0]))
        except ValueError as error:
            raise InitializationError(f"the algebraic equations are {error}") from None

    def _in_calls(self) -> steps.Model:
        """The model as functions that are called."""
        return steps.Model(self.dae, self._model.rows, ca.MX)

    def _build(self) -> None:
        """Build and bind what every method needs."""
        memory = self.memory
        if not self._functions:
            called = self._called()
            fast = {name: steps.short(function) for name, function in called.items()} if self.compile else called
            if self.compile and self.sizes[1] <= _FEW:
                fast |= self._marking()
            self._functions = self._finished(called, fast, self._rebuild)
        functions, m, p = self._functions, memory.m, memory.p

        def both(name: str, given: Sequence[Array], results: Sequence[Array], reached: bool = False) -> list[Call]:
            """A function from either side of the double buffer; with ``reached``, y and this on the other side come before its results."""
            others = [[memory.y[k], memory.reached[k]] if reached else [] for k in (1, 0)]
            return [
                bound(functions[name], [memory.time, y, m, p, *given], [*other, *results])
                for y, other in zip(memory.y, others, strict=True)
            ]

        self.fresh = both("fresh", [memory.tolerance], [memory.start], reached=True)
        self.rest = [bound(functions["rest"], [memory.time, memory.y[k], m, p], [memory.y[1 - k]]) for k in (0, 1)]
        located = [memory.time, memory.fraction, memory.above, memory.dense, m, p]
        self.locator = Locator(bound(functions["locate"], located, [memory.at, memory.g, memory.worst]), memory)
        results = [memory.held, memory.flags, memory.edges, memory.closing]
        update = both("update", [memory.fire, memory.jumped], results)
        if self.timed:
            self.instants = bound(functions["instants"], [m, p], [memory.instants])
        if self._turning:
            self.corner = both("corner", [], [memory.corner], reached=True)
        if self.algebra is not None and "newton" in functions:
            self.algebra.hasten(functions["newton"])
        carry = self.continuity.carry if self.continuity is not None else lambda _: False
        self.resolver = ModeResolver(self.dae, memory, update, self.fresh, self.algebra, carry)
        self.admissible = Admissible(self.dae, memory, self.resolver.notes)
        self._ready = True

    def keep_left(self, t: float, side: int) -> None:
        """Keep what may not jump at an event, as it is before it."""
        if self.continuity is not None:
            self.continuity.before(side)
        if self.overlaps is not None and self.overlaps.may_jump:
            self.overlaps.before(t, side)

    def check_jumps(self, t: float, side: int) -> None:
        """SimulationError if something has jumped that may not."""
        if self.continuity is not None:
            self.continuity.check(side, bool(self.resolver.extra))
        if self.overlaps is not None and self.overlaps.may_jump:
            self.overlaps.check(t, side)

    def _called(self) -> dict[str, ca.Function]:
        """The functions that both loops call besides steps, by name."""
        model = self._model
        functions = {"fresh": steps.fresh(model), "rest": steps.rest(model)}
        functions |= {"locate": steps.locate(model), "update": steps.update(model)}
        if self.timed:
            functions["instants"] = steps.instants(self.dae)
        if self._turning:
            functions["corner"] = steps.corner(model)
        if self.waves:
            functions["longest"] = self.waves.function
        if 0 < self.sizes[1] <= _LARGE:
            functions["newton"] = steps.newton(model)
        return functions

    def _marking(self) -> dict[str, ca.Function]:
        """What the loop in C needs to mark the laws at a limit that others hold at rest."""
        mobility = resting.mobility(self.dae)
        return {} if mobility is None else {"mobility": mobility}

    def functions(self, method: str) -> dict[str, ca.Function]:
        """All functions of a run with one method, for other drivers than ``loop``; a start must have been loaded."""
        step = self._written(method)
        if step is None or _long(step):
            step = steps.step(self._in_calls(), method)
        called = {name: steps.short(function) for name, function in self._called().items()}
        found = {"method": step} | called | self._marking()
        if self.dae.whens:
            found["resets"] = reset_values(self.dae)
        return found

    def _finished(
        self, functions: dict[str, ca.Function], fast: Mapping[str, Compilable], install: Install
    ) -> dict[str, ca.Function]:
        """The functions to start with; the compiled ones, ``fast``, are passed to ``install`` when they are ready later."""
        if self.compile == "background":
            return self._builds.finished(functions, fast, install)
        return compile_functions(fast) if self.compile else functions

    def _rebuild(self, functions: dict[str, ca.Function]) -> None:
        """Bind the compiled functions at the next start."""
        self._functions, self._ready = functions, False

    def adopt(self) -> None:
        """Use the machine code that was built since the last run."""
        self._builds.adopt()


def _long(step: ca.Function) -> bool:
    return bool(step.n_instructions() > _LONG)


def _bends(indicators: Sequence[Indicator]) -> dict[int, int]:
    """Indicators of laws whose values have a kink but no jump: index of the indicator -> index of the law's mode."""
    laws = [(k, indicator.law) for k, indicator in enumerate(indicators)]
    return {k: law.index for k, law in laws if isinstance(law, Switch) and law.continuous}


def vector(name: str, values: ArrayLike, size: int) -> Array:
    """The numbers as a flat array of this size. Raises ValueError if the size differs."""
    vector = np.asarray(values, dtype=np.float64).ravel()
    if vector.size != size:
        raise ValueError(f"{name} has {vector.size} entries instead of {size}")
    return vector
