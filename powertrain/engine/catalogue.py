"""What a run records about the laws of a model: the same for every run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from powertrain.dae.hybrid import HybridDae, Law, When


@dataclass(frozen=True)
class Catalogue:
    """``kinds``: (index, name, kind) of held values whose changes are events; ``quiet``: held values that change without an event.

    ``chattering``: laws that may switch without end; ``counted``: names of guards whose violations are only counted; ``modes``: indices of
    all modes; ``rests``: by the index of a mode, the index of the mark for a law that rests at its limit.
    """

    kinds: tuple[tuple[int, str, str], ...]
    quiet: frozenset[int]
    chattering: Mapping[int, Law | When]
    counted: tuple[str, ...]
    modes: tuple[int, ...]
    rests: Mapping[int, int]


def catalogue(dae: HybridDae) -> Catalogue:
    """The catalogue of one model."""
    loud = tuple(switch for switch in dae.switches if not switch.continuous)
    groups: list[tuple[str, tuple[Law | When, ...]]] = [
        ("friction", dae.frictions),
        ("switch", loud),
        ("contact", dae.contacts),
        ("when", dae.whens),
    ]
    entries = {schedule.index + k for schedule in dae.schedules for k in range(3)}
    return Catalogue(
        kinds=tuple((law.index, law.name, kind) for kind, laws in groups for law in laws),
        quiet=frozenset(entries | {s.index for s in (*dae.switches, *dae.relations) if s.continuous}),
        chattering={law.index: law for _, laws in groups for law in laws if getattr(law, "time", None) is None},
        counted=tuple(dae.counted),
        modes=tuple(law.index for law in (*dae.laws, *dae.whens)),
        rests={f.index: f.rests for f in dae.frictions if f.rests is not None},
    )
