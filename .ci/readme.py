"""Run every ```bash and ```python block of README.md, as a reader would, each in turn; stop at the first that fails.

A bash block runs in the checkout's root, without its lines that install: the environment that is active is tested.
A python block runs in an empty folder with warnings as errors.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
BLOCK = re.compile(r"^```(bash|python)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
INSTALL = re.compile(r"(git clone|cd|pip install|python -m venv|source)\b")


def commands(language: str, text: str) -> list[str]:
    """Return the command line that runs one block, empty if nothing of it is left to run."""
    if language == "python":
        return [sys.executable, "-W", "error", "-c", text]
    script = "\n".join(line for line in text.splitlines() if not INSTALL.match(line)).strip()
    return ["bash", "-euo", "pipefail", "-c", script] if script else []


def main() -> int:
    """Run the blocks; the exit code of the first failure, else 0."""
    blocks = BLOCK.findall((ROOT / "README.md").read_text(encoding="utf-8"))
    if not blocks:
        sys.exit("README.md has no program and no command to run")
    for language, text in blocks:
        command = commands(language, text)
        if not command:
            continue
        print(f"-- {language}\n{text}", flush=True)
        with tempfile.TemporaryDirectory() as empty:
            done = subprocess.run(command, cwd=ROOT if language == "bash" else empty, check=False)
        if done.returncode:
            return done.returncode
    return 0


if __name__ == "__main__":
    sys.exit(main())
