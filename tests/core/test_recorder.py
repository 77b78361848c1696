"""The line of the text that is being read."""

from __future__ import annotations

import subprocess
import sys

READ = """
from powertrain.language.recorder import Recorder

def text(place):
    a, b = (place() for _ in range(2))
    yield a, b

for _ in range(500):
    active = Recorder()
    active.text = text(lambda: active.place)
    for a, b in active.text:
        assert a.line == b.line == 5, a
"""


def test_place_while_a_line_is_read_by_parts() -> None:
    """A law inside of an unpacked generator; CPython 3.11 crashed, so that it takes a process of its own."""
    done = subprocess.run([sys.executable, "-c", READ], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
