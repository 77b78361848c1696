"""Reads the equations of a component: what it yields with its line, and its exceptions as ModelErrors."""

from __future__ import annotations

import dis
import traceback
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from inspect import isgeneratorfunction
from itertools import pairwise
from pathlib import Path
from typing import Any

import casadi as ca

from powertrain.errors import ModelError, PowertrainError, suggestion
from powertrain.language.component import Component
from powertrain.language.connectors import of_a_signal
from powertrain.language.fields import Frozen
from powertrain.language.recorder import Place, Recorder
from powertrain.language.symbols import Symbol

_POWERTRAIN = Path(__file__).parents[1]
_NOT_SOURCE = tuple(
    map(str, (Path(__file__).parent, _POWERTRAIN / "language", _POWERTRAIN / "__init__.py", Path(ca.__file__).parent))
)
"""Where the lines of a traceback are not those of a model."""
_DROPPED = bytes((dis.opmap["COMPARE_OP"], dis.opmap["POP_TOP"]))
_CACHE = bytes((dis.opmap["CACHE"],))
"""Fills the places between two instructions."""


def read(component: Component, text: Any, active: Recorder) -> Iterator[tuple[Place, Any]]:
    """What the equations of a component yield, with the source line."""
    active.path, active.text = component._path, text
    where = component._path or "the model"
    if not isinstance(text, Iterable) or isinstance(text, ca.SX):
        raise ModelError(
            _not_yielded(active, where)
            or f"{where}: the equations of {type(component).__name__} are {text!r}; an equation is written  yield a == b"
        )
    if dropped := _dropped_comparison(type(component)):
        place = Place(component._path, *dropped)
        raise ModelError(f"{place}: a comparison has no effect without yield; write  yield a == b")
    with guarded(component):
        for row in text:
            active.yielded(row)
            yield active.place, row
    if said := _not_yielded(active):
        raise ModelError(said)


def _not_yielded(active: Recorder, where: str = "") -> str:
    """The message for a law written without ``yield``; ``where`` replaces an unknown line."""
    if not active.written:
        return ""
    place, word, _ = active.written[0]
    return f"{where or place}: {word}(...) has no effect without yield; write  yield {word}(...)"


@lru_cache(maxsize=4096)
def _dropped_comparison(kind: type) -> tuple[str, int] | None:
    """File and line of the first comparison whose value Python drops, in the methods of a class that yield its equations.

    Such a statement is  self.w == 0  without ``yield``.
    """
    for function in (f for base in kind.__mro__ for f in vars(base).values() if isgeneratorfunction(f)):
        code = function.__code__
        if _DROPPED not in code.co_code[::2].replace(_CACHE, b""):
            continue
        found = list(dis.get_instructions(code))
        for instruction, after in pairwise(found):
            positions = instruction.positions
            if (instruction.opname, after.opname) == ("COMPARE_OP", "POP_TOP") and positions and positions.lineno:
                return code.co_filename, positions.lineno
    return None


@contextmanager
def guarded(component: Component) -> Iterator[None]:
    """Turn exceptions in a component's equations into a ModelError with the component and the line."""
    try:
        yield
    except PowertrainError:
        raise
    except Exception as error:
        inner: BaseException | None = error
        while inner is not None and not isinstance(inner, PowertrainError):
            inner = inner.__cause__ or inner.__context__
        if inner is not None:  # a library has replaced our message by its own
            raise inner from None
        raise ModelError(f"{_raised_at(error, component._path)}: {_reason(error)}") from error


def _reason(error: Exception) -> str:
    """The meaning of an exception in a component's equations."""
    owner = error.obj if isinstance(error, AttributeError) else None
    if isinstance(error, RuntimeError) and "truth value" in str(error):
        return (
            "a Python if/and/or/not, max or min cannot decide on a symbol; use switch(condition, a, b), casadi.logic_and, "
            "casadi.logic_or, casadi.logic_not, casadi.fmax or casadi.fmin"
        )
    if isinstance(error, Frozen):
        return f"{error.name} cannot be assigned a value; an equation is written  yield a == b"
    if isinstance(owner, Component):
        known = list(owner._fields)
        return (
            f"{owner._path or 'the model'} ({type(owner).__name__}) has no {error.name}"  # type: ignore[attr-defined]
            f"{suggestion(str(error.name), known)} (it has {', '.join(known)})"  # type: ignore[attr-defined]
        )
    if "Possible prototypes" in str(error):  # CasADi lists all signatures
        said = str(error).splitlines()
        had = next((line.strip() for line in said if "You have" in line), "")
        return f"CasADi cannot compute this: {said[0].rstrip('.')} {had}"
    if isinstance(error, RecursionError):
        return "this calls itself without end"
    return of_a_signal(error) or f"this raises {type(error).__name__}: {error}"


def _raised_at(error: BaseException, path: str) -> Place:
    """The last line of the model's source in a traceback."""
    inner = [f for f in traceback.extract_tb(error.__traceback__) if not f.filename.startswith(_NOT_SOURCE)]
    return Place(path, inner[-1].filename, inner[-1].lineno or 0) if inner else Place(path)


def residual_of(row: Any, place: Place) -> Symbol:
    """Left - right of an equation; ModelError for anything else."""
    if isinstance(row, bool | int | float):
        raise ModelError(
            f"{place}: this is the plain value {row!r}, not an equation between symbols; the value of a signal is written "
            "signal.value, and a string is not a symbol"
        )
    if not isinstance(row, ca.SX):
        raise ModelError(f"{place}: yields {type(row).__name__}; an equation is written  a == b")
    if not row.is_scalar():
        rows = " x ".join(map(str, row.shape))
        raise ModelError(f"{place}: an equation is between single expressions, this one has {rows}; yield one for each")
    if row.is_constant():
        same = "both sides are the same" if float(row) else "the two sides are different numbers"
        raise ModelError(f"{place}: {same}, so this says nothing about the model")
    if not row.is_op(ca.OP_EQ):
        raise ModelError(f"{place}: {row} is not an equation; an equation is written  a == b")
    return row.dep(0) - row.dep(1)
