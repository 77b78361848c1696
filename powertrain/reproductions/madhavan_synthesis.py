"""Madhavan 1996, chapters 3 and 4: the enumeration of 1:-1 couplings, its verdicts, and Fig. 3.6 from the type synthesis."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from powertrain.components.gearless.linkage.synthesis import Coupling, CouplingStructure
from powertrain.components.gearless.linkage.synthesis_evaluation import order, synthesize
from powertrain.reproductions.drawing import panels
from powertrain.reproductions.table import Row, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PRINTED = ("RBcCBcR", "RCCCCR", "RRSCSRR", "RSRCRSR", "RPSCSPR", "RSPCPSR")
"""Table 3.1."""
WHOLE = {"RCCCCR": "RCCCCCR", "RSRCSR": "RSRCRSR"}
"""Names that miss letters in print, and what they are."""


def enumeration() -> Table:
    """Sections 3.2, 3.3 and 4.1: structure, mobility, joint combinations."""
    couplings = synthesize().couplings
    names = {coupling.name for coupling in couplings}
    four = [coupling for coupling in couplings if coupling.links == 4]
    six = [coupling for coupling in couplings if coupling.links == 6]
    middle = CouplingStructure().in_the_middle
    rows = [
        Row("middle joint that keeps symmetry and has no dead points", "", "3.2", "C", ", ".join(map(str, middle))),
        Row("sum of freedoms in each loop", "1", "eq. (3.3)", "7", _only(_loop_freedoms(c) for c in couplings)),
        Row("f_x of the four-link mechanism", "1", "3.3", "4", _only(c.input_side[1].freedom for c in four)),
        Row("joint combinations with four links", "1", "3.3", "1", len(four)),
        Row("joint combinations with six links", "1", "3.3", "5", len(six)),
    ]
    for k, printed in enumerate(PRINTED):
        name = WHOLE.get(printed, printed)
        right = name if name != printed else None
        remark = "as Table 4.1 has it; the print misses a letter" if right else ""
        rows.append(
            Row(f"combination {k + 1}", "", "Table 3.1", printed, name if name in names else "missing", remark, right)
        )
    rows.append(
        Row(
            "combination 4 in Fig. 3.6",
            "",
            "Fig. 3.6, 4.1",
            "RSRCSR",
            _found("RSRCRSR", names),
            "the print misses a letter",
            "RSRCRSR",
        )
    )
    for source, group in (("eq. (4.1)", four), ("eq. (4.2)", six)):
        what = "of the mechanism with four links" if group is four else "of those with six links"
        j, f = "5" if group is four else "7", [sum(joint.freedom for *_, joint in c.edges) for c in group]
        rows += [
            Row(f"l {what}", "1", source, "4" if group is four else "6", _only(c.links for c in group)),
            Row(f"j {what}", "1", source, j, _only(len(c.edges) for c in group)),
            Row(f"sum of freedoms {what}", "1", source, "12", _only(f)),
            Row(
                f"F {what}",
                "1",
                source,
                "0",
                _only(c.freedom for c in group),
                "overconstrained: the symmetry makes them move",
            ),
        ]
    return Table("Enumeration", rows, "Generated from the structure specifications (3.2.1); no result is an input.")


def evaluation() -> Table:
    """Section 4.1: verdicts and order."""
    found = synthesize()
    problems = {coupling.name: said for coupling, said in found.problems.items()}
    printed = dict.fromkeys((WHOLE.get(name, name) for name in PRINTED), "accepted") | {
        "RCCCCCR": "rejected",
        "RSPCPSR": "rejected",
    }
    rows = [
        Row(name, "", "Table 4.1", verdict, "rejected" if problems[name] else "accepted", "; ".join(problems[name]))
        for name, verdict in printed.items()
    ]
    rank = {coupling.name: order(coupling) for coupling in found.accepted}
    rows.append(Row("potential mechanisms", "1", "4.1", "4", len(found.accepted)))
    for name, count in (("RPSCSPR", "3"), ("RRSCSRR", "1"), ("RSRCRSR", "1")):
        rows.append(Row(f"sliders of {name}", "1", "4.1", count, rank[name][1]))
    rows.append(Row("joints of RBcCBcR that are not lower pairs", "1", "Table 4.1", "2", rank["RBcCBcR"][0]))
    best = ", ".join(sorted(coupling.name for coupling in found.ranking[0]))
    remark = "equal in all criteria; RRSCSRR is the author's choice"
    rows.append(Row("the mechanisms that are left", "", "4.1", "RRSCSRR, RSRCRSR", best, remark))
    return Table(
        "Evaluation",
        rows,
        "Ranked by sliding pairs, in total and on one link (3.2.2), then by point contacts and sliders.",
    )


def _loop_freedoms(coupling: Coupling) -> int:
    return sum(joint.freedom for joint in (*coupling.input_side, coupling.middle))


def _only(values: object) -> int:
    """The value that all have."""
    (value,) = set(values)  # type: ignore[call-overload]
    return int(value)


def _found(name: str, names: set[str]) -> str:
    return name if name in names else "missing"


def figure_3_6() -> Figure:
    """The graphs of the six couplings."""
    found = synthesize()
    couplings = sorted(found.couplings, key=lambda c: [WHOLE.get(n, n) for n in PRINTED].index(c.name))
    figure, axes = panels([coupling.name for coupling in couplings], 3, 3.4, 3.3)
    for k, (ax, coupling) in enumerate(zip(axes, couplings, strict=True), 1):
        draw_graph(coupling, ax)
        said = found.problems[coupling]
        ax.set_title(
            f"{k}. {coupling.name}: {'rejected' if said else 'accepted'}", color="C3" if said else "k", fontsize=11
        )
    return figure


def draw_graph(coupling: Coupling, ax: Axes) -> None:
    """Links as vertices (the cage ringed), joints as edges, the two loops side by side."""
    sides = (coupling.lever - 2, coupling.links - coupling.lever)
    place = {1: (0.0, -1.0), coupling.lever: (0.0, 1.0)}
    for first, count, x in ((2, sides[0], -1.0), (coupling.lever + 1, sides[1], 1.0)):
        for k in range(count):
            height = -math.cos(math.pi * (k + 1) / (count + 1))
            place[first + k if x < 0 else coupling.links - k] = (x, height)
    for one, other, joint in coupling.edges:
        (x1, y1), (x2, y2) = place[one], place[other]
        ax.plot([x1, x2], [y1, y2], color="C0", zorder=1)
        box = {"boxstyle": "round,pad=0.2", "fc": "white", "ec": "none"}
        ax.text((x1 + x2) / 2, (y1 + y2) / 2, joint.name, ha="center", va="center", color="C0", bbox=box)
    for link, (x, y) in place.items():
        ax.plot(x, y, "o", ms=17, mfc="white", mec="k", mew=2.5 if link == 1 else 1, zorder=2)
        if link == 1:
            ax.plot(x, y, "o", ms=23, mfc="none", mec="k", zorder=2)
        ax.text(x, y, str(link), ha="center", va="center", zorder=3)
    ax.set(xlim=(-1.5, 1.5), ylim=(-1.45, 1.35))
    ax.set_aspect("equal")
    ax.set_axis_off()
