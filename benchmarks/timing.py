"""Fair timing on a shared machine: runs take turns, medians are compared, and a ratio belongs to two runs of one round."""

from __future__ import annotations

import gc
import math
import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

Call = Callable[[], object]


@dataclass(frozen=True)
class Row:
    """One measured number: what was measured, on what scale, and the goal it is held against."""

    benchmark: str
    what: str
    measured: str
    goal: str = ""
    met: bool | None = None


@dataclass(frozen=True)
class Timings:
    """Seconds of every run in every round; runs that were left out of a round have nan there."""

    seconds: Mapping[str, list[float]]

    def median(self, name: str) -> float:
        """Median time of one run in seconds."""
        return statistics.median(s for s in self.seconds[name] if not math.isnan(s))

    def ratio(self, name: str, baseline: str) -> float:
        """The median over the rounds of time of ``name`` / time of ``baseline``."""
        pairs = zip(self.seconds[name], self.seconds[baseline], strict=True)
        return statistics.median(a / b for a, b in pairs if not (math.isnan(a) or math.isnan(b)))


def measure(calls: Mapping[str, Call], rounds: int, inner: int = 3, slow: int = 3) -> Timings:
    """Times all calls in turns, after one call of each that is not counted.

    In a round every call is made ``inner`` times and the median kept; what takes over half a second is called once, in the first
    ``slow`` rounds only.
    """
    first = {name: seconds(call) for name, call in calls.items()}
    found: dict[str, list[float]] = {name: [] for name in calls}
    for n in range(rounds):
        gc.collect()
        for name, call in calls.items():
            long = first[name] > 0.5
            skipped = long and n >= slow
            times = [] if skipped else [seconds(call) for _ in range(1 if long else inner)]
            found[name].append(statistics.median(times) if times else math.nan)
    return Timings(found)


def seconds(call: Call) -> float:
    """Wall-clock time of one call."""
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def at_most(benchmark: str, what: str, ratio: float, goal: float) -> Row:
    """A ratio that shall not exceed ``goal``."""
    return Row(benchmark, what, f"{ratio:.3g} x", f"<= {goal:g} x", ratio <= goal)


def at_least(benchmark: str, what: str, ratio: float, goal: float) -> Row:
    """A ratio that shall reach ``goal``."""
    return Row(benchmark, what, f"{ratio:.3g} x", f">= {goal:g} x", ratio >= goal)


def duration(s: float) -> str:
    """Seconds in readable units."""
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if s >= size:
            return f"{s / size:.3g} {unit}"
    return f"{s * 1e6:.3g} µs"


def table(rows: list[Row]) -> str:
    """The rows as a Markdown table."""
    lines = ["| benchmark | what | measured | goal | |", "|---|---|---|---|---|"]
    return "\n".join([*lines, *(f"| {row.benchmark} {_cells(row)}" for row in rows)])


def sections(rows: list[Row]) -> str:
    """The rows as Markdown, with a title and a table for each benchmark."""
    found: dict[str, list[str]] = {}
    for row in rows:
        found.setdefault(row.benchmark, []).append(_cells(row))
    head = "| what | measured | goal | |\n|---|---|---|---|"
    return "\n\n".join("\n".join([f"## {name[0].upper()}{name[1:]}\n", head, *cells]) for name, cells in found.items())


def _cells(row: Row) -> str:
    mark = "" if row.met is None else "met" if row.met else "**missed**"
    goal = row.goal.replace("<=", "≤").replace(">=", "≥").replace(" ", "\u00a0")
    return f"| {row.what} | {row.measured} | {goal} | {mark} |"
