"""Planetary gears and Ravigneaux sets as levers, from their tooth numbers."""

from __future__ import annotations

from powertrain import ParameterError
from powertrain.components.differentials.teeth import Ring, Sun, check_room
from powertrain.components.transmissions.network import Lever


def planetary(name: str, sun: str, ring: str, carrier: str, *, teeth: tuple[int, int], eta: float = 1.0) -> Lever:
    """A simple planetary gear.

    Parameters
    ----------
    name : str
        Name of the set.
    sun, ring, carrier : str
        Names of its shafts.
    teeth : tuple of int
        Tooth numbers of sun and ring.
    eta : float
        Efficiency with the carrier fixed [1].

    Returns
    -------
    Lever

    Raises
    ------
    ParameterError
        For tooth numbers with which no planet fits.
    """
    Z_sun, Z_ring = teeth
    _check_teeth(f"planetary gear {name}", (Z_sun,), Z_ring)
    return Lever(name, sun, ring, carrier, -Z_ring / Z_sun, eta)


def double_planetary(
    name: str, sun: str, ring: str, carrier: str, *, teeth: tuple[int, int], eta: float = 1.0
) -> Lever:
    """A planetary gear with pairs of planets: with the carrier fixed, sun and ring turn in the same direction.

    Parameters
    ----------
    name : str
        Name of the set.
    sun, ring, carrier : str
        Names of its shafts.
    teeth : tuple of int
        Tooth numbers of sun and ring.
    eta : float
        Efficiency with the carrier fixed, of three meshes [1].

    Returns
    -------
    Lever

    Raises
    ------
    ParameterError
        For tooth numbers with which no planet fits.
    """
    Z_sun, Z_ring = teeth
    _check_teeth(f"planetary gear {name}", (Z_sun,), Z_ring)
    return Lever(name, sun, ring, carrier, Z_ring / Z_sun, eta)


def ravigneaux(
    large: str, small: str, ring: str, carrier: str, *, teeth: tuple[int, int, int], eta: float = 1.0
) -> tuple[Lever, Lever]:
    """A Ravigneaux set as two levers with one ring and one carrier.

    The large sun meshes with the ring through one planet, the small sun through two. Where one sun drives and the other is held, the ring
    takes the difference of the two powers; the levers count the loss of its mesh for both. In second gear they give 98.5 % for the
    ``RAVIGNEAUX_FOUR`` in place of 98.8 %, and 97.9 % for the ``LEPELLETIER_SIX`` in place of 98.3 %. In all other gears of these sets
    they are exact. ``RavigneauxGear`` has the four meshes.

    Parameters
    ----------
    large, small, ring, carrier : str
        Names of the shafts of the large sun, the small sun, the ring and the carrier.
    teeth : tuple of int
        Tooth numbers of large sun, small sun and ring.
    eta : float
        Efficiency of the large sun's set with the carrier fixed [1]; the other set has one more mesh, eta^(3/2).

    Returns
    -------
    tuple of Lever
        The sets of the large and of the small sun.

    Raises
    ------
    ParameterError
        For tooth numbers with which no planet fits, and if the large sun is not the larger one.
    """
    Z_large, Z_small, Z_ring = teeth
    where = f"Ravigneaux set of {large}, {small}, {ring}, {carrier}"
    _check_teeth(where, (Z_large, Z_small), Z_ring)
    if Z_small >= Z_large:  # the long planets must clear the small sun
        raise ParameterError(f"{where}: the large sun has {Z_large} teeth, and the small sun {Z_small}; it needs fewer")
    return (
        Lever("large sun", large, ring, carrier, -Z_ring / Z_large, eta),
        Lever("small sun", small, ring, carrier, Z_ring / Z_small, eta**1.5),
    )


def _check_teeth(where: str, suns: tuple[int, ...], ring: int) -> None:
    """Wheels must have teeth, and planets must fit between them."""
    try:
        for sun in suns:
            check_room(Sun(sun), Ring(ring))
    except ParameterError as error:
        raise ParameterError(f"{where}: {error}") from None
