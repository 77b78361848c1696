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
from powertrain.language.symbols import Symbol
from powertrain.plant import Plant

_SPEEDS = ("rad/s", "m/s")
"""Units of the states that are speeds."""


class Energies:
    """The second variations of the stored energies of one model about an operating point.

    In a body that turns, small vibrations do not conserve the energy E(y) of the parts, y = (x, z), but F = E - dE/dy y_0: y_0 contains
    the constant speeds of the operating point, and zeros for the rest. For the kinetic energy v' M(q) v/2 the second variation of F is
    dv' M dv/2 - dq' (v_0' M v_0)_qq dq/4, where the last term is the potential of the centrifugal field (Jacobi's integral of the linear
    equations). With the algebraic unknowns dz = Z dx of the linear model, a small motion dx stores 1/2 dx' H dx,
    H = (1 Z')  F_yy  (1 Z')'. A vibration dx = Re(v exp(s t)) stores the mean 1/4 v^H H v at the instant of unit amplitude.
    """

    def __init__(self, compiled: Compiled) -> None:
        dae, terms = compiled.dae, written_terms(compiled)
        y = ca.vertcat(dae.x, dae.z)
        steady = Symbol.sym("steady", y.numel())
        hessians = [ca.hessian(energy - ca.jtimes(energy, y, steady), y)[0] for energy in terms.energy]
        kept = [k for k, hessian in enumerate(hessians) if hessian.nnz()]
        self.components = [terms.parts[k].path or terms.parts[k].kind for k in kept]
        slopes = [ca.jacobian(dae.residual, v) for v in (dae.z, dae.x)]
        self._slopes = ca.Function("powertrain_slopes", dae.arguments, slopes)
        self._hessians = ca.Function("powertrain_energies", [*dae.arguments, steady], [hessians[k] for k in kept])
        self._speeds = np.array([compiled.signals[name].unit in _SPEEDS for name in compiled.states], bool)

    def shares(self, point: OperatingPoint, vectors: NDArray[Any]) -> NDArray[np.float64]:
        """How the mean energy of vibrations is distributed: (vibration, component); ``vectors``: all states, one column each."""
        by_z, by_x = (np.array(v, float) for v in self._slopes(*point))
        kinematics = np.vstack([np.eye(len(point.x)), -np.linalg.solve(by_z, by_x)])
        hessians = self._hessians.call([*point, kinematics @ np.where(self._speeds, point.x, 0.0)])
        motions = kinematics @ vectors
        forms = [np.einsum("im,ij,jm->m", motions.conj(), np.array(h, float), motions).real for h in hessians]
        energies = np.array(forms).reshape(len(hessians), vectors.shape[1]).T
        total = energies.sum(axis=1, keepdims=True)
        return np.asarray(np.divide(energies, total, out=np.zeros_like(energies), where=total > 0.0))


_kept: WeakKeyDictionary[Plant[Any], Energies] = WeakKeyDictionary()


def energies_of(plant: Plant[Any]) -> Energies:
    """Those of a plant, built once."""
    if plant not in _kept:
        _kept[plant] = Energies(plant.compiled)
    return _kept[plant]
