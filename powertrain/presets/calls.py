"""Calls in parameter files and options: their arguments, and the functions that give maps."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import powertrain as pt
from powertrain.errors import suggestion


def map_of(text: str, folder: Path) -> pt.Map:
    """The map that a call gives: ``cells_in_series(96)``, ``read_fuel_map('fuel.csv', fill=True)``; files are relative to ``folder``.

    Errors: ValueError for another text or function, and for arguments that it does not take; ParameterError of the function.
    """
    from powertrain.components.electric import cells_in_series
    from powertrain.components.engines import read_fuel_map, read_torque_map

    functions: dict[str, Callable[..., pt.Map]] = {
        f.__name__: f for f in (cells_in_series, read_fuel_map, read_torque_map)
    }
    try:
        node = ast.parse(text.strip(), mode="eval").body
    except SyntaxError as error:
        raise ValueError(error.msg) from None
    if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Name) or node.func.id not in functions:
        name = text.partition("(")[0].strip()
        raise ValueError(
            f"there is no function {name!r} that gives a map{suggestion(name, functions)}; choose from {', '.join(functions)}"
        )
    function = functions[node.func.id]
    arguments = [ast.literal_eval(value) for value in node.args]
    named = {str(k.arg): ast.literal_eval(k.value) for k in node.keywords}
    arguments, named = located(function, arguments, named, folder)
    try:
        return function(*arguments, **named)
    except TypeError as error:
        raise ValueError(f"{error}; it takes {', '.join(inspect.signature(function).parameters)}") from None


def located(
    maker: Callable[..., Any], arguments: list[Any], named: dict[str, Any], folder: Path
) -> tuple[list[Any], dict[str, Any]]:
    """The arguments of a maker with the names of files relative to a folder: its signature says which take a path."""
    parameters = inspect.signature(maker).parameters
    files = [name for name, parameter in parameters.items() if re.search(r"\bPath\b", str(parameter.annotation))]

    def at(name: str, value: Any) -> Any:
        return folder / value if name in files and isinstance(value, str) else value

    names = [*parameters, *(len(arguments) * [""])]  # too many arguments are refused by the maker
    placed = [at(name, value) for name, value in zip(names, arguments, strict=False)]
    return placed, {name: at(name, value) for name, value in named.items()}
