"""The positions of a differential's members in a split-path transmission: Yu & Beachley's six types and nine combinations.

D. Yu, N. Beachley, Mechanical efficiency of differential gearing, Gear Technology (July/August 1986), Table 1, pp. 14-16.
"""

from __future__ import annotations

import math
from typing import Any, Literal, overload

from powertrain import ParameterError, Symbol

Layout = Literal["bHa", "Hba", "baH", "abH", "Hab", "aHb"]
"""The members at 1 (input), 2 (variable unit) and 3 (output)."""
Coupling = Literal["input", "output"]
"""The variable unit is between 1 and 2 (input-coupled) or between 3 and 2 (output-coupled)."""

TYPES: dict[int, Layout] = {1: "bHa", 2: "Hba", 3: "baH", 4: "abH", 5: "Hab", 6: "aHb"}
"""The paper's numbers of the six types of connection."""
COMBINATIONS: dict[str, tuple[int, int]] = {
    "I": (1, 2),
    "II": (3, 5),
    "III": (4, 6),
    "IV": (1, 3),
    "V": (2, 4),
    "VI": (5, 6),
    "VII": (1, 6),
    "VIII": (2, 5),
    "IX": (3, 4),
}
"""The types between which a transmission switches when b and H (I-III), a and H (IV-VI) or a and b (VII-IX) change places.

The text determines I (a remains the output). Within each column of Table 1 the others are in the order of their lower type.
"""


def members(layout: str) -> tuple[str, str, str]:
    """The ports of a differential at 1, 2 and 3: ("b", "carrier", "a") for "bHa". Errors: ParameterError for other layouts."""
    if layout not in TYPES.values():
        raise ParameterError(
            f"the layout {layout!r} must be one of {', '.join(TYPES.values())} (members at 1: input, 2: variable unit, 3: output)"
        )
    first, second, third = ("carrier" if name == "H" else name for name in layout)
    return first, second, third


@overload
def relative_ratio(layout: str, R_o: float) -> float: ...
@overload
def relative_ratio(layout: str, R_o: Symbol) -> Symbol: ...
def relative_ratio(layout: str, R_o: Any) -> Any:
    """R = (w_3 - w_2)/(w_1 - w_2) of a layout, from the basic speed ratio R_o = (w_a - w_h)/(w_b - w_h); eqs. (1), (2), (24).

    Errors: ParameterError for an unknown layout, for R_o = 0 or 1, at which members coincide, and for R_o that is not finite.

    >>> [round(relative_ratio(layout, -1.7), 2) for layout in TYPES.values()]
    [-1.7, 2.7, 0.63, 0.37, 1.59, -0.59]
    """
    if not isinstance(R_o, Symbol):
        _check_finite("R_o", R_o)
        if R_o in (0.0, 1.0):
            raise ParameterError(
                f"R_o = {R_o:g}: no differential has this basic ratio; two of its members would coincide"
            )
    speeds = {"a": R_o, "b": 1.0, "carrier": 0.0}
    one, two, three = (speeds[name] for name in members(layout))
    return (three - two) / (one - two)


def overall_ratio(layout: str, R_o: float, V: float, coupling: Coupling = "input") -> float:
    """The ratio r = w_3/w_1 for a ratio of the variable unit.

        input-coupled, V = w_2/w_1:   r = R + (1 - R) V                        (24)
        output-coupled, V = w_2/w_3:  r (1 - V + R V) = R

    Parameters
    ----------
    layout : str
        The layout, which determines the relative ratio R from the basic ratio.
    R_o : float
        Basic ratio of the planetary gear [1].
    V : float
        Ratio of the variable unit [1].
    coupling : {"input", "output"}
        The shaft to which the variable unit is coupled.

    Returns
    -------
    float
        r [1].

    Raises
    ------
    ParameterError
        If no finite r belongs to V, or V is not finite.
    """
    _check_finite("V", V)
    R = relative_ratio(layout, R_o)
    if _input_coupled(coupling):
        return R + (1 - R) * V
    if 1 - V + R * V == 0:
        raise ParameterError(f"the output-coupled layout {layout} holds its input at V = {V:g}: r would be infinite")
    return R / (1 - V + R * V)


def unit_ratio(layout: str, R_o: float, r: float, coupling: Coupling = "input") -> float:
    """The ratio V of the variable unit that gives the ratio r.

        input-coupled:   V = (r - R)/(1 - R)                                   (23)
        output-coupled:  V = (1 - R/r)/(1 - R)

    Parameters
    ----------
    layout : str
        The layout, which determines the relative ratio R from the basic ratio.
    R_o : float
        Basic ratio of the planetary gear [1].
    r : float
        The ratio w_3/w_1 [1].
    coupling : {"input", "output"}
        The shaft to which the variable unit is coupled.

    Returns
    -------
    float
        V [1].

    Raises
    ------
    ParameterError
        If no finite V gives r, or r is not finite.
    """
    _check_finite("r", r)
    R = relative_ratio(layout, R_o)
    if _input_coupled(coupling):
        return (r - R) / (1 - R)
    if r == 0:
        raise ParameterError(
            f"the output-coupled layout {layout} cannot have its output at rest while the input turns: V would be infinite; "
            "use the input-coupled layout"
        )
    return (1 - R / r) / (1 - R)


def _check_finite(name: str, value: float) -> None:
    if not math.isfinite(value):
        raise ParameterError(f"{name} = {value:g} must be finite")


def _input_coupled(coupling: str) -> bool:
    """Whether the unit is between 1 and 2. Errors: ParameterError for anything but input and output."""
    if coupling not in ("input", "output"):
        raise ParameterError(f'the coupling {coupling!r} must be "input" or "output"')
    return coupling == "input"


def switched(one: str, other: str) -> tuple[int, int, int]:
    """The positions (0, 1, 2) in which two layouts differ: the two members that change places, then the one that stays."""
    differ = [i for i, (p, q) in enumerate(zip(members(one), members(other), strict=True)) if p != q]
    if len(differ) != 2:
        raise ParameterError(
            f"the layouts {one} and {other} differ in {len(differ)} positions: exactly two members change places in "
            "a switched transmission"
        )
    return differ[0], differ[1], 3 - sum(differ)
