"""The table of other tools' catalogues is true: what it names exists, and every "no" has a reason."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import powertrain.components.cycles as cycles
import powertrain.components.transmissions as transmissions
import powertrain.measured.record as record
import powertrain.trials as trials
from powertrain.presets.catalogue import assembled, components

PAGE = Path(__file__).parents[1] / "docs" / "catalogues.md"
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in PAGE.read_text(encoding="utf-8").splitlines()
    if line.startswith("|") and not re.match(r"\| (block|model|feature|---)", line)
]


def test_what_the_table_names_exists() -> None:
    known = {entry.name for entry in (*components(), *assembled())}
    for module in (cycles, transmissions, trials, record):
        known |= set(vars(module))
    for theirs, ours, remark in ROWS:
        for name in re.findall(r"`(\w+)`", ours):
            assert name in known, f"{theirs}: {name}"
        for name in re.findall(r"`([A-Z]\w+)`", remark):
            assert name in known, f"{theirs}: {name}"


def test_every_no_has_a_reason() -> None:
    assert len(ROWS) > 70
    refused = [row for row in ROWS if row[1] == "no"]
    assert len(refused) > 10
    for theirs, _, remark in refused:
        assert len(remark) > 20, theirs
    assert all("`" in ours or ours == "no" for _, ours, _ in ROWS)


def test_the_speed_is_that_of_the_benchmarks() -> None:
    """Compiled cars of the library over the WLTC, in times of FASTSim."""
    measured = (PAGE.parent / "benchmarks.md").read_text(encoding="utf-8")
    times = [
        float(x) for x in re.findall(r"\w+, compiled, rtol 0.0001: .*, in times of FASTSim \| ([\d.]+) x", measured)
    ]
    assert len(times) > 10
    for page in ("catalogues.md", "comparison.md"):
        said = re.search(r"([\d.]+) to (\d+) times as long", (PAGE.parent / page).read_text(encoding="utf-8"))
        assert said
        assert float(said[1]) == pytest.approx(min(times), rel=0.1)
        assert float(said[2]) == pytest.approx(max(times), rel=0.1)
