"""A compiled model as C99 source: the functions that CasADi generates, the tables of the model, and the loop in ``powertrain_run.c``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import casadi as ca
import numpy as np

from powertrain.compiler.assemble import Compiled
from powertrain.dae.hybrid import HybridDae
from powertrain.engine.in_c import SOURCES, TABLES, places, signal_tables
from powertrain.engine.limits import limits
from powertrain.engine.prepared import Prepared
from powertrain.engine.schedules import Schedules
from powertrain.errors import ParameterError
from powertrain.native.driver import Begun
from powertrain.numerics.compiled import code_of

FIXED = ("powertrain_run.h", "powertrain_run.c", "powertrain_loop.h", "powertrain_loop.c", "main.c")
_ABSENT = ("newton", "instants", "corner", "longest", "resets", "mobility")
"""Functions that only some models need."""


def refuse(engine: Prepared) -> None:
    """ParameterError for models that the loop in C does not run."""
    for contact in engine.dae.contacts:
        raise ParameterError(
            f"export_c: {contact.name} ({contact.where}) is a unilateral contact; impacts are not available in C"
        )
    if engine.large:
        raise ParameterError(
            f"export_c: the model has {sum(engine.sizes[:2])} unknowns; above 100 its linear systems are solved numerically, which is not "
            "available in C"
        )


def write(folder: Path, compiled: Compiled, engine: Prepared, method: str, t: float, start: Begun) -> None:
    """The files of a model in a folder, with a start at ``t`` (s)."""
    functions, inputs = engine.functions(method), list(compiled.inputs)
    folder.mkdir(parents=True, exist_ok=True)
    files = {
        "functions.c": code_of(functions),
        "model.h": _header(engine, functions, inputs),
        "model.c": _tables(engine, t, start, inputs, list(compiled.parameters)),
    }
    files |= {"powertrain_limits.h": limits()} | {name: (SOURCES / name).read_text(encoding="utf-8") for name in FIXED}
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")


def _laws(dae: HybridDae) -> list[int]:
    """The places of the modes of laws."""
    return [*(f.index for f in dae.frictions if not f.prescribed), *(s.index for s in dae.switches)]


def _header(engine: Prepared, functions: dict[str, ca.Function], inputs: Sequence[str]) -> str:
    dae, (n, nz, held, parameters), called = engine.dae, engine.sizes, functions.values()
    sizes = {
        "X": n, "Z": nz, "Y": max(n + nz, 1), "HELD": held, "PARAMETERS": parameters, "INPUTS": len(inputs),
        "INDICATORS": len(engine.indicators), "WHENS": len(dae.whens), "RESET_VALUES": sum(len(w.resets) for w in dae.whens),
        "TIMED": len(engine.timed), "GUARDS": len(dae.guards), "SIGNALS": len(dae.schedules), "BARRIERS": len(dae.barriers),
        "RESTS": len(engine.catalogue.rests), "LAWS": len(_laws(dae)), "FRICTIONS": len(dae.frictions),
        "ARG": max(f.sz_arg() for f in called), "RES": max(f.sz_res() for f in called),
        "IW": max(f.sz_iw() for f in called), "WORK": max(f.sz_w() for f in called),
    }  # fmt: skip
    lines = ["/* Sizes, tables and functions of the model; written by powertrain. */", '#include "powertrain_run.h"']
    lines += [f"#define PT_{name} {size}" for name, size in sizes.items()]
    lines += [f"#define pt_{key} {f.name()}" for key, f in functions.items()]
    lines += [f"#define pt_{key} 0" for key in _ABSENT if key not in functions]
    arguments = "(const double **, double **, long long *, double *, int)"
    lines += [f"int {f.name()}{arguments};" for f in called]
    lines += [f"extern const int pt_{name}[];" for name in ("inputs", *TABLES.split())]
    lines += [
        "extern const double pt_t0, pt_x0[], pt_z0[], pt_m0[], pt_p0[];",
        "extern const pt_signals pt_default_signals;",
    ]
    lines += ["extern const char *const pt_input_names[], *const pt_parameter_names[], *const pt_unknown_names[];", ""]
    return "\n".join(lines)


def _tables(engine: Prepared, t: float, start: Begun, inputs: Sequence[str], parameters: Sequence[str]) -> str:
    dae = engine.dae
    resets = [r for when in dae.whens for r in when.resets]
    order = [s.name for s in start.schedules]
    integers: dict[str, Iterable[int]] = {
        "places": [s.index for s in start.schedules],
        "inputs": [order.index(name) for name in inputs],
        "when_place": [w.index for w in dae.whens],
        "when_first": np.cumsum([0, *(len(w.resets) for w in dae.whens)]).tolist(),
        "when_initially": [int(w.initially or w.time is not None) for w in dae.whens],
        "reset_place": [r.index for r in resets],
        "reset_discrete": [int(r.discrete) for r in resets],
        "laws": _laws(dae),
        **places(engine),
    }
    lines = ['#include "model.h"']
    lines += [f"const int pt_{name}[] = {_braced(values)};" for name, values in integers.items()]
    lines += [f"const double pt_t0 = {t!r};"]
    lines += [f"const double pt_{name}0[] = {_braced(getattr(start, name))};" for name in "xzmp"]
    lines += _signals(signal_tables(Schedules(start.schedules)))
    unknowns = [*dae.state_names, *(dae.z[k].name() for k in range(dae.z.numel()))]
    for what, names in {"input": inputs, "parameter": parameters, "unknown": unknowns}.items():
        lines.append(f"const char *const pt_{what}_names[] = {{{', '.join([*(_quoted(n) for n in names), '0'])}}};")
    return "\n".join([*lines, ""])


def _signals(tables: dict[str, np.ndarray]) -> list[str]:
    lines = []
    for name, values in tables.items():
        kind = "int" if values.dtype.kind == "i" else "double"
        lines.append(f"static const {kind} signal_{name}[] = {_braced(values.tolist())};")
    names = ", ".join(f"signal_{name}" for name in tables)
    return [*lines, f"const pt_signals pt_default_signals = {{{len(tables['times'])}, {names}}};"]


def _braced(values: Iterable[float]) -> str:
    """Numbers as C reads them back to the last bit; one zero for none, which C does not know."""
    found = [
        repr(v if isinstance(v, int) else float(v))
        for v in (values.tolist() if isinstance(values, np.ndarray) else values)
    ]
    return "{" + (", ".join(found) or "0") + "}"


def _quoted(name: str) -> str:
    return '"' + name.replace("\\", "\\\\").replace('"', '\\"') + '"'
