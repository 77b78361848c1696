"""Spherical cams with checked numbers: those that mesh, and those that can be built."""

from __future__ import annotations

from dataclasses import dataclass

from powertrain import arguments_checked
from powertrain.components.gearless.spherical_cam.checks import check_angles, check_cut, check_numbers, check_profile
from powertrain.components.gearless.spherical_cam.curves import Array, CamCurves


@arguments_checked
@dataclass(frozen=True)
class CamGeometry(CamCurves):
    """The equations of a cam with M lobes in mesh with a carrier of N conical rollers, whether or not it can be built.

    Errors: ParameterError for fewer than 3 lobes or rollers, and for angles outside (0, 90 degrees].
    """

    def __post_init__(self) -> None:
        check_numbers(self)

    def whole_profile(self, points: int = 361) -> Array:
        """The closed profile of all M lobes: ``points`` per valley. Errors: ParameterError if undercut, open, or M = N."""
        check_cut(self)
        return self.valleys(points)


@arguments_checked
@dataclass(frozen=True)
class SphericalCam(CamGeometry):
    """A spherical cam that can be built, with its rollers: ``CamGeometry``, checked.

    Cam and roller can only push. With the roller beyond the middle of its stroke (psi > -pi/M), the cam drives it for psi' > 0, up to
    sigma. A second, conjugate cam with a second set of rollers does the rest; it is equal but half a stroke apart: by pi/M on the
    cam, by pi/N on the carrier. One is inside the other along the radius. The default angles are those of the pressure angles in
    Table 1.

    Errors: ParameterError for fewer than 3 lobes or rollers, M = N, angles outside their limits, overlapping rollers, a pitch curve
    with cusps or loops, an undercut profile, a double point, a gap between the strokes of the conjugate cams, or a roller that cuts into a
    lobe.

    >>> cam = SphericalCam(4, 5)
    >>> round(cam.beta_1, 4), round(cam.minimum_pressure_angle, 2)
    (0.6747, 0.53)
    """

    def __post_init__(self) -> None:
        check_angles(self)
        check_profile(self)
