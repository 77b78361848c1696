"""Models for other processes."""

from __future__ import annotations

import pickle
from typing import Any

from powertrain.errors import ParameterError
from powertrain.language.component import Component, children


def packed_model(model: Component) -> bytes:
    """The pickled model; ParameterError names the part whose field cannot be sent to another process."""
    try:
        return pickle.dumps(model)
    except Exception as error:
        where, value = _unpicklable(model, type(model).__name__)
        raise ParameterError(
            f"{where} = {value!r} cannot be sent to another process ({error}); a function must be defined at the top level of a module"
        ) from error


def _unpicklable(component: Component, path: str) -> tuple[str, Any]:
    """The first field, down the tree, that does not pickle."""
    parts = dict(children(component))
    for name, value in component._values.items():
        if not isinstance(value, Component) and not any(part.startswith(f"{name}[") for part in parts):
            try:
                pickle.dumps(value)
            except Exception:
                return f"{path}.{name}", value
    for name, part in parts.items():
        try:
            pickle.dumps(part)
        except Exception:
            return _unpicklable(part, f"{path}.{name}")
    return path, type(component)
