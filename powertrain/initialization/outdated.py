"""Values that the model does not know everywhere: what was computed when it was compiled keeps the values it was made with."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from powertrain.compiler.assemble import Compiled
from powertrain.language.units import with_unit

_SHOWN = 3
_COMPUTED = "tables and limits that were computed when the model was compiled"


def outdated(compiled: Compiled, values: Mapping[str, ArrayLike]) -> tuple[str, ...]:
    """A note on parameters with other values than in the tables and limits of the model; none without such parameters."""
    changed = _in_tables(
        compiled, [n for n, v in values.items() if np.any(np.asarray(v) != compiled.parameters[n].value)]
    )
    if not changed:
        return ()
    return (
        f"{_COMPUTED} are those for {listed(changed)}, not for the given values; "
        "pt.replace makes a model that has the new values everywhere",
    )


def constant_in_tables(compiled: Compiled, names: Iterable[str]) -> tuple[str, ...]:
    """A note on parameters whose derivatives leave out the tables and limits of the model; none without such parameters."""
    found = _in_tables(compiled, names)
    return (f"without the change of {_COMPUTED}, for {listed(found)}",) if found else ()


def _in_tables(compiled: Compiled, names: Iterable[str]) -> list[str]:
    """Those of the parameters that tables or limits were computed with, and their values there."""
    found = [(n, compiled.parameters[n]) for n in names if n in compiled.source.recorder.evaluated]
    return [f"{name} = {with_unit(f'{constant.value:g}', constant.unit)}" for name, constant in found]


def listed(names: Sequence[str]) -> str:
    """Names for a sentence, the first few of many."""
    *first, last = [*names[:_SHOWN], f"{len(names) - _SHOWN} more"] if len(names) > _SHOWN else names
    return f"{', '.join(first)} and {last}" if first else last
