"""Newton's method with full steps as machine code, for ``WIDTH`` small systems abreast; see ``powertrain.numerics.newton``.

Each system is iterated to its end while it is in the registers, which takes a fraction of the time of steps for all systems in turn. The
linear systems are solved by Gaussian elimination with scaled rows; each of the systems abreast has its own pivots. A system whose matrix
is singular does not converge.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol
from powertrain.numerics.compiled import compiler, library
from powertrain.numerics.elimination import Pattern
from powertrain.numerics.newton import Mask
from powertrain.numerics.vectorised import WIDTH, VectorTape, Writer, outputs_in_c

_MACROS = """\
#define MAGNITUDE(x) ((lanes)((mask)(x) & ~SIGN))
#define LARGER(x, y) CHOOSE((x) >= (y), x, y)
#define ANY(m) ((m)[0] | (m)[1] | (m)[2] | (m)[3])
"""
_STEP = """\
for (int i = 0; i < N; i++) {
    lanes largest = ALL(0.0);
    for (int j = 0; j < N; j++) largest = LARGER(largest, MAGNITUDE(m[i][j]));
    for (int j = 0; j <= N; j++) m[i][j] /= largest;
}
for (int j = 0; j < N; j++) {
    for (int i = j + 1; i < N; i++) {
        const mask swap = MAGNITUDE(m[i][j]) > MAGNITUDE(m[j][j]);
        if (ANY(swap)) for (int k = j; k <= N; k++) {
            const lanes upper = m[j][k], lower = m[i][k];
            m[j][k] = CHOOSE(swap, lower, upper);
            m[i][k] = CHOOSE(swap, upper, lower);
        }
    }
    for (int i = j + 1; i < N; i++) {
        const lanes factor = m[i][j] / m[j][j];
        if (ANY(factor != ALL(0.0))) for (int k = j + 1; k <= N; k++) m[i][k] -= factor * m[j][k];
    }
}
lanes shared = ALL(1.0);
for (int i = OWN; i < N; i++) shared = LARGER(1.0 + MAGNITUDE(z[i]), shared);
mask small = active;
for (int i = N - 1; i >= 0; i--) {
    for (int k = i + 1; k < N; k++) m[i][N] -= m[i][k] * m[k][N];
    m[i][N] /= m[i][i];
    const lanes part = MAGNITUDE(m[i][N]) / (i < OWN ? 1.0 + MAGNITUDE(z[i]) : shared);
    small &= part <= ALL(still);
}
for (int i = 0; i < N; i++) z[i] = CHOOSE(active, z[i] + m[i][N], z[i]);
converged |= small;
active &= ~small;
"""
"""The end of a step, for the matrix m with the negative values as its last column."""


class NewtonAbreast:
    """The method for systems of one kind. Serves one thread.

    The entries of the matrices of ``pattern`` and then the values, ``outputs``, depend on ``fixed`` and the unknowns ``z``, which differ
    between systems, and on a column ``common`` to all. The first ``own`` unknowns have sizes of their own, as ``relative`` gives them; the
    others share the largest of theirs. Raises NotWritten if an operation has no C version, OSError if the cache cannot be used.
    """

    def __init__(
        self,
        fixed: Sequence[Symbol],
        z: Sequence[Symbol],
        common: Symbol,
        pattern: Pattern,
        outputs: Sequence[Symbol],
        own: int,
    ) -> None:
        code = _written(fixed, z, common, pattern, outputs, own)
        self._tape = VectorTape(common.numel() + 2, len(z) + 1, library(code, compiler()))

    def __call__(
        self, fixed: Sequence[Array], z: Array, common: Array, *, still: float, most: int
    ) -> tuple[Array, Mask]:
        """As ``newton`` without halvings: the unknowns, one row per system, and whether each converged."""
        self._tape.set_common(np.array([*common, still, most]))
        found = self._tape.of_rows([*fixed, *z.T], len(z))
        return found[:-1].T, found[-1] != 0.0


def _written(
    fixed: Sequence[Symbol], z: Sequence[Symbol], common: Symbol, pattern: Pattern, outputs: Sequence[Symbol], own: int
) -> str:
    """The function in C: the columns of ``fixed`` and ``z`` -> those of the unknowns and of what converged."""
    writer, first, count = Writer("powertrain_newton"), len(fixed), common.numel()
    given = [writer.line(f"*(const stored *)(a[{i}] + k)", True) for i in range(first)]
    moving = [writer.line(f"z[{i}]", True) for i in range(len(z))]
    same = [writer.line(f"ALL(c[{j}])", False) for j in range(count)]
    names = outputs_in_c([*fixed, *z, common], outputs, [*([each] for each in (*given, *moving)), same], writer)
    entries, values = names[: pattern.rows.size], names[pattern.rows.size :]
    places = zip(pattern.rows.tolist(), pattern.columns.tolist(), entries, strict=True)
    return "\n".join(
        [
            _MACROS,
            f"enum {{ N = {len(z)}, OWN = {own} }};",
            *writer.head(),
            "void powertrain_columns(long long n, const double *const *a, const double *c, double *const *r) {",
            f"const double still = c[{count}], most = c[{count + 1}];",
            *writer.fixed,
            f"for (long long k = 0; k < n; k += {WIDTH}) {{",
            f"if (k > n - {WIDTH}) k = n - {WIDTH};",
            "lanes z[N];",
            f"for (int i = 0; i < N; i++) z[i] = *(const stored *)(a[{first} + i] + k);",
            "mask converged = (mask)ALL(0.0), active = (mask)(ALL(0.0) == ALL(0.0));",
            "for (int step = 0; step < most && ANY(active); step++) {",
            *writer.each,
            "lanes m[N][N + 1] = {{{0.0}}};",
            *(f"m[{i}][{j}] = {entry};" for i, j, entry in places),
            *(f"m[{i}][N] = -{value};" for i, value in enumerate(values)),
            _STEP,
            "}",
            "for (int i = 0; i < N; i++) *(stored *)(r[i] + k) = z[i];",
            "*(stored *)(r[N] + k) = TRUE(converged);",
            "}\n}\n",
        ]
    )
