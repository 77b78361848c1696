"""Tapes as machine code for columns of points: C with the vector types of GCC and Clang, which computes ``WIDTH`` points at a time.

The operations are those of CasADi's virtual machine in the same order, so results are identical to the last bit. What is common to all
points is computed once. Functions of the C library and searches in tables take one point at a time.
"""

from __future__ import annotations

import ctypes
import math
import threading
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol
from powertrain.numerics.buffers import zeros
from powertrain.numerics.compiled import Compilable, InC, compiler, library, warn_of_cache
from powertrain.numerics.lookup import Lookup, looked_up
from powertrain.numerics.tape import replayed

WIDTH = 4
_ENTRIES = range(WIDTH)
_SHARED = 1 << 15
"""From this number of points on, a second thread takes half of them."""
_COPIED = 512
"""Up to this number of points, copying a row takes less time than asking for its address."""
LESSER = "CHOOSE(({0} <= {1}) | ({1} != {1}), {0}, {1})"
"""The lesser of two vectors, entry by entry; the other where one is nan."""
_WRITTEN = {
    ca.OP_ASSIGN: "{0}",
    ca.OP_ADD: "{0} + {1}",
    ca.OP_SUB: "{0} - {1}",
    ca.OP_MUL: "{0} * {1}",
    ca.OP_DIV: "{0} / {1}",
    ca.OP_NEG: "-{0}",
    ca.OP_SQ: "{0} * {0}",
    ca.OP_TWICE: "{0} + {0}",
    ca.OP_INV: "ALL(1.0) / {0}",
    ca.OP_LT: "{0} < {1}",
    ca.OP_LE: "{0} <= {1}",
    ca.OP_EQ: "{0} == {1}",
    ca.OP_NE: "{0} != {1}",
    ca.OP_NOT: "~{0.mask}",
    ca.OP_AND: "{0.mask} & {1.mask}",
    ca.OP_OR: "{0.mask} | {1.mask}",
    ca.OP_IF_ELSE_ZERO: "(lanes)({0.mask} & (mask){1})",
    ca.OP_FABS: "(lanes)((mask){0} & ~SIGN)",
    ca.OP_SIGN: "CHOOSE({0} < ALL(0.0), ALL(-1.0), CHOOSE({0} > ALL(0.0), ALL(1.0), {0}))",
    ca.OP_COPYSIGN: "(lanes)(((mask){0} & ~SIGN) | ((mask){1} & SIGN))",
    ca.OP_FMIN: LESSER,
    ca.OP_FMAX: "CHOOSE(({0} >= {1}) | ({1} != {1}), {0}, {1})",
}
"""CasADi operations in C."""
_LOGICAL = {ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_NOT, ca.OP_AND, ca.OP_OR}
"""Operations whose results are truth values."""
_LIBRARY = (
    "exp log pow sqrt sin cos tan asin acos atan atan2 floor ceil fmod remainder erf sinh cosh tanh asinh acosh atanh "
    "log1p expm1 hypot"
)
_NAMED = {getattr(ca, f"OP_{name.upper()}"): name for name in _LIBRARY.split()} | {ca.OP_CONSTPOW: "pow"}
"""Operations that are functions of the C library."""
_LOW = {"linear": 0, "exact": 1, "binary": 2}
"""CasADi's numbers for the methods of finding an interval."""
_HEAD = f"""\
#ifndef POWERTRAIN_LANES
#define POWERTRAIN_LANES
#include <math.h>
static int low(double x, const double *t, int n, int how) {{
    int i = 0, last = n - 2;
    if (how == 1) {{
        long long place = (long long)((x - t[0]) * (n - 1) / (t[n - 1] - t[0]));
        return place < 0 ? 0 : place > last ? last : (int)place;
    }}
    if (how == 0) {{
        while (i < last && !(x < t[i + 1])) i++;
        return i;
    }}
    while (i < last) {{
        int middle = (i + last + 1) / 2;
        if (x < t[middle]) last = middle - 1;
        else i = middle;
    }}
    return i;
}}
typedef double lanes __attribute__((vector_size({8 * WIDTH})));
typedef double stored __attribute__((vector_size({8 * WIDTH}), aligned(8), may_alias));
typedef long long mask __attribute__((vector_size({8 * WIDTH})));
#define ALL(x) ((lanes){{{", ".join("x" for _ in _ENTRIES)}}})
#define TRUE(m) ((lanes)((m) & (mask)ALL(1.0)))
#define CHOOSE(m, x, y) ((lanes)(((m) & (mask)(x)) | (~(m) & (mask)(y))))
#define SIGN ((mask)ALL(-0.0))
#define LOW(x, t, n, how) ((lanes){{{", ".join(f"low(x[{i}], t, n, how)" for i in _ENTRIES)}}})
#define ENTRIES(t, x) ((lanes){{{", ".join(f"t[(int)x[{i}]]" for i in _ENTRIES)}}})
#endif
"""
_WIDE = """\
#ifdef __x86_64__
__attribute__((target("avx2")))
#endif
"""


