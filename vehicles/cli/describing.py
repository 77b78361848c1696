"""``powertrain info``: what a component or a vehicle is, and what can be set in it."""

from __future__ import annotations

import inspect
import re
import textwrap
from collections.abc import Iterator
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import click

from powertrain.vehicles.cli.options import Command, of_the_command_line
from powertrain.vehicles.cli.text import columns, title

if TYPE_CHECKING:
    from powertrain import Component
    from powertrain.vehicles.cli.catalogue import Entry

HELPER = re.compile(r"\bself\.(_\w+)\(")


@click.command(
    "info",
    cls=Command,
    short_help="A component or vehicle: parameters, slots, ports, equations, source.",
    examples=("info Clutch", "info rotational.Fixed", "info SplitPathCar", "info MappedEngine --text"),
)
@click.argument("name")
@click.option("--text", is_flag=True, help="The whole text of the class, as it stands in its file.")
def command(name: str, text: bool) -> None:
    """What a component or a vehicle is: parameters with units, defaults and ranges, slots, ports, variables, equations, source.

    What is listed can be set by `powertrain run VEHICLE --set PATH=VALUE`. Names found in several families take the family before them.
    """
    from powertrain.vehicles.cli import catalogue

    with of_the_command_line():
        entry = catalogue.find(name, (*catalogue.assembled(), *catalogue.components()), "component")
    click.echo(described(entry, text))


def described(entry: Entry, text: bool = False) -> str:
    """All about a component."""
    kind = entry.kind
    sections = [f"{entry.name} ({entry.family})\n\n{textwrap.indent(inspect.getdoc(kind) or '', '  ')}"]
    for heading, body in (
        ("Parameters", _parameters(kind)),
        ("Slots and fields", _slots(kind)),
        ("Ports", _ports(kind)),
        ("Variables", _variables(kind)),
        ("Parameters of its parts", _inner(kind)),
        ("Equations", inspect.getsource(kind) if text else "\n".join(_equations(kind))),
        ("Source", f"  {kind.__module__}, {inspect.getsourcefile(kind)}"),
    ):
        if body:
            sections.append(f"{title(heading)}\n{body}")
    return "\n".join(sections)


def _parameters(kind: type[Component]) -> str:
    from powertrain import Parameter

    rows = [_parameter(name, spec, spec.default) for name, spec in kind._fields.items() if isinstance(spec, Parameter)]
    return columns(rows, ("name", "default", "unit", "range", "meaning"), right=[1])


def _parameter(name: str, spec: Any, value: float | None) -> tuple[str, ...]:
    return name, "must be given" if value is None else f"{value:g}", spec.unit, spec.range, spec.doc


def _slots(kind: type[Component]) -> str:
    from powertrain import Component, Discrete, Parameter, Variable
    from powertrain.component import _MISSING, Port
    from powertrain.vehicles.cli import catalogue

    rows = []
    for name, spec in kind._fields.items():
        if isinstance(spec, (Port, Parameter, Variable, Discrete)):
            continue
        takes = kind._slot_types().get(name)
        default = (
            "must be given"
            if spec is _MISSING
            else type(spec).__name__
            if isinstance(spec, Component)
            else _short(spec)
        )
        fits = [entry.name for entry in catalogue.fitting(takes) if entry.kind is not takes]
        rows.append((name, _kind(takes), default, f"takes {', '.join(fits)}" if fits else ""))
    return columns(rows, ("name", "kind", "default", ""))


def _kind(takes: Any) -> str:
    return takes.__name__ if isinstance(takes, type) else str(takes).replace("typing.", "").replace("NoneType", "None")


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 30 else f"a {type(value).__name__}"


def _ports(kind: type[Component]) -> str:
    from powertrain import Variable
    from powertrain.component import Port

    rows = []
    for name, spec in kind._fields.items():
        if isinstance(spec, Port):
            made = spec.build()
            unit, doc = (str(getattr(made, key, "")) for key in ("unit", "doc"))
            inner = [f"{n} [{q.unit}]" for n, q in spec.kind._fields.items() if isinstance(q, Variable) and not doc]
            rows.append(
                (
                    name,
                    spec.kind.__name__,
                    unit or ", ".join(inner),
                    doc or ("grounded if open" if spec.grounded else ""),
                )
            )
    return columns(rows, ("name", "kind", "unit", "meaning"))


def _variables(kind: type[Component]) -> str:
    from powertrain import Discrete, Variable

    rows = [
        (name, spec.unit, spec.doc) for name, spec in kind._fields.items() if isinstance(spec, (Variable, Discrete))
    ]
    return columns(rows, ("name", "unit", "meaning"))


def _inner(kind: type[Component]) -> str:
    """The parameters of the parts that stand in the slots by default, by path."""
    from powertrain import PowertrainError
    from powertrain import compile as build
    from powertrain.vehicles.cli.settings import places

    try:
        model = kind()
    except PowertrainError:
        return ""
    found = [p for p in places(model) if p.spec is not None and "." in p.path]
    if found:
        with suppress(PowertrainError):  # some parts do not stand alone
            free = build(model).parameters
            found = [p for p in found if p.path in free]
    rows = [_parameter(p.path, p.spec, p.value) for p in found]
    return columns(rows, ("path", "value", "unit", "range", "meaning"), right=[1])


def _equations(kind: type[Component]) -> Iterator[str]:
    """The text of equations, initial, energy and loss, with the helpers they call."""
    wanted, seen = ["equations", "initial", "energy", "loss"], set[str]()
    while wanted:
        name = wanted.pop(0)
        owner = next((c for c in kind.__mro__ if name in vars(c)), None)
        if name in seen or owner is None or owner.__module__ == "powertrain.component":
            continue
        seen.add(name)
        text = textwrap.dedent(inspect.getsource(vars(owner)[name]))
        wanted += [helper for helper in HELPER.findall(text) if helper not in seen]
        yield textwrap.indent(text, "  ")
