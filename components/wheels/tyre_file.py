"""Tyre property files (.tir): the longitudinal force of MF-Tyre 5.2 to 6.2 in the parameters of the Magic Formula wheel."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path

from powertrain import ParameterError

_UNITS = {
    "LENGTH": ("meter", "metre", "m"),
    "FORCE": ("newton", "n"),
    "MASS": ("kg", "kilogram"),
    "TIME": ("second", "sec", "s"),
}
_COMMENT = re.compile("[$!]")
_MARK = "\ufeff".encode().decode("latin-1")
"""The byte order mark with which some editors begin UTF-8 files."""


def read_tir(path: str | Path) -> dict[str, str]:
    """The entries of a tyre property file by name, without their sections, comments and quotes.

    Parameters
    ----------
    path : str or Path
        A file with lines ``NAME = value $comment`` in [SECTIONS].

    Returns
    -------
    dict of str to str

    Raises
    ------
    ParameterError
        For files that cannot be read, have another layout, give a name two values, or use other units than metre, newton, kg and second.

    Examples
    --------
    >>> from powertrain.components.wheels.tyre_file import read_tir
    >>> read_tir("tyre.tir")["FNOMIN"]  # doctest: +SKIP
    '4850'
    """
    try:
        text = Path(path).read_text(encoding="latin-1").removeprefix(_MARK)
    except (OSError, TypeError) as error:
        raise ParameterError(f"{path} cannot be read: {error}") from None
    found = {name: value for name, (_, value) in _entries(path, text).items()}
    for name, spellings in _UNITS.items():
        unit = found.get(name) or spellings[0]
        if unit.lower() not in spellings:
            raise ParameterError(f"{path}: {name} = {unit}; only files in {spellings[0]} are read")
    return found


def _entries(path: str | Path, text: str) -> dict[str, tuple[int, str]]:
    """The lines and values of the entries by name, without empty ones."""
    found: dict[str, tuple[int, str]] = {}
    in_section = False
    for k, line in enumerate(text.splitlines(), 1):
        name, _, value = (part.strip() for part in _COMMENT.split(line)[0].partition("="))
        in_section |= name.startswith("[")
        if not (value := value.strip("'\"").strip()):
            continue
        if not in_section:
            raise ParameterError(f"{path} is not a tyre property file: line {k} stands above the first [SECTION]")
        before, other = found.setdefault(name.upper(), (k, value))
        if other != value:
            raise ParameterError(f"{path}:{k}: {name} = {value}, but {other} in line {before}")
    return found


def parameters(path: str | Path, given: Mapping[str, object]) -> dict[str, float]:
    """The parameters of a ``MagicFormulaWheel`` at nominal load and pressure, without camber; the file may lack those ``given``."""
    entries = read_tir(path)

    def number(name: str, default: float | None = None) -> float:
        text = entries.get(name)
        if text is None and default is not None:
            return default
        if text is None:
            raise ParameterError(f"{path} has no {name}, which a Magic Formula file of version 5.2 or later has")
        try:
            return float(text)
        except ValueError:
            raise ParameterError(f"{path}: {name} = {text} is not a number") from None

    def positive(name: str, default: float | None = None) -> float:
        if not (value := number(name, default)) > 0:
            raise ParameterError(f"{path}: {name} = {value:g} must be positive")
        return value

    load, free, scale = positive("FNOMIN") * positive("LFZO", 1.0), positive("UNLOADED_RADIUS"), number("LKX", 1.0)
    found = {
        "Fz0": load,
        "pCx1": number("PCX1") * number("LCX", 1.0),
        "pDx1": number("PDX1") * number("LMUX", 1.0),
        "pDx2": number("PDX2", 0.0) * number("LMUX", 1.0),
        "pEx1": number("PEX1", 0.0) * number("LEX", 1.0),
        "pKx1": number("PKX1") * scale,
        "pKx2": number("PKX2", 0.0) * scale,
        "pKx3": number("PKX3", 0.0),
    }
    if "LONGITUDINAL_STIFFNESS" in entries:
        found["c"] = number("LONGITUDINAL_STIFFNESS")
    elif number("PTX1", 0.0) > 0.0:
        relaxation = number("PTX1") * positive("LSGKP", 1.0) * free * number("LFZO", 1.0)
        found["c"] = found["pKx1"] * load / relaxation
    if "QSY1" in entries:
        found["Cr"] = abs(number("QSY1") * number("LMY", 1.0))
    if "radius" not in given:
        if "BREFF" not in entries:
            raise ParameterError(f"{path} has no BREFF, DREFF and FREFF for the rolling radius under load; give radius")
        share = number("DREFF") * math.atan(number("BREFF")) + number("FREFF")
        found["radius"] = positive("Q_RE0", 1.0) * free - load / positive("VERTICAL_STIFFNESS") * share
    return {name: value for name, value in found.items() if name not in given}
