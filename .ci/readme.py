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


def run(language: str, text: str, folder: Path) -> int:
    """Run one block and return its exit code; ``folder`` is empty."""
    if language == "python":
        (folder / "program.py").write_text(text, encoding="utf-8")
        return subprocess.run([sys.executable, "-W", "error", "program.py"], cwd=folder, check=False).returncode
    script = "".join(line for line in text.splitlines(keepends=True) if not INSTALL.match(line))
    return subprocess.run(["bash", "-euo", "pipefail", "-c", script], cwd=ROOT, check=False).returncode


def main() -> int:
    """Run the blocks; the exit code of the first failure, else 0."""
    blocks = BLOCK.findall((ROOT / "README.md").read_text(encoding="utf-8"))
    if not blocks:
        sys.exit("README.md has no program and no command to run")
    for language, text in blocks:
        print(f"-- {language}\n{text}", flush=True)
        with tempfile.TemporaryDirectory() as folder:
            code = run(language, text, Path(folder))
        if code:
            return code
    return 0


if __name__ == "__main__":
    sys.exit(main())
