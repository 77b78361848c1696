"""Compiles functions with the machine's C compiler; libraries are cached on disk.

The cache is a folder owned by the user. An entry consists of two files: the library, named by the hash of its content, and a text file,
named by the hash of the library's sources, which names the library. A library is loaded only if its content matches its name.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import platform
import shlex
import shutil
import stat
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import TypeAlias

import casadi as ca

from powertrain.errors import PowertrainError

FLAGS = ("-O3", "-fPIC", "-shared", "-ffp-contract=off", "-fno-math-errno", "-fno-semantic-interposition")
"""No flag changes a number. The last one permits calls within the library to be inlined, for example of the absolute value."""
_INLINE = {
    f"return f{name}(x, y);": f"return x {sign} y || y != y ? x : y;" for name, sign in (("min", "<="), ("max", ">="))
}
"""The same numbers without a library call, also for nan; limits and indicators contain many of these two."""


def cache_directory() -> Path:
    """``$POWERTRAIN_CACHE``, or ``powertrain`` in the user's cache directory."""
    chosen = os.environ.get("POWERTRAIN_CACHE")
    if chosen:
        return Path(chosen)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "powertrain"


@dataclass(frozen=True)
class InC:
    """A function already written in C."""

    function: ca.Function
    code: str

    def name(self) -> str:
        """Its name in C."""
        return str(self.function.name())


Compilable: TypeAlias = ca.Function | InC


def compile_functions(functions: Mapping[str, Compilable]) -> dict[str, ca.Function]:
    """The same functions from a shared library; if the cache cannot be used, the functions unchanged, with a warning that gives the reason.

    Raises PowertrainError if there is no compiler or it fails.
    """
    code, command = code_of(functions), compiler()
    try:
        return Library(functions, library(code, command))
    except (OSError, RuntimeError) as error:  # RuntimeError from a file system that forbids executables
        warn_of_cache(error)
        return uncompiled(functions)


def uncompiled(functions: Mapping[str, Compilable]) -> dict[str, ca.Function]:
    """The functions as CasADi functions."""
    return {key: each.function if isinstance(each, InC) else each for key, each in functions.items()}


def warn_of_cache(error: Exception) -> None:
    """The warning that the cache cannot be used."""
    warnings.warn(
        f"compile=True has no effect here: the cache of compiled models cannot be used ({error}). "
        "Name a folder of your own in the environment variable POWERTRAIN_CACHE",
        RuntimeWarning,
        stacklevel=3,
    )


def code_of(functions: Mapping[str, Compilable]) -> str:
    """The functions in C."""
    generator, written = ca.CodeGenerator("powertrain_steps.c"), list[str]()
    for function in functions.values():
        if isinstance(function, InC):
            written.append(function.code)
        else:
            generator.add(function)
    code = str(generator.dump())
    for call, expression in _INLINE.items():
        code = code.replace(call, expression)
    return "\n".join([code, *written])


class Library(dict[str, ca.Function]):
    """Functions from machine code."""

    def __init__(self, functions: Mapping[str, Compilable], path: Path) -> None:
        super().__init__({key: ca.external(function.name(), str(path)) for key, function in functions.items()})
        self._path = path

    def addresses(self) -> dict[str, int | None]:
        """Where the functions are in memory, for other machine code."""
        code = ctypes.CDLL(str(self._path))
        return {key: ctypes.cast(code[function.name()], ctypes.c_void_p).value for key, function in self.items()}


def library(code: str, compiler: tuple[str, ...]) -> Path:
    """The library of the code, built if the cache has none or a damaged one."""
    return known(code, compiler) or _built(code, compiler, _entry(code, compiler))


def known(code: str, compiler: tuple[str, ...]) -> Path | None:
    """The library of the code, if the cache has an undamaged one."""
    entry = _entry(code, compiler)
    digest = entry.read_text(encoding="ascii", errors="replace") if entry.is_file() else ""
    found = entry.parent / f"powertrain_{digest}.so"
    return found if digest.isalnum() and found.is_file() and _digest(found) == digest else None


def _entry(code: str, compiler: tuple[str, ...]) -> Path:
    """The text file that names the library of the code, itself named by the hash of the sources."""
    folder = _own_folder(cache_directory() / "compiled")
    origin = "\n".join((code, *FLAGS, *compiler, _version(compiler), sys.platform, platform.machine()))
    return folder / f"{hashlib.sha256(origin.encode()).hexdigest()}.txt"


def _own_folder(folder: Path) -> Path:
    """The folder, which only its owner can read and write. OSError if it belongs to another user."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode):
        raise NotADirectoryError(f"{folder} is not a folder")
    if hasattr(os, "getuid") and found.st_uid != os.getuid():
        raise PermissionError(f"{folder} belongs to another user")
    if found.st_mode & 0o077:
        folder.chmod(0o700)
    return folder


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _built(code: str, compiler: tuple[str, ...], entry: Path) -> Path:
    """Compile the code and enter it into the cache; files get their names only when complete."""
    with tempfile.TemporaryDirectory(dir=entry.parent) as folder:
        source, built, named = Path(folder) / "steps.c", Path(folder) / "steps.so", Path(folder) / "entry"
        source.write_text(code, encoding="utf-8")
        compile_c(compiler, FLAGS, [str(source)], built)
        digest = _digest(built)
        named.write_text(digest, encoding="ascii")
        library = built.replace(entry.parent / f"powertrain_{digest}.so")
        named.replace(entry)
    return library


def compiler(what: str = "compile=True") -> tuple[str, ...]:
    """The command of the C compiler with its arguments: that of ``CC``, one on the path, or the one of the package ziglang.

    ``CC`` is the path of a compiler, or a command in the syntax of a shell. PowertrainError if there is none, with ``what`` needs it.
    """
    given = os.environ.get("CC") or ""
    try:
        chosen = [given] if shutil.which(given) else shlex.split(given)
    except ValueError as error:
        raise PowertrainError(f"the environment variable CC is not a command: {error}") from None
    found = chosen or [path for name in ("cc", "gcc", "clang") if (path := shutil.which(name))][:1]
    if not found and find_spec("ziglang"):
        found = [sys.executable, "-m", "ziglang", "cc"]
    if not found:
        raise PowertrainError(
            f"{what} needs a C compiler, and neither cc, gcc nor clang is on the path. Install one, for example with "
            "pip install 'powertrain[compiler]', or leave compile=False."
        )
    return tuple(found)


def compile_c(
    compiler: tuple[str, ...], flags: Sequence[str], sources: Sequence[str], library: Path, folder: Path | None = None
) -> None:
    """Compile sources, named relative to ``folder``, to a library. PowertrainError if the compiler fails."""
    done = _run([*compiler, *flags, *sources, "-o", str(library), "-lm"], folder)
    if done.returncode:
        said = f"failed with exit status {done.returncode}:\n{done.stderr[-2000:]}"
        raise PowertrainError(f"the C compiler {shlex.join(compiler)} {said.rstrip()}")


@lru_cache
def _version(compiler: tuple[str, ...]) -> str:
    """The compiler's version text; empty if it does not support the question."""
    return _run([*compiler, "--version"]).stdout


def _run(command: list[str], folder: Path | None = None) -> subprocess.CompletedProcess[str]:
    try:
        return subprocess.run(command, cwd=folder, capture_output=True, text=True, errors="replace", check=False)
    except OSError as error:
        raise PowertrainError(f"the C compiler {command[0]} cannot be run: {error.strerror}") from None
