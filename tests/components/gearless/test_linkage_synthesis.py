"""Type synthesis: the six couplings of the thesis, their mobility, verdicts and order; other searches; counts by brute force."""

from __future__ import annotations

from itertools import combinations, product

import pytest

import powertrain as pt
from powertrain.components.gearless.linkage.synthesis import (
    Bc,
    C,
    Coupling,
    CouplingStructure,
    E,
    G,
    Joint,
    P,
    R,
    S,
    middle_problem,
)
from powertrain.components.gearless.linkage.synthesis_evaluation import Criteria, Synthesis, synthesize

SIX = {"RBcCBcR", "RCCCCCR", "RRSCSRR", "RSRCRSR", "RPSCSPR", "RSPCPSR"}


@pytest.fixture(scope="module")
def thesis() -> Synthesis:
    return synthesize()


def named(found: Synthesis) -> dict[str, Coupling]:
    return {coupling.name: coupling for coupling in found.couplings}


def test_six_couplings(thesis: Synthesis) -> None:
    """Table 3.1. Two of its names miss letters (RCCCCR, RSRCSR), which seven joints and Fig. 3.5 give back."""
    assert len(thesis.couplings) == 6
    assert set(named(thesis)) == SIX
    assert thesis.couplings[0].name == "RBcCBcR"


def test_mobility(thesis: Synthesis) -> None:
    """Eqs. (4.1), (4.2): F = 0 of the whole, 1 of each loop."""
    for name, coupling in named(thesis).items():
        joints = [joint for *_, joint in coupling.edges]
        assert (coupling.links, len(joints)) == ((4, 5) if name == "RBcCBcR" else (6, 7))
        assert sum(joint.freedom for joint in joints) == 12
        assert coupling.freedom == 0
        assert coupling.loops == 2
        assert coupling.symmetric


def test_graph(thesis: Synthesis) -> None:
    """Fig. 3.5, numbered as there: 1 cage, 2 input, 3 and 5 couplers, 4 lever, 6 output; cage and lever are ternary, the others binary."""
    coupling = named(thesis)["RRSCSRR"]
    assert coupling.edges == ((1, 2, R), (2, 3, R), (3, 4, S), (4, 1, C), (4, 5, S), (5, 6, R), (6, 1, R))
    assert coupling.lever == 4
    assert [len(coupling.on_link(link)) for link in range(1, 7)] == [3, 2, 2, 3, 2, 2]


def test_middle_joint() -> None:
    """P. 19: dead points with R and P, lost symmetry with S and Bc."""
    assert CouplingStructure().in_the_middle == (C,)
    assert all("dead points" in str(middle_problem(joint)) for joint in (R, P))
    assert all("symmetry" in str(middle_problem(joint)) for joint in (S, Bc, E))


def test_verdicts(thesis: Synthesis) -> None:
    """Table 4.1: two are rejected, each by its rule."""
    problems = {coupling.name: found for coupling, found in thesis.problems.items()}
    assert {coupling.name for coupling in thesis.rejected} == {"RCCCCCR", "RSPCPSR"}
    assert problems["RCCCCCR"][0] == "5 sliding pairs, 3 allowed"
    assert problems["RSPCPSR"] == ("the lever has 3 sliding pairs (P, C, P), 1 allowed",)


def test_ranking(thesis: Synthesis) -> None:
    """4.1: point contacts speak against RBcCBcR, three sliders against RPSCSPR, and two are left that are equal."""
    ranking = [[coupling.name for coupling in group] for group in thesis.ranking]
    assert [set(group) for group in ranking] == [{"RRSCSRR", "RSRCRSR"}, {"RPSCSPR"}, {"RBcCBcR"}]


def words(joints: tuple[Joint, ...], length: int, middle: Joint, mobility: int = 6) -> list[tuple[Joint, ...]]:
    """All words of joints that start and end with R, whose parts to either side of a middle joint close a loop of one freedom."""
    found = []
    for word in product(joints, repeat=length):
        for k in range(2, length - 2):
            left, right = word[: k + 1], word[k:]
            ends = word[0] == word[-1] == R and word[k] == middle
            if ends and all(sum(j.freedom for j in part) == mobility + 1 for part in (left, right)):
                found.append((*word[:k], Joint("|", 0, 0, 0), *word[k + 1 :]))
    return found


def test_count_by_brute_force() -> None:
    """Among all words of up to seven joints only six read alike from both sides."""
    every = [word for length in (5, 6, 7) for word in words((R, P, S, C, Bc), length, C)]
    alike = [word for word in every if word == word[::-1]]
    assert {"".join(map(str, word)).replace("|", "C") for word in alike} == SIX
    assert len(alike) == 6
    free = synthesize(CouplingStructure(symmetric=False)).couplings
    assert len(free) == len({min(word, word[::-1], key=str) for word in every})
    assert sum(coupling.symmetric for coupling in free) == 6


