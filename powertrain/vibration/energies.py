"""The energy of small vibrations, component by component, from the energies that the components declare."""

from __future__ import annotations

from typing import Any
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.analysis.energy_terms import written_terms
from powertrain.analysis.operating_point import OperatingPoint
from powertrain.compiler.assemble import Compiled
from powertrain.plant import Plant


class Energies:
    """The second variations of the stored energies of one model about an operating point.

    With the energy E(x, z) of a component and the algebraic unknowns dz = Z dx of the linear model, a small motion dx stores
    1/2 dx' H dx beside what is linear in dx, with H = (1 Z')  E_yy  (1 Z')', y = (x, z). A vibration dx = Re(v exp(s t)) stores the mean
    1/4 v^H H v at the instant of unit amplitude.
    """

    def __init__(self, compiled: Compiled) -> None:
        dae, terms = compiled.dae, written_terms(compiled)
        y = ca.vertcat(dae.x, dae.z)
        hessians = [ca.hessian(energy, y)[0] for energy in terms.energy]
        kept = [k for k, hessian in enumerate(hessians) if hessian.nnz()]
        self.components = [terms.parts[k].path or terms.parts[k].kind for k in kept]
        slopes = [ca.jacobian(dae.residual, v) for v in (dae.z, dae.x)]
        self._function = ca.Function("powertrain_energies", dae.arguments, [*slopes, *(hessians[k] for k in kept)])
        self._sizes = dae.x.numel(), dae.z.numel()

    def shares(self, point: OperatingPoint, vectors: NDArray[Any]) -> NDArray[np.float64]:
        """How the mean energy of vibrations is distributed: (vibration, component); ``vectors``: all states, one column each."""
        n, nz = self._sizes
        by_z, by_x, *hessians = (np.array(v, float) for v in self._function(*point))
        kinematics = np.vstack([np.eye(n), -np.linalg.solve(by_z, by_x) if nz else np.zeros((0, n))])
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
