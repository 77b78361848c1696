"""Natural frequencies, damping and shapes of the vibrations of a model at an operating point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from powertrain.analysis.linearization import Point, Selector, free_response
from powertrain.errors import ParameterError
from powertrain.language.arguments import listed
from powertrain.language.component import Component
from powertrain.plant import Plant

if TYPE_CHECKING:
    import xarray as xr

Matrix = NDArray[Any]
_STILL = 1e-9
"""Amplitudes below this share of the eigenvector are round-off."""
_CRITICAL = 1e-6
"""Imaginary parts below this share of their eigenvalue are round-off: two real ones that coincide, at critical damping."""
_ROUNDING = 64 * np.finfo(float).eps
"""Singular values below this share of the largest one, times the number of states, are zero."""


def eigenmodes(
    plant: Plant[Any] | Component,
    shapes: Sequence[Selector] | None = None,
    *,
    at: Point | None = None,
    parameters: Mapping[str, float] | None = None,
) -> xr.Dataset:
    """The vibration modes of a model, the slowest first: frequency, damping and mode shape.

    Each pair of eigenvalues s = -D w_0 +- i w_0 sqrt(1 - D^2) of the linear model der(x) = A x is one ``mode``, with ``frequency``
    w_0/(2 pi) [Hz] without damping, ``damped_frequency`` [Hz], ``damping`` ratio D [1] (negative: unstable) and ``shape``: amplitude
    and sign or phase of the signals ``shapes`` (default: the states) as complex numbers, scaled so that the largest one is 1. The
    attribute ``zero_eigenvalues`` counts motions without restoring force: two for a rigid body that turns or moves freely, one for an
    integral such as that of the fuel flow.

    Modes of friction are those of the operating point: a stuck clutch joins its two sides. ``at`` and ``parameters`` as for
    ``pt.linearize``. Raises ParameterError for a model without vibration modes, and the errors of ``pt.linearize``.
    """
    import xarray as xr

    plant = plant if isinstance(plant, Plant) else Plant(plant)
    wanted = list(plant.compiled.states) if shapes is None else listed("shapes", shapes)
    if not wanted:
        raise ParameterError("shapes: name at least one signal")
    a, c, names = free_response(plant, wanted, at, parameters)
    values, vectors = _moving(a)
    swings = np.imag(values) > _CRITICAL * np.abs(values)
    if not swings.any():
        raise ParameterError(
            f"{type(plant.model).__name__} has no vibration modes: none of its {len(a)} eigenvalues is complex"
        )
    order = np.flatnonzero(swings)[np.argsort(np.abs(values[swings]), kind="stable")]
    size, shape = np.abs(values[order]), (c @ vectors[:, order]).T
    largest = shape[np.arange(len(order)), np.abs(shape).argmax(axis=1)]
    if (np.abs(largest) < _STILL).any():
        raise ParameterError("in some vibration modes none of the signals in shapes moves; name other signals")
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
    attributes = {"zero_eigenvalues": len(a) - len(values)}
    return xr.Dataset(data, {"mode": np.arange(1, len(order) + 1), "signal": list(names)}, attributes)


def _moving(a: Matrix) -> tuple[Matrix, Matrix]:
    """The eigenvalues of a matrix that are not zero, and their eigenvectors.

    A rigid body that moves freely has the eigenvalue zero twice with one eigenvector. Rounding by eps splits it into two of sqrt(eps),
    which may look like a vibration. Therefore zeros are taken out by null spaces first, which rounding changes by eps only: in an
    orthonormal basis (n, r) with a n = 0, the matrix is (0, u; 0, a'). The null space of a', what moves into that of a, is taken out in
    the same way, until none is left. An eigenvector v of a' to the eigenvalue s gives n u v/s + r v of a.
    """
    from scipy.linalg import matrix_balance

    inner, scale = matrix_balance(a, permute=False)
    limit = _ROUNDING * len(a) * np.linalg.norm(inner, 2) if len(a) else 0.0
    turns: list[tuple[Matrix, Matrix, Matrix]] = []
    while len(inner):
        _, sizes, rows = np.linalg.svd(inner)
        rank = int((sizes > limit).sum())
        if rank == len(inner):
            break
        null, rest = rows[rank:].T, rows[:rank].T
        turns.append((null, rest, null.T @ inner @ rest))
        inner = rest.T @ inner @ rest
    values, vectors = (np.asarray(found, complex) for found in np.linalg.eig(inner))
    for null, rest, coupling in reversed(turns):
        vectors = null @ (coupling @ vectors / values) + rest @ vectors
    vectors = scale @ vectors
    return values, vectors / np.linalg.norm(vectors, axis=0)
