"""Loads of the parts of a gearless differential in a simulated run: forces, contact pressures, shaking forces on the housing.

Forces follow from the motion, the torques and the inertia of the run. Friction in the contacts is small compared with the normal forces
and is neglected in the forces, as in the sources.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from functools import singledispatch
from typing import Any

import numpy as np
from numpy.typing import NDArray

from powertrain import Component, ParameterError, Result, der
from powertrain.components.gearless.circular_cam import (
    CircularCamDifferential,
    CircularCams,
    FrictionDisk,
    track_contacts,
)
from powertrain.components.gearless.circular_cam import forces as cam_forces
from powertrain.components.gearless.linkage import Linkage, LinkageDifferential, LinkMasses
from powertrain.components.gearless.linkage.forces import Drive, Reactions, reactions
from powertrain.components.gearless.linkage.masses import LinkBody
from powertrain.components.gearless.linkage.shaking import shaking
from powertrain.components.gearless.spherical_cam import CamBody, SphericalCamDifferential

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Loads(Mapping[str, Array]):
    """Time series by name: ``loads["F_ax"]`` at ``loads.time`` [s], in ``loads.units["F_ax"]``; pandas.DataFrame(loads) accepts them."""

    time: Array
    values_by_name: dict[str, Array]
    units: dict[str, str]

    def __getitem__(self, name: str) -> Array:
        return self.values_by_name[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.values_by_name)

    def __len__(self) -> int:
        return len(self.values_by_name)

    def __str__(self) -> str:
        rows = (f"  {name:22} {v.min():12.5g} .. {v.max():12.5g} {self.units[name]}" for name, v in self.items())
        return "\n".join([f"Loads, {self.time[0]:g} .. {self.time[-1]:g} s", *rows])


def reactions_of(result: Result[Any], design: Any = None, *, path: str = "differential") -> Loads:
    """Forces in the joints and bearings of the gearless differential at ``path``.

    Circular cams (``design``: CircularCams, for the rollers' radii if the component has no masses): forces on one active roller of each
    track and the axial force on the disks, see ``circular_cam.Forces``. Spherical cam (``design``: CamBody): normal forces of the rollers
    of either side on the inner and the outer cam of one pair, radial and axial force of the pair on its bearing. Linkage: magnitudes of the
    forces in S-pairs, C-pair and R-pairs, see ``linkage.forces.Reactions`` for the convention that makes them unique. Errors:
    ParameterError for a path without a gearless differential, or a missing design.
    """
    run = _SimulatedPart(result, path)
    return run.loads(_reactions(run.part, run, design))


def contact_of(result: Result[Any], design: Any = None, *, path: str = "differential") -> Loads:
    """Contact pressures [Pa]; ``design`` and errors as for ``reactions_of``.

    Cams: Hertz's maximum pressure; that of circular cams is for the hollow (1.1 of the roller's radius) and the material (200 GPa) by
    default of ``track_contacts``. Linkage: force over projected area of pins, balls and rod.
    """
    run = _SimulatedPart(result, path)
    return run.loads(_contact(run.part, run, design))


def shaking_of(result: Result[Any], design: Any = None, *, path: str = "differential") -> Loads:
    """Forces [N] and moments [N.m] that the moving parts exert on the cage's bearings, in axes of the cage, x along the shafts.

    Circular cams with four or more rollers are balanced, and so are pairs of spherical cams; the effect of a single roller or pair
    is given beside the sum. ``design`` and errors as for ``reactions_of``. Rollers of circular cams without ``masses`` cause no shaking;
    spherical cams without ``masses`` have the inertia of the design.
    """
    run = _SimulatedPart(result, path)
    return run.loads(_shaking(run.part, run, design))


class _SimulatedPart:
    """A differential's signals and parameters in a result."""

    def __init__(self, result: Result[Any], path: str) -> None:
        self.result, self.path = result, path
        self.part = self._at(result.model)

    def _at(self, model: Any) -> Any:
        found = model
        for step in self.path.replace("]", "").replace("[", ".").split("."):
            found = found[int(step)] if isinstance(found, tuple) else getattr(found, step, None)
        if not isinstance(found, Component):
            raise ParameterError(f"path = {self.path!r} is not a component of {type(model).__name__}")
        return found

    def __getitem__(self, name: str) -> Array:
        return np.asarray(self.result[f"{self.path}.{name}"])

    def rate(self, name: str) -> Array:
        """Time derivative of a variable."""
        return np.asarray(self.result[lambda m: der(getattr(self._at(m), name))])

    def number(self, name: str) -> float:
        return float(self.result.parameters[f"{self.path}.{name}"])

    def loads(self, found: dict[str, tuple[Array, str]]) -> Loads:
        shape = self.result.time.shape
        values = {name: np.broadcast_to(value, shape).copy() for name, (value, _) in found.items()}
        return Loads(np.asarray(self.result.time), values, {name: unit for name, (_, unit) in found.items()})

    def needs(self, design: Any, kind: type) -> Any:
        if not isinstance(design, kind):
            raise ParameterError(
                f"{self.path} is a {type(self.part).__name__}: design must be its {kind.__name__}, not {design!r}"
            )
        return design


