"""What is computed for the pages, once for a state of the library: executed pages, examples, reproduced papers.

Results lie in docs/_computed with the fingerprint of what they were computed from. ``-D recompute=0`` does not look at the library's.
"""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

DOCS = Path(__file__).parents[1]
ROOT = DOCS.parent
RESULTS = DOCS / "_computed"
EXECUTED = ("tutorial", "howto", "vehicles", "theory")
"""Folders whose pages are executed where they have Python blocks."""
STAMP = "fingerprint.txt"


@dataclass(frozen=True)
class Job:
    """Something to compute: a kind and a name; ``source`` is the text that tells what."""

    kind: str
    name: str
    source: Path

    @property
    def folder(self) -> Path:
        """Where its results go."""
        return RESULTS / self.kind / self.name

    def fingerprint(self, library: str) -> str:
        """Of everything that the results depend on: the library, and the source."""
        return f"{library}\n{hashlib.sha256(self.source.read_bytes()).hexdigest()}"


def jobs() -> list[Job]:
    """Everything that is computed, what takes long first."""
    from powertrain.reproductions import PAPERS

    papers = [Job("paper", name, ROOT / "powertrain" / "reproductions" / f"{PAPERS[name]}.py") for name in PAPERS]
    examples = [Job("example", path.stem, path) for path in sorted((ROOT / "examples").glob("[0-9]*.py"))]
    return [*papers[::-1], *examples[::-1], *(Job("page", name, DOCS / f"{name}.md") for name in executed_pages())]


def executed_pages() -> list[str]:
    """The names of the pages with Python blocks, in the folders of such pages."""
    pages = [path for folder in EXECUTED for path in sorted((DOCS / folder).glob("*.md"))]
    return [
        path.relative_to(DOCS).with_suffix("").as_posix()
        for path in pages
        if "\n```python\n" in path.read_text(encoding="utf-8")
    ]


def library() -> str:
    """The fingerprint of the library's files."""
    files = [
        p
        for name in ("powertrain", "components", "vehicles")
        for s in ("py", "csv")
        for p in (ROOT / name).rglob(f"*.{s}")
    ]
    whole = hashlib.sha256()
    for path in sorted({p.resolve() for p in files}):
        if "cli" not in path.parts:
            whole.update(path.read_bytes())
    return whole.hexdigest()


def compute(*, recompute: bool = True, report: Callable[[str], None] = print) -> None:
    """Compute what is missing or out of date, each job in its own process, and report how long each took.

    Without ``recompute`` a change of the library does not count. Errors: RuntimeError with the last output of a process that failed.
    """
    state = library()
    wanted = [job for job in jobs() if not _is_there(job, job.fingerprint(state), recompute)]
    path = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = {**os.environ, "PYTHONPATH": path, "MPLBACKEND": "Agg"}
    # Fifty processes import the library: its bytecode is kept, whatever the environment says.
    environment |= {"PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": str(RESULTS / "bytecode")}

    def run(job: Job) -> None:
        command = [sys.executable, "-W", "error", __file__, job.kind, job.name]
        started = time.perf_counter()
        with tempfile.TemporaryDirectory() as scratch:  # programs on the pages write files where they stand
            ran = subprocess.run(command, env=environment, cwd=scratch, capture_output=True, text=True, check=False)
        if ran.returncode:
            raise RuntimeError(f"{job.kind} {job.name} failed:\n{ran.stderr[-3000:]}")
        (job.folder / STAMP).write_text(job.fingerprint(state), encoding="utf-8")
        report(f"{job.kind} {job.name}: {time.perf_counter() - started:.1f} s")

    with ThreadPoolExecutor(max_workers=min(os.cpu_count() or 1, 4)) as pool:
        list(pool.map(run, wanted))


def _is_there(job: Job, fingerprint: str, recompute: bool) -> bool:
    stamp = job.folder / STAMP
    if not stamp.is_file():
        return False
    there = stamp.read_text(encoding="utf-8")
    return there == fingerprint if recompute else there.splitlines()[1] == fingerprint.splitlines()[1]


def perform(job: Job) -> None:
    """Do one job."""
    job.folder.mkdir(parents=True, exist_ok=True)
    if job.kind == "page":
        from executed import run_page

        run_page(job.source, job.folder)
    elif job.kind == "paper":
        from powertrain.reproductions import write_report

        write_report(job.name, job.folder, dpi=100)
    else:
        command = [sys.executable, "-W", "error", str(job.source), str(job.folder / "picture.png")]
        ran = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
        (job.folder / "printed.json").write_text(json.dumps(ran.stdout), encoding="utf-8")


if __name__ == "__main__":
    perform(next(job for job in jobs() if (job.kind, job.name) == (sys.argv[1], sys.argv[2])))
