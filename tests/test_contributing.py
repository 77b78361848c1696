"""The component that CONTRIBUTING.md walks through is real: its text, put together, runs and passes its own test."""

from __future__ import annotations

import re
from pathlib import Path
from runpy import run_path

GUIDE = Path(__file__).parents[1] / "CONTRIBUTING.md"


def test_the_guide_builds_a_component_that_works(tmp_path: Path) -> None:
    program = tmp_path / "torque_limiter.py"
    blocks = re.findall(r"^```python\n(.*?)^```$", GUIDE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    program.write_text("from __future__ import annotations\n" + "".join(blocks), encoding="utf-8")
    names = run_path(str(program))
    names["test_limiter_holds_below_its_torque_and_slips_above"]()