class NotWritten(Exception):
    """The tape has an operation without a C version here."""


class VectorTape:
    """Columns of results from columns of arguments, by the library of the code from ``written``. Serves one thread; uses two.

    ``least`` and ``most`` are the numbers of points in one call of ``into``.
    """

    least, most = WIDTH, 1 << 16

    def __init__(self, common: int, outputs: int, library: Path) -> None:
        self._outputs = outputs
        self._call: Any = ctypes.CDLL(str(library)).powertrain_columns
        self._call.restype = None
        self._call.argtypes = [ctypes.c_longlong, *(ctypes.c_void_p,) * 3]
        self._common = zeros(common)

    def set_common(self, values: Array) -> None:
        """Set the values common to all points."""
        self._common[: values.size] = values

    def into(self, arguments: Sequence[Array], results: Sequence[Array]) -> None:
        """Evaluate points, given as contiguous arrays, directly into ``results``."""
        given, found = (np.array([a.ctypes.data for a in arrays], np.uintp) for arrays in (arguments, results))
        self._evaluate(arguments[0].size, given, found)

    def __call__(self, rows: Array) -> Array:
        """One row per output for one row per varying scalar."""
        return self.of_rows(rows, rows.shape[1])

    def of_rows(self, rows: Iterable[Array], count: int) -> Array:
        """The same for separate rows of ``count`` values."""
        rows, width = list(rows), max(count, WIDTH)
        found = np.empty((self._outputs, width))
        if count < _COPIED:
            given = np.zeros((len(rows), width))
            for values, row in zip(given, rows, strict=True):
                values[:count] = row
            self._evaluate(width, _places(given), _places(found))
        else:
            kept = [np.ascontiguousarray(row) for row in rows]
            self._evaluate(width, np.array([row.ctypes.data for row in kept], np.uintp), _places(found))
        return found[:, :count]

    def _evaluate(self, count: int, given: NDArray[np.uintp], found: NDArray[np.uintp]) -> None:
        if count < _SHARED:
            self._part(0, count, given, found)
            return
        other = threading.Thread(target=self._part, args=(count // 2, count, given, found))
        other.start()
        self._part(0, count // 2, given, found)
        other.join()

    def _part(self, first: int, last: int, given: NDArray[np.uintp], found: NDArray[np.uintp]) -> None:
        """Evaluate the points from the first to before the last."""
        begin, end = (a + np.uintp(8 * first) for a in (given, found))
        self._call(last - first, begin.ctypes.data, self._common.ctypes.data, end.ctypes.data)


def _places(rows: Array) -> NDArray[np.uintp]:
    """The addresses of the rows of a contiguous array."""
    return np.asarray(rows.ctypes.data + rows.strides[0] * np.arange(len(rows), dtype=np.uintp))


def vector_tape(varying: Sequence[Symbol], common: Symbol, outputs: Sequence[Symbol]) -> VectorTape | None:
    """``outputs`` as functions of scalars that differ between points (``varying``) and of a column common to all.

    None if an operation has no C version and, with a warning, if the cache cannot be used. PowertrainError if there is no compiler or it
    fails.
    """
    try:
        code = written(varying, common, outputs)
        return VectorTape(common.numel(), len(outputs), library(code, compiler()))
    except NotWritten:
        return None
    except OSError as error:
        warn_of_cache(error)
        return None


def written(varying: Sequence[Symbol], common: Symbol, outputs: Sequence[Symbol]) -> str:
    """The function in C; NotWritten if an operation has no C version."""
    writer, count = Writer("powertrain_columns"), len(varying)
    own = [writer.line(f"*(const stored *)(a[{i}] + k)", True) for i in range(count)]
    same = [writer.line(f"ALL(c[{j}])", False) for j in range(common.numel())]
    results = outputs_in_c([*varying, common], outputs, [*([each] for each in own), same], writer)
    return "\n".join(
        [
            *writer.head(),
            "void powertrain_columns(long long n, const double *const *a, const double *c, double *const *r) {",
            *writer.fixed,
            f"for (long long k = 0; k < n; k += {WIDTH}) {{",
            f"if (k > n - {WIDTH}) k = n - {WIDTH};",
            *writer.each,
            *(f"*(stored *)(r[{i}] + k) = {name};" for i, name in enumerate(results)),
            "}\n}\n",
        ]
    )


def abreast(name: str, varying: Symbol, common: Sequence[Symbol], outputs: Symbol) -> Compilable:
    """A function of ``WIDTH`` points at once: (one row of ``varying`` per point; ``common``) -> rows of ``outputs``.

    In vectors if all operations have a C version, else one point at a time.
    """
    one = ca.Function(f"{name}_one", [varying, *common], [outputs])
    points, rest = ca.MX.sym("points", WIDTH, varying.numel()), [ca.MX.sym("common", each.numel()) for each in common]
    rows = [one(point.T, *rest).T for point in ca.vertsplit(points)]
    whole = ca.Function(name, [points, *rest], [ca.vertcat(*rows)])
    try:
        return InC(whole, _in_vectors(whole, varying, common, ca.vertsplit(outputs)))
    except NotWritten:
        return whole


def _in_vectors(whole: ca.Function, varying: Symbol, common: Sequence[Symbol], outputs: Sequence[Symbol]) -> str:
    """The function in C, with CasADi's calling convention."""
    name = whole.name()
    writer = Writer(name)
    own = [writer.line(f"*(const stored *)(arg[0] + {WIDTH * i})", True) for i in range(varying.numel())]
    same = [
        [writer.line(f"ALL(arg[{k}][{j}])", False) for j in range(each.numel())] for k, each in enumerate(common, 1)
    ]
    results = outputs_in_c([varying, *common], outputs, [own, *same], writer)
    return "\n".join(
        [
            *writer.head(),
            f"int {name}(const double **arg, double **res, long long *iw, double *w, int mem) {{",
            *writer.fixed,
            *writer.each,
            *(f"*(stored *)(res[0] + {WIDTH * i}) = {result};" for i, result in enumerate(results)),
            "return 0;\n}",
            *shapes_in_c(name, "in", [whole.size_in(i) for i in range(whole.n_in())]),
            *shapes_in_c(name, "out", [whole.size_out(0)]),
        ]
    )


def shapes_in_c(name: str, side: str, sizes: Sequence[tuple[int, int]]) -> list[str]:
    """The interface that CasADi requires of a C function: the number of arguments or results, and their shapes."""
    patterns = "".join(f"{{{rows}, {columns}, 1}}, " for rows, columns in sizes)
    return [
        f"long long {name}_n_{side}(void) {{ return {len(sizes)}; }}",
        f"const long long *{name}_sparsity_{side}(long long i) {{",
        f"static const long long dense[][3] = {{{patterns}}};",
        f"return i < {len(sizes)} ? dense[i] : 0;\n}}",
    ]


def outputs_in_c(
    inputs: Sequence[Symbol], outputs: Sequence[Symbol], values: Sequence[Sequence[Value]], writer: Writer
) -> list[str]:
    """The outputs in C, for ``values`` of all entries of the inputs; the writer holds the operations."""
    scalar = ca.Function("powertrain_scalars", list(inputs), list(outputs))
    return [str(each) for each in replayed(scalar, outputs, lambda i, j: values[i][j], writer)]


@dataclass(frozen=True)
class Value:
    """The name of a variable in C, and whether it differs between points.

    Truth values, 0 or 1 in CasADi, are masks: more than half of the operations of a map combine them.
    """

    writer: Writer
    name: str
    varies: bool
    truth: bool = False

    def __str__(self) -> str:
        """The number."""
        return f"TRUE({self.name})" if self.truth else self.name

    @property
    def mask(self) -> str:
        """Where the number is not zero."""
        return self.name if self.truth else f"({self.name} != ALL(0.0))"

    def __add__(self, other: Value | float) -> Value:
        return self.writer.operate(ca.OP_ADD, [self, self._of(other)])

    def __sub__(self, other: Value) -> Value:
        return self.writer.operate(ca.OP_SUB, [self, other])

    def __mul__(self, other: Value | float) -> Value:
        return self.writer.operate(ca.OP_MUL, [self, self._of(other)])

    __rmul__ = __mul__

    def __truediv__(self, other: Value) -> Value:
        return self.writer.operate(ca.OP_DIV, [self, other])

    def _of(self, other: Value | float) -> Value:
        return other if isinstance(other, Value) else self.writer.constant(other)


class Writer:
    """Arithmetic in C: ``fixed`` are the lines common to all points, ``each`` the others; ``tables`` by their numbers."""

    def __init__(self, name: str) -> None:
        self._name = name
        self.fixed, self.each, self.tables = list[str](), list[str](), dict[str, str]()
        self._lookups: dict[tuple[int, ...], Lookup] = {}

    def head(self) -> list[str]:
        """The declarations before the function."""
        tables = (f"static const double {name}[] = {{{numbers}}};" for numbers, name in self.tables.items())
        return [*tables, _HEAD, _WIDE if _wide() else ""]

    def line(self, expression: str, varies: bool, truth: bool = False) -> Value:
        """A new variable."""
        value, kind = Value(self, f"v{len(self.fixed) + len(self.each)}", varies, truth), "mask" if truth else "lanes"
        (self.each if varies else self.fixed).append(f"const {kind} {value.name} = {expression};")
        return value

    def constant(self, value: float) -> Value:
        """A number."""
        return self.line(f"ALL({_number(value)})", False)

    def operate(self, code: int, operands: list[Value]) -> Value:
        """One operation on one or two variables."""
        if code == ca.OP_MUL and all(each.truth for each in operands):
            code = ca.OP_AND
        if code in _NAMED:
            calls = (f"{_NAMED[code]}({', '.join(f'{each}[{i}]' for each in operands)})" for i in _ENTRIES)
            text = f"(lanes){{{', '.join(calls)}}}"
        elif code in _WRITTEN:
            text = _WRITTEN[code].format(*operands)
        else:
            raise NotWritten
        return self.line(text, any(each.varies for each in operands), code in _LOGICAL)

    def call(self, function: ca.Function, operands: list[Value]) -> list[Value]:
        """A table's value or its derivatives."""
        found = looked_up(function, operands, self, self._lookups)
        if found is None:
            raise NotWritten
        return found

    def interval(self, points: Sequence[float], mode: str, x: Value) -> Value:
        """The number of the interval between ``points`` that contains x."""
        return self.line(f"LOW({x}, {self._table(points)}, {len(points)}, {_LOW[mode]})", x.varies)

    def entries(self, numbers: Sequence[float], places: Sequence[Value]) -> list[Value]:
        """The numbers at these places."""
        table = self._table(numbers)
        return [self.line(f"ENTRIES({table}, {place})", place.varies) for place in places]

    def _table(self, numbers: Sequence[float]) -> str:
        """The name of an array."""
        return self.tables.setdefault(", ".join(map(_number, numbers)), f"{self._name}_{len(self.tables)}")


@cache
def _wide() -> bool:
    """Whether this machine is known to have vectors of ``WIDTH`` numbers. The cache distinguishes libraries by their code."""
    try:
        return " avx2 " in Path("/proc/cpuinfo").read_text(encoding="ascii", errors="replace")
    except OSError:
        return False


def _number(value: float) -> str:
    return value.hex() if math.isfinite(value) else "NAN" if math.isnan(value) else f"{'-' * (value < 0)}INFINITY"