def two_loop_graphs(links: int) -> set[tuple[int, ...]]:
    """All graphs in which links 0 and 1 are ternary and joined, the others binary, and the joint of 0 and 1 lies in both loops.

    Each is named by how many links the ways from 0 to 1 beside that joint have between them.
    """
    found = set()
    pairs = [pair for pair in combinations(range(links), 2) if pair != (0, 1)]
    for edges in combinations(pairs, links):  # with the middle joint j = l + 1, two loops
        near: dict[int, set[int]] = {link: set() for link in range(links)}
        for one, other in edges:
            near[one].add(other)
            near[other].add(one)
        if any(len(others) != 2 for others in near.values()):
            continue
        ways = []
        for first in near[0]:
            way = [0, first]
            while way[-1] not in (0, 1):
                (after,) = near[way[-1]] - {way[-2]}
                way.append(after)
            ways.append(way)
        if all(way[-1] == 1 for way in ways) and sum(len(way) - 2 for way in ways) == links - 2:
            found.add(tuple(sorted(len(way) - 2 for way in ways)))
    return found


@pytest.mark.parametrize("symmetric", [True, False])
def test_graphs_by_brute_force(symmetric: bool) -> None:
    """Figs. 3.4 and 3.5 are all graphs with equal halves; without symmetry there are two more."""
    every = set.union(*(two_loop_graphs(links) for links in range(3, 7)))
    assert every == {(1, 1), (1, 2), (1, 3), (2, 2)}
    found = synthesize(CouplingStructure(symmetric=symmetric)).couplings
    between = {tuple(sorted((len(c.input_side) - 1, len(c.output_side) - 1))) for c in found}
    assert between == {graph for graph in every if not symmetric or graph[0] == graph[1]}


def test_longer_search_by_brute_force() -> None:
    """Nine joints and lower pairs only: three joints in each arm with four freedoms together, and none of four."""
    found = synthesize(CouplingStructure(joints=(R, P, S, C), max_joints=9)).couplings
    arms = [arm for n in (1, 2, 3) for arm in product((R, P, S, C), repeat=n) if sum(j.freedom for j in arm) == 4]
    assert {coupling.input_side[1:] for coupling in found} == set(arms)
    assert len(found) == len(arms) == 5 + 12
    assert {coupling.freedom for coupling in found} == {0}


def test_plane_pairs_and_lower_pairs() -> None:
    """With the plane pair that the thesis leaves out, and without the ball in a cylinder."""
    found = synthesize(CouplingStructure(joints=(R, P, S, C, E)))
    assert set(named(found)) - SIX == {"RRECERR", "RERCRER", "RPECEPR", "REPCPER"}
    assert "RBcCBcR" not in named(found)
    lower = synthesize(criteria=Criteria(point_contacts=0))
    assert {coupling.name for coupling in lower.accepted} == {"RRSCSRR", "RSRCRSR", "RPSCSPR"}


def test_known_couplings_in_plane_and_on_sphere() -> None:
    """The slider of Fig. 3.1, whose middle joint has dead points, and the bevel gears of Fig. 2.1."""
    plane = synthesize(CouplingStructure(joints=(R,), middle=(P,), mobility=3))
    assert [coupling.name for coupling in plane.couplings] == ["RRRPRRR"]
    sphere = synthesize(CouplingStructure(joints=(G,), middle=(R,), mobility=3, max_joints=5))
    assert [coupling.name for coupling in sphere.couplings] == ["RGRGR"]
    assert sphere.couplings[0].freedom == 1  # not overconstrained


def test_idle_freedoms() -> None:
    """Two RSSR linkages on one rocker: each coupler spins about itself, which is no motion of the linkage."""
    found = named(synthesize(CouplingStructure(joints=(R, S), middle=(R,))))
    assert set(found) == {"RSSRSSR"}
    assert found["RSSRSSR"].freedom == 3  # two of them idle


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        ({"mobility": 7}, "mobility = 7"),
        ({"max_joints": 4}, "max_joints = 4"),
        ({"loop_freedom": 0}, "loop_freedom = 0"),
        ({"joints": ()}, "one kind of joint"),
        ({"joints": (R, S)}, "no joint can be the middle one .*dead points.*symmetry"),
    ],
)
def test_impossible_searches(wrong: dict[str, object], text: str) -> None:
    with pytest.raises(pt.ParameterError, match=text):
        CouplingStructure(**wrong)  # type: ignore[arg-type]
