"""C baselines: built with gcc into a temporary directory, called through ctypes."""

from __future__ import annotations

import atexit
import ctypes
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import casadi as ca
import numpy as np
from numpy.typing import NDArray

FLOORS = Path(__file__).parent / "floors"
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
FLAGS = ("-O3", "-march=native", "-fPIC", "-shared")


def no_compiler() -> str:
    """Why there can be no C baseline, or nothing."""
    return "" if shutil.which("gcc") else "skipped: there is no gcc"


def build(source: Path, defines: tuple[str, ...] = (), generated: ca.Function | None = None) -> ctypes.CDLL:
    """The source, and the C code that CasADi generates for a function, as a loaded library."""
    folder = Path(tempfile.mkdtemp(prefix="powertrain_floor_"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    library = folder / f"{source.stem}_{folder.name}.so"
    sources = [source]
    if generated is not None:
        generator = ca.CodeGenerator("generated.c")
        generator.add(generated)
        sources.append(folder / "generated.c")
        sources[-1].write_text(generator.dump())
    command = ["gcc", *FLAGS, *(f"-D{d}" for d in defines), *map(str, sources), "-o", str(library), "-lm"]
    subprocess.run(command, check=True, capture_output=True)
    return ctypes.CDLL(str(library))


def keep_memory() -> None:
    """Makes glibc keep the memory of arrays that are freed, so that no run pays for fresh pages.

    Otherwise it keeps it or gives it back depending on what else has been freed before, and new pages take longer to come than to fill.
    """
    if sys.platform == "linux" and hasattr(libc := ctypes.CDLL(None), "mallopt"):
        libc.mallopt(_TRIM_THRESHOLD, 1 << 30)
        libc.mallopt(_MMAP_THRESHOLD, 1 << 25)


def pointer(array: NDArray[np.float64]) -> ctypes.c_void_p:
    """Where the numbers of a contiguous float64 array lie. The array must be kept as long as this is used."""
    assert array.dtype == np.float64
    assert array.flags.c_contiguous
    return ctypes.c_void_p(array.ctypes.data)
