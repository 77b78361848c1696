"""Natural frequencies, damping, shapes and energies of the vibrations of a model at an operating point."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from powertrain.analysis.linearization import linear_at
from powertrain.analysis.operating_point import Point, operating_point
from powertrain.dae.hybrid import OperatingPoint
from powertrain.errors import ParameterError
from powertrain.language.arguments import listed
from powertrain.language.component import Component
from powertrain.plant import Plant, plant_of
from powertrain.signals import Selector
from powertrain.vibration.eigenvectors import Eigenvectors, eigenvectors
from powertrain.vibration.energies import energies_of

if TYPE_CHECKING:
    import xarray as xr

Matrix = NDArray[Any]
_STILL = 1e-9
"""Amplitudes below this share of the eigenvector are round-off."""
_CRITICAL = 1e-6
"""Imaginary parts below this share of their eigenvalue are round-off: two real ones that coincide, at critical damping."""
MEANINGS = {
    "frequency": ("Hz", "Undamped natural frequency"),
    "damped_frequency": ("Hz", "Damped frequency"),
    "damping": ("1", "Damping ratio"),
    "shape": ("1", "Mode shape"),
    "energy": ("1", "Share of the mean energy"),
}
"""Units and names of what a mode has."""


@dataclass(frozen=True)
class Vibrations:
    """The vibrations at one operating point, a column each.

    ``values``: eigenvalues with positive imaginary part; ``states`` and ``left``: right and left eigenvectors over all states of the
    model; ``shapes``: the signals asked for, scaled so that the largest one is 1; ``energies``: shares (vibration, component);
    ``zeros``: how many eigenvalues are zero; ``size``: the number of states; ``notes``: what is not certain.
    """

    values: Matrix
    states: Matrix
    left: Matrix
    shapes: Matrix
    energies: NDArray[np.float64]
    signals: tuple[str, ...]
    zeros: int
    size: int
    notes: tuple[str, ...]


def eigenmodes(
    plant: Plant[Any] | Component,
    shapes: Sequence[Selector] | None = None,
    *,
    at: Point | None = None,
    parameters: Mapping[str, float] | None = None,
) -> xr.Dataset:
    """The vibration modes of a model, the slowest first: frequency, damping, mode shape and energies.

    Each pair of eigenvalues s = -D w_0 +- i w_0 sqrt(1 - D^2) of the linear model der(x) = A x is one ``mode``, with ``frequency``
    w_0/(2 pi) [Hz] without damping, ``damped_frequency`` [Hz], ``damping`` ratio D [1] (negative: unstable) and ``shape``: amplitude
    and sign or phase of the signals ``shapes`` as complex numbers, scaled so that the largest one is 1. The
    attribute ``zero_eigenvalues`` counts motions without restoring force: two for a rigid body that turns or moves freely, one for an
    integral such as that of the fuel flow. The attribute ``notes`` names laws that change their mode at this very point, such as the
    driving side of an unloaded gear, for which the derivatives are those of one side, and vibrations that round-off hides next to others
    a million times as fast.

    ``energy`` [1] is the share that each ``component`` has in the mean energy of the vibration: kinetic energy in inertias, strain
    energy in springs, from the quadratic form of the energies that the components declare. Without damping both halves are 0.5. A
    change of an inertia J or of a stiffness c by a fraction e changes the squared frequency by -2 E_J e and by 2 E_c e (Rayleigh).
    A mass that moves in a rotating part, such as a centrifugal pendulum, has the potential energy of the centrifugal field in addition.

    Coefficients that change along the motion, such as those of a ``PistonEngine`` or a universal joint with the angle, are those of
    the point. Replace an engine by its mean inertia (how-to "Analyse the torsional vibration of an engine"), or use ``pt.floquet``.

    Parameters
    ----------
    plant : Plant or Component
        The model.
    shapes : sequence of str or selectors, optional
        Signals whose amplitudes make up the mode shape; by default the states.
    at, parameters
        The operating point, as for ``pt.linearize``. Modes of friction are those of this point: a stuck clutch joins its two sides.

    Returns
    -------
    xarray.Dataset

    Raises
    ------
    ParameterError
        For a model without vibration modes.
    ModelError
        As ``pt.linearize``.
    """
    import xarray as xr

    plant = plant_of(plant)
    found = vibrations(plant, shapes_of(plant, shapes), operating_point(plant, at, parameters))
    if not len(found.values):
        raise ParameterError(
            f"{type(plant.model).__name__} has no vibration modes: none of its {found.size} eigenvalues is complex"
        )
    dims = {"shape": ("mode", "signal"), "energy": ("mode", "component")}
    data = {
        name: (dims.get(name, ("mode",)), values, dict(zip(("units", "long_name"), MEANINGS[name], strict=True)))
        for name, values in properties(found).items()
    }
    coordinates = {
        "mode": np.arange(1, len(found.values) + 1),
        "signal": list(found.signals),
        "component": energies_of(plant).components,
    }
    return xr.Dataset(data, coordinates, {"zero_eigenvalues": found.zeros, "notes": "\n".join(found.notes)})


def shapes_of(plant: Plant[Any], shapes: Sequence[Selector] | None) -> list[Any]:
    """The signals of mode shapes, by default the states."""
    wanted = list(plant.compiled.states) if shapes is None else listed("shapes", shapes)
    if not wanted:
        none = f"{type(plant.model).__name__} has no states, and so no vibration modes"
        raise ParameterError("shapes: name at least one signal" if plant.compiled.states else none)
    return wanted


def vibrations(plant: Plant[Any], wanted: Sequence[Selector], point: OperatingPoint) -> Vibrations:
    """The vibrations at an operating point, the slowest first; perhaps none. Errors as for ``eigenmodes``."""
    named = [s for s in wanted if isinstance(s, str)]
    states = [name for name in plant.compiled.states if name not in named]
    linear = linear_at(plant, (), [*wanted, *states], point)
    a, c, labels = linear.matrices.a, linear.matrices.c, linear.outputs
    found = eigenvectors(a)
    swings = np.flatnonzero(np.imag(found.values) > _CRITICAL * np.abs(found.values))
    order = swings[np.argsort(np.abs(found.values[swings]), kind="stable")]
    moving = c @ found.right[:, order]
    shape = moving[: len(wanted)].T
    largest = shape[np.arange(len(order)), np.abs(shape).argmax(axis=1)]
    if (still := np.abs(largest) < _STILL).any():
        there = ", ".join(f"{w / (2 * np.pi):.4g}" for w in np.abs(found.values[order[still]]))
        raise ParameterError(f"none of the signals in shapes moves in the vibrations of {there} Hz; name other signals")
    rows = [labels.index(name) for name in plant.compiled.states]
    left = np.zeros((len(rows), len(order)), complex)
    left[linear.kept] = found.left[:, order]
    energies = energies_of(plant).shares(point, moving[rows])
    return Vibrations(
        found.values[order], moving[rows], left, (shape / largest[:, None]).T, energies, labels[: len(wanted)],
        len(a) - len(found.values), len(a), tuple(_notes(linear.one_sided, found)),
    )  # fmt: skip


def _notes(one_sided: Sequence[str], found: Eigenvectors) -> Iterator[str]:
    if one_sided:
        yield f"the derivatives are those of one side of {', '.join(one_sided)}, whose mode changes at this very point"
    if found.hidden:
        stiff = np.abs(found.values).max(initial=0.0) / (2 * np.pi)
        soft = ", ".join(f"{w / (2 * np.pi):.3g}" for w in found.hidden)
        yield (
            f"next to {stiff:.3g} Hz, round-off hides a vibration of about {soft} Hz, which counts among the zero eigenvalues, and slow "
            "vibrations are not accurate; make the stiffest parts rigid"
        )


def properties(found: Vibrations) -> dict[str, Matrix]:
    """The properties of the modes, one row per vibration."""
    size = np.abs(found.values)
    return {
        "frequency": size / (2 * np.pi),
        "damped_frequency": np.imag(found.values) / (2 * np.pi),
        "damping": -np.real(found.values) / size,
        "shape": found.shapes.T,
        "energy": found.energies,
    }
