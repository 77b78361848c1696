"""Type synthesis of 1:-1 couplings: the evaluation, which selects and ranks mechanisms (Madhavan 1996, ch. 4)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby

from powertrain.components.gearless.linkage.synthesis import Coupling, CouplingStructure


@dataclass(frozen=True)
class Criteria:
    """Limits on a mechanism: the evaluation criteria (3.2.2). Sliders rub, wear and lose energy.

    ``sliding``: P and C pairs in total; ``sliding_on_a_link``: on one link; ``point_contacts``: joints that are not lower pairs (None:
    any).
    """

    sliding: int = 3
    sliding_on_a_link: int = 1
    point_contacts: int | None = None

    def problems(self, coupling: Coupling) -> tuple[str, ...]:
        """The criteria that reject a mechanism, in order; empty if it is accepted."""
        found: list[str] = []
        if (count := sliders(coupling)) > self.sliding:
            found.append(f"{count} sliding pairs, {self.sliding} allowed")
        for link in range(1, coupling.links + 1):
            on_it = [joint for joint in coupling.on_link(link) if joint.sliding]
            if len(on_it) > self.sliding_on_a_link:
                pairs = ", ".join(map(str, on_it))
                found.append(
                    f"{_called(coupling, link)} has {len(on_it)} sliding pairs ({pairs}), {self.sliding_on_a_link} allowed"
                )
        if self.point_contacts is not None and (count := point_contacts(coupling)) > self.point_contacts:
            found.append(f"{count} joints without surface contact, {self.point_contacts} allowed")
        return tuple(found)


def sliders(coupling: Coupling) -> int:
    """Sliding pairs of a mechanism."""
    return sum(joint.sliding for *_, joint in coupling.edges)


def point_contacts(coupling: Coupling) -> int:
    """Joints of a mechanism in point or line contact: high stress, and wear."""
    return sum(not joint.surface for *_, joint in coupling.edges)


def order(coupling: Coupling) -> tuple[int, int, int]:
    """Joints without surface contact, sliding pairs, links: the ranking of chapter 4; fewer is better."""
    return point_contacts(coupling), sliders(coupling), coupling.links


@dataclass(frozen=True)
class Synthesis:
    """The mechanisms of a structure, and their evaluation by the criteria."""

    structure: CouplingStructure
    criteria: Criteria
    couplings: tuple[Coupling, ...]

    @property
    def problems(self) -> dict[Coupling, tuple[str, ...]]:
        """The criteria that reject each mechanism (Table 4.1)."""
        return {coupling: self.criteria.problems(coupling) for coupling in self.couplings}

    @property
    def accepted(self) -> list[Coupling]:
        """Potential mechanisms."""
        return [coupling for coupling, found in self.problems.items() if not found]

    @property
    def rejected(self) -> list[Coupling]:
        """The others."""
        return [coupling for coupling, found in self.problems.items() if found]

    @property
    def ranking(self) -> list[list[Coupling]]:
        """The potential mechanisms, best first; those in one list rank equally, and the choice among them is the designer's.

        The thesis ends with RRSCSRR and RSRCRSR, which rank equally, and chooses the first.
        """
        return [list(group) for _, group in groupby(sorted(self.accepted, key=order), key=order)]


def synthesize(structure: CouplingStructure | None = None, criteria: Criteria | None = None) -> Synthesis:
    """Generate and evaluate mechanisms; by default the search of the thesis: six mechanisms, four of them accepted."""
    what = structure or CouplingStructure()
    return Synthesis(what, criteria or Criteria(), tuple(what.generate()))


def _called(coupling: Coupling, link: int) -> str:
    names = {1: "the cage", 2: "the input link", coupling.lever: "the lever", coupling.links: "the output link"}
    return names.get(link, f"link {link}")
