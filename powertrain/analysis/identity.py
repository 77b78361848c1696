"""Whether two computations are the same: hashes of values, of functions by their code, and of compiled models by their equations."""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from functools import partial
from types import CodeType, FunctionType
from typing import Any

import casadi as ca
import numpy as np

from powertrain.compiler.assemble import Compiled
from powertrain.errors import ParameterError
from powertrain.language.symbols import column

CONSTANTS = bool, int, float, str, bytes, tuple, np.ndarray, np.generic
"""Values of a module on which the result of a function may depend; other objects may change while it runs."""


def identity(*values: Any) -> str:
    """A hash of numbers, strings, arrays and functions, and of mappings and sequences of them. The same in every process.

    A function is its code, its defaults, the values it holds, and the constants and functions of its module that it names.
    """
    content = hashlib.sha256()
    for piece in _pieces(values):
        content.update(b"%d:" % len(piece))
        content.update(piece)
    return content.hexdigest()


def model_identity(compiled: Compiled) -> str:
    """A hash of the equations, laws, signals, parameters and start conditions of a compiled model."""
    dae = compiled.dae
    expressions: list[ca.SX] = []
    rest = _without_expressions(dae, expressions)
    expressions.append(column([entry.expression for entry in compiled.signals.values()]))
    given = dae.opened.tau if dae.opened else ca.SX(0, 1)
    equations = ca.Function("powertrain_identity", [*dae.arguments, given], expressions)
    starts = (
        [(u.name, u.start, u.guess) for u in compiled.variables.values()],
        [str(e.residual) for e in compiled.source.initial],
    )
    texts = [(name, entry.unit, entry.doc) for name, entry in compiled.signals.items()]
    values = [(name, c.value, c.unit) for name, c in compiled.parameters.items()]
    return identity(equations.serialize(), rest, texts, values, starts)


def _named(function: FunctionType) -> dict[str, Any]:
    """The constants and functions of its module that a function names, and what these name in turn."""
    found, waiting = dict[str, Any](), [function.__code__]
    while waiting:
        code = waiting.pop()
        waiting += [inner for inner in code.co_consts if isinstance(inner, CodeType)]
        for name in set(code.co_names) - found.keys():
            value = function.__globals__.get(name)
            if isinstance(value, FunctionType) and value.__globals__ is function.__globals__:
                found[name] = value.__code__, value.__defaults__, value.__kwdefaults__
                waiting.append(value.__code__)
            elif isinstance(value, CONSTANTS):
                found[name] = value
    return found


def _without_expressions(value: Any, expressions: list[ca.SX]) -> Any:
    """The content of nested records; expressions in it are moved to ``expressions`` and leave a placeholder."""
    if isinstance(value, ca.SX):
        expressions.append(value)
        return len(expressions)
    if isinstance(value, tuple):
        return [_without_expressions(item, expressions) for item in value]
    if is_dataclass(value):
        return type(value).__name__, [_without_expressions(getattr(value, f.name), expressions) for f in fields(value)]
    return value


def _pieces(value: Any) -> Iterator[bytes]:
    """The content of a value, preceded by its kind and size."""
    if isinstance(value, np.ndarray):
        yield f"array {value.dtype.str} {value.shape}".encode()
        yield value.tobytes()
    elif isinstance(value, Mapping):
        yield f"mapping {len(value)}".encode()
        for name in sorted(value, key=repr):
            yield from _pieces(name)
            yield from _pieces(value[name])
    elif isinstance(value, list | tuple | set | frozenset):
        value = sorted(value, key=repr) if isinstance(value, set | frozenset) else value
        yield f"sequence {len(value)}".encode()
        for item in value:
            yield from _pieces(item)
    elif isinstance(value, FunctionType):
        cells = dict(zip(value.__code__.co_freevars, value.__closure__ or (), strict=True))
        held = {name: cell.cell_contents for name, cell in cells.items() if name != value.__name__}
        yield from _pieces((value.__code__, value.__defaults__, value.__kwdefaults__, held, _named(value)))
    elif isinstance(value, CodeType):
        yield from _pieces((value.co_code, value.co_names, value.co_consts))
    elif isinstance(value, partial):
        yield from _pieces((value.func, value.args, value.keywords))
    elif value is None or isinstance(value, bool | int | float | str | bytes | np.generic):
        yield repr(value).encode()
    else:
        try:
            yield pickle.dumps(value)
        except Exception as error:
            raise ParameterError(f"cannot tell whether {value!r} is the same in another process: {error}") from None
