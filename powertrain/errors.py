"""What can go wrong, in the user's terms: the component, the quoted line or the value with its unit, what is wrong, what to do."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from typing import Any


class PowertrainError(Exception):
    """Base class of all errors that the library raises on purpose. If the error ended a sweep, ``sweep`` holds the cases so far."""

    sweep: Any = None


class ModelError(PowertrainError):
    """The model is wrong; the message names components and quotes their source lines."""


class ParameterError(PowertrainError):
    """A value is missing, unknown or outside its range."""


class InitializationError(PowertrainError):
    """No consistent initial state was found; the message names the conditions."""


class SimulationError(PowertrainError):
    """The simulation ended early; ``result`` holds the run up to that instant."""

    def __init__(self, message: str, result: Any = None) -> None:
        super().__init__(message)
        self.result = result


PART = 3
"""Letters from which a name is sought within others."""


def suggestion(name: str, known: Iterable[str], fields: Mapping[str, Any] | None = None) -> str:
    """'; did you mean ...?' with up to three near misses of ``name``, or '' where nothing is near.

    First come those of ``fields`` whose description begins with the name: mass is m, "Mass of the vehicle". Last come those that
    contain it: golf is volkswagen-golf-gti-manual.
    """
    known, begins = list(dict.fromkeys(known)), name.replace("_", " ").lower() + " "
    near = [k for k, spec in (fields or {}).items() if str(getattr(spec, "doc", "")).lower().startswith(begins)][:3]
    if near:
        return f"; did you mean {' or '.join(near)}?"
    near = [k for k in known if k.lower() == name.lower()] or difflib.get_close_matches(name, known, n=3, cutoff=0.5)
    near += [k for k in known if k not in near and k.rpartition(".")[2] == name.rpartition(".")[2]][: 3 - len(near)]
    near = near or [k for k in known if len(name) >= PART and name.lower() in k.lower()][:3]
    return f"; did you mean {' or '.join(near)}?" if near else ""
