"""The model as it is written, kept beside its equations for all that refers to it: selectors, energy terms, connections, messages."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

from powertrain.compiler.flat import Equation, Face, Flat
from powertrain.language.component import Component
from powertrain.language.law import Law
from powertrain.language.recorder import Place, Recorder, reading
from powertrain.language.symbols import Symbol


@dataclass(frozen=True)
class Source:
    """The components of a model, each before its parts, and what they say, in the model's variables.

    ``connections``: the ports that meet in each node. ``bindings``: bound parameters with their values in terms of the free ones.
    """

    components: tuple[Component, ...]
    connections: tuple[tuple[Face, ...], ...]
    equations: tuple[Equation, ...]
    initial: tuple[Equation, ...]
    laws: tuple[tuple[Place, Law], ...]
    bindings: tuple[tuple[Symbol, Symbol], ...]
    recorder: Recorder

    @property
    def model(self) -> Component:
        """The model, whose variables and those of its parts are symbols."""
        return self.components[0]

    @contextmanager
    def reading(self, path: str) -> Iterator[Recorder]:
        """Allows ``der`` and laws in expressions of the components' variables; what they declare is recorded apart."""
        with reading(replace(self.recorder, path=path, text=None, switches=[], schedules=[], guards=[])) as apart:
            yield apart


def source_of(flat: Flat) -> Source:
    """What remains of the flat model after compilation."""
    return Source(
        components=tuple(flat.components),
        connections=tuple(flat.nodes),
        equations=tuple(flat.equations),
        initial=tuple(flat.initial),
        laws=tuple(flat.laws),
        bindings=tuple((b.constant.symbol, b.value) for b in flat.bindings.values()),
        recorder=flat.recorder,
    )