@singledispatch
def _reactions(part: Component, run: _SimulatedPart, design: Any) -> dict[str, tuple[Array, str]]:
    raise ParameterError(f"{run.path} is a {type(part).__name__}, not a gearless differential")


@singledispatch
def _contact(part: Component, run: _SimulatedPart, design: Any) -> dict[str, tuple[Array, str]]:
    raise ParameterError(f"{run.path} is a {type(part).__name__}, not a gearless differential")


@singledispatch
def _shaking(part: Component, run: _SimulatedPart, design: Any) -> dict[str, tuple[Array, str]]:
    raise ParameterError(f"{run.path} is a {type(part).__name__}, not a gearless differential")


def _cams(part: CircularCamDifferential, run: _SimulatedPart, design: Any) -> CircularCams:
    """The design with the parameters of the run."""
    if part.masses is None:
        given = run.needs(design, CircularCams)
        r_out, r_in = given.outer.r, given.inner.r
    else:
        r_out, r_in = run.number("masses.r_out"), run.number("masses.r_in")
    lengths = {name: run.number(name) for name in ("D_out", "D_in", "alpha_out", "alpha_in")}
    disk = FrictionDisk(run.number("d_out"), run.number("d_in"), run.number("mu"), part.uniform)
    return CircularCams.build(**lengths, r_out=r_out, r_in=r_in, disk=disk, n=part.n)


@_reactions.register
def _(part: CircularCamDifferential, run: _SimulatedPart, design: Any) -> dict[str, tuple[Array, str]]:
    cams = _cams(part, run, design)
    found = cam_forces(cams, run["theta"], run["crown.tau"], part.sharing, run.number("stiffness"))
    units = {"alpha": "rad", "share": "1", "M": "N.m"}
    names = [field.name for field in fields(found)]
    return {name: (getattr(found, name), units.get(name.partition("_")[0], "N")) for name in names}


@_contact.register
def _(part: CircularCamDifferential, run: _SimulatedPart, design: Any) -> dict[str, tuple[Array, str]]:
    cams = _cams(part, run, design)
    found = cam_forces(cams, run["theta"], run["crown.tau"], part.sharing, run.number("stiffness"))
    pairs = ("outer", cams.outer, found.F_n_out), ("inner", cams.inner, found.F_n_in)
    return {
        f"{name}_{'convex' if contact.convex else 'concave'}": (contact.pressure(force), "Pa")
        for name, track, force in pairs
        for contact in track_contacts(track)
    }


@_shaking.register
def _(part: CircularCamDifferential, run: _SimulatedPart, design: Any) -> dict[str, tuple[Array, str]]:
    cams = _cams(part, run, design)
    force, moment_y, moment_z, single = (np.zeros_like(run["theta"]) for _ in range(4))
    if part.masses is not None:
        theta, speed, rate = run["theta"], run["w_rel"] / 2, run.rate("w_rel") / 2
        for track, m in ((cams.outer, run.number("masses.m_out")), (cams.inner, run.number("masses.m_in"))):
            for roller in range(track.n):
                alpha = track.alpha(theta)
                # d/dtheta of D/2 tan(alpha), with d sin(alpha)/dtheta = (n/pi) sin(alpha_max) = D/(2 R_m)
                curve = track.sense(theta, roller) * (track.D / 2) ** 2 / (track.R_m * np.cos(alpha) ** 3)
                inertial = -m * (track.climb(theta, roller) * rate + curve * speed**2)
                at = 2 * math.pi * roller / track.n
                force, single = force + inertial, np.maximum(single, np.abs(inertial))
                moment_y = moment_y + inertial * track.D / 2 * math.sin(at)
                moment_z = moment_z - inertial * track.D / 2 * math.cos(at)
    return {
        "force_x": (force, "N"),
        "moment_y": (moment_y, "N.m"),
        "moment_z": (moment_z, "N.m"),
        "roller": (single, "N"),
    }


def _sides(run: _SimulatedPart) -> Iterator[tuple[str, Array, Array, float]]:
    """Name, cam angle from the middle of a stroke, torque of both side wheels [N.m], and the side.

    On the left side the rollers after the middle of their stroke carry a forward torque, on the right side those before it; a
    backward torque is the reverse. Mirroring y exchanges the flanks, half a turn about z the sides.
    """
    for name, side in (("left", 1.0), ("right", -1.0)):
        torque = -run[f"{name}.tau"]
        yield name, np.where(torque >= 0, side, -side) * run["psi"], torque, side


