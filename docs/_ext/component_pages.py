"""A page for every component and vehicle, from its declarations; the facts are those of ``powertrain info``."""

from __future__ import annotations

import importlib
import inspect
import re
from functools import cache
from pathlib import Path

import pagetext

from powertrain.cli.facts import facts, text_of
from powertrain.presets.catalogue import Entry, assembled, components
from powertrain.presets.ordinary import ORDINARY

TITLES = {
    "rotational": "Rotational mechanics",
    "translational": "Translational mechanics",
    "differentials": "Differentials and planetary gears",
    "gearless.circular_cam": "Circular-cam differential",
    "gearless.spherical_cam": "Spherical cam differential",
    "gearless.linkage": "Linkage differential",
    "cvu": "Continuously variable units",
    "transmissions": "Transmissions",
    "engines": "Combustion engines",
    "vibration": "Torsional vibration and mounts",
    "belts": "Belts and chains",
    "electric": "Electric machines and batteries",
    "wheels": "Wheels and tyres",
    "body": "Bodies, axles and roads",
    "control": "Drivers and controls",
    "cycles": "Drive cycles",
    "vehicle": "One-dimensional vehicle",
    "blocks": "Signals",
    "thermal": "Heat",
}
"""The families in the order of their pages; a family that is not here comes after them, by its name."""
VEHICLES = "vehicles"
_KIND = re.compile(r"\b[A-Z]\w+\b(?!`)")


def write_pages(docs: Path) -> None:
    """Write <docs>/components, and take away the pages of what is no longer there."""
    folder = docs / "components"
    families: dict[str, list[Entry]] = {name: [] for name in TITLES}
    for entry in components():
        families.setdefault(entry.family, []).append(entry)
    families = {name: sorted(found, key=lambda e: e.name.lower()) for name, found in families.items() if found}
    written = {folder / "index.md"}
    pagetext.write(folder / "index.md", _index(families))
    for family, entries in (*families.items(), (VEHICLES, list(assembled()))):
        written.add(folder / family / "index.md")
        pagetext.write(folder / family / "index.md", _family(family, entries))
        for entry in entries:
            written.add(folder / family / f"{entry.name}.md")
            pagetext.write(folder / family / f"{entry.name}.md", _page(entry))
    for old in set(folder.rglob("*.md")) - written:
        old.unlink()


def _index(families: dict[str, list[Entry]]) -> str:
    count = sum(map(len, families.values()))
    parts = [
        "# Components",
        f"{count} components in {len(families)} families, one page each: description and equations, parameters with unit, default and "
        "range, ports, variables, and the source of the equations. The pages are generated from the declarations. `powertrain info NAME` "
        "prints the same information. See the [conventions](../conventions.md) for signs and names. If you do not know what a part is "
        "called here, look for its [ordinary name](#by-ordinary-name) below.",
    ]
    parts += [f"[**{_title(f)}**]({f}/index.md) — {_links(f, entries)}" for f, entries in families.items()]
    parts += ["## By ordinary name", _ordinary()]
    return "\n\n".join([*parts, _toctree(f"{family}/index" for family in families)])


def _ordinary() -> str:
    """A table of ordinary names, for those who do not know what a class is called."""
    places = {e.name: f"{e.family}/{e.name}.md" for e in reversed(components())}
    rows = (
        f"| {names} | {', '.join(f'[{kind}]({places[kind]})' for kind in kinds)} |"
        for names, kinds in sorted(ORDINARY.items(), key=lambda row: row[0].lower())
    )
    return "\n".join(["| looking for | component |", "| --- | --- |", *rows])


def _links(family: str, entries: list[Entry]) -> str:
    return ", ".join(f"[{entry.name}]({family}/{entry.name}.md)" for entry in entries)


def _family(family: str, entries: list[Entry]) -> str:
    rows = "\n".join(f"| [{e.name}]({e.name}.md) | {pagetext.escaped(_first_line(e))} |" for e in entries)
    if family == VEHICLES:
        title, said = "Vehicles: components and parameters", ""
    else:
        said = inspect.getdoc(importlib.import_module(f"powertrain.components.{family}")) or ""
        title = _title(family)
    parts = [f"# {title}", pagetext.docstring(said), f"| component | description |\n| --- | --- |\n{rows}"]
    return "\n\n".join([*parts, _toctree(entry.name for entry in entries)])


def _page(entry: Entry) -> str:
    kind = entry.kind
    parts = [
        f"# {entry.name}",
        pagetext.docstring(inspect.getdoc(kind) or "", kind._fields),
        f"```python\n{_import(entry)}\n```",
    ]
    tables = facts(kind)
    for found in tables:
        rows = [[_cell(cell, head) for cell, head in zip(row, found.head, strict=True)] for row in found.rows]
        shown = f"```{{table}}\n:class: facts\n\n{pagetext.table(found.head, rows, found.right, code=(0,))}\n```"
        if found.title == "Slots and fields":
            shown = _KIND.sub(lambda name: _linked(name[0]), shown)
        parts.append(f"## {found.title}\n\n{shown}")
    if any("must be given" in row for found in tables for row in found.rows):
        parts.append("–: no default; a value must be given.")
    parts.append(f"## Equations as written\n\n```python\n{text_of(kind).strip()}\n```")
    line = inspect.getsourcelines(kind)[1]
    file = kind.__module__.removeprefix("powertrain.").replace(".", "/")
    parts.append(f"Source: `{file}.py`, line {line}.")
    return "\n\n".join(parts) + "\n"


def _cell(text: str, head: str) -> str:
    if head == "range":
        return text.replace(", ", ",\N{NO-BREAK SPACE}").replace("-inf", "−∞").replace("inf", "∞")
    return text.replace("must be given", "–")


@cache
def _places() -> dict[str, str]:
    """The pages of components by name, without names that occur in several families."""
    names = [entry.name for entry in components()]
    return {e.name: f"../{e.family}/{e.name}.md" for e in components() if names.count(e.name) == 1}


def _linked(name: str) -> str:
    return f"[{name}]({_places()[name]})" if name in _places() else name


def _import(entry: Entry) -> str:
    package, _, _ = entry.kind.__module__.rpartition(".")
    exported = getattr(importlib.import_module(package), entry.name, None) is entry.kind
    return f"from {package if exported else entry.kind.__module__} import {entry.name}"


def _title(family: str) -> str:
    return TITLES.get(family, family.replace("_", " ").capitalize())


def _first_line(entry: Entry) -> str:
    return (inspect.getdoc(entry.kind) or "").partition("\n")[0]


def _toctree(names: object) -> str:
    assert hasattr(names, "__iter__")
    return "\n".join(["```{toctree}", ":hidden:", ":maxdepth: 1", "", *names, "```", ""])
