"""Libraries built in the background: one thread calls the C compiler while runs continue with uncompiled functions."""

from __future__ import annotations

import os
import threading
import warnings
from collections.abc import Callable, Mapping
from queue import SimpleQueue

import casadi as ca

from powertrain.errors import PowertrainError
from powertrain.numerics.compiled import Compilable, Library, code_of, compiler, known, library, uncompiled


class Build:
    """The library of some functions, built by the thread when its turn comes."""

    def __init__(self, functions: Mapping[str, Compilable], code: str, command: tuple[str, ...]) -> None:
        self._functions, self._code, self._command = functions, code, command
        self._error: Exception | None = None
        self.done = False

    def execute(self) -> None:
        """Compile the code into the cache."""
        try:
            library(self._code, self._command)
        except (OSError, PowertrainError) as error:
            self._error = error
        self.done = True

    def functions(self) -> dict[str, ca.Function]:
        """The functions from the library; if it could not be built, the uncompiled functions, with a warning that gives the reason."""
        try:
            if self._error is not None:
                raise self._error
            return Library(self._functions, library(self._code, self._command))
        except (OSError, RuntimeError, PowertrainError) as error:
            warnings.warn(f"compile='background' has no effect here: {error}", RuntimeWarning, stacklevel=2)
            return uncompiled(self._functions)


class _Thread:
    """Builds one library at a time and leaves a core for the runs. It ends with the program; unfinished builds are dropped."""

    def __init__(self) -> None:
        self._begin()
        if hasattr(os, "register_at_fork"):
            os.register_at_fork(after_in_child=self._begin)

    def _begin(self) -> None:
        """Nothing is asked for yet, and nothing runs: a forked process does not have the threads of its parent."""
        self._queue: SimpleQueue[Build] = SimpleQueue()
        self._lock = threading.Lock()
        self._running = False
        self.asked = self.done = 0

    def add(self, build: Build) -> None:
        with self._lock:
            self.asked += 1
            if not self._running:
                threading.Thread(target=self._work, name="powertrain-builds", daemon=True).start()
                self._running = True
        self._queue.put(build)

    def _work(self) -> None:
        while True:
            self._queue.get().execute()
            self.done += 1


_THREAD = _Thread()


def begin(functions: Mapping[str, Compilable]) -> dict[str, ca.Function] | Build | None:
    """The functions from a cached library, else the build of one; None if there is no compiler or no cache."""
    code = code_of(functions)
    try:
        command = compiler()
        if (found := known(code, command)) is not None:
            return Library(functions, found)
    except (OSError, RuntimeError, PowertrainError):
        return None
    build = Build(functions, code, command)
    _THREAD.add(build)
    return build


def progress() -> str:
    """How many libraries of this program are built, if some are still to come."""
    asked, done = _THREAD.asked, _THREAD.done
    return f"machine code {done} of {asked}" if done < asked else ""


Install = Callable[[dict[str, ca.Function]], None]


class Builds:
    """The builds for which one engine waits, and what to do with the functions of each."""

    def __init__(self) -> None:
        self._waiting: list[tuple[Build, Install]] = []

    def finished(
        self, functions: dict[str, ca.Function], fast: Mapping[str, Compilable], install: Install
    ) -> dict[str, ca.Function]:
        """``fast`` from the cache; else ``functions``, until ``adopt`` finds the library of ``fast`` and calls ``install``."""
        found = begin(fast)
        if isinstance(found, Build):
            self._waiting.append((found, install))
        return found if isinstance(found, dict) else functions

    def adopt(self) -> None:
        """Install libraries that have been built; called at the start of a run, so that each run has one set of functions."""
        ready = [(build, install) for build, install in self._waiting if build.done]
        self._waiting = [entry for entry in self._waiting if not entry[0].done]
        for build, install in ready:
            install(build.functions())