@_reactions.register
def _(part: SphericalCamDifferential, run: _SimulatedPart, design: Any) -> dict[str, tuple[Array, str]]:
    body, found = run.needs(design, CamBody), {}
    total = np.zeros((*run["psi"].shape, 3))
    for name, s, torque, side in _sides(run):
        inner, outer, force = body.forces(part.cycle, s, torque)
        found[f"{name}_inner"], found[f"{name}_outer"] = (inner, "N"), (outer, "N")
        push = np.where(torque >= 0, 1.0, -1.0)
        total = total + force * np.stack([np.full_like(push, side), push, np.ones_like(push)], -1)
    found["bearing_radial"] = np.hypot(total[..., 0], total[..., 1]), "N"
    found["bearing_axial"] = np.abs(total[..., 2]), "N"
    return found


@_contact.register
def _(part: SphericalCamDifferential, run: _SimulatedPart, design: Any) -> dict[str, tuple[Array, str]]:
    body, found = run.needs(design, CamBody), {}
    for name, s, torque, _side in _sides(run):
        inner, outer = body.pressure(part.cycle, s, torque)
        found[f"{name}_inner"], found[f"{name}_outer"] = (inner, "Pa"), (outer, "Pa")
    return found


@_shaking.register
def _(part: SphericalCamDifferential, run: _SimulatedPart, design: Any) -> dict[str, tuple[Array, str]]:
    body = run.needs(design, CamBody)
    inertia = body.spin_inertia if part.masses is None else run.number("masses.J_cam")
    cage = np.asarray(run.result[lambda m: der(run._at(m).crown.phi)])
    gyroscopic = inertia / body.pairs * run["w_cam"] * cage  # -w_cage x J w_cam, across the shaft of each pair
    at = 2 * math.pi * np.arange(body.pairs) / body.pairs
    return {
        "moment_y": (gyroscopic * float(np.sin(at).sum()), "N.m"),
        "moment_z": (-gyroscopic * float(np.cos(at).sum()), "N.m"),
        "pair": (np.abs(gyroscopic), "N.m"),
    }


def _linkage(run: _SimulatedPart) -> tuple[Linkage, Drive, LinkMasses]:
    bodies = {
        name: LinkBody(*(run.number(f"{what}_{name}") for what in ("m", "axial", "transverse")))
        for name in ("coupler", "lever")
    }
    cage = run.number("J_cage")
    masses = LinkMasses(
        cage=LinkBody(1.0, cage, cage),
        output=run.number("J_output"),
        coupler_centre=run.number("centre_coupler"),
        **bodies,
    )
    motion = {"u": run["w_diff"], "w": run["w"], "du": run.rate("w_diff"), "dw": run.rate("w")}
    linkage = Linkage(*(run.number(name) for name in ("a", "b", "offset")))
    return linkage, Drive.at(run["alpha"], **motion), masses


def _joints(run: _SimulatedPart) -> tuple[Linkage, Reactions]:
    linkage, drive, masses = _linkage(run)
    return linkage, reactions(linkage, drive, masses, crown=run["crown.tau"])


@_reactions.register
def _(part: LinkageDifferential, run: _SimulatedPart, design: Any) -> dict[str, tuple[Array, str]]:
    _, found = _joints(run)
    forces = "S_left", "S_right", "C_force", "R_left", "R_right"
    moments = "C_moment", "R_left_moment", "R_right_moment"
    sizes = {name: np.linalg.norm(getattr(found, name), axis=-1) for name in (*forces, *moments)}
    return {name: (size, "N" if name in forces else "N.m") for name, size in sizes.items()}


@_contact.register
def _(part: LinkageDifferential, run: _SimulatedPart, design: Any) -> dict[str, tuple[Array, str]]:
    _, found = _joints(run)
    areas = {
        "ball": math.pi * run.number("r_ball") ** 2,
        "pin": 2 * run.number("r_pin") * run.number("l_pin"),
        "rod": 2 * run.number("r_rod") * run.number("l_rod"),
    }
    loads = {"ball": ("S_left", "S_right"), "pin": ("R_left", "R_right"), "rod": ("C_force",)}
    return {
        f"{joint}{name[1:] if joint != 'rod' else ''}": (
            np.linalg.norm(getattr(found, name), axis=-1) / areas[joint],
            "Pa",
        )
        for joint, names in loads.items()
        for name in names
    }


@_shaking.register
def _(part: LinkageDifferential, run: _SimulatedPart, design: Any) -> dict[str, tuple[Array, str]]:
    found = shaking(*_linkage(run))
    return {
        f"{what}_{axis}": (values[..., i], unit)
        for what, values, unit in (("force", found.force, "N"), ("moment", found.moment, "N.m"))
        for i, axis in ((1, "y"), (2, "z"))
    }
