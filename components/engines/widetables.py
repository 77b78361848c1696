"""Converts wide tables, with one axis in the first line and another in the first column, to long ones with a row per point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from powertrain import Heading, ParameterError, TextTable
from powertrain.components.engines.tablecolumns import CALL, UNITS, unit_of

Roles = Mapping[str, Sequence[str]]
"""The quantities of a table, the value last, and the kinds of units that each may have."""


Asked = Mapping[str, str | None]
"""The headings named in the call."""


def long_table(sheet: TextTable, roles: Roles, asked: Asked) -> tuple[TextTable, Asked]:
    r"""The table itself, or a wide one with a column for every role, and the headings of these.

    The corner may name the first column, or both the first column and the first line, ``speed [rpm] \ torque [N.m]``, or the values. The
    call names the rest. The first column contains the speeds unless the corner says otherwise.
    Errors: ParameterError if something is not named.
    """
    if not sheet.is_wide:
        return sheet, asked
    named = {role: Heading.of(text) for role, text in asked.items() if text is not None}
    corner = _corner(sheet, roles)
    said = {role: Heading(head.name or role, head.unit) for role, head in (corner | named).items()}
    speed, load, value = roles
    missing = [f"{role}='{role} [unit]'" for role in roles if role not in said]
    if missing:
        raise ParameterError(
            f"{sheet.path}: a wide table with {speed}s in its first column, {load}s in its first line and the {value} inside: "
            f"pass {', '.join(missing)} {CALL}"
        )
    axes = [role for role in corner if role != value] or [speed]
    first, across = (speed, load) if axes[0] == speed else (load, speed)
    table = sheet.long(said[first], said[across], said[value])
    return table, {role: str(head) for role, head in said.items()}


def _corner(sheet: TextTable, roles: Roles) -> dict[str, Heading]:
    """The roles that the corner cell names, by their units."""
    headings = [Heading.of(part) for part in str(sheet.headings[0]).split("\\") if part.strip()]
    return {
        role: heading
        for heading in headings
        for role, kinds in roles.items()
        if any(unit_of(heading) in UNITS[kind] for kind in kinds)
    }
