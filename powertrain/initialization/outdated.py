"""Values of a run that the model does not know everywhere: what was computed when it was compiled keeps the values it was made with."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.assemble import Compiled
from powertrain.initialization.uniqueness import listed
from powertrain.language.units import with_unit


def outdated(compiled: Compiled, p: NDArray[np.float64]) -> tuple[str, ...]:
    """A note on parameters that have other values in this run than in the tables and limits of the model; none without such parameters."""
    evaluated = compiled.source.recorder.evaluated
    changed = [
        f"{name} = {with_unit(f'{constant.value:g}', constant.unit)}"
        for (name, constant), value in zip(compiled.parameters.items(), p.tolist(), strict=True)
        if name in evaluated and value != constant.value
    ]
    if not changed:
        return ()
    return (
        f"tables and limits that were computed when the model was compiled are those for {listed(changed)}, "
        "not for the values of this run; pt.replace makes a model that has the new values everywhere",
    )
