"""Check what is distributed.

Wheels are installed into empty folders: they bring `powertrain` and its command, complete, and nothing beside. Source distributions hold
the sources with all of their tests, examples, benchmarks and data.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
SHIPPED = ("powertrain", "components", "vehicles", "tests", "examples", "benchmarks", "docs")
MADE = ("_build", "_computed", "components", "examples", "reproductions")
"""Folders of the documentation that are made from the rest."""
SCRIPTS = "Scripts" if os.name == "nt" else "bin"
IMPORTS = """
import powertrain, powertrain.components, powertrain.vehicles
for module in powertrain, powertrain.components, powertrain.vehicles:
    assert module.__file__.startswith({target!r}), module.__file__
"""


def check(wheel: str, target: Path) -> list[str]:
    """Install ``wheel`` into the empty folder ``target`` and return what is wrong with it, a line each."""
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", str(target), wheel]
    subprocess.run(pip, check=True)
    found = {path.name for path in target.iterdir() if not path.name.endswith(".dist-info")}
    expected = {"powertrain", SCRIPTS}
    wrong = [] if found == expected else [f"the wheel installs {sorted(found)}, it should be {sorted(expected)}"]
    if not (target / "powertrain" / "py.typed").is_file():
        wrong.append("py.typed is missing")
    for source, name in ("powertrain", "."), ("components", "components"), ("vehicles", "vehicles"):
        here = {path.relative_to(ROOT / source) for path in sources(ROOT / source)}
        there = {path.relative_to(target / "powertrain" / name) for path in sources(target / "powertrain" / name)}
        wrong += [f"{source}/{path} is not in the wheel" for path in sorted(here - there)]
    environment = os.environ | {"PYTHONPATH": str(target), "PYTHONWARNINGS": "error"}
    program = IMPORTS.format(target=str(target))
    if subprocess.run([sys.executable, "-c", program], cwd=target, env=environment, check=False).returncode:
        wrong.append("the installed package cannot be imported")
    return wrong


def lacking(sdist: str) -> list[str]:
    """Return the sources that a source distribution does not hold, a line each."""
    with tarfile.open(sdist) as archive:
        there = {Path(*Path(name).parts[1:]) for name in archive.getnames()}
    here = {path.relative_to(ROOT) for folder in SHIPPED for path in sources(ROOT / folder)}
    return [f"{path} is not in the source distribution" for path in sorted(here - there)]


def sources(folder: Path) -> list[Path]:
    """List the modules and tables below a folder, without those behind its links."""
    links = [path for path in folder.iterdir() if path.is_symlink()]
    found = [path for kind in ("*.py", "*.pyi", "*.csv", "page.*") for path in folder.rglob(kind)]
    links += [ROOT / "docs" / made for made in MADE]
    return [path for path in found if not any(path.is_relative_to(link) for link in links)]


def main() -> None:
    """Check each file named on the command line."""
    for name in sys.argv[1:]:
        if name.endswith(".tar.gz"):
            wrong = lacking(name)
        else:
            with tempfile.TemporaryDirectory() as folder:
                wrong = check(name, Path(folder).resolve())
        if wrong:
            sys.exit("\n".join(wrong))
        print(f"{name}: complete" if name.endswith(".tar.gz") else f"{name}: only powertrain, complete, imports")


if __name__ == "__main__":
    main()
