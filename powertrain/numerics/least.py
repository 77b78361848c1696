"""The least of some numbers over many points, as a function in C with CasADi's calling convention: ``WIDTH`` points at a time."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import casadi as ca

from powertrain.language.symbols import Symbol
from powertrain.numerics.compiled import Compilable, InC
from powertrain.numerics.vectorised import LESSER, WIDTH, Writer, outputs_in_c, shapes_in_c


def least_of(
    name: str,
    sizes: Sequence[tuple[int, int]],
    places: Sequence[tuple[int, slice]],
    numbers: Callable[[Sequence[Symbol]], Sequence[Symbol]],
    without: Sequence[float],
) -> Compilable:
    """A function of matrices of these sizes: the least of each of the ``numbers`` over all points; ``without`` if there are no points.

    ``places[i]``: in which matrix the i-th scalar of all points is, and where, column by column; ``numbers`` are computed from these
    scalars, operation by operation.
    """
    matrices = [ca.SX.sym("matrix", *size) for size in sizes]
    given = [matrices[which].nz[place] for which, place in places]
    points = given[0].numel()
    found = [ca.mmin(each) for each in numbers(given)] if points else without
    whole = ca.Function(name, matrices, [ca.densify(ca.vertcat(*found))])
    return InC(whole, _in_vectors(whole, places, points, numbers)) if points >= WIDTH else whole


def _in_vectors(
    whole: ca.Function,
    places: Sequence[tuple[int, slice]],
    points: int,
    numbers: Callable[[Sequence[Symbol]], Sequence[Symbol]],
) -> str:
    """The function in C. The last ``WIDTH`` points are taken together, so that some of them may count twice."""
    name, given = whole.name(), ca.SX.sym("given", len(places))
    writer, results = Writer(name), range(whole.numel_out(0))
    own = [writer.line(_entries(f"arg[{which}]", place), True) for which, place in places]
    each = outputs_in_c([given], numbers(ca.vertsplit(given)), [own], writer)
    return "\n".join(
        [
            *writer.head(),
            f"int {name}(const double **arg, double **res, long long *iw, double *w, int mem) {{",
            *(f"lanes least{i} = ALL(NAN);" for i in results),
            *writer.fixed,
            f"for (int n = 0; n < {points}; n += {WIDTH}) {{",
            f"const int k = n < {points - WIDTH} ? n : {points - WIDTH};",
            *writer.each,
            *(f"least{i} = {LESSER.format(f'least{i}', number)};" for i, number in enumerate(each)),
            "}",
            "double *r = res[0];",
            *(f"r[{i}] = least{i}[0];" for i in results),
            f"for (int k = 1; k < {WIDTH}; k++) {{",
            *(f"r[{i}] = r[{i}] <= least{i}[k] || least{i}[k] != least{i}[k] ? r[{i}] : least{i}[k];" for i in results),
            "}\nreturn 0;\n}",
            *shapes_in_c(name, "in", [whole.size_in(i) for i in range(whole.n_in())]),
            *shapes_in_c(name, "out", [whole.size_out(0)]),
        ]
    )


def _entries(matrix: str, place: slice) -> str:
    """The scalars of points k, k + 1, ... as a vector."""
    return f"(lanes){{{', '.join(f'{matrix}[{place.start} + {place.step} * (k + {i})]' for i in range(WIDTH))}}}"
