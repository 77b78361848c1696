"""The energy of small vibrations, component by component, from the energies that the components declare."""

from __future__ import annotations

from typing import Any
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.analysis.energy_terms import written_terms
from powertrain.compiler.assemble import Compiled
from powertrain.dae.hybrid import OperatingPoint
from powertrain.language.symbols import Symbol
from powertrain.plant import Plant

SPEEDS = ("rad/s", "m/s")
"""Units of the states that are speeds."""


class Energies:
    """The second variations of the stored energies of one model about an operating point.

    With the energy E(x, z) of a component and the algebraic unknowns dz = Z dx of the linear model, a small motion dx stores
    1/2 dx' H dx beside what is linear in dx, with H = (1 Z')  F_yy  (1 Z')', y = (x, z). A vibration dx = Re(v exp(s t)) stores the mean
    1/4 v^H H v at the instant of unit amplitude.

    F = E - E_y u, with the speeds u of the operating point, is the energy relative to its motion (Jacobi's integral). E alone is not
    conserved: E_y u is the angular momentum times the speed, which the vibration exchanges with the motion. Inertias and springs have the
    same H from E and F. For a mass in a rotating frame only F contains the centrifugal field as a potential.
    """

    def __init__(self, compiled: Compiled) -> None:
        dae, terms = compiled.dae, written_terms(compiled)
        y, speeds = ca.vertcat(dae.x, dae.z), Symbol.sym("speeds", dae.x.numel() + dae.z.numel())
        relative = [energy - ca.jtimes(energy, y, speeds) for energy in terms.energy]
        hessians = [ca.hessian(energy, y)[0] for energy in relative]
        kept = [k for k, hessian in enumerate(hessians) if hessian.nnz()]
        self.components = [terms.parts[k].path or terms.parts[k].kind for k in kept]
        self._slopes = dae.function("slopes", *(ca.jacobian(dae.residual, v) for v in (dae.z, dae.x)))
        self._hessians = ca.Function("powertrain_energies", [*dae.arguments, speeds], [hessians[k] for k in kept])
        units = [compiled.signals[name].unit if name in compiled.signals else "" for name in compiled.states]
        self._speeds = np.isin(units, SPEEDS)

    def shares(self, point: OperatingPoint, vectors: NDArray[Any]) -> NDArray[np.float64]:
        """How the mean energy of vibrations is distributed: (vibration, component); ``vectors``: all states, one column each."""
        by_z, by_x = (np.array(v, float) for v in self._slopes(*point))
        kinematics = np.vstack([np.eye(len(point.x)), -np.linalg.solve(by_z, by_x)])
        speeds = kinematics @ np.where(self._speeds, point.x, 0.0)
        hessians = [np.array(h, float) for h in self._hessians.call([*point, speeds])]
        motions = kinematics @ vectors
        forms = [np.einsum("im,ij,jm->m", motions.conj(), h, motions).real for h in hessians]
        energies = np.array(forms).reshape(len(hessians), vectors.shape[1]).T
        total = energies.sum(axis=1, keepdims=True)
        return np.asarray(np.divide(energies, total, out=np.zeros_like(energies), where=total > 0.0))


_kept: WeakKeyDictionary[Plant[Any], Energies] = WeakKeyDictionary()


def energies_of(plant: Plant[Any]) -> Energies:
    """Those of a plant, built once."""
    if plant not in _kept:
        _kept[plant] = Energies(plant.compiled)
    return _kept[plant]
