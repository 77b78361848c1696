"""Checks that there are as many equations as unknowns everywhere in the model; the error names what is redundant or missing."""

from __future__ import annotations

from collections.abc import Collection

from powertrain.compiler.alias import Reduced, quote
from powertrain.compiler.index import Differentiated
from powertrain.compiler.law_torques import LawTorque
from powertrain.compiler.matching import Matching
from powertrain.errors import ModelError
from powertrain.language.component import children
from powertrain.language.connectors import Connector
from powertrain.language.fields import Port, Variable
from powertrain.language.symbols import key


def check_structure(reduced: Reduced, torques: list[LawTorque]) -> None:
    """As many equations as variables, and every variable matched to an equation; the error names what is redundant or missing."""
    _check_open_ends(reduced)
    known = {key(t.symbol) for t in torques}
    system = Differentiated(reduced, known)
    bases = [list(dict.fromkeys(b for b, _ in system.bases(e.residual))) for e in reduced.equations]
    matching = Matching(lambda e: bases[e])
    for e in range(len(bases)):
        if not matching.augment(e):
            raise ModelError(_too_much(reduced, sorted(matching.seen_equations), matching.seen_variables, torques))
    free = [b for b in reduced.symbols if b not in reduced.aliases and b not in known and b not in matching.equation_of]
    if free:
        raise ModelError(_too_little(reduced, free))


def _check_open_ends(reduced: Reduced) -> None:
    """ModelError for a part that transmits nothing because one of its ends is not connected."""
    for part, end in reduced.flat.open_ports:
        if any(not isinstance(inner, Connector) for _, inner in children(part)):
            continue  # its own parts may have an effect
        named = [part.__dict__[n] for n, spec in part._fields.items() if isinstance(spec, Port)]
        ports = [p for p in named if p.kind() is end.kind()]
        flows = [key(p._symbols[n]) for p in ports for n, q in p._fields.items() if isinstance(q, Variable) and q.flow]
        others = {reduced.affine(k).root for p in ports if p is not end for k in _potentials(p)}
        rigid = any(reduced.affine(k).root in others for k in _potentials(end))
        if len(ports) > 1 and flows and not rigid and all(_is_nothing(reduced, k) for k in flows):
            raise ModelError(
                f"loose end: {end._path} is not connected, so that {part._path} ({type(part).__name__}) transmits nothing; "
                "connect it, or remove the part"
            )


def _potentials(port: Connector) -> list[int]:
    return [key(port._symbols[n]) for n, q in port._fields.items() if isinstance(q, Variable) and not q.flow]


def _is_nothing(reduced: Reduced, k: int) -> bool:
    alias = reduced.affine(k)
    return alias.root is None and isinstance(alias.offset, float) and alias.offset == 0.0


def _too_much(reduced: Reduced, equations: list[int], variables: set[int], torques: list[LawTorque]) -> str:
    said = [reduced.written(e) for e in equations]
    roots = set(reduced.variables([reduced.equations[e] for e in equations]))
    laws = [t for t in torques if key(t.symbol) in roots]
    named = [b for b in [*reduced.variables(said), *(key(t.symbol) for t in laws)] if b in reduced.flat.unknowns]
    behind = [*said, *reduced.tied_by(named)]
    quoted, held = quote(behind), _held_open(reduced, {e.place.path for e in behind})
    if held:
        return (
            f"over-determined: {held._path} has a given position but is not connected, so nothing holds it: its torque or force is zero. "
            f"Connect it to what holds or moves it, such as a Fixed or an exact Speed\n  {quoted}"
        )
    if laws:
        given = "\n  ".join(str(t.place) for t in laws)
        return (
            f"over-determined: these laws give torques or forces that the equations below them give too, so that a motion is not "
            f"determined; put an inertia or a compliance between\n  {given}\n  {quoted}"
        )
    names = sorted(_name(reduced, b) for b in variables)
    n = len(equations)
    count = f"{n} equation{'s' * (n != 1)} for the {len(names)} unknown{'s' * (len(names) != 1)} {', '.join(names[:8])}"
    what = count if names else "this is already known from the other equations"
    return f"over-determined: {what}; remove one of these\n  {quoted}"


def _held_open(reduced: Reduced, paths: Collection[str]) -> Connector | None:
    """An unconnected port of a component of these paths that an equation of another one holds, as ``self.gear.ring.phi == 0``."""
    for part, end in reduced.flat.open_ports:
        if not any(f"{path}.".startswith(f"{part._path}.") for path in paths):
            continue
        held = {k for k in _potentials(end) if reduced.affine(k).root is None}
        others = [e for e in reduced.flat.equations if e.place.path != part._path] if held else []
        if held.intersection(reduced.variables(others)):
            return end
    return None


def _too_little(reduced: Reduced, free: list[int]) -> str:
    names = sorted(_with_aliases(reduced, b) for b in free)
    more = ", ..." if len(names) > 8 else ""
    inputs = reduced.flat.loose_inputs
    hint = f"not connected: {', '.join(inputs)}" if inputs else "is an equation missing, or a part not connected?"
    return f"under-determined: {len(free)} equation{'s' * (len(free) != 1)} missing to determine {', '.join(names[:8])}{more}; {hint}"


def _with_aliases(reduced: Reduced, base: int) -> str:
    """A variable and a few that are multiples of it or of its derivative."""
    flat = reduced.flat
    tied = [flat.unknowns[k].name for k, alias in reduced.aliases.items() if alias.root == base and k in flat.unknowns]
    tied.sort(key=lambda name: (name.count("."), name))
    return _name(reduced, base) + (f" (with {', '.join(tied[:3])})" if tied else "")


def _name(reduced: Reduced, base: int) -> str:
    unknown = reduced.flat.unknowns.get(base)
    return unknown.name if unknown else reduced.symbols[base].name()
