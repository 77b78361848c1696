"""Plots: each function takes and returns an ``Axes``. matplotlib is imported here only, when it is needed."""

from __future__ import annotations

import re
from collections.abc import Sequence
from reprlib import repr as short
from typing import TYPE_CHECKING, Any

from powertrain.errors import ParameterError
from powertrain.events import MODES
from powertrain.language.arguments import text
from powertrain.language.reals import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FEW = 10
"""Lines with colours of their own and a legend inside the axes."""
_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def axes_of(ax: Axes | None, size: tuple[float, float] | None = None) -> Axes:
    """The axes given, or those of a new figure of this size in inches. ParameterError for anything else, such as a figure."""
    import matplotlib.pyplot as plt
    from matplotlib import axes

    if ax is None:
        return plt.subplots(figsize=size, layout="constrained")[1]
    if not isinstance(ax, axes.Axes):
        raise ParameterError(
            f"ax = {short(ax)} is not an Axes of matplotlib, as  figure, ax = plt.subplots()  gives one"
        )
    return ax


def plot_signals(result: Any, *what: Any, ax: Axes | None = None, events: bool | str = False, **line: Any) -> Axes:
    """Signals over time, with a legend, in one Axes: signals of a second unit are dashed and have their axis on the right.

    ``what``: names, patterns ("clutch*.w_rel") and selectors. ``events``: True marks every event with a thin line, a
    pattern those of the laws that fit. ``line``: options of matplotlib's lines. ParameterError for more than two units, and for another
    unit than that in the label of the lines in ``ax``.
    """
    groups: dict[str, list[tuple[str, str, Array]]] = {}
    for label, unit, doc, values in _signals(result, what):
        groups.setdefault(unit, []).append((label, doc, values))
    if len(groups) > 2:
        said = "; ".join(f"{', '.join(label for label, _, _ in group)} [{unit}]" for unit, group in groups.items())
        raise ParameterError(f"a plot shows at most two units, not {said}; plot the others in separate Axes (ax=...)")
    count = sum(map(len, groups.values()))
    ax = axes_of(ax, None if count <= FEW else (9.0, 5.0))
    drawn = len(ax.lines)
    sides: list[Axes] = []
    colours = line_colours(drawn + count)
    marker = "o" if len(set(result.time.tolist())) == 1 else None
    for unit, group in groups.items():
        side, style = (ax.twinx(), "--") if sides else (ax, "-")
        _name_axis(side, [(label, doc) for label, doc, _ in group], unit)
        for label, _, values in group:
            look = {"color": colours[drawn], "linestyle": style, "marker": marker, "label": label}
            side.plot(result.time, values, **look | line)
            drawn += 1
        _name_modes(result, side, [label for label, _, _ in group])
        sides.append(side)
    if events is not False:
        mark_events(result, ax, "*" if events is True else text("events", events))
    ax.set_xlabel("Time [s]")
    ax.margins(x=0)
    ax.grid(visible=True, alpha=0.3)
    handles = [handle for side in sides for handle in side.get_legend_handles_labels()[0]]
    legend_of(sides[-1], handles, aside=0.15 * (len(sides) - 1))
    return ax


def line_colours(count: int) -> list[Any]:
    """The colours of the cycle for a few lines, else as many from a colour map."""
    if count <= FEW:
        return [f"C{k}" for k in range(count)]
    from matplotlib import colormaps

    return [colormaps["turbo"](k / (count - 1)) for k in range(count)]


