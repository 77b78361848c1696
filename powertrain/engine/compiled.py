"""Passing functions through the machine's C compiler, cached on disk by the content of their code."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import casadi as ca

from powertrain.errors import PowertrainError

FLAGS = ("-O1", "-fPIC", "-shared")


def cache_directory() -> Path:
    """``$POWERTRAIN_CACHE``, or ``powertrain`` in the user's cache directory."""
    chosen = os.environ.get("POWERTRAIN_CACHE")
    if chosen:
        return Path(chosen)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "powertrain"


def compile_functions(functions: dict[str, ca.Function]) -> dict[str, ca.Function]:
    """The same functions from a shared library. Raises PowertrainError where there is no compiler or it fails."""
    generator = ca.CodeGenerator("powertrain_steps.c")
    for function in functions.values():
        generator.add(function)
    code = generator.dump()
    digest = hashlib.sha256((code + " ".join(FLAGS)).encode()).hexdigest()[:24]
    library = cache_directory() / f"powertrain_{digest}.so"
    if not library.exists():
        _build(code, library)
    return {key: ca.external(function.name(), str(library)) for key, function in functions.items()}


def _build(code: str, library: Path) -> None:
    compiler = os.environ.get("CC") or shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        raise PowertrainError(
            "compile=True needs a C compiler, and neither cc, gcc nor clang is on the path. Install one, or leave compile=False."
        )
    library.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=library.parent) as folder:
        source, built = Path(folder) / "steps.c", Path(folder) / "steps.so"
        source.write_text(code)
        done = subprocess.run(
            [compiler, *FLAGS, str(source), "-o", str(built), "-lm"], capture_output=True, text=True, check=False
        )
        if done.returncode:
            raise PowertrainError(f"the C compiler {compiler} failed:\n{done.stderr[-2000:]}")
        built.replace(library)
