"""Natural frequencies, damping and shapes of the vibrations of a model at an operating point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from powertrain.analysis.linearization import Point, Selector, linearize
from powertrain.arguments import listed
from powertrain.component import Component
from powertrain.errors import ParameterError
from powertrain.plant import Plant

if TYPE_CHECKING:
    import xarray as xr

_STILL = 1e-9
"""Imaginary parts below this share of the largest eigenvalue, and amplitudes below this share of the eigenvector, are round-off."""


def eigenmodes(
    plant: Plant[Any] | Component,
    shapes: Sequence[Selector] | None = None,
    *,
    at: Point | None = None,
    parameters: Mapping[str, float] | None = None,
) -> xr.Dataset:
    """The vibrations of a model, slowest first: frequency, damping, and how much every signal takes part.

    Each pair of eigenvalues s = -D w_0 +- i w_0 sqrt(1 - D^2) of the linear model der(x) = A x is one ``mode``, with ``frequency``
    w_0/(2 pi) [Hz] without damping, ``damped_frequency`` [Hz], ``damping`` D [1] (negative: it grows) and ``shape``: amplitude and sign or
    phase of the signals ``shapes`` (default: the states) as complex numbers, the largest one being 1.

    Modes of friction are those of the operating point: a stuck clutch joins its sides. ``at`` and ``parameters`` as for ``pt.linearize``.
    Raises ParameterError for a model that does not vibrate, and what ``pt.linearize`` raises.
    """
    import xarray as xr

    plant = plant if isinstance(plant, Plant) else Plant(plant)
    driven = [*plant.compiled.inputs, *plant.parameters][:1]  # a linear model has an input; its column is not looked at
    wanted = list(plant.compiled.states) if shapes is None else listed("shapes", shapes)
    if not wanted:
        raise ParameterError("shapes: name at least one signal")
    model = linearize(plant, inputs=driven, outputs=wanted, at=at, parameters=parameters)
    values, vectors = (np.asarray(found, complex) for found in np.linalg.eig(model.A))
    swings = np.imag(values) > _STILL * np.abs(values).max(initial=0.0)
    if not swings.any():
        raise ParameterError(
            f"{type(plant.model).__name__} does not vibrate: none of its {len(values)} eigenvalues is complex"
        )
    order = np.flatnonzero(swings)[np.argsort(np.abs(values[swings]), kind="stable")]
    size, shape = np.abs(values[order]), (model.C @ vectors[:, order]).T
    largest = shape[np.arange(len(order)), np.abs(shape).argmax(axis=1)]
    if (np.abs(largest) < _STILL).any():
        raise ParameterError("none of the signals in shapes takes part in some of the vibrations; name others")
    data = {
        "frequency": ("mode", size / (2 * np.pi), {"units": "Hz", "long_name": "Undamped natural frequency"}),
        "damped_frequency": (
            "mode",
            np.imag(values[order]) / (2 * np.pi),
            {"units": "Hz", "long_name": "Damped frequency"},
        ),
        "damping": ("mode", -np.real(values[order]) / size, {"units": "1", "long_name": "Damping ratio"}),
        "shape": (("mode", "signal"), shape / largest[:, None], {"units": "1", "long_name": "Mode shape"}),
    }
    names = list(model.linearization.outputs)
    return xr.Dataset(data, {"mode": np.arange(1, len(order) + 1), "signal": names})