def legend_of(ax: Axes, handles: Sequence[Any], aside: float = 0.0) -> None:
    """A legend in the axes, if it is short, else on their right; ``aside``: share of their width that stands there already.

    A second axis stands there: its legend is on the right as well, because in the axes it would hide lines of the first.
    """
    if len(handles) <= FEW and not aside:
        ax.legend(handles=handles, loc="best")
    else:
        columns = -(-len(handles) // 24)
        place = (1.02 + aside, 1.0)
        ax.legend(handles=handles, loc="upper left", bbox_to_anchor=place, borderaxespad=0.0, fontsize=8, ncols=columns)


def mark_events(result: Any, ax: Axes, pattern: str = "*") -> Axes:
    """A thin vertical line at every event of the laws that fit."""
    for time in dict.fromkeys(result.events[pattern].times.tolist()):
        ax.axvline(time, color="0.4", linewidth=1.0, linestyle=":", zorder=0)
    return ax


def axis_label(signals: Sequence[tuple[str, str]], unit: str) -> str:
    """What (name, meaning up to its first comma) have in common, with the unit: 'Angular velocity [rad/s]', 'w [rad/s]' or '[rad/s]'."""
    meanings = {doc.partition(",")[0] for _, doc in signals if doc}
    names = {label.rpartition(".")[2] for label, _ in signals}
    common = meanings.pop() if len(meanings) == 1 and all(doc for _, doc in signals) else ""
    if not common and len(names) == 1 and all(doc for _, doc in signals):
        common = names.pop()
    shown = f"[{unit_text(unit)}]" if unit not in ("", "1") else ""
    return " ".join(part for part in (common, shown) if part)


def unit_text(unit: str) -> str:
    """A unit as it is printed: 'kg·m²', 'N·m/rad'."""
    raised = re.sub(r"(?<=[A-Za-z])-?\d+", lambda match: match.group().translate(_SUPERSCRIPTS), unit)
    return raised.replace(".", "·")


def _signals(result: Any, what: Sequence[Any]) -> list[tuple[str, str, str, Array]]:
    """Label, unit, meaning and values of all that is asked for."""
    if not what:
        raise ParameterError('plot needs the names of signals: result.plot("J1.w"); result.names() lists them')
    found: list[tuple[str, str, str, Array]] = []
    for item in what:
        patterned = isinstance(item, str) and ("*" in item or "?" in item)
        for one in result.names(str(item)) if patterned else [item]:
            found.append((result.label(one), result.unit(one), result.description(one), result[one]))
    return found


def _name_axis(ax: Axes, signals: Sequence[tuple[str, str]], unit: str) -> None:
    """Label the axis; if its lines have another label with this unit, with the unit alone. ParameterError for another unit."""
    label, before = axis_label(signals, unit), ax.get_ylabel() if ax.lines else ""
    if before and label != before:
        if _bracketed(label) != _bracketed(before):
            raise ParameterError(
                f"the axis of ax shows {before}; plot {signals[0][0]} [{unit_text(unit)}] in separate Axes (ax=...)"
            )
        label = _bracketed(label)
    ax.set_ylabel(label)


def _bracketed(label: str) -> str:
    """The unit at the end of a label, '[rad/s]'; empty if there is none."""
    return label[label.rfind("[") :] if label.endswith("]") else ""


def _name_modes(result: Any, ax: Axes, labels: Sequence[str]) -> None:
    """Label the axis with the names of the modes if all signals are modes of one kind."""
    kinds = {result.modes.get(label, "") for label in labels}
    named = MODES.get(kinds.pop(), {}) if len(kinds) == 1 else {}
    if named:
        ax.set_yticks(sorted(named), [named[mode] for mode in sorted(named)])
        ax.set_ylabel("Mode")


def plot_overlaid(
    results: Sequence[Any], names: Sequence[str], signals: Sequence[str], *, ax: Axes | None = None
) -> Axes:
    """Signals of several runs (results, or saved runs) over time in one Axes: a colour for each signal, a line style for each run.

    Errors: ParameterError for unknown signals and for signals of different units.
    """
    units = {unit for result in results for _, unit, _, _ in _signals(result, signals)}
    if len(units) > 1:
        raise ParameterError(f"plot: overlaid signals must have one unit, not {', '.join(sorted(units))}")
    count = max(len(_signals(result, signals)) for result in results)
    ax = axes_of(ax, None if count * len(results) <= FEW else (9.0, 5.0))
    colours = line_colours(count)
    _name_axis(ax, [(label, doc) for result in results for label, _, doc, _ in _signals(result, signals)], units.pop())
    for result, name, style in zip(results, names, ("-", "--", ":", "-."), strict=False):
        for k, (label, _, _, values) in enumerate(_signals(result, signals)):
            ax.plot(result.time, values, color=colours[k], linestyle=style, label=f"{label}, {name}")
    ax.set_xlabel("Time [s]")
    ax.margins(x=0)
    ax.grid(visible=True, alpha=0.3)
    legend_of(ax, ax.get_legend_handles_labels()[0])
    return ax
